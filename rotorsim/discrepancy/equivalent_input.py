r"""Equivalent input of the injectors: how each pin's reference would have to arrive to make what a calibration leaves.

The lines that injector j drives answer an error g of its gain with S_j(omega), and a delay T with D_j(omega) T: columns
of the plant itself, about each record's own motion. In a linear plant D_j = -i omega S_j; a film that bends with the
motion answers a larger reference otherwise than a later one. A relative error e_j(omega) of its input, the same in all
records, makes

.. math:: r(\omega) \approx J\,\delta\theta + \sum_j S_j\,\Re e_j - \frac{D_j}{\omega}\,\Im e_j

which is solved for the calibration and the e_j of all bands together. 1 + e_j is the ratio of the equivalent to the
commanded input: its gain and phase. A gain error g and a time T by which it comes late, lag or delay, are read from it,

.. math:: 1 + e_j(\omega) = (1 + g)\,e^{-i \omega T}

Pins that answer one reference move the rotor alike; a curve for all pins of an axis is known where those of single pins
are not. The input is that of the plant's tangents: where the film bends with the motion it is some per cent off, which
the intervals hold; an effect that is fitted has no such error.

A cause elsewhere would be forced into inputs. These are shown where they take most of the misfit that the calibration
alone leaves beyond the noise; where more than noise is left next to them, intervals are wider.

Cites: platz_2001.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from rotorsim.base.errors import NoAnswerError
from rotorsim.base.quantity import quantities
from rotorsim.base.rounding import answer
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint, within
from rotorsim.discrepancy.comparison import TwinComparison
from rotorsim.discrepancy.fit import ParameterFit, cost_of, covariance, prior_rows, step_of
from rotorsim.discrepancy.machine_file import pins_along
from rotorsim.effects import REGISTRY

GAIN, DELAY = "actuator_gain", "actuator_delay"
"""Effects whose sensitivities are those to the input of an injector; without the second one the plant is linear."""
STEP, LATER = 0.02, 5e-5
"""Relative step of a gain, and step of a delay [s], in finite differences."""
BANDS = 8
"""Bands of frequency in which an input has one error."""
SHOWN = 0.02
"""Share of the largest sensitivity from which on a line shows an input."""
ERROR, LATE = 0.3, 2e-3
"""Standard deviations, before the records, of an input's relative error [1] and of the time by which it is late [s]."""
MOST_ROUNDS, ENDED = 5, 1.0
"""Most rounds of the solution, and the fall of the sum of squares below which it has ended."""
SHARES = 0.5 ** np.arange(5)
"""Shares of a step [1] that are tried until the sum of squares falls."""
PROMISED = 0.5
"""Share of what shown inputs take that a tangent has to foretell, for the plant to solve for them."""
TAKEN, OF_ALL = 0.9, 0.25
"""Least shares [1] of the misfit beyond the noise, and of the whole sum of squares, that shown inputs take."""
EARLY = 2.0
"""Standard deviations of its time by which an input that is known may come early: no drive does."""
FORM = 0.03
"""Standard deviation of a ratio's relative error by the tangent of a film that bends with the motion, in each band."""
KNOWN = 0.5
"""Share of these below which records determine a number."""

Pair = tuple[np.ndarray, np.ndarray]
"""Columns (n,) that answer the real and the imaginary part of an input's error."""
Sources = Sequence[tuple[str, tuple[int, ...]]]
"""Names of inputs, each with the numbers of the injectors that err alike."""


