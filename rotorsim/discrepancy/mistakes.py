r"""Mistakes of a laboratory, tried before anything is fitted: units, clocks, probes, the sense of rotation.

Each is a discrete alternative. A likely one is suggested and never assumed: a diagnosis stops with the sentence.

Probes that are exchanged, reversed, turned, of another plane, and a shaft that turns the other way, change the shape of
the motion at a line (its amplitudes and phases by probe), whatever the size and the phase of what excites it,

.. math:: d = \Big\langle 1 - \frac{|\hat y' s|^2}{|y|^2\,|s|^2} \Big\rangle

y are the readings of all probes at the line, s those of the twin, the mean is that over records. A resonance that is
off scales both alike; supports that are off turn the orbit, and so twins with softer and with stiffer ones are tried.
The alternatives act on y. One is named where the records have its shape (d at most `SHAPE`) and clearly not their own,
nearly all of them; several that have it as well are named together. Source: the modal assurance criterion of
Allemang & Brown (1982), of the operating deflection.

Shapes that are nearly alike, as of two planes within one half wave, hide an exchange, which a calibration then takes up
by supports far from the file. So alternatives are calibrated too where the records as they are ask for a finding: first
all by the tangent at the machine file's own numbers, then the best ones with the plant. A delay is one alternative: the
tangent of its own calibration refines it. One is named where it leaves no group beyond the floor and a sum of squares
with priors that is lower by `CLEARLY` at least. A delay, which a seal or a damping may imitate, is named where no
effect of the machine explains the records better and it explains all of them, those that were not fitted too.

Cites: allemang_1982.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from rotorsim.base.errors import DataError
from rotorsim.base.rounding import answer
from rotorsim.base.units import RIG_SAMPLE, TO_RPM
from rotorsim.discrepancy.calibration import FitParameter, ParameterPoint
from rotorsim.discrepancy.changes import MAIN, PLANE
from rotorsim.discrepancy.comparison import Misfit, TwinComparison, flagged, table
from rotorsim.discrepancy.fit import ParameterFit, fit_parameters, foreseen, prior_rows
from rotorsim.discrepancy.judge import seen_together
from rotorsim.discrepancy.records import TURNED, laid_over, misread_speed
from rotorsim.discrepancy.run_ups import RunupTrial, ramp
from rotorsim.discrepancy.trial import TURNING, Trial, delayed, turns_of
from rotorsim.discrepancy.twin import of_axis

FACTORS = {25.4: "mils or inches taken for millimetres", 1e3: "a prefix of a thousand lost (mm, um; mV, V; kN, N)",
           1e6: "metres taken for micrometres", 39.37: "inches taken for metres"}  # fmt: skip
"""Factors between units that are taken for one another, with their causes."""
PREFIXES, ANY_GAIN = (1e3, 1e6), 4.0
"""Factors that gains show whatever the calibration is, and the factor by which they may miss them."""
PEAK = 2.0
"""Size of a peak of 1X over that at the ends of a table."""
PEAK_INSIDE = 20
"""Part of the rows at either end of a table that has no peak, as its inverse."""
FASTEST = 2 * np.pi * 500.0
"""Fastest speed [rad/s] of another unit that is tried."""
ALIKE = 0.7
"""Cosine between measured and simulated lines from which they count as the same up to a factor."""
NEAR = 0.35
"""Relative distance of a ratio to one of FACTORS: the calibration may be off as well."""
FEWEST_CLOCKS = 4
"""Fewest records that show the rate of a clock."""
SURE_TURN, CLEAR_TURN = 5.0, 3.0
"""Rate of a clock over its standard deviation from which it is clear, of all records and of one."""
LEAST_TURN = 1e-3
"""Least scatter [rad] of that turn."""
EARLY, HALF = (-0.8, -0.25), 0.5
"""Samples by which a response is early where the force was sampled, and the least share of the misfit that goes."""
SAMPLED = (
    "the force is taken as sampled while it moves on, and not as held from sample to sample: most of the misfit goes "
    "with it, on all lines that the force excites"
)
"""Note on such a force."""
LAGS, FAINT_LINE = np.linspace(-0.02, 0.02, 801), 0.01
"""Time shifts [s] that are tried, and share of the largest line from which on a line has a phase."""
SHAPE = 0.05
"""Largest misfit of a shape for an alternative to be named."""
CLEARER = 0.25
"""Largest share of that misfit in the misfit of the records as they are."""
MOSTLY = 0.8
"""Least share of the records in which an alternative is the better one."""
TURNS = np.deg2rad([30.0, 45.0, 60.0, 90.0, -30.0, -45.0, -60.0, -90.0])
"""Angles [rad] by which the probes of a plane may be turned."""
CLEARLY = 12.0
"""Sum of squares by which an alternative fits better than the records as they are, to be named."""
LATE = np.linspace(-0.005, 0.005, 101)
"""Times [s] by which the probes may be late against the shaft's angle; the best one is refined."""
TOO_LATE = "the displacement is shifted by {:+.1f} ms against the shaft's angle"
"""Alternative of a delay."""
TOO_LATE_TOO = "the records fit better when {}, or with an effect that acts like a delay: check the clocks first"
"""Note on it."""
ALL_LATE = (
    "records: no effect of the catalogue explains them, and all of them fit when {}; state clock in [conditions], how "
    "far it may be off, or record all channels on one clock; nothing was assumed"
)
"""Refusal of records that a delay explains."""
MOST_FORESEEN = 0.5
"""Most sum of squares of an alternative over that of the records as they are, both by the tangent, where groups of
lines are beyond their floor and would have to go."""
MOST_CALIBRATED = 2
"""Most alternatives that are calibrated with the plant."""
COMPLIANCES = (0.5, -1.0)
"""Changes of the compliance of all supports that are tried where the shape does not fit."""


