r"""Equivalent force on the disc for the residual that no effect explains.

.. math:: f(\omega) = Z(\omega)\, r(\omega), \qquad Z = G^{-1}

G (2, 2) is the receptance of the re-fitted plant's linearisation from disc force to sensors; of a single probe
it is one row, and f the least force that makes its reading. Its largest lines come with frequency, order, direction
(forward, backward, along an axis) and the exponents with which the force grows over speed, pressure and amplitude.

Cites: platz_2001.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.discrepancy.data.blocks import TURNING
from rotorsim.discrepancy.data.changes import RING, RING_KEY, ring_axes
from rotorsim.discrepancy.data.spectra import Trial
from rotorsim.base.rounding import answer
from rotorsim.discrepancy.residuals.comparison import TwinComparison
from rotorsim.discrepancy.residuals.misfit import UNSTEADY, Misfit, tone
from rotorsim.discrepancy.twin.parameters import ParameterPoint
from rotorsim.discrepancy.twin.plant import FAILURES, Setting, Twin
from rotorsim.plant.equilibrium import settle
from rotorsim.plant.linearise import linearise

MOST_LINES, NEIGHBOURS, MOST_RECORDS = 8, 3, 4
"""Most lines that are reported, lines of a peak's skirt to each side, most records that are looked at."""


def equivalent_force(
    comparison: TwinComparison, point: ParameterPoint, residual: np.ndarray, flags: Sequence[Misfit]
) -> dict[str, Any]:
    """Spectral lines of the equivalent force in flagged records, its direction and growth exponents."""
    lines: list[dict[str, Any]] = []
    growth = _growth(comparison, residual, flags)
    for i in list(dict.fromkeys(f.number for f in flags))[:MOST_RECORDS]:
        trial = comparison.trials[i]
        groups = {f.group for f in flags if f.number == i}
        with suppress(*FAILURES):  # where the plant has no solution there is no force either
            if trial.orders:
                found, own = _of_vectors(comparison, point, residual, i, trial, groups)
                lines += found
                growth = own if comparison.trials[flags[0].number].orders else growth
            else:
                lines += _of_record(comparison, point, residual, i, trial, groups)
    lines.sort(key=lambda x: -x["force_n"])
    return {
        "where": "at the disc, as far as one measuring plane shows",
        "lines": lines[:MOST_LINES],
        "growth": growth,
        "groups": sorted({f.group for f in flags}),
    }


def _of_record(
    comparison: TwinComparison, point: ParameterPoint, residual: np.ndarray, i: int, trial: Trial, groups: set[str]
) -> list[dict[str, Any]]:
    layout, found = comparison.layout, []
    r, w = comparison.lines_of(i, residual * comparison.sigma), comparison.lines_of(i, residual)
    white = (w.real**2 + w.imag**2).sum(axis=0)
    group = layout.group[comparison.numbers_of(i)[0][: r.shape[1]]]
    inside = np.isin(group, [layout.groups.index(g) for g in groups - {UNSTEADY}])
    values = point.setting(comparison.twin, trial.speed, trial.pressure, trial.changes)
    a = comparison.twin.set(values)
    regulator = comparison.twin.regulator(values, trial.speed, trial.pressure)
    plant = linearise(a, settle(a, trial.speed, regulator), trial.speed)
    probes = _probes(comparison.twin, trial, values)
    # off the lines of a record that no period fits, a tone is spread over neighbours
    spread = 0 if trial.periodic else 2
    for k in _peaks(white * inside, 3):
        near = r[:, max(0, k - spread) : k + spread + 1]
        found.append(_line(trial, plant, probes, float(trial.frequencies[1 + k]), r[:, k], near))
    if UNSTEADY in groups:
        f, size = tone(trial, comparison.apart(point)[i])
        found.append(_line(trial, plant, probes, f, size, size[:, None]) | {"unsteady": True})
    return found


def _of_vectors(
    comparison: TwinComparison, point: ParameterPoint, residual: np.ndarray, i: int, trial: Trial, groups: set[str]
) -> tuple[list[dict[str, Any]], dict[str, float]]:
    """The row of every flagged order of a run-up with the largest residual, and how the largest force grows."""
    layout, rows = comparison.layout, trial.rows_of_vectors
    r, first = comparison.lines_of(i, residual * comparison.sigma), comparison.numbers_of(i)[0]
    values = point.setting(comparison.twin, trial.speed, trial.pressure, trial.changes)
    a, probes = comparison.twin.set(values), _probes(comparison.twin, trial, values)
    found: list[dict[str, Any]] = []
    growth: dict[str, float] = {}
    for k, order in enumerate(trial.orders):
        if layout.groups[layout.group[first[k * rows]]] not in groups:
            continue
        of_rows = []
        for line in range(k * rows, (k + 1) * rows):
            speed = trial.speed_at(1 + line)
            plant = linearise(a, settle(a, speed, trial.pressure), speed)
            one = r[:, line : line + 1]
            of_rows.append(_line(trial, plant, probes, order * speed / (2 * np.pi), one[:, 0], one))
            of_rows[-1] |= {"order": float(order), "point": f"{speed * TO_RPM:.0f} rpm"}
        worst = max(of_rows, key=lambda x: x["residual_um"])
        if not found or worst["force_n"] > max(x["force_n"] for x in found):
            speeds = [trial.speed_at(1 + line) for line in range(rows)]
            growth = {"speed": float(np.polyfit(np.log(speeds), np.log([x["force_n"] for x in of_rows]), 1)[0])}
        found.append(worst)
    return found, growth