@dataclass(frozen=True, eq=False)
class EquivalentInput:
    """Equivalent over commanded input of injectors that err alike, at frequencies (b,) [Hz], with its readings.

    gain, phase : ratio (b,) and its angle [rad], with standard deviations
    error, late : gain error [1] and time [s] that explain it together, with standard deviations
    law : the same ratio (b,) [complex] by the best explanation; empty without one
    """

    name: str
    injectors: tuple[int, ...]
    frequency: np.ndarray
    gain: np.ndarray
    gain_sd: np.ndarray
    phase: np.ndarray
    phase_sd: np.ndarray
    error: float
    error_sd: float
    late: float
    late_sd: float
    law: np.ndarray = field(default_factory=lambda: np.zeros(0, complex))

    @property
    def is_known(self) -> bool:
        """Whether the records determine its error and its time next to those of the others, and it is not early."""
        determined = self.error_sd < KNOWN * ERROR and self.late_sd < KNOWN * LATE
        return determined and self.late >= -EARLY * self.late_sd

    @property
    def sentence(self) -> str:
        """Its readings as text."""
        if not self.is_known:
            return f"{self.name}: not known from these records"
        gain = f"gain {100 * self.error:+.2g} +- {100 * self.error_sd:.1g} %"
        gain = gain if self.error > -1 else f"reversed, gain {1 + self.error:.2g} +- {self.error_sd:.1g}"
        return f"{self.name}: {gain}, late by {self.late * 1e3:.2g} +- {self.late_sd * 1e3:.1g} ms"

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, for JSON."""
        return {
            "name": self.name, "injectors": list(self.injectors), "known": self.is_known,
            "frequency_hz": self.frequency.tolist(), "gain": self.gain.tolist(), "gain_sd": self.gain_sd.tolist(),
            "phase_rad": self.phase.tolist(), "phase_sd_rad": self.phase_sd.tolist(),
            "error": {"value": self.error, "sd": self.error_sd}, "late_s": {"value": self.late, "sd": self.late_sd},
        }  # fmt: skip


def equivalent_inputs(
    comparison: TwinComparison, base: ParameterFit, best: ParameterPoint | None = None
) -> tuple[EquivalentInput, ...]:
    """Equivalent inputs of both axes and of every injector with a pin; none where no record drives them.

    Those of the axes, and those of single injectors, are left out where they do not take most of the misfit.

    `base` has the numbers of the calibration, which is fitted anew next to them: one without them may be led astray.
    That fit begins at the machine file, and at `base` where it does not take most of the misfit from there.
    `best` is the point of what explains the records best.
    """
    driven = any(np.ptp(t.rows[:, 2:4]) for t in comparison.trials)
    if GAIN not in comparison.twin.slots or not driven or any(t.orders for t in comparison.trials):
        return ()
    pins = {axis: pins_along(comparison.twin.machine, axis) for axis in "xy"}
    axes = [(f"all pins that follow r_{axis}", own) for axis, own in pins.items() if len(own) > 1]
    alone = [(f"injector {k}", (k,)) for own in pins.values() for k in own]
    try:
        return _of_all(comparison, base, axes, sorted(alone), best)
    except NoAnswerError:
        return ()


def _of_all(
    comparison: TwinComparison, base: ParameterFit, axes: Sources, alone: Sources, best: ParameterPoint | None
) -> tuple[EquivalentInput, ...]:
    """Equivalent inputs of all pins of an axis, and of single ones; each has a calibration of its own."""
    if _share_taken(base, 0.0, 0) <= 0:
        return ()
    nominal = comparison.stored.columns(ParameterPoint(), base.parameters) / comparison.sigma[:, None]
    start = replace(base, point=ParameterPoint(), residual=comparison.residual(ParameterPoint()), J=nominal)
    near = _of_file(comparison, {k for _, own in alone for k in own})
    found, begins = list[EquivalentInput](), [(start, dict[int, Pair]()), (base, dict[int, Pair]())]
    for sources in filter(None, (axes, alone)):
        tangents = [_foretold(comparison, begin, sources, {**near, **columns}) for begin, columns in begins]
        if max(_share_taken(base, *one) for one in tangents) < PROMISED:
            continue
        for begin, columns in begins:
            fit, solution = _solved(comparison, begin, sources, columns)
            if _share_taken(base, solution.cost, len(solution.errors)) >= 1:
                found += _read(comparison, fit, sources, solution, best)
                break
    return tuple(found)


def _share_taken(base: ParameterFit, cost: float, count: int) -> float:
    """Share of what shown inputs take, 1 or more for most of what a calibration leaves beyond the noise.

    `cost` is left with so many numbers of theirs, besides what that number takes from it. A floor may be higher than
    the noise, so that inputs have to take a share of the whole sum too; 0 without a misfit.
    """
    excess = base.cost - len(base.residual)
    return max(base.cost - cost - count, 0.0) / max(TAKEN * excess, OF_ALL * base.cost) if excess > 0 else 0.0


@dataclass(frozen=True, eq=False)
class InputTangent:
    """Columns J (n, k) of a calibration and of its inputs' errors, each with its `parameters`.

    columns, turned : what every input answers (n,), and the same a quarter of a period later
    band : number of the band (n,) of each line; middles (b,) [Hz]
    """

    parameters: tuple[FitParameter, ...]
    J: np.ndarray
    columns: list[np.ndarray]
    turned: list[np.ndarray]
    band: np.ndarray
    middles: np.ndarray

    @classmethod
    def of(
        cls, comparison: TwinComparison, base: ParameterFit, sources: Sources, columns: dict[int, Pair]
    ) -> InputTangent:
        """Columns of a calibration, and of sources by those of single pins."""
        S, turned = zip(*(np.sum([columns[k] for k in own], axis=0) for _, own in sources), strict=True)
        f = comparison.layout.frequency
        limits, middles = _bands(f, np.sum(np.square(S), axis=0))
        band = np.digitize(f, limits) - 1
        parts = [np.where(band == b, part, 0.0) for pair in zip(S, turned, strict=True) for b in range(BANDS)
                 for part in pair]  # fmt: skip
        errors = (FitParameter(f"input.{i}", STEP, ERROR) for i in range(len(parts)))
        return cls((*base.parameters, *errors), np.column_stack([base.J, *parts]), [*S], [*turned], band, middles)

    def change(self, residual: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Step (k,) of Gauss and Newton from the values v, within the parameters' limits."""
        return within(self.parameters, v + step_of(self.J, residual, v, prior_rows(self.parameters), 0.0)) - v