def check_before(comparison: TwinComparison, simulated: np.ndarray) -> None:
    """Raise DataError for records with a likely mistake; simulated (n,) [m] is at the nominal point."""
    check_speed_unit(comparison, simulated)
    check_exchanged(comparison, simulated)
    check_units(comparison, simulated)
    check_clocks(comparison, simulated)
    check_clock_rate(comparison)
    check_probes(comparison, simulated)


def excited(comparison: TwinComparison, vector: np.ndarray, wanted: Callable[[str], bool]) -> np.ndarray:
    """Values (k,) of the selected line groups."""
    layout = comparison.layout
    groups = [i for i, name in enumerate(layout.groups) if wanted(name)]
    return np.asarray(vector[np.isin(layout.group, groups) & (layout.frequency > 0)])


def _ratio(comparison: TwinComparison, simulated: np.ndarray, wanted: Callable[[str], bool]) -> tuple[float, float]:
    """Ratio of norms measured to simulated, and cosine, over some groups; (nan, 0) where there is nothing."""
    y, s = (excited(comparison, v, wanted) for v in (comparison.measured, simulated))
    a, b = float(np.linalg.norm(y)), float(np.linalg.norm(s))
    return (a / b, float(y @ s) / (a * b)) if a > 0 and b > 0 else (np.nan, 0.0)


def _factor(ratio: float) -> tuple[float, str] | None:
    """The factor of FACTORS that a ratio is near, and what it comes from."""
    for factor, what in FACTORS.items():
        for share in (factor, 1 / factor):
            if abs(ratio / share - 1) < NEAR:
                return share, what
    return None