def _probes(twin: Twin, trial: Trial, values: Setting) -> np.ndarray:
    """Direction cosines (channels, 2) of the probes to x and y, where their ring stands."""
    return trial.directions @ ring_axes(values.get(RING_KEY, getattr(twin.effect(RING, 0), "angle", 0.0)))


def _line(trial: Trial, plant: Any, probes: np.ndarray, f: float, r: np.ndarray, near: np.ndarray) -> dict[str, Any]:
    """A line r (2,) [m] at f [Hz] as the force that makes it, with the size of `near` (2, lines)."""
    G = probes @ answer(plant.transfer, 2j * np.pi * f)[:, 2:4]
    # of a single probe the least force that it may be
    to_force = answer(np.linalg.pinv, G)
    force, every = to_force @ r[: len(G)], to_force @ near[: len(G)]
    return {
        "record": trial.name,
        "point": trial.point,
        "frequency_hz": f,
        "order": _order(trial, f),
        "force_n": float(np.linalg.norm(every)),
        "direction": _direction(force) if len(G) > 1 else "direction unknown (one probe)",
        "residual_um": float(np.linalg.norm(r)) * TO_UM,
        "unsteady": False,
    }


def _order(trial: Trial, f: float) -> float | None:
    """Order of a frequency [Hz] that is a whole one or below 1X; None for others and at rest."""
    if abs(trial.speed) <= TURNING:
        return None
    order = f * 2 * np.pi / abs(trial.speed)
    return order if abs(order - round(order)) < 0.02 or order < 1 else None


def _peaks(size: np.ndarray, most: int) -> list[int]:
    """The largest lines that are not next to larger ones: the skirts of a peak are the peak."""
    left = size.copy()
    found: list[int] = []
    while len(found) < most and left.max() > 0:
        k = int(np.argmax(left))
        found.append(k)
        left[max(0, k - NEIGHBOURS) : k + NEIGHBOURS + 1] = 0.0
    return found


def _direction(force: np.ndarray) -> str:
    forward, backward = abs(force[0] + 1j * force[1]) / 2, abs(force[0] - 1j * force[1]) / 2
    if forward > 2 * backward:
        return "turns forward"
    if backward > 2 * forward:
        return "turns backward"
    angle = np.degrees(
        0.5 * np.arctan2(2 * (force[0] * np.conj(force[1])).real, abs(force[0]) ** 2 - abs(force[1]) ** 2)
    )
    return f"along {angle:.0f} deg from x"


def _growth(comparison: TwinComparison, residual: np.ndarray, flags: Sequence[Misfit]) -> dict[str, float]:
    """Exponents of a fit  size ~ speed^a pressure^b amplitude^c  to the residual of the worst group over records."""
    flags = [f for f in flags if f.group != UNSTEADY]
    if not flags:
        return {}
    layout, trials = comparison.layout, comparison.trials
    group, kind = flags[0].group, bool(trials[flags[0].number].orders)
    metres = residual * comparison.sigma
    rows: list[list[float]] = []
    sizes: list[float] = []
    for i, t in enumerate(trials):
        own = (layout.record == i) & (layout.group == layout.groups.index(group))
        if own.any() and t.speed > 1 and bool(t.orders) is kind:
            rows.append([1.0, np.log(t.speed), np.log(max(t.pressure, 1.0)), np.log(max(t.amplitude, 1e-3))])
            sizes.append(float(np.log(max(float(np.linalg.norm(metres[own])), 1e-12))))
    names = ("", "speed", "pressure", "amplitude")
    A = np.array(rows)
    vary = [k for k in range(4) if k == 0 or (len(A) and np.ptp(A[:, k]) > 0.1)]
    if len(rows) < len(vary) + 1:
        return {}
    x = answer(np.linalg.lstsq, A[:, vary], np.array(sizes), rcond=None)[0]
    return {names[k]: float(v) for k, v in zip(vary, x, strict=True) if k}