@dataclass(frozen=True, eq=False)
class InputErrors:
    """Errors of inputs (2 k,), real and imaginary parts in turn, with covariance, and the tangent that has them.

    cost, wider : sum of squares left, with priors; factor of covariances, where more than noise is left
    """

    errors: np.ndarray
    V: np.ndarray
    tangent: InputTangent
    cost: float
    wider: float


def _foretold(
    comparison: TwinComparison, base: ParameterFit, sources: Sources, columns: dict[int, Pair]
) -> tuple[float, int]:
    """Sum of squares with priors that the tangent foretells from a calibration on, and the number of inputs' errors."""
    tangent = InputTangent.of(comparison, base, sources, columns)
    v = np.append(base.vector, np.zeros(len(tangent.parameters) - len(base.parameters)))
    change = tangent.change(base.residual, v)
    left = base.residual - tangent.J @ change
    return cost_of(left, v + change, prior_rows(tangent.parameters)), len(v) - len(base.parameters)


def _solved(
    comparison: TwinComparison, base: ParameterFit, sources: Sources,
    columns: dict[int, Pair],
) -> tuple[ParameterFit, InputErrors]:  # fmt: skip
    """The calibration next to errors of the sources' inputs, and these errors: Newton's method with the chord of J.

    The plant has the calibration; the errors stay linear. A step is halved until the sum of squares falls, and the
    solution ends where no share of it does. `columns` are those of single pins, found where there are none, and once
    more after the first step.
    """
    n, errors = len(base.parameters), np.zeros(2 * BANDS * len(sources))
    fresh = {k for _, own in sources for k in own} - set(columns)
    for number in range(MOST_ROUNDS):
        if fresh and number < 2:
            columns |= _columns(comparison, base, fresh)
        if number == 0 or (fresh and number == 1):
            tangent = InputTangent.of(comparison, base, sources, columns)
        p, J = prior_rows(tangent.parameters), tangent.J
        r, v = base.residual - J[:, n:] @ errors, np.r_[base.vector, errors]
        cost, change = cost_of(r, v, p), tangent.change(r, v)
        for share in SHARES:
            point, there = base.point.moved(base.parameters, share * change[:n]), errors + share * change[n:]
            new = comparison.residual(point)
            if (found := cost_of(new - J[:, n:] @ there, v + share * change, p)) < cost:
                base, errors = replace(base, point=point, residual=new), there
                break
        else:
            break
        if number and cost - found < ENDED:
            break
    left = base.residual - tangent.J[:, n:] @ errors
    cost = cost_of(left, np.r_[base.vector, errors], prior_rows(tangent.parameters))
    whole = replace(base, parameters=tangent.parameters, J=tangent.J, residual=left, cost=cost)
    V, wider = covariance(whole, comparison.layout.record)[n:, n:], max(1.0, whole.chi2 / len(left))
    return base, InputErrors(errors, V, tangent, cost, wider)


def _of_file(comparison: TwinComparison, pins: set[int]) -> dict[int, Pair]:
    """Whitened change (n,) with the gain of each of the pins, of the machine file: the columns of the screening."""
    own, limits = f"{GAIN}.{comparison.twin.slots[GAIN]}", quantities(REGISTRY[GAIN])["error"].bounds
    gain = FitParameter(f"{own}.error", REGISTRY[GAIN].forms[0].step, low=limits[0], high=limits[1])
    held = {k: ParameterPoint(fixed={f"{own}.injector": float(k)}) for k in pins}
    columns = {k: comparison.stored.columns(p, [gain])[:, 0] / comparison.sigma for k, p in held.items()}
    return {k: (S, _times(comparison, S, lambda f: 1j)) for k, S in columns.items()}


def _columns(comparison: TwinComparison, base: ParameterFit, pins: set[int]) -> dict[int, Pair]:
    """Whitened changes (n,) with the real and with the imaginary part of each pin's error, at a calibration.

    A delay is interpolated between samples, so that its column is that of a difference of two.
    """
    here, slots = comparison.predict(base.point), comparison.twin.slots

    def column(effect: str, number: str, step: float, k: int) -> np.ndarray:
        held = base.point.holding({f"{effect}.{slots[effect]}.injector": float(k)})
        return comparison.column(held, FitParameter(f"{effect}.{slots[effect]}.{number}", step), here)

    def later(f: np.ndarray) -> np.ndarray:
        return np.asarray(1j * RIG_SAMPLE / np.expm1(-2j * np.pi * f * RIG_SAMPLE))

    found = {}
    for k in pins:
        S = column(GAIN, "error", STEP, k)
        late = column(DELAY, "delay", LATER, k) if DELAY in slots else None
        found[k] = S, _times(comparison, S, lambda f: 1j) if late is None else _times(comparison, late, later)
    return found