def check_units(comparison: TwinComparison, simulated: np.ndarray) -> None:
    """Check of displacement and excitation for a factor between units."""
    drive, alike = _ratio(comparison, simulated, lambda g: g.endswith("band") or g == "resonance")
    turning, turned = _ratio(comparison, simulated, lambda g: g in ("1X", "2X", "3X"))
    every = [(r, c) for r, c in ((drive, alike), (turning, turned)) if abs(c) > ALIKE]
    found = [(f, r) for r, _ in every if (f := _factor(r)) is not None]
    by_lines = None if found else _factor_of_lines(comparison, simulated)
    if by_lines is not None:
        ratio, factor = by_lines
        raise DataError(
            f"records: the displacement is {ratio:.3g} times what the machine file makes of it, or the force, or the "
            f"reference, {1 / ratio:.3g} times what makes it, about {max(factor, 1 / factor):.4g}: is it a matter of "
            f"units, {FACTORS[max(factor, 1 / factor)]}? state the unit in the mapping; nothing was assumed",
            argument="units",
            value=factor,
        )
    if not found:
        return
    (factor, what), ratio = found[0]
    only = len(every) == 2 and len(found) == 1 and ratio == drive
    channel = "the reference, or the force," if only else "the displacement"
    shown = f"{1 / ratio:.3g}" if only else f"{ratio:.3g}"
    near = 1 / factor if only else factor
    raise DataError(
        f"records: {channel} is {shown} times what the machine file makes of it, about {near:.4g}: is it a matter of "
        f"units, {what}? state the unit in the mapping; nothing was assumed",
        argument="units",
        value=near,
    )


def _factor_of_lines(comparison: TwinComparison, simulated: np.ndarray) -> tuple[float, float] | None:
    """Ratio of the gains, and the power of a thousand that it is near in every record with excited lines.

    Gains are laid over each other by a factor on the frequency: resonances that are off spoil a comparison of lines.
    """
    gains = [own[0][1] for own in laid_over(comparison, simulated)]
    for factor in (one for size in PREFIXES for one in (size, 1 / size)):
        if gains and all(1 / ANY_GAIN < gain / factor < ANY_GAIN for gain in gains):
            return float(np.median(gains)), factor
    return None


def check_speed_unit(comparison: TwinComparison, simulated: np.ndarray) -> None:
    """Check of the speeds of vectors for a unit that is taken for another.

    The measured 1X has its peak inside the table and the machine has none there, but one at speeds of another unit.
    """
    for i, trial in enumerate(comparison.trials):
        if not (isinstance(trial, RunupTrial) and 1 in trial.orders):
            continue
        seen = _peak(trial, comparison.lines_of(i, comparison.measured))
        if seen is None or _peak(trial, comparison.lines_of(i, simulated)) is not None:
            continue
        rate, found = abs(float(np.ptp(trial.rows[:, 0]))) / (len(trial.rows) * RIG_SAMPLE), []
        for factor in (share for one in TURNED for share in (one, 1 / one)):
            speeds = factor * trial.speeds
            if not TURNING < min(speeds) < max(speeds) < FASTEST:
                continue
            rows = ramp(speeds, rate, trial.pressure, trial.turns, trial.recorded)
            other = replace(trial, speeds=speeds, rows=rows, length=len(rows))
            twin = TwinComparison(comparison.twin, [other], comparison.threads)
            there = _peak(other, twin.lines_of(0, twin.predict(ParameterPoint())))
            if there is not None and abs(there / (factor * seen) - 1) < NEAR:
                found.append((abs(np.log(there / (factor * seen))), factor, there))
        if found:
            _, factor, there = min(found)
            raise DataError(
                f"{trial.name}: 1X is largest at {seen * TO_RPM:.4g} rpm, that of the machine file at "
                f"{there * TO_RPM:.4g} rpm; {misread_speed(seen, factor * seen)}",
                argument="speed",
                value=seen,
            )


def _peak(trial: RunupTrial, lines: np.ndarray) -> float | None:
    """Speed [rad/s] at which 1X of the lines (2, orders x rows) of a table is largest; None at an end of it."""
    first = trial.orders.index(1) * len(trial.speeds)
    size = np.sqrt(np.sum(np.abs(lines[:, first : first + len(trial.speeds)]) ** 2, axis=0))
    by_speed = np.argsort(trial.speeds)
    k, n = int(np.argmax(size[by_speed])), len(by_speed)
    ends = size[by_speed[[0, -1]]].max()
    inside = n // PEAK_INSIDE < k < n - 1 - n // PEAK_INSIDE and size[by_speed[k]] > PEAK * ends
    return float(trial.speeds[by_speed[k]]) if inside else None


