r"""Sensitivities to forces on the shaft by the linear film, with which a search ranks its forms.

A force of a form is evaluated along the motion that the plant has without it. Its response goes through the receptances
of the plant about its equilibrium, which all forms share,

.. math:: \frac{\partial y}{\partial p} = C\,Z(\omega)^{-1} \Phi^T\,
          \mathcal F\Big\{\frac{\partial f}{\partial p}(q, \dot q, \varphi)\Big\}

Assumes: the film does not bend with the motion, which makes a column some per cent wrong; sensors read the
displacement. A column counts where the plant bears it out on the record that shows most of it, and forms that a
search may fit have the plant's own.

Cites: platz_2001.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import gcd
from types import SimpleNamespace

import numpy as np

from rotorsim.base.rounding import answer
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.candidates import Form, screen
from rotorsim.discrepancy.comparison import LOST, TwinComparison
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.hypotheses import CLEAR, FINALISTS
from rotorsim.discrepancy.law_terms import linear_model, lines_of_series
from rotorsim.discrepancy.trial import Trial
from rotorsim.discrepancy.twin import PRESSURE, Twin
from rotorsim.effects import REGISTRY
from rotorsim.plant.assemble import Assembly, put_rows
from rotorsim.plant.calls import Call
from rotorsim.plant.kernels.layout import DISC
from rotorsim.plant.simulation import Simulation, rows, settle

ERROR = 0.15
"""Largest relative error of a column on the record that shows most of it."""
MOST_WRONG = 0.5
"""Largest relative error of what a calibration leaves of a column."""
EVERY = 8
"""Most samples of a period of which one has its force evaluated: 625 a second, for lines up to 300 Hz."""


@dataclass(frozen=True, eq=False)
class RecordReceptance:
    """Receptances of a trial, and its motion at places of the shaft, at the machine file's numbers."""

    twin: Twin
    trial: Trial
    motions: dict[bytes, np.ndarray] = field(default_factory=dict)

    @cached_property
    def seen(self) -> np.ndarray:
        """Response (lines, 2, m) of the channels to modal forces (m,)."""
        plant, _, channels = linear_model(self.twin, ParameterPoint(), self.trial)
        return channels @ answer(np.linalg.inv, plant.factor(2j * np.pi * self.trial.frequencies).stiffness)

    @cached_property
    def moments(self) -> np.ndarray:
        """Time [s], angle [rad] and speed [rad/s] (k, 3) over the period."""
        inputs, angle = self.trial.short
        time = RIG_SAMPLE * np.arange(len(inputs) - self.trial.length, len(inputs))[:: self.stride]
        return np.column_stack([time, angle + self.trial.speed * time, np.full(len(time), self.trial.speed)])

    @property
    def stride(self) -> int:
        """Samples from one moment to the next."""
        return gcd(self.trial.length, EVERY)

    def motion(self, shape: np.ndarray) -> np.ndarray:
        """Displacement and velocity (k, 4) over the period at a place with rows (2, n)."""
        if (key := shape.tobytes()) not in self.motions:
            t, n, (inputs, angle) = self.trial, self.trial.length, self.trial.short
            values = ParameterPoint().setting(self.twin, t.speed, t.pressure, t.changes)
            lean = self.twin.lean(values)
            a, pressure = lean.set(values), lean.regulator(values, t.speed, t.pressure)
            w = settle(a, t.speed, pressure)
            put_rows(w, a.rotor.disc, shape, a.rotor.n)
            w[a.rotor.angle] = angle
            at = Simulation(a, w).advance(inputs + (pressure - t.pressure) * PRESSURE)[-n:, DISC]
            omega = 2j * np.pi * np.fft.rfftfreq(n, RIG_SAMPLE)[:, None]
            rate = np.fft.irfft(omega * np.fft.rfft(at, axis=0), n, axis=0)
            self.motions[key] = np.hstack([at, rate])[:: self.stride]
        return self.motions[key]

    def lines(self, call: Call, shape: np.ndarray, numbers: Sequence[SimpleNamespace]) -> np.ndarray:
        """Change of the lines (2, lines) [m] as the numbers of an effect go from the first to the second."""
        steady = np.zeros((len(self.moments), 1))  # the shaft does not accelerate
        moving = self.motion(shape) if call.effect.port == "motion" else steady
        moments = np.hstack([self.moments, moving]).tolist()
        kernel = getattr(type(call.effect).kernel, "py_func", type(call.effect).kernel)
        before, after = (np.array([kernel(*one, p) for one in moments]) for p in numbers)
        force = lines_of_series((after - before).T, len(self.seen))
        return np.asarray(np.einsum("lcm,ml->cl", self.seen, shape[:, : self.seen.shape[2]].T @ force))


