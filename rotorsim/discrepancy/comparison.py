r"""Comparison of trials with a twin: residuals over the noise floor, their sensitivities, groups of lines beyond it.

Runs go to parallel threads. Sensitivities are taken at rounded speeds, pressures and angles and kept on disk, so that
the same campaign, recorded again, reads them, and so that they are the same whichever diagnosis computed them. A search
starts from them and updates those of its best forms.

A group of lines is flagged by its sum of squared residuals. The mean over blocks, which a diagnosis compares, does not
show a tone between the lines of a block, which may cancel there; so the scatter between blocks is tested as well,

.. math:: \chi^2 = \sum_{b, f} |r_b(f) - \bar r(f)|^2 / \sigma^2(f)

over blocks b and lines f away from the orders of the shaft, with the pooled scatter of the records.

Cites: bendat_2010.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import sqrt
from typing import Any

import numpy as np
from scipy.optimize import fminbound

from rotorsim.base.cache import RUNS, Cache, in_cache, key_of, sources_hash
from rotorsim.base.units import RIG_SAMPLE, TO_RPM, TO_UM
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.data_vector import (
    FAINTEST,
    TOLERANCE,
    DataLayout,
    floor,
    make_layout,
    repeat_scatter,
    repeats,
)
from rotorsim.discrepancy.shooting import ForcedMotion, forced_motion
from rotorsim.discrepancy.trial import TURNING, Trial, clock_offset, delayed
from rotorsim.discrepancy.twin import NO_SOLUTION, Setting, Twin

SOURCES = (*RUNS, "rotorsim/analysis", "rotorsim/discrepancy")
"""Source folders and files whose change makes cached responses stale."""
THREADS = min(2, os.cpu_count() or 1)
"""Number of runs at a time."""
BEYOND = 0.01
"""Displacement [m] from which on the twin counts as without solution."""
CLOSE = 0.01
"""Error of the tolerance that records show, as a share of the declared one."""
LOST = NO_SOLUTION / 4
"""Change of a line [m] by a finer mesh or another law from which on one of both has no solution."""
QUARTER, FEWEST_RECORDS = 0.02, 3
"""Share of a response by which that to the sine of a phase may differ from that to the cosine, a quarter of a period
later; least records for which that is tried on one."""
SAME_ANGLE = 0.01
"""Angle [rad] within which records that repeat each other begin, so that their derivatives are alike."""
MOST_KNOWN, MOST_SPECTRA = 256, 12
"""Responses that are kept, and spectra by blocks."""
SIGMAS, LEAST_EXCESS = 6.0, 20.0
"""Standard deviations, and least excess, by which a group's sum of squares is beyond its number where it is flagged;
of two numbers, as an order has, one in 60 000 is by chance."""
UNSTEADY = "unsteady"
"""Name of the group of lines between the orders that do not repeat."""
NEAR_ORDER = 1.5
"""Distance to an order, in lines, within which lines are left out: a speed that wavers spreads it."""


@dataclass(eq=False)
class TwinComparison:
    """Comparison of trials with a twin; sigma (n,) [m] is the noise floor, correction (n,) [m] the solver's error."""

    twin: Twin
    trials: list[Trial]
    threads: int = THREADS
    sigma: np.ndarray = field(default_factory=lambda: np.zeros(0))
    correction: np.ndarray = field(default_factory=lambda: np.zeros(0))
    evaluations: int = 0
    scatter_known: bool = True
    tolerance: float = TOLERANCE
    """Declared tolerance of the model that the floor holds, as a share of every line."""
    floor_known: bool = False
    """Whether sigma is the floor yet."""
    scatter: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
    cache: Cache | None = None
    """Responses on disk, so that an interrupted diagnosis resumes where it was."""
    known: dict[str, np.ndarray] = field(default_factory=dict)
    """The last responses, by key."""
    blocks: dict[str, list[np.ndarray]] = field(default_factory=dict)
    """The last spectra by blocks, by key."""
    motions: dict[Any, ForcedMotion] = field(default_factory=dict)
    """The last periodic motions on linear bearings, by plant and inputs."""
    directions: dict[str, np.ndarray] = field(default_factory=dict)
    """Data vectors [m] of the parameters that need no simulation: sensor zeros, mesh, injector law."""

    def __post_init__(self) -> None:
        self.layout: DataLayout = make_layout(self.trials)
        slow = (self.layout.frequency == 0) & ~self.layout.drift
        slow &= np.array([t.has_mean for t in self.trials])[self.layout.record]
        for i, axis in enumerate("xy"):
            self.directions[f"offset_{axis}"] = (slow & (self.layout.channel == i)).astype(float)
        self.measured = np.concatenate([t.vector(t.spectra) for t in self.trials])
        self.correction = np.zeros_like(self.measured)
        self.sigma = np.ones_like(self.measured)

    def spectra(
        self, point: ParameterPoint, twin: Twin | None = None, whole: bool = False, near: ParameterPoint | None = None
    ) -> list[np.ndarray]:  # fmt: skip
        """Simulated blocks' DFTs of the trials [m]; from the motion at a `near` point on (`simulate`).

        Records with the same inputs are simulated once; near another point those that repeat each other are. Steps of
        finite differences are needed once, others are kept for a while.
        """
        twin = twin or self.twin
        key = "" if near is not None else self.key(point, twin, whole)
        if (found := self.blocks.pop(key, None)) is None:
            found = self._simulated(point, twin, whole, near)
        if key:
            for old in list(self.blocks)[: 1 - MOST_SPECTRA]:
                del self.blocks[old]
            self.blocks[key] = found
        return found

    def _simulated(
        self, point: ParameterPoint, twin: Twin, whole: bool, near: ParameterPoint | None
    ) -> list[np.ndarray]:  # fmt: skip
        """Spectra by blocks as the plant makes them."""
        seen: dict[tuple[str, float], int] = {}
        first = [seen.setdefault((t.inputs, round(t.angle, 9)), i) for i, t in enumerate(self.trials)]
        first = first if near is None else self.repeated
        numbers = sorted(set(first))
        self.evaluations += len(numbers)
        done = dict(zip(numbers, self.run([(self.trials[i], point) for i in numbers], twin, whole, near), strict=True))
        return [done[i] for i in first]

    def run(
        self, jobs: Sequence[tuple[Trial, ParameterPoint]], twin: Twin, whole: bool = False,
        near: ParameterPoint | None = None,
    ) -> list[np.ndarray]:  # fmt: skip
        """Simulated blocks' DFTs [m] of trials at points, on parallel threads: kernels let go of Python's lock."""
        for trial, point in jobs:  # twins are built once, before threads
            own = plant_of(twin, trial, point, near)
            for plant in (own.twin, own.led):
                if plant is not None:
                    plant.assembly  # noqa: B018
        if self.threads < 2 or len(jobs) < 2:
            return [simulate(twin, trial, point, whole, near, self.motions) for trial, point in jobs]
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(lambda job: simulate(twin, job[0], job[1], whole, near, self.motions), jobs))

    def with_twin(self, twin: Twin) -> TwinComparison:
        """The same comparison, floor included, with another twin of the machine."""
        other = copy(self)
        other.twin, other.known, other.blocks, other.motions = twin, {}, {}, {}
        vars(other).pop("stored", None)  # sensitivities of this one's twin
        return other

    def predict(self, point: ParameterPoint, twin: Twin | None = None, whole: bool = False) -> np.ndarray:
        """Simulated data vector (n,) [m] without the correction of the solver's error."""
        return self._shifted(self._response(point, twin or self.twin, whole), point)

    def _response(
        self, point: ParameterPoint, twin: Twin, whole: bool, near: ParameterPoint | None = None
    ) -> np.ndarray:  # fmt: skip
        """Simulated response (n,) [m]; not computed again where it is known, or in the cache."""
        key = self.key(point, twin, whole, *([_numbers(near)] if near is not None else []))
        if (found := self.known.pop(key, None)) is None:

            def computed() -> np.ndarray:
                return self._joined(self.spectra(point, twin, whole, near))

            found = computed() if self.cache is None else self.cache.array(key, self.measured.shape, computed)
        for old in list(self.known)[: 1 - MOST_KNOWN]:
            del self.known[old]
        self.known[key] = found
        return found

    def key(self, point: ParameterPoint, twin: Twin, *more: Any) -> str:
        """Cache key of a response to the inputs of the trials by a twin at a point, and of `more`."""
        inputs = [(t.inputs, t.angle, t.lead) for t in self.trials]
        return key_of(sources_hash(*SOURCES), *twin.plant_key, inputs, *_numbers(point), *more)

    def _joined(self, found: list[np.ndarray]) -> np.ndarray:
        return np.concatenate([t.vector(s) for t, s in zip(self.trials, found, strict=True)])

    def _shifted(self, y: np.ndarray, point: ParameterPoint) -> np.ndarray:
        """The response plus the part of the parameters that need no simulation."""
        for parameter, value in point.values.items():
            if parameter.key in self.directions:
                y = y + value * self.directions[parameter.key]
        return self._clocked(y) if any(t.clock for t in self.trials) else y

    def _clocked(self, y: np.ndarray) -> np.ndarray:
        """The response (n,) [m] as the clocks of records that state how far they may be off show it."""
        y = y.copy()
        for i, trial in enumerate(self.trials):
            if not trial.clock:
                continue
            f, tau = trial.frequencies[1:], self._offset(i, y)[0]
            for own, lines in zip(self.numbers_of(i), self.lines_of(i, y), strict=True):
                moved = delayed(lines, f, tau)
                y[own] = np.concatenate([moved.real, moved.imag])
        return y

    def _offset(self, i: int, y: np.ndarray) -> tuple[float, float]:
        """Clock offset [s] of trial i against a response y (n,) [m], and its standard deviation."""
        trial = self.trials[i]
        half = trial.spectra.shape[2] - 1
        sigma = np.array([self.sigma[own][:half] for own in self.numbers_of(i)]) if self.floor_known else None
        measured = self.lines_of(i, self.measured)
        return clock_offset(measured, self.lines_of(i, y), trial.frequencies[1:], trial.clock, sigma)

    def clock_offsets(self, point: ParameterPoint) -> dict[str, tuple[float, float]]:
        """Clock offset [s] and standard deviation by record, of those that state how far a clock may be off."""
        if not any(t.clock for t in self.trials):
            return {}
        y = self._response(point, self.twin, False)
        return {t.name: self._offset(i, y) for i, t in enumerate(self.trials) if t.clock}

    def numbers_of(self, i: int) -> list[np.ndarray]:
        """Numbers of the lines of trial i in a data vector, by channel: real parts, then imaginary ones."""
        layout = self.layout
        return [np.flatnonzero((layout.record == i) & (layout.channel == c))[2:] for c in range(2)]

    def lines_of(self, i: int, y: np.ndarray) -> np.ndarray:
        """Complex lines (2, k) of trial i in a data vector, without the mean."""
        return np.array([y[own[: len(own) // 2]] + 1j * y[own[len(own) // 2 :]] for own in self.numbers_of(i)])

    def residual(self, point: ParameterPoint) -> np.ndarray:
        """Whitened measured less simulated (n,)."""
        return np.asarray((self.measured - self.predict(point) - self.correction) / self.sigma)

    def column(
        self,
        point: ParameterPoint,
        parameter: FitParameter,
        here: np.ndarray,
        progress: Callable[[], None] | None = None,
        central: bool = False,
        cosine: np.ndarray | None = None,
    ) -> np.ndarray:
        """Whitened derivative (n,) of the simulated response by a parameter, by a finite step away from `point`.

        A `central` one steps to both sides, but at a limit of the parameter and where a side has no solution. That by
        the sine of a phase follows from the one by its `cosine`, where that is given and a record bears it out.
        """
        if parameter.key in self.directions:
            return np.asarray(self.directions[parameter.key] / self.sigma)
        base = point.values.get(parameter, 0.0)
        step = parameter.step if base + parameter.step <= parameter.high else -parameter.step
        if cosine is not None and (turned := self._quarter_later(point, parameter, step, here, cosine)) is not None:
            return turned
        moved = self._beside(point, parameter, step, here)
        if progress is not None:
            progress()
        if central and parameter.low <= base - step <= parameter.high:
            behind = self._beside(point, parameter, -step, here)
            if np.abs(moved - here).max() > LOST:
                return np.asarray((here - behind) / step / self.sigma)
            if np.abs(behind - here).max() < LOST:
                return np.asarray((moved - behind) / (2 * step) / self.sigma)
        return np.asarray((moved - here) / step / self.sigma)

    def _quarter_later(
        self, point: ParameterPoint, parameter: FitParameter, step: float, here: np.ndarray, cosine: np.ndarray
    ) -> np.ndarray | None:
        """Lines of `cosine` (n,) a quarter of a period later or earlier, as the record with most of it shows.

        The plant hardly changes with the turning. None where that record shows another response, and where records are
        few, turn in both senses, or are vectors.
        """
        if len(self.trials) < FEWEST_RECORDS or any(t.orders or t.clock for t in self.trials):
            return None
        turned = np.zeros_like(cosine)
        for i in range(len(self.trials)):
            for own, lines in zip(self.numbers_of(i), self.lines_of(i, cosine), strict=True):
                turned[own] = np.concatenate([-lines.imag, lines.real])
        i = int(np.argmax(np.bincount(self.layout.record, weights=cosine**2)))
        there, own, y = point.moved([parameter], np.array([step])), self.layout.record == i, np.zeros_like(here)
        y[own] = self.trials[i].vector(self.run([(self.trials[i], there)], self.twin, near=point)[0])
        found = ((self._shifted(y, there) - here) / step / self.sigma)[own]
        turned *= np.sign(found @ turned[own])
        same = np.linalg.norm(found - turned[own]) < QUARTER * np.linalg.norm(found)
        return turned if same and len({t.speed > 0 for t in self.trials}) == 1 else None

    @cached_property
    def repeated(self) -> list[int]:
        """Number of the first trial that each repeats; its own where none comes before."""
        return [
            next((k for k in range(i) if repeats(self.trials[k], t) and _in_phase(self.trials[k], t)), i)
            for i, t in enumerate(self.trials)
        ]

    def _beside(self, point: ParameterPoint, parameter: FitParameter, step: float, here: np.ndarray) -> np.ndarray:
        """Simulated data vector (n,) [m] a step of a parameter away from a point, where it is `here`, from the motion
        there on; records that repeat each other change alike."""
        there = point.moved([parameter], np.array([step]))
        y = self._shifted(self._response(there, self.twin, False, point), there)
        for i, k in enumerate(self.repeated):
            if k != i:
                own, first = self.layout.record == i, self.layout.record == k
                y[own] = here[own] + (y[first] - here[first])
        return y

    @cached_property
    def stored(self) -> SensitivityColumns:
        """Sensitivities that are kept on disk."""
        return SensitivityColumns(self)

    def jacobian(
        self, point: ParameterPoint, parameters: Sequence[FitParameter], here: np.ndarray | None = None,
        progress: Callable[[], None] | None = None, central: bool = False,
    ) -> np.ndarray:  # fmt: skip
        """Whitened derivatives (n, k); trends cost no runs of their own."""
        here = self.predict(point) if here is None else here
        found: dict[str, np.ndarray] = {}
        columns = []
        for parameter in parameters:
            plain = replace(parameter, trend="")
            if plain.name not in found:
                cosine = None if (other := cosine_of(plain)) is None else found.get(other.name)
                found[plain.name] = self.column(point, plain, here, progress, central, cosine)
            share = np.array([parameter.share(t.speed, t.pressure) for t in self.trials])
            columns.append(found[plain.name] * (share[self.layout.record] if parameter.trend else 1.0))
        return np.column_stack(columns) if columns else np.zeros((len(here), 0))

    def apart(self, point: ParameterPoint) -> list[np.ndarray]:
        """Measured less simulated lines of every block (blocks, 2, lines) [m] by trial."""
        return self._apart(self.spectra(point))

    def _apart(self, found: list[np.ndarray]) -> list[np.ndarray]:
        shown = list(found)
        for i, (trial, s) in enumerate(zip(self.trials, found, strict=True)):
            if trial.clock:
                shown[i] = delayed(s, trial.frequencies, self._offset(i, self._joined(found))[0])
        return [t.spectra - s for t, s in zip(self.trials, shown, strict=True)]

    def proven(self, point: ParameterPoint, fine: Twin) -> TwinComparison:
        """The same comparison with the solver's error as it is at `point`."""
        other = copy(self)
        other.correction = self._error(point, fine, self._response(point, self.twin, False))
        return other

    def _error(self, point: ParameterPoint, fine: Twin, response: np.ndarray) -> np.ndarray:
        """Changes (n,) [m] by a finer grid and step, and by a whole run in place of one period.

        Taken at the machine file's own numbers where a twin has no solution at `point`.
        """
        error = self._response(point, fine, False) + self._response(point, self.twin, True) - 2 * response
        if np.abs(error).max() < LOST or not point.values:
            return error
        return self._error(ParameterPoint(), fine, self._response(ParameterPoint(), self.twin, False))

    def _law(
        self, point: ParameterPoint, law: Twin, matched: Mapping[FitParameter, float], response: np.ndarray
    ) -> np.ndarray:
        """Change (n,) [m] by the injectors' other law; as in `_error` without a solution."""
        moved = point.moved(list(matched), np.array(list(matched.values())))
        change = self._response(moved, law, False) - response
        if np.abs(change).max() < LOST or not point.values:
            return change
        return self._law(ParameterPoint(), law, matched, self._response(ParameterPoint(), self.twin, False))

    def set_floor(
        self,
        point: ParameterPoint,
        fine: Twin | None,
        tolerance: float,
        law: Twin | None = None,
        matched: Mapping[FitParameter, float] | None = None,
    ) -> np.ndarray:
        """Measure scatter and the solver's error at `point`; returns that error (n,) [m].

        `law` is the twin with the injectors' other law, whose flow is this one's at the `matched` changes.
        """
        found = self.spectra(point)
        residuals = self._apart(found)
        scatter, means, drifts, self.scatter_known = repeat_scatter(self.trials, residuals)
        self.scatter = (scatter, means, drifts)
        response = self._joined(found)
        error = np.zeros_like(response)
        if fine is not None:
            error = self._error(point, fine, response)
        if law is not None:
            self.directions["law"] = self._law(point, law, matched or {}, response)
        self.correction = error
        if fine is not None:
            self.directions["mesh"] = error
        self.sigma = floor(self.trials, self.layout, scatter, means, drifts, response, error, tolerance)
        self.floor_known, self.tolerance = True, tolerance
        return error

    def with_tolerance(self, point: ParameterPoint, tolerance: float) -> TwinComparison:
        """The same comparison with another tolerance of the model in its floor, as a share of the lines at a point."""
        other, response = copy(self), self._response(point, self.twin, False)
        assert self.scatter is not None
        other.sigma = floor(self.trials, self.layout, *self.scatter, response, self.correction, tolerance)
        other.tolerance = tolerance
        vars(other).pop("stored", None)
        return other

    def tolerance_shown(self, point: ParameterPoint, left: np.ndarray) -> float:
        """Most likely tolerance of the model, up to the declared one, where the floor is the standard deviation of what
        is left (n,) [m] at a point."""

        def loss(tolerance: float) -> float:
            sigma = self.with_tolerance(point, tolerance).sigma
            return float(np.sum(2 * np.log(sigma) + (left / sigma) ** 2))

        return float(fminbound(loss, 0.0, self.tolerance, xtol=CLOSE * self.tolerance))


def _in_phase(a: Trial, b: Trial) -> bool:
    """Whether derivatives of two records that repeat each other are alike: they begin at one angle of the shaft."""
    return not (a.clock or b.clock) and abs(np.exp(1j * a.angle) - np.exp(1j * b.angle)) < SAME_ANGLE


def cosine_of(parameter: FitParameter) -> FitParameter | None:
    """Fit parameter of the cosine part of a wave, for that of its sine part; None for any other."""
    path, _, part = parameter.key.rpartition(".")
    return replace(parameter, key=f"{path}.c") if part == "s" and "~" in path else None


def _numbers(point: ParameterPoint) -> tuple[list[tuple[str, float]], list[tuple[str, float]]]:
    """All numbers of a point in order, for keys."""
    return sorted((k.name, value) for k, value in point.values.items()), sorted(point.fixed.items())


def simulate(
    twin: Twin, trial: Trial, point: ParameterPoint, whole: bool = False, near: ParameterPoint | None = None,
    motions: dict[Any, ForcedMotion] | None = None,
) -> np.ndarray:  # fmt: skip
    """DFTs of a trial's blocks (blocks, 2, lines) [m] at a point; 1 mm throughout if the twin has no solution.

    Of a periodic record the twin runs one period and what leads into it, from the motion at a `near` point on if there
    is one, unless it is to be run as a `whole` or an effect with a long memory is at work. A rotor on linear bearings
    that a record shows in its motion from the first sample on is in that of all its inputs, and one that only turns is
    run over a turn. Its `motions` are kept, and a step away from a motion that an effect bends begins in it.
    """
    plant = plant_of(twin, trial, point, near)
    twin, values, begin = plant.twin, plant.setting, plant.near
    if trial.settled and twin.machine.film is None:
        ahead, rows, angle = trial.from_motion
        motion = None if len(ahead) else motion_of(plant, trial, {} if motions is None else motions)
        if motion is None:
            period = trial.length if len(ahead) else 0
            found = twin.run(values, np.concatenate([ahead, rows]), trial.pressure, angle, True, not period, period)
            table = found[len(ahead) :, :2]
        else:
            table = motion.readings[:, :2]
        if not np.abs(table).max() < BEYOND:  # nor a number
            return np.full(trial.spectra.shape, NO_SOLUTION, complex)
        return trial.lines_of_window(table)
    if trial.turning and twin.machine.film is None and not whole and not twin.lingers(values, True):
        turn = twin.over_a_turn(values, trial.speed, trial.pressure, trial.angle_of_window, trial.start * RIG_SAMPLE)
        if turn is not None and np.abs(turn[:, :2]).max() < BEYOND:
            lines = trial.lines_of_turn(turn[:, :2])
            if lines is not None:
                return lines
    short = trial.lead > 0 and not whole and not twin.lingers(values, trial.balanced)
    if short and twin.machine.film is not None:
        begin = None if begin is None or twin.lingers(begin, trial.balanced) else begin
        table = twin.over_period(values, *trial.short, trial.pressure, trial.length, begin, plant.led)[:, :2]
    else:
        rows, angle = trial.short if short else (trial.used, trial.angle)
        table = twin.run(values, rows, trial.pressure, angle, turning=trial.in_motion)[:, :2]
    if not np.abs(table).max() < BEYOND:  # nor a number
        return np.full(trial.spectra.shape, NO_SOLUTION, complex)
    return trial.short_lines(table[-trial.length :]) if short else trial.lines(table)


def motion_of(plant: TrialPlant, trial: Trial, known: dict[Any, ForcedMotion]) -> ForcedMotion | None:
    """Periodic motion in a trial, from that near it on where one is `known`, which is as it is found from rest."""
    _, rows, angle = trial.from_motion

    def found(twin: Twin, setting: Setting, near: ForcedMotion | None = None) -> ForcedMotion | None:
        return forced_motion(twin, setting, rows, trial.pressure, angle, near)

    def kept(twin: Twin, setting: Setting) -> ForcedMotion | None:
        key = id(twin), trial.inputs, angle, *sorted(setting.items())
        if key not in known and (new := found(twin, setting)) is not None:
            for old in list(known)[: 1 - MOST_KNOWN]:
                known.pop(old, None)
            known[key] = new
        return known.get(key)

    if plant.near is None or plant.led is not plant.twin:
        return kept(plant.twin, plant.setting)
    return found(plant.twin, plant.setting, kept(plant.led, plant.near))


@dataclass(frozen=True)
class TrialPlant:
    """Twin that runs a trial, its setting, and the setting near it that another twin has `led` to its motion."""

    twin: Twin
    setting: Setting
    near: Setting | None = None
    led: Twin | None = None


def plant_of(twin: Twin, trial: Trial, point: ParameterPoint, near: ParameterPoint | None) -> TrialPlant:
    """The plant of a trial at a point, from the motion `near` it.

    Candidates that are off cost time, so that twins have none. The motion near a step of any of them is one, whatever
    their options.
    """
    values = point.setting(twin, trial.speed, trial.pressure, trial.changes)
    if near is None:
        return TrialPlant(twin.lean(values), values)
    begin = at_work(twin, near).setting(twin, trial.speed, trial.pressure, trial.changes)
    return TrialPlant(twin.lean(values), values, begin, twin.lean(begin))


def at_work(twin: Twin, point: ParameterPoint) -> ParameterPoint:
    """The point without options that are held for effects which are off: they change nothing."""
    turned, own = {k.key.split(".")[0] for k in point.values}, twin.machine.effects
    on = turned | {name for name, table in twin.slots.items() if table < len(own.get(name, ()))}
    return replace(point, fixed={key: v for key, v in point.fixed.items() if key.split(".")[0] in on})


def rounded(trial: Trial) -> Trial:
    """Trial at rounded speed, pressure and angle, which repeated recordings share."""
    rows = np.round(trial.rows, 9)
    if not trial.orders:
        rows[:, 0], rows[:, 1] = np.round(rows[:, 0], 1), np.round(rows[:, 1], -3)
    # a clock's offset follows from measured lines, of which sensitivities know nothing
    angle = float(np.round(trial.angle, 1) % 6.3)
    return replace(trial, rows=rows, pressure=float(rows[0, 1]), angle=angle, clock=0.0)


@dataclass(eq=False)
class SensitivityColumns:
    """Sensitivity columns of a comparison at rounded points; `here` caches the reference responses."""

    comparison: TwinComparison
    here: list[tuple[ParameterPoint, np.ndarray]] = field(default_factory=list)

    def __post_init__(self) -> None:
        c = self.comparison
        self.rough = TwinComparison(c.twin, [rounded(t) for t in c.trials], c.threads)
        self.cache = Cache(in_cache("sensitivities"))

    def columns(
        self, point: ParameterPoint, parameters: Sequence[FitParameter], progress: Callable[[], None] | None = None
    ) -> np.ndarray:
        """Sensitivity columns (n, k) [m], kept on disk column by column."""
        comparison = self.comparison
        share = {k: np.array([k.share(t.speed, t.pressure) for t in comparison.trials]) for k in parameters if k.trend}
        out, found = [], dict[str, np.ndarray]()
        for parameter in parameters:
            if parameter.key in comparison.directions:
                out.append(comparison.directions[parameter.key])
                continue
            plain = FitParameter(
                parameter.key, parameter.step, low=parameter.low, high=parameter.high, plane=parameter.plane
            )
            cosine = None if (other := cosine_of(plain)) is None else found.get(other.name)
            column = found[plain.name] = self._column(point, plain, progress, cosine)
            out.append(column * (share[parameter][comparison.layout.record] if parameter.trend else 1.0))
        return np.column_stack(out) if out else np.zeros((len(comparison.measured), 0))

    def _column(
        self,
        point: ParameterPoint,
        parameter: FitParameter,
        progress: Callable[[], None] | None,
        cosine: np.ndarray | None,
    ) -> np.ndarray:
        # one that follows from its cosine differs a little from one by its own step
        own = parameter.name, parameter.step, parameter.low, parameter.high, cosine is not None
        key = self.rough.key(point, self.rough.twin, *own)
        shape = self.comparison.measured.shape

        def computed() -> np.ndarray:
            return self.rough.column(point, parameter, self._at(point), progress, cosine=cosine)

        return self.cache.array(key, shape, computed)

    def _at(self, point: ParameterPoint) -> np.ndarray:
        """The response at a point."""
        same = at_work(self.comparison.twin, point)
        known = next((y for p, y in self.here if (p.values, p.fixed) == (same.values, same.fixed)), None)
        if known is None:
            known = self.rough.predict(same)
            self.here.append((same, known))
        return known


@dataclass(frozen=True)
class Misfit:
    """Line group with a residual above the floor: record, point, channel, group, sums, sizes [m].

    `rms` over `floor` is the root of `chi2` over `numbers`: in both, lines weigh by their floors.
    """

    record: str
    point: str
    channel: str
    group: str
    numbers: int
    chi2: float
    rms: float
    floor: float
    amplitude: float
    number: int
    speed: float = 0.0
    """Shaft speed [rad/s] of vectors at which the residual is largest; 0 for records, which have one speed."""
    largest: float = 0.0
    """Residual [m, 0-pk] there."""

    @property
    def place(self) -> str:
        """Row of vectors with the largest residual, as text; empty for records."""
        return f"{self.largest * TO_UM:.3g} um at {self.speed * TO_RPM:.0f} rpm" if self.speed else ""

    @property
    def excess(self) -> float:
        """Part of the sum of squares that the noise floor does not explain."""
        return self.chi2 - self.numbers


def table(comparison: TwinComparison, residual: np.ndarray) -> list[Misfit]:
    """All line groups with their sums of squares, flagged or not."""
    layout, out = comparison.layout, []
    for i, trial in enumerate(comparison.trials):
        for c, channel in enumerate(trial.channels):
            for name in layout.groups:
                if (own := layout.numbers.get((i, c, name))) is None:
                    continue
                n = len(own)
                r, s = residual[own], comparison.sigma[own]
                # lines weigh by their floors, so that what is beyond the floor is larger than it
                low = float(np.mean(s**-2.0) ** -0.5)
                rms = low * float(np.sqrt(np.mean(r**2)))
                speed, largest = _peak(trial, layout.frequency[own], r * s) if trial.orders else (0.0, 0.0)
                out.append(
                    Misfit(
                        trial.name, trial.point, channel, name, n, float(r @ r), rms, low, trial.amplitude, i,
                        speed, largest,
                    )
                )  # fmt: skip
    return out


def _peak(trial: Trial, lines: np.ndarray, metres: np.ndarray) -> tuple[float, float]:
    """Speed [rad/s] and size [m, 0-pk] of the largest residual of a group of vectors; lines (n,) by their number."""
    if not lines.any():
        return 0.0, 0.0
    size = np.sqrt(np.bincount(lines.astype(int), weights=metres**2))
    line = int(np.argmax(size))
    return trial.speed_at(line), float(size[line])


def flagged(groups: list[Misfit]) -> list[Misfit]:
    """Line groups above the floor, worst first."""
    worst = [g for g in groups if g.excess > max(SIGMAS * sqrt(2 * g.numbers), LEAST_EXCESS)]
    return sorted(worst, key=lambda g: -g.excess)


def excess(groups: list[Misfit]) -> float:
    """Sum of the misfit above the floor in flagged groups."""
    return sum(g.excess for g in flagged(groups))


def unsteady(trials: list[Trial], residuals: list[np.ndarray], scatter: np.ndarray) -> list[Misfit]:
    """Records and channels with more scatter between blocks than the noise; worst first.

    `residuals` are measured less simulated lines (blocks, 2, lines) [m], `scatter` (records, 2, lines) [m] standard
    deviations of a real part of a record's mean line.
    """
    found = []
    for i, (trial, residual) in enumerate(zip(trials, residuals, strict=True)):
        if not trial.periodic or trial.blocks < 2:
            continue
        quiet = between_orders(trial)
        apart = (residual - residual.mean(axis=0))[:, :, quiet]
        for c, channel in enumerate(trial.channels):
            sigma = np.hypot(scatter[i, c, : len(quiet)][quiet] * sqrt(trial.blocks), FAINTEST)
            n = 2 * (trial.blocks - 1) * int(quiet.sum())
            chi2 = float(np.sum(np.abs(apart[:, c]) ** 2 / sigma**2)) if n else 0.0
            if chi2 - n > max(SIGMAS * sqrt(2 * n), LEAST_EXCESS):
                rms, floor = float(np.sqrt(np.mean(np.abs(apart[:, c]) ** 2))), float(np.sqrt(2 * np.mean(sigma**2)))
                found.append(
                    Misfit(trial.name, trial.point, channel, UNSTEADY, n, chi2, rms, floor, trial.amplitude, i)
                )
    return sorted(found, key=lambda f: -f.excess)


def tone(trial: Trial, residual: np.ndarray) -> tuple[float, np.ndarray]:
    """Frequency [Hz] and size (2,) [m, 0-pk, complex] of the largest tone between the lines of a block."""
    blocks, _, lines = residual.shape
    spectra = np.zeros((blocks, 2, trial.length // 2 + 1), complex)
    spectra[:, :, 1:lines] = (residual - residual.mean(axis=0))[:, :, 1:] * (trial.length / 2)
    series = np.fft.irfft(spectra, trial.length, axis=2).transpose(0, 2, 1).reshape(-1, 2)
    whole = np.fft.rfft(series, axis=0)[: blocks * (lines - 1)] * (2 / len(series))
    k = int(np.argmax(np.abs(whole).max(axis=1)))
    return k / (len(series) * RIG_SAMPLE), whole[k]


def between_orders(trial: Trial) -> np.ndarray:
    """Mask (lines,) of the lines away from the mean and from the orders."""
    f = trial.frequencies
    away = f > f[1] / 2
    turns = abs(trial.speed) / (2 * np.pi)
    if abs(trial.speed) > TURNING:
        away &= np.abs(f - np.round(f / turns) * turns) > NEAR_ORDER * f[1]
    return np.asarray(away)