def check_exchanged(comparison: TwinComparison, simulated: np.ndarray) -> None:
    """Check for exchanged channels x and y."""
    y, s, other = [np.zeros(0)], [np.zeros(0)], [np.zeros(0)]
    for i, trial in enumerate(comparison.trials):
        if trial.probe_angle is None:
            y += [*comparison.lines_of(i, comparison.measured)]
            s += [*comparison.lines_of(i, simulated)]
            other += [*comparison.lines_of(i, simulated)[::-1]]
    measured, own, exchanged = (np.concatenate(v) for v in (y, s, other))
    least = min(np.linalg.norm(measured - own), np.linalg.norm(measured))
    if np.linalg.norm(measured - exchanged) < 0.5 * least or _loud_where_quiet(comparison, simulated):
        raise DataError("records: channels x and y fit when they are exchanged; check the mapping of the sensors")


def _loud_where_quiet(comparison: TwinComparison, simulated: np.ndarray) -> bool:
    """Whether the power of excited lines in x over y is that in y over x, record by record.

    Resonances that are off spoil a comparison of lines, but not which way an excitation points.
    """
    bands = [k for k, name in enumerate(comparison.layout.groups) if name.endswith("band") or name == "resonance"]
    ratios = []
    for i, trial in enumerate(comparison.trials):
        # not the orders: an unbalance is as loud in x as in y
        at = comparison.lines_of(i, np.isin(comparison.layout.group, bands))[0].real > 0
        if trial.orders or trial.probe_angle is not None or not at.any():
            continue
        power = [
            [float(np.linalg.norm(lines[at])) for lines in comparison.lines_of(i, v)]
            for v in (comparison.measured, simulated)
        ]
        if np.min(power) > 0:
            ratios.append([np.log(x / y) for x, y in power])
    if len(ratios) < 2:
        return False
    found, wanted = np.array(ratios).T
    size = float(np.linalg.norm(found) * np.linalg.norm(wanted))
    return bool(np.ptp(wanted) > 0.4 and float(found @ wanted) < -0.7 * size)


def check_clocks(comparison: TwinComparison, simulated: np.ndarray) -> None:
    """Check for a time shift of displacement against inputs, common to a record's excited lines."""
    for i, trial in enumerate(comparison.trials):
        at = trial.excited[1:]
        if trial.orders or trial.clock or at.sum() < 4:
            continue
        f = trial.frequencies[1:][at]
        turned = np.exp(-2j * np.pi * f * LAGS[:, None])
        lags = []
        for c in range(len(trial.channels)):
            y, s = (comparison.lines_of(i, v)[c][at] for v in (comparison.measured, simulated))
            match = np.abs((np.conj(s * turned) @ y).real)
            best = int(np.argmax(match))
            # a resonance that is off turns the loudest lines alone, a clock all of them
            clear = np.minimum(np.abs(y), np.abs(s)) > FAINT_LINE * min(np.abs(y).max(), np.abs(s).max())
            alike = abs(np.mean(np.exp(1j * np.angle(np.conj(s * turned[best]) * y))[clear].real)) if clear.any() else 0
            loud = match[best] > 0.85 * np.linalg.norm(y) * np.linalg.norm(s)
            if loud and alike > ALIKE and match[400] < 0.6 * match[best]:
                lags.append(float(LAGS[best]))
        if len(lags) == len(trial.channels) and abs(lags[0] - lags[-1]) < 3e-4:
            raise DataError(
                f"{trial.name}: the displacement is shifted by {lags[0] * 1e3:+.2f} ms in time; are the clocks of the "
                "two recorders aligned? shift one of them, or state clock, how far it may be off; nothing was assumed",
                argument="clock",
                value=lags[0],
            )


@dataclass(frozen=True, eq=False)
class ProbeMistake:
    """Alternative to the readings of one plane, or of all: its sentence, and the change of the readings by plane."""

    sentence: str
    change: Callable[[dict[float, np.ndarray]], dict[float, np.ndarray]]
    backward: bool = False
    """Whether the twin's shaft turns the other way instead."""