@dataclass(frozen=True, eq=False)
class LinearColumns:
    """Sensitivities of a comparison by its linear films, at the machine file's numbers, its response `here`."""

    comparison: TwinComparison
    here: np.ndarray

    @classmethod
    def of(cls, comparison: TwinComparison) -> LinearColumns | None:
        """Sensitivities of records that repeat next to a film; None for others."""
        periodic = not any(t.orders or t.clock or not t.lead for t in comparison.trials)
        if comparison.twin.machine.film is None or not periodic:
            return None
        here = comparison.predict(ParameterPoint())
        return cls(comparison, here) if np.abs(here).max() < LOST else None

    @cached_property
    def records(self) -> list[RecordReceptance]:
        """One for each trial, the same for those that repeat each other."""
        own = [RecordReceptance(self.comparison.twin, t) for t in self.comparison.trials]
        return [own[k] for k in self.comparison.repeated]

    def columns(self, form: Form) -> np.ndarray | None:
        """Sensitivities (n, k) [m] of a force on the shaft; None for others, or where the plant has others."""
        if REGISTRY[form.effect].port not in ("force", "motion") or REGISTRY[form.effect].states:
            return None
        begin = ParameterPoint().holding(form.fixed)
        found = np.column_stack([self._column(begin, parameter) for parameter in form.parameters])
        return found if np.all(np.isfinite(found)) and self._borne_out(begin, form.parameters[0], found[:, 0]) else None

    def _column(self, begin: ParameterPoint, parameter: FitParameter) -> np.ndarray:
        twin, name = self.comparison.twin, "_".join(parameter.key.split(".")[:2])
        before, after = (p.setting(twin) for p in (begin, begin.moved([parameter], np.array([parameter.step]))))
        plants = [twin.lean(after).set(setting) for setting in (before, after)]
        call = next(c for c in plants[1].calls if c.record == name)
        shape, numbers = rows(plants[1], call.shape, plants[1].w), [_numbers(a, name) for a in plants]
        known = {
            id(r): r.trial.vector(r.lines(call, shape, numbers)[None])
            for r in {id(r): r for r in self.records}.values()
        }
        return np.concatenate([known[id(record)] for record in self.records]) / parameter.step

    def _borne_out(self, begin: ParameterPoint, parameter: FitParameter, column: np.ndarray) -> bool:
        """Whether the plant has the same on the record that shows most of a column (n,)."""
        record = self.comparison.layout.record
        i = int(np.argmax(np.bincount(record, weights=column**2)))
        trial, own = self.comparison.trials[i], record == i
        there = begin.moved([parameter], np.array([parameter.step]))
        [lines] = self.comparison.run([(trial, there)], self.comparison.twin, near=begin)
        plant = (trial.vector(lines) - self.here[own]) / parameter.step
        return bool(np.linalg.norm(column[own] - plant) < ERROR * np.linalg.norm(plant))


def not_sure(
    base: ParameterFit, forms: Sequence[Form], columns: Mapping[str, np.ndarray], linear: Collection[str]
) -> list[Form]:
    """Forms with `linear` columns that may be among the `FINALISTS` by their whitened `columns`, and half of a name.

    Those too that a calibration `base` imitates so far that what is left of them may be half as large again by their
    error.
    """
    view = screen(base, forms, [columns[f.label] for f in forms])
    drops = np.array([view.drop(i)[0] for i in range(len(forms))])
    cut, found = max([CLEAR / 2, *np.sort(drops)[-FINALISTS:][:1]]), list[Form]()
    for i, form in enumerate(forms):
        wrong = ERROR / max(view.survives(i), ERROR)
        if form.label in linear and (wrong > MOST_WRONG or drops[i] * (1 + wrong) ** 2 >= cut):
            found.append(form)
    return found


def _numbers(a: Assembly, record: str) -> SimpleNamespace:
    """The numbers of an effect as its kernel has them."""
    row = a.record[record][0]
    return SimpleNamespace(**{name: float(row[name]) for name in row.dtype.names})
