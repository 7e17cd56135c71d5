r"""Responses that explanations predict in an experiment yet to be made, with what their parameters leave open.

.. math:: y \sim N\big(m_k,\; \Sigma + J_k V_k J_k' + \tau_k^2 U U'\big)

m_k is the plant's response at the fitted point of explanation k, V_k the covariance of its parameters after the records
there are, U the directions of the model's form error. Sensitivities J_k come from the plant in a `close` look; in a
first look those of the usual excitation at the operating point stand for them, in proportion to the excitation and, of
the motion, turned with the ring of the probes.
Source: MacKay (2003), chapter 28.

Cites: mackay_2003.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.discrepancy.data.changes import ring_axes
from rotorsim.discrepancy.data.groups import EXCITED, NAMES, Layout, make_layout
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.discrepancy.data.sweeps import Sweep
from rotorsim.discrepancy.fit.least_squares import ParameterFit
from rotorsim.discrepancy.fit.parameters import DIRECTIONS, FitParameter
from rotorsim.discrepancy.odds.model_form import ModelForm, model_form, whitened_size
from rotorsim.discrepancy.odds.odds import TEMPERATURE
from rotorsim.discrepancy.odds.posterior import posterior_root
from rotorsim.discrepancy.plan.expected import PredictedResponse
from rotorsim.discrepancy.residuals.comparison import LOST, ParameterPoint, TwinComparison, simulate
from rotorsim.discrepancy.residuals.floor import floor
from rotorsim.effects import REGISTRY

Columns = dict[tuple[int, str], np.ndarray]
"""Sensitivities (n,) [m per unit] by number of the explanation and key; -1 is common to all."""


@dataclass(eq=False)
class Forecast:
    """Explanations by their fits and the relative error of the model's form that each leaves."""

    comparison: TwinComparison
    fits: Sequence[ParameterFit]
    errors: Sequence[float]

    @cached_property
    def roots(self) -> list[np.ndarray]:
        """Roots of the covariances of every fit's parameters."""
        part = self.comparison
        size = whitened_size(part.layout, part.predict(self.fits[0].point), part.sigma)
        form: ModelForm = model_form(part.layout, part.trials, size)
        pairs = zip(self.fits, self.errors, strict=True)
        return [posterior_root(form, fit, error, TEMPERATURE) for fit, error in pairs]

    @cached_property
    def varied(self) -> list[tuple[int, FitParameter]]:
        """Parameters whose sensitivities the plant is run for: those of all fits at the first one's point."""
        own = [{p.key: replace(p, trend="") for p in fit.parameters if p.key not in DIRECTIONS} for fit in self.fits]
        common = [key for key in own[0] if all(key in other for other in own)]
        found = [(-1, own[0][key]) for key in common]
        return found + [(k, p) for k, one in enumerate(own) for key, p in one.items() if key not in common]

    def means(self, trials: Sequence[Trial]) -> list[list[np.ndarray]]:
        """Responses (n,) [m] of every explanation in every trial."""
        points = {self._acting(fit): fit.point for fit in reversed(self.fits)}  # of some explanations it is the same
        flat = iter(self._run([(trial, point) for trial in trials for point in points.values()]))
        found = [{acting: next(flat) for acting in points} for _ in trials]
        return [[own[self._acting(fit)] for fit in self.fits] for own in found]

    def _acting(self, fit: ParameterFit) -> tuple[Any, ...]:
        """What a response follows from: values, and an effect's options where its size is not zero."""
        values = tuple(sorted((p.name, v) for p, v in fit.point.values.items() if v))
        own = {p.name for p in fit.parameters} - {p.name for p in self.fits[0].parameters}
        return values, tuple(sorted(fit.point.fixed.items())) if own & dict(values).keys() else ()

    def columns(
        self,
        trials: Sequence[Trial],
        means: Sequence[Sequence[np.ndarray]],
        of_sensors: bool = False,
        own: bool = False,
    ) -> list[Columns]:
        """Sensitivities of every trial; to effects `of_sensors` alone, or to what explanations have of their `own`.

        Those of a parameter without solution a step away are zero.
        """
        varied = [(k, p) for k, p in self.varied if not of_sensors or is_of_sensor(p.key)]
        varied = [(k, p) for k, p in varied if not own or k >= 0]
        points = {k: self.fits[max(k, 0)].point for k, _ in varied}
        moved = [points[k].moved([p], np.array([self._step(points[k], p)])) for k, p in varied]
        flat = iter(self._run([(trial, point) for trial in trials for point in moved]))
        out = []
        for known in means:
            found: Columns = {}
            for k, p in varied:
                change = (next(flat) - known[max(k, 0)]) / self._step(points[k], p)
                found[k, p.key] = change if np.abs(change).max() * p.step < LOST else np.zeros_like(change)
            out.append(found)
        return out

    @staticmethod
    def _step(point: ParameterPoint, p: FitParameter) -> float:
        value = point.values.get(p, 0.0)
        return p.step if value + p.step <= p.high else -p.step

    def _run(self, jobs: Sequence[tuple[Trial, ParameterPoint]]) -> list[np.ndarray]:
        """Responses (n,) [m] of trials at points, on all threads of the comparison."""
        twin = self.comparison.twin
        twin.assembly  # noqa: B018  (built once, before threads)
        with ThreadPoolExecutor(max(self.comparison.threads, 1)) as pool:
            return list(pool.map(lambda job: job[0].vector(simulate(twin, *job)), jobs))

    def predicted(
        self, trial: Trial, means: Sequence[np.ndarray], columns: Columns, sigma: np.ndarray
    ) -> list[PredictedResponse]:
        """Predictions of all explanations in a trial whose numbers have the standard deviations sigma (n,) [m]."""
        layout = make_layout([trial])
        form = model_form(layout, [trial], whitened_size(layout, np.max(np.abs(means), axis=0), sigma))
        shape = form.directions * np.sqrt(form.variances) * sigma[:, None]
        out = []
        for k, (fit, root, mean, error) in enumerate(zip(self.fits, self.roots, means, self.errors, strict=True)):
            J = np.column_stack([self._column(k, p, trial, layout, columns) for p in fit.parameters])
            out.append(PredictedResponse(mean, J @ root, error * shape))
        return out

    def _column(self, k: int, p: FitParameter, trial: Trial, layout: Layout, columns: Columns) -> np.ndarray:
        if p.key in DIRECTIONS:
            channel = {"offset_x": 0, "offset_y": 1}.get(p.key, -1)
            slow = (layout.frequency == 0) & ~layout.drift & (layout.channel == channel)
            return slow.astype(float)
        found = columns.get((-1, p.key), columns.get((k, p.key), np.zeros(len(layout.record))))
        return found * p.share(trial.speed, trial.pressure)

    def floor(self, trial: Trial, means: Sequence[np.ndarray]) -> np.ndarray:
        """Standard deviations (n,) [m] that the numbers of a trial should have, from the scatter of the records."""
        part, layout = self.comparison, make_layout([trial])
        assert part.scatter is not None
        scatter, slow, drifts = part.scatter
        alike = [i for i, t in enumerate(part.trials) if bool(t.orders) == bool(trial.orders)] or [0]
        # what scatters is alike in every sample: a line's scatter falls with the root of their number
        samples = np.array([_samples(part.trials[i]) for i in alike])
        each = [np.median(scatter[i][:, 1 : part.trials[i].spectra.shape[2]]) for i in alike]
        line = float(np.median(np.array(each) * np.sqrt(samples))) / np.sqrt(_samples(trial))
        response = np.max(np.abs(means), axis=0)
        return floor(
            [trial], layout, np.full((1, 2, trial.spectra.shape[2]), line), np.median(slow[alike], axis=0)[None],
            np.median(drifts[alike], axis=0)[None], response, self._solver_share * response, part.tolerance,
        )  # fmt: skip

    @cached_property
    def _solver_share(self) -> float:
        """Solver's error relative to the response, typical of the records."""
        part = self.comparison
        size = np.abs(part.measured)
        large = size > np.percentile(size, 80)
        return float(np.median(np.abs(part.correction[large]) / np.maximum(size[large], 1e-300)))