def check_clock_rate(comparison: TwinComparison) -> None:
    """Check for a clock of the probes that runs at another rate than that of the shaft's angle.

    The order of the shaft turns from block to block then, by the same share of its angle in every record. The amplitude
    scatters as the turn does; two blocks may agree by chance, so that no record counts for less than the scatter of all
    of them. Some records show the rate by themselves, and nearly all turn its way.
    """
    found, squares = [], []
    for trial in comparison.trials:
        if trial.orders or trial.clock or trial.blocks < 2 or abs(trial.speed) < 1.0 or len(trial.broken):
            continue
        f = trial.frequencies
        at = int(np.argmin(np.abs(f - abs(trial.speed) / (2 * np.pi))))
        lines = trial.spectra[:, :, at]
        whole = turns_of(trial.speed, trial.length)  # blocks hold whole samples, and nearly whole turns
        steps = np.sum(np.conj(lines[:-1]) * lines[1:]) * np.exp(-2j * np.pi * (whole - round(whole)))
        apart = np.abs(lines[1:]) - np.abs(lines[:-1])
        squares.append((float(np.sum(apart**2)), apart.size))
        a_block = 2 * np.pi * f[at] * trial.length * RIG_SAMPLE
        size = max(float(np.linalg.norm(lines)), 1e-300)
        found.append((-float(np.angle(steps)) / a_block, size, a_block))
    if len(found) < FEWEST_CLOCKS:
        return
    (rate, size, a_block), (shaken, count) = np.array(found).T, np.array(squares).T
    pooled = count * shaken.sum() / count.sum()
    sd = np.maximum(np.sqrt(np.maximum(shaken, pooled)) / size, LEAST_TURN) / a_block
    usual = float(np.sum(rate / sd**2) / np.sum(sd**-2))
    spread = max(np.sqrt(np.mean(((rate - usual) / sd) ** 2)), 1.0) / np.sqrt(np.sum(sd**-2))
    clear = np.sum(np.abs(rate) > CLEAR_TURN * sd) >= FEWEST_CLOCKS and np.mean(rate * usual > 0) >= MOSTLY
    if clear and abs(usual) > SURE_TURN * spread:
        raise DataError(
            f"records: the clock of the probes drifts by {1e6 * usual:+.0f} ppm against the shaft's angle; state clock "
            "in [conditions], how far it may be off, and its drift is taken out, or record all channels on one clock; "
            "nothing was assumed",
            argument="clock",
            value=usual,
        )


def check_probes(comparison: TwinComparison, simulated: np.ndarray) -> None:
    """Check of probes that are exchanged, reversed, turned or of another plane, and of the sense of rotation."""
    groups = _simultaneous(comparison.trials)
    lines = [_shapes(comparison, own, comparison.measured) for own in groups]
    found = [_shapes(comparison, own, simulated) for own in groups]
    if not any(lines) or _misfit(lines, found).mean() <= 2 * SHAPE:
        return
    twins = [found, *(
        [_shapes(comparison, own, other) for own in groups] for other in _supported(comparison)
    )]  # fmt: skip
    before = [_misfit(lines, one) for one in twins]
    own = min(before, key=np.mean)
    if own.mean() <= 2 * SHAPE:
        return
    back = _turning_back(comparison)
    backward = [_shapes(comparison, g, back) for g in groups]
    better = []
    for mistake in _mistakes(comparison.trials):
        changed = [mistake.change(one) for one in lines]
        pairs = [(backward, own)] if mistake.backward else zip(twins, before, strict=True)
        misfit, was = min(((_misfit(changed, one), old) for one, old in pairs), key=lambda pair: pair[0].mean())
        shows = misfit != was
        clear = misfit.mean() <= min(SHAPE, CLEARER * own.mean())
        if clear and np.sum((misfit < own) & shows) >= MOSTLY * np.sum(shows):
            better.append((float(misfit.mean()), mistake.sentence))
    least = min((size for size, _ in better), default=0.0)
    _refuse([sentence for size, sentence in sorted(better) if size <= 2 * least + 0.1 * SHAPE])