def _read(
    comparison: TwinComparison, base: ParameterFit, sources: Sources, found: InputErrors,
    best: ParameterPoint | None,
) -> list[EquivalentInput]:  # fmt: skip
    """Gain and phase of all sources, and the gain error and the time that make them."""
    law = np.zeros((0, len(sources)), complex) if best is None else 1 + _made_by(comparison, base, found, best)
    out, omega = [], 2 * np.pi * found.tangent.middles
    for i, (name, own) in enumerate(sources):
        at = 2 * (BANDS * i + np.arange(BANDS))
        ratio = 1 + found.errors[at] + 1j * found.errors[at + 1]
        # logarithm of the ratio: real parts, then imaginary ones
        per = np.block([[np.diag((1 / ratio).real), np.diag(-(1 / ratio).imag)],
                        [np.diag((1 / ratio).imag), np.diag((1 / ratio).real)]])  # fmt: skip
        V = per @ found.V[np.ix_(np.r_[at, at + 1], np.r_[at, at + 1])] @ per.T
        V = found.wider * (V + FORM**2 * np.eye(len(V)))
        sd, design = np.sqrt(np.diag(V)), block_diag(np.ones((BANDS, 1)), -omega[:, None])
        weighted = answer(np.linalg.solve, V, design)
        W = answer(np.linalg.inv, design.T @ weighted + np.diag([ERROR**-2.0, LATE**-2.0]))
        # a drive that is reversed has the phase of minus the ratio
        both = [np.concatenate([np.log(np.abs(ratio)), np.unwrap(np.angle(sign * ratio))]) for sign in (1, -1)]
        readings = [W @ (weighted.T @ y) for y in both]
        left = [y @ answer(np.linalg.solve, V, y) - x @ (weighted.T @ y) for y, x in zip(both, readings, strict=True)]
        turned = int(left[1] < left[0])
        (error, late), phase = readings[turned], both[turned][BANDS:] + np.pi * turned
        gain, (gain_sd, late_sd) = (1 - 2 * turned) * np.exp(error), np.sqrt(np.diag(W))
        out.append(
            EquivalentInput(
                name, own, found.tangent.middles, np.abs(ratio), np.abs(ratio) * sd[:BANDS], phase, sd[BANDS:],
                float(gain - 1), float(abs(gain) * gain_sd), float(late), float(late_sd), law[:, i],
            )
        )  # fmt: skip
    return out


def _made_by(comparison: TwinComparison, base: ParameterFit, found: InputErrors, best: ParameterPoint) -> np.ndarray:
    """Errors (bands, sources) of the inputs that act as what an explanation adds to a calibration, by least squares."""
    own = {k: v for k, v in best.values.items() if k not in base.parameters}
    there = replace(base.point, values={**base.point.values, **own}).holding(best.fixed)
    more = (comparison.predict(there) - comparison.predict(base.point)) / comparison.sigma
    tangent = found.tangent
    S = np.column_stack([*tangent.columns, *tangent.turned])
    bands = [tangent.band == b for b in range(BANDS)]
    e = np.array([answer(np.linalg.lstsq, S[here], more[here], rcond=1e-9)[0] for here in bands])
    return np.asarray(e[:, : len(tangent.columns)] + 1j * e[:, len(tangent.columns) :])


def _times(comparison: TwinComparison, column: np.ndarray, factor: Callable[[np.ndarray], Any]) -> np.ndarray:
    """A column (n,) with its lines times a factor of their frequencies [Hz]; without means."""
    out = np.zeros_like(column)
    for i in range(len(comparison.trials)):
        for own, lines in zip(comparison.numbers_of(i), comparison.lines_of(i, column), strict=True):
            f = comparison.layout.frequency[own][: len(lines)]
            out[own] = np.concatenate([(turned := factor(f) * lines).real, turned.imag])
    return out


def _bands(frequency: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Limits (b + 1,) [Hz] of bands that hold the lines which show the inputs, alike in number, and their middles."""
    shown = np.unique(frequency[(frequency > 0) & (weight > SHOWN**2 * weight.max())])
    if len(shown) < BANDS or not np.all(np.isfinite(weight)):
        raise NoAnswerError(f"{len(shown)} lines show the inputs")
    parts = np.array_split(shown, BANDS)
    limits = np.array([*(part[0] for part in parts), shown[-1] * (1 + 1e-9)])
    return limits, np.array([part.mean() for part in parts])