def _samples(trial: Trial) -> float:
    """Samples that a line of a trial, or a vector of a run-up, is taken over."""
    if isinstance(trial, Sweep):
        return float(np.median(2 * np.pi * trial.turns / (np.abs(trial.speeds) * RIG_SAMPLE)))
    return float(trial.length * trial.blocks)


def _drive(trial: Trial) -> float:
    """Rms of what excites a trial, about its mean [V or N]."""
    rows = trial.rows[trial.start : trial.start + trial.blocks * trial.length]
    driving = rows[:, 2:4] if rows[:, 2:4].any() else rows[:, 4:6]
    return float(np.sqrt(driving.var(axis=0).sum()))


def in_proportion(columns: Columns, usual: Trial, other: Trial) -> Columns | None:
    """Sensitivities of another excitation at one operating point; None where its lines are others."""
    if usual.spectra.shape != other.spectra.shape or usual.orders or other.orders or _drive(usual) == 0:
        return None
    layout, size = make_layout([usual]), _drive(other) / _drive(usual)
    driven = np.isin(layout.group, [NAMES.index(name) for name in (*EXCITED, "between")])
    return {key: np.where(driven, size, 1.0) * column for key, column in columns.items()}


def is_of_sensor(key: str) -> bool:
    """Whether a parameter is of an effect on the readings."""
    effect = REGISTRY.get(key.partition(".")[0])
    return effect is not None and effect.port == "sensor"


def on_turned_ring(columns: Columns, angle: float) -> Columns:
    """Sensitivities of the motion as probes on a ring read them that is turned further by an angle [rad]."""
    turn = ring_axes(angle)
    return {key: (turn @ one.reshape(2, -1)).ravel() for key, one in columns.items() if not is_of_sensor(key[1])}