@dataclass(frozen=True, eq=False)
class LateProbes:
    """Delay [s] of all probes with which the records fit better, and the calibration with it."""

    lag: float
    fit: ParameterFit

    @property
    def words(self) -> str:
        """The alternative in words."""
        return TOO_LATE.format(1e3 * self.lag)

    @property
    def sentence(self) -> str:
        """Sentence on it, where an effect may be what imitates it."""
        return TOO_LATE_TOO.format(self.words)


def check_late(parts: Iterable[TwinComparison], late: LateProbes) -> None:
    """Raise DataError for late probes that explain the records of all roles, each and together."""
    groups = list[Misfit]()
    for part in parts:
        own = _late(part, late.lag)
        groups += table(own, own.residual(late.fit.point))
    if all(f.group == "slow" for f in flagged(groups)) and not seen_together(groups):
        raise DataError(ALL_LATE.format(late.words), argument="clock", value=late.lag)


def check_alternatives(comparison: TwinComparison, base: ParameterFit, J: np.ndarray) -> LateProbes | None:
    """Raise DataError for probes that are exchanged, reversed or turned, by calibrations of the alternatives.

    Returns late probes where the records fit as well with them, which a seal or a damping may imitate; else None.

    `base` is the calibration of the records as they are, J (n, k) [m] has the sensitivities of its parameters at the
    machine file's own numbers.
    """
    origin = ParameterPoint()
    start = replace(base, point=origin, residual=comparison.residual(origin), J=J / comparison.sigma[:, None])
    cost, others = _foreseen(comparison, start), list[tuple[float, str, TwinComparison]]()
    most = cost(comparison) * (MOST_FORESEEN if flagged(table(comparison, base.residual)) else 1.0)
    for mistake in (one for one in _mistakes(comparison.trials) if not one.backward):
        other = _with_trials(comparison, _with_mistake(comparison.trials, mistake))
        others.append((cost(other), mistake.sentence, other))
    lag = min(LATE, key=lambda t: cost(_late(comparison, t)))
    if lag:
        others.append((cost(_late(comparison, lag)), TOO_LATE, _late(comparison, lag)))
    found, late = [], None
    for least, sentence, other in sorted(others, key=lambda one: one[0])[:MOST_CALIBRATED]:
        if least >= most:
            break
        fit = fit_parameters(other, origin, base.parameters, start.J)
        if sentence == TOO_LATE:
            lag = _refined(comparison, lag, _foreseen(other, fit))
            other = _late(comparison, lag)
            fit = fit_parameters(other, fit.point, base.parameters, fit.J)
            late = LateProbes(lag, fit)
        if fit.cost < base.cost - CLEARLY and not flagged(table(other, fit.residual)):
            found.append((fit.cost, sentence))
    shown = [sentence for size, sentence in sorted(found) if size < min(found)[0] + CLEARLY]
    _refuse([sentence for sentence in shown if sentence != TOO_LATE])
    return late if TOO_LATE in shown else None


def _foreseen(comparison: TwinComparison, fit: ParameterFit) -> Callable[[TwinComparison], float]:
    """Sum of squares with priors that a fit of other readings reaches, by the tangent at a fit of these."""
    cost = foreseen(fit, fit.parameters)
    return lambda other: cost((other.measured - comparison.measured) / comparison.sigma)


def _refined(comparison: TwinComparison, lag: float, cost: Callable[[TwinComparison], float]) -> float:
    """Lag [s] within two steps of one that is tried for which a sum of squares is least."""
    reach = 2 * (LATE[1] - LATE[0])
    bounds = lag - reach, lag + reach
    return float(answer(minimize_scalar, lambda t: cost(_late(comparison, t)), method="bounded", bounds=bounds).x)


def _late(comparison: TwinComparison, lag: float) -> TwinComparison:
    """The comparison with readings that come earlier by a lag [s]."""
    return _with_trials(comparison, [
        t if t.orders or t.clock else replace(t, spectra=delayed(t.spectra, t.frequencies, -lag))
        for t in comparison.trials
    ])  # fmt: skip


