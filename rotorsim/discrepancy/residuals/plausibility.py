"""Plausibility of records for a machine: units, channels and clocks before the fit, the unexplained share after it.

A likely mistake is suggested and never assumed: a diagnosis stops with the sentence.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.spectra import EXCITED
from rotorsim.discrepancy.residuals.comparison import TwinComparison

FACTORS = {25.4: "mils or inches taken for millimetres", 1e3: "a prefix of a thousand lost (mm, um; mV, V)",
           1e6: "metres taken for micrometres", 39.37: "inches taken for metres"}  # fmt: skip
"""Factors between units that are taken for one another, with their causes."""
ALIKE = 0.7
"""Cosine between measured and simulated lines from which they count as the same up to a factor."""
NEAR = 0.35
"""Relative distance of a ratio to one of FACTORS: the calibration may be off as well."""
LAGS = np.linspace(-0.02, 0.02, 801)
"""Time shifts [s] that are tried."""
UNLIKE, FOREIGN = 0.5, 0.8
"""Shares of the response that stay unexplained: from the first nothing is named, from the second it is refused."""


def check_before(comparison: TwinComparison, simulated: np.ndarray) -> None:
    """Raise DataError for records with a likely mistake; simulated (n,) [m] is at the nominal point."""
    check_exchanged(comparison, simulated)
    check_units(comparison, simulated)
    check_clocks(comparison, simulated)


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
    if not found:
        return
    (factor, what), ratio = found[0]
    only = len(every) == 2 and len(found) == 1 and ratio == drive
    channel = "the reference, or the force," if only else "the displacement"
    shown = f"{1 / ratio:.3g}" if only else f"{ratio:.3g}"
    near = 1 / factor if only else factor
    raise DataError(
        f"records: {channel} is {shown} times what the machine file makes of it, about {near:.4g}: is it a matter of "
        f"units, {what}? state the unit in the mapping; nothing was assumed"
    )


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
            if match[best] > 0.85 * np.linalg.norm(y) * np.linalg.norm(s) and match[400] < 0.6 * match[best]:
                lags.append(float(LAGS[best]))
        if len(lags) == len(trial.channels) and abs(lags[0] - lags[-1]) < 3e-4:
            raise DataError(
                f"{trial.name}: the displacement is shifted by {lags[0] * 1e3:+.2f} ms in time; are the clocks of the "
                "two recorders aligned? shift one of them, or state clock, how far it may be off; nothing was assumed"
            )


def unexplained(comparison: TwinComparison, fitted: np.ndarray) -> float:
    """Fraction of the measured response to excitation not explained by a prediction (n,) [m]; 0 if unexcited.

    Orders of the shaft do not count: a missing force may well be larger than what the unbalance does.
    """
    layout = comparison.layout
    excited = np.isin(layout.group, [layout.groups.index(band) for band in EXCITED])
    y, f = comparison.measured[excited], fitted[excited]
    return float(np.linalg.norm(y - f)) / max(float(np.linalg.norm(y)), 1e-300)


def check_after(comparison: TwinComparison, fitted: np.ndarray) -> list[str]:
    """Warnings for a poorly matching machine; raises DataError if the records cannot be this machine's."""
    share = unexplained(comparison, fitted)
    if share < UNLIKE:
        return []
    if share > FOREIGN:
        raise DataError(
            f"records: even re-calibrated, the machine file leaves {100 * share:.0f} % of the response unexplained; "
            "are they of this machine, and are the machine file, speed and pressure right?"
        )
    return [
        f"re-calibrated, the machine file leaves {100 * share:.0f} % of the response unexplained: nothing is named; "
        "check that the records are of this machine"
    ]