def _with_trials(comparison: TwinComparison, trials: list[Trial]) -> TwinComparison:
    """The comparison with other readings; floor and twin stay."""
    other = copy(comparison)
    other.trials, other.measured = trials, np.concatenate([t.vector(t.spectra) for t in trials])
    return other


def _refuse(sentences: Sequence[str]) -> None:
    """Raise DataError with the alternatives that fit, the best first; nothing for none."""
    if sentences:
        raise DataError(
            f"records: they fit when {' or when '.join(sentences[:3])}; check names, angles, positions, signs and "
            "the clock of the probes in the mapping; nothing was assumed",
            argument="probes",
            value=sentences[0],
        )


def _with_mistake(trials: Sequence[Trial], mistake: ProbeMistake) -> list[Trial]:
    """Trials with the readings of each record as an alternative has them."""
    out = list(trials)
    for own in _simultaneous(trials):
        planes = {i: trials[i].changes.get(PLANE, MAIN) for i in own}
        read = mistake.change({z: trials[i].spectra for i, z in planes.items()})
        for i, z in planes.items():
            out[i] = replace(trials[i], spectra=read[z])
    return out


def _simultaneous(trials: Sequence[Trial]) -> list[list[int]]:
    """Numbers of the trials of each record: one for each of its planes."""
    found: dict[str, list[int]] = {}
    for i, trial in enumerate(trials):
        if not trial.orders and trial.probe_angle is None:
            found.setdefault(trial.name.rpartition(", ")[0] if trial.other_plane else trial.name, []).append(i)
    return list(found.values())


Readings = dict[float, np.ndarray]
"""Readings (2, lines) by plane."""


def _shapes(comparison: TwinComparison, own: Sequence[int], y: np.ndarray) -> Readings:
    """Readings at the loudest lines of a record: the order of the shaft, and what is excited; none in a quiet one."""
    first = comparison.trials[own[0]]
    f, turns = first.frequencies[1:], abs(first.speed) / (2 * np.pi)
    wanted = first.excited[1:] | (np.abs(f - turns) < 0.51 * f[0])
    lines = {comparison.trials[i].changes.get(PLANE, MAIN): comparison.lines_of(i, y) for i in own}
    return {z: one[:, wanted] for z, one in lines.items()}


def _misfit(measured: Sequence[Readings], simulated: Sequence[Readings]) -> np.ndarray:
    """Misfit of the shapes (records,), the loud lines of a record weighted by their power."""
    out = []
    for y, s in zip(measured, simulated, strict=True):
        planes = sorted(y)
        a, b = np.concatenate([y[z] for z in planes]), np.concatenate([s[z] for z in planes])
        power, other = (np.sum(np.abs(one) ** 2, axis=0) for one in (a, b))
        if not power.any() or not other.any():
            continue
        alike = np.abs(np.sum(np.conj(a) * b, axis=0)) ** 2 / np.maximum(power * other, 1e-300)
        out.append(float(np.sum(power * (1 - alike)) / power.sum()))
    return np.array(out or [0.0])


def _supported(comparison: TwinComparison) -> Iterator[np.ndarray]:
    """Responses (n,) [m] of the twin on softer and on stiffer supports; none without linear bearings."""
    bearings = comparison.twin.machine.bearings
    keys = [f"bearing.{i}.k{axis}" for i, one in enumerate(bearings) for axis in "xy" if of_axis(one, axis)[0].any()]
    for change in COMPLIANCES if keys else ():
        yield comparison.predict(ParameterPoint({FitParameter(key, 0.1): change for key in keys}))


def _turning_back(comparison: TwinComparison) -> np.ndarray:
    """Response (n,) [m] of the twin whose shaft turns the other way."""
    back = []
    for trial in comparison.trials:
        rows = trial.rows.copy()
        rows[:, 0] *= -1
        back.append(replace(trial, rows=rows, angle=-trial.angle))
    return TwinComparison(comparison.twin, back, comparison.threads).predict(ParameterPoint())


def _mistakes(trials: Sequence[Trial]) -> Iterator[ProbeMistake]:
    """All alternatives: of each plane, of both, and of the shaft."""
    names = {t.changes.get(PLANE, MAIN): t.channels for t in trials if t.probe_angle is None}

    def of(z: float | None, matrix: np.ndarray) -> Callable[[Readings], Readings]:
        return lambda y: {plane: matrix @ one if z in (None, plane) else one for plane, one in y.items()}

    for z, (a, b) in names.items():
        yield ProbeMistake(f"channels {a} and {b} are exchanged", of(z, np.array([[0, 1], [1, 0]])))
        yield ProbeMistake(f"probe {a} is reversed", of(z, np.diag([-1, 1])))
        yield ProbeMistake(f"probe {b} is reversed", of(z, np.diag([1, -1])))
        if len(names) > 1:
            yield ProbeMistake(f"probes {a} and {b} are both reversed", of(z, -np.eye(2)))
        for angle in TURNS:
            yield ProbeMistake(f"probes {a} and {b} are turned by {np.degrees(angle):+.0f} deg", of(z, _turn(angle)))
    if len(names) == 2:
        one, other = names
        yield ProbeMistake(
            f"the planes are exchanged: {' and '.join(names[one])} with {' and '.join(names[other])}",
            # a record of one plane shows no exchange
            lambda y: {one: y[other], other: y[one]} if len(y) == 2 else y,
        )
        for angle in TURNS:
            yield ProbeMistake(
                f"the probes of both planes are turned by {np.degrees(angle):+.0f} deg", of(None, _turn(angle))
            )
    if any(abs(t.speed) > 1.0 for t in trials):
        yield ProbeMistake("the rotation is in the other sense", lambda y: y, backward=True)


def _turn(angle: float) -> np.ndarray:
    """Rotation (2, 2) of readings by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def force_is_sampled(comparison: TwinComparison, base: ParameterFit) -> bool:
    """Whether the force was sampled while it moved on, and not held from sample to sample as the plant takes it.

    The response then comes half a sample earlier than that of the plant, on all lines that the force excites; most of
    what the calibration leaves has to go with it.
    """
    y, h = comparison.predict(base.point), np.zeros(len(base.residual))
    for i, trial in enumerate(comparison.trials):
        if trial.orders or not (trial.settled and trial.rows[:, 4:6].any()):
            return False
        late = np.where(trial.excited, -2j * np.pi * trial.frequencies * RIG_SAMPLE, 0.0)[1:]
        for own, lines in zip(comparison.numbers_of(i), late * comparison.lines_of(i, y), strict=True):
            h[own] = np.concatenate([lines.real, lines.imag])
    A = np.vstack([np.column_stack([base.J, h / comparison.sigma]), np.diag([*prior_rows(base.parameters), 0.0])])
    b = np.concatenate([base.residual, -prior_rows(base.parameters) * base.vector, [0.0]])
    size = np.linalg.norm(A, axis=0)
    size[size == 0] = 1.0
    x = answer(np.linalg.lstsq, A / size, b, rcond=1e-9)[0]
    left = float(np.sum((b - A / size @ x) ** 2))
    beyond = base.cost - len(base.residual)
    return bool(beyond > 0 and base.cost - left > HALF * beyond and EARLY[0] < x[-1] / size[-1] < EARLY[1])


def held(trial: Trial) -> Trial:
    """Trial whose force, held from sample to sample, makes the response to the sampled one, which repeats."""
    at = (np.arange(len(trial.rows)) - trial.start) % trial.length
    period = trial.rows[trial.start : trial.start + trial.length, 4:6]
    f = np.fft.rfftfreq(trial.length)
    lines = np.fft.rfft(period, axis=0) / (np.sinc(f) * np.exp(-1j * np.pi * f))[:, None]
    rows = trial.rows.copy()
    rows[:, 4:6] = np.fft.irfft(lines, trial.length, axis=0)[at]
    return replace(trial, rows=rows)
