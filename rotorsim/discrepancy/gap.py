r"""Gap between measurement and simulation: rms at each stage, bands missed, the force that would make the rest.

The rms [um] of the vibration, without its mean, is that by channel and operating point. Of a run-up's vectors an
amplitude is missed by more than a tenth of the order's largest one, a phase by more than 15 deg. Phases of amplitudes,
and orders, that are hardly above their floor do not count. A residual that no effect explains is shown as the
equivalent force on the disc,

.. math:: f(\omega) = Z(\omega)\, r(\omega), \qquad Z = G^{-1}

G (2, 2) is the receptance of the re-fitted plant's linearisation from disc force to sensors; of a single probe
it is one row, and f the least force that makes its reading. Its largest lines come with frequency, order, direction
(forward, backward, along an axis) and the exponents with which the force grows over speed, pressure and amplitude.

At bearings and discs without probes the re-fitted plant gives virtual readings of 1X, with the standard deviation
that the covariance V of the fit's parameters gives them,

.. math:: \sigma_a^2 = g' V g, \qquad g_k = \Re\{\bar q\, \partial q / \partial v_k\} / |q|, \quad a = |q|

Cites: platz_2001.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.rounding import answer
from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.discrepancy.calibration import ParameterPoint
from rotorsim.discrepancy.changes import PLANE, RING, RING_KEY, ring_axes
from rotorsim.discrepancy.comparison import UNSTEADY, Misfit, TwinComparison, tone
from rotorsim.discrepancy.fit import ParameterFit
from rotorsim.discrepancy.trial import TURNING, Trial
from rotorsim.discrepancy.twin import FAILURES, NO_SOLUTION, Setting, Twin
from rotorsim.plant.linearise import linearise
from rotorsim.plant.mesh import Mesh
from rotorsim.plant.simulation import settle

if TYPE_CHECKING:
    import xarray as xr

STAGES = ("nominal", "re-calibrated", "with effect", "floor")
"""Stages of a diagnosis whose gap is shown."""
MISSED_AMPLITUDE, MISSED_PHASE = 0.10, np.deg2rad(15.0)
"""Share of an order's largest amplitude, and phase [rad], by which a row is missed."""
ABOVE = 3.0
"""Amplitude over its floor below which it has no phase."""
NEAR_BANDS = 0.05
"""Distance of two bands, as a share of all rows, below which they are one."""
MOST_LINES, NEIGHBOURS, MOST_RECORDS = 8, 3, 4
"""Most lines that are reported, lines of a peak's skirt to each side, most records that are looked at."""


VIRTUAL = "virtual readings of 1X at {point}, by the re-fitted machine: {places}"
"""Note on the motion where no probe is."""
SAME_PLANE = 1e-3
"""Distance [m] up to which a probe shows the motion of a bearing or a disc."""


def virtual_readings(comparison: TwinComparison, fit: ParameterFit, V: np.ndarray) -> list[str]:
    """Sentence on 1X at bearings and discs without probes in the fastest record that only turns; none without one.

    V (k, k) is the covariance of the fit's parameters.
    """
    machine, turning = comparison.twin.machine, [t for t in comparison.trials if t.turning and t.probe_angle is None]
    seen = {t.changes.get(PLANE, Mesh(machine).probe) for t in comparison.trials}
    parts = {n: d.position for n, d in zip(machine.disc_names, machine.discs, strict=True)}
    parts |= {n: b.position for n, b in zip(machine.bearings_in_words, machine.bearings, strict=True)}
    parts = {name: z for name, z in parts.items() if all(abs(z - own) > SAME_PLANE for own in seen)}
    if not turning or not parts:
        return []
    fastest = max(turning, key=lambda t: abs(t.speed))
    known = {k: v for k, v in fastest.changes.items() if k not in (PLANE, RING_KEY)}
    own = [replace(fastest, names=(), changes={**known, PLANE: z}) for z in parts.values()]
    virtual = TwinComparison(comparison.twin, own, comparison.threads)
    y = virtual.predict(fit.point)
    J = virtual.jacobian(fit.point, fit.parameters, y)
    line = int(np.argmin(np.abs(fastest.frequencies[1:] - abs(fastest.speed) / (2 * np.pi))))
    shown = []
    for i, name in enumerate(parts):
        sizes = []
        q = virtual.lines_of(i, y)[:, line]
        slopes = np.array([virtual.lines_of(i, column)[:, line] for column in J.T])
        for axis, value, slope in zip("xy", q, slopes.T, strict=True):
            g = (np.conj(value) * slope).real / max(abs(value), 1e-300)
            sizes.append(f"{axis} {abs(value) * TO_UM:.3g} +- {np.sqrt(g @ V @ g) * TO_UM:.2g} um")
        shown.append(f"{name} {', '.join(sizes)}")
    return [VIRTUAL.format(point=fastest.point.partition(",")[0], places="; ".join(shown))]


def rms(comparison: TwinComparison, vector: np.ndarray) -> np.ndarray:
    """Time-domain rms of the vibration (records, 2) [m] of a data vector (n,) [m], over all rows of vectors.

    Without the mean: static sag and zeros of the sensors are no vibration.
    """
    layout = comparison.layout
    power = (
        np.where(layout.frequency == 0, 0.0, vector**2 / 2)
        / np.array([t.rows_of_vectors for t in comparison.trials])[layout.record]
    )
    out = np.zeros((len(comparison.trials), 2))
    np.add.at(out, (layout.record, layout.channel), power)
    return np.sqrt(out)


def gap_of(comparison: TwinComparison, points: list[ParameterPoint | None]) -> np.ndarray:
    """Gap (records, 2, stages) [m] at fitted points; None repeats the previous stage; the last is the floor."""
    out, last = [], np.zeros(0)
    for point in points:
        if point is not None:
            last = comparison.measured - comparison.predict(point) - comparison.correction
        out.append(rms(comparison, last))
    noise = np.zeros_like(comparison.sigma)
    if comparison.scatter is not None:
        scatter, means, _ = comparison.scatter
        for i, trial in enumerate(comparison.trials):
            for c in range(2):
                own = np.flatnonzero((comparison.layout.record == i) & (comparison.layout.channel == c))
                lines = scatter[i, c, 1 : trial.spectra.shape[2]]
                noise[own] = np.concatenate([[means[i, c], 0.0], lines, lines])
    out.append(rms(comparison, noise))
    return np.stack(out, axis=2)


def gap_dataset(parts: dict[str, tuple[TwinComparison, np.ndarray]]) -> xr.Dataset:
    """Gaps of all records as a Dataset: gap(record, axis, stage) [m] with role and operating point.

    Of a single probe x holds its reading, and y is NaN.
    """
    import xarray as xr

    names, roles, points, values = [], [], [], []
    for role, (comparison, gap) in parts.items():
        for trial, one in zip(comparison.trials, gap, strict=True):
            names.append(trial.name)
            roles.append(role)
            points.append(trial.point)
            one[len(trial.channels) :] = np.nan
            values.append(one)
    coords = {"record": names, "axis": ["x", "y"], "stage": list(STAGES)}
    data = np.array(values).reshape(len(names), 2, len(STAGES))
    attrs = {"units": "m", "long_name": "rms of measured less simulated"}
    dataset = xr.Dataset({"gap": (("record", "axis", "stage"), data, attrs)}, coords, {"kind": "gap"})
    return dataset.assign_coords(role=("record", roles), point=("record", points))


def reduction(dataset: xr.Dataset, role: str = "untouched") -> float:
    """Reduction of the gap from re-calibrated to with effect, as a fraction, scatter subtracted.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.discrepancy.reduction(rs.diagnose("dtu_gas_bearing", "puzzle/records").gap)  # doctest: +SKIP
    """
    chosen = dataset["gap"].values[dataset["role"].values == role]
    if not len(chosen):
        return float("nan")
    squares = np.nansum(chosen**2, axis=(0, 1))
    before, after = squares[1] - squares[3], squares[2] - squares[3]
    return float(1 - np.sqrt(max(after, 0.0) / before)) if before > 0 else 0.0


def spectra_of(comparison: TwinComparison, points: list[ParameterPoint | None]) -> list[dict[str, Any]]:
    """Frequencies [Hz] and magnitudes [m] (2, lines) of measurement, residuals and floor, record by record.

    Of vectors also orders, speeds (rows,) [rad/s] and complex amplitudes (2, orders, rows) [m], measured and simulated.
    """
    stages, last = [], np.zeros(0)
    for point in points:
        if point is not None:
            last = comparison.measured - comparison.predict(point) - comparison.correction
        stages.append(last)
    out = []
    for i, trial in enumerate(comparison.trials):
        measured = comparison.lines_of(i, comparison.measured)
        left = [comparison.lines_of(i, stage) for stage in stages]
        out.append(
            {
                "record": trial.name,
                "point": trial.point,
                "speed": trial.speed,
                "channels": trial.channels,
                "frequency": trial.frequencies[1:],
                "measured": _size(measured),
                "stages": [_size(lines) for lines in left],
                "floor": _size(comparison.lines_of(i, comparison.sigma)),
            }
            | (_vectors(trial, measured, left) if trial.orders else {"orders": ()})
        )
    return out


def _size(lines: np.ndarray) -> np.ndarray:
    """Magnitudes of complex lines."""
    return np.hypot(lines.real, lines.imag)


def _vectors(trial: Trial, measured: np.ndarray, left: list[np.ndarray]) -> dict[str, Any]:
    """Complex amplitudes of a run-up's table, from its measured lines and what each stage leaves (2, k) [m]."""
    rows = trial.rows_of_vectors
    return {
        "orders": trial.orders,
        "speeds": np.array([trial.speed_at(1 + line) for line in range(rows)]),
        "measured_vectors": measured.reshape(2, -1, rows),
        "simulated_vectors": [(measured - one).reshape(2, -1, rows) for one in left],
    }


def missed_bands(shown: Iterable[dict[str, Any]], model: str = "the model") -> list[str]:
    """Sentences on the rows of vectors that `spectra_of` shows, an order and channel each; none for records."""
    parts = [one for one in shown if one["orders"]]
    tables: dict[str, list[dict[str, Any]]] = {}
    for one in parts:
        tables.setdefault(one["record"].rpartition(",")[0], []).append(one)
    return [
        f"{name}, {channel}, {order}X: {model} misses {missed}"
        for name, own in tables.items()
        for k, order in enumerate(own[0]["orders"])
        for c, channel in enumerate(own[0]["channels"])
        if (missed := _missed(*_rows(own, c, k)))
    ]


def _rows(parts: Sequence[dict[str, Any]], channel: int, number: int) -> tuple[np.ndarray, ...]:
    """Speeds (k,) [rad/s] that rise, measured and simulated vectors and floors (k,) [m] of all parts of a table."""
    speed = np.concatenate([one["speeds"] for one in parts])
    measured = np.concatenate([one["measured_vectors"][channel, number] for one in parts])
    simulated = np.concatenate([one["simulated_vectors"][-1][channel, number] for one in parts])
    floor = np.concatenate([one["floor"][channel].reshape(-1, len(one["speeds"]))[number] for one in parts])
    rising = np.argsort(speed)
    return speed[rising], measured[rising], simulated[rising], floor[rising]


def _missed(speed: np.ndarray, measured: np.ndarray, simulated: np.ndarray, floor: np.ndarray) -> str:
    """Text on the missed amplitude and phase: largest miss and bands of speed; empty where nothing is missed."""
    clear = np.abs(measured) > ABOVE * floor
    if not clear.any():
        return ""
    if np.abs(simulated).max() > NO_SOLUTION / 2:
        return f"all: it has no solution at {_bands(speed, np.abs(simulated) > NO_SOLUTION / 2)}"
    top = float(np.abs(measured).max())
    off = np.abs(np.abs(simulated) - np.abs(measured))
    turned = np.where(clear, np.abs(np.angle(simulated * np.conj(measured))), 0.0)
    found = []
    if off.max() > MISSED_AMPLITUDE * top:
        worst = f"up to {off.max() * TO_UM:.3g} um ({100 * off.max() / top:.0f} % of its peak)"
        found.append(f"the amplitude by {worst} at {_bands(speed, off > MISSED_AMPLITUDE * top)}")
    if turned.max() > MISSED_PHASE:
        found.append(f"the phase by up to {np.rad2deg(turned.max()):.0f} deg at {_bands(speed, turned > MISSED_PHASE)}")
    return " and ".join(found)


def _bands(speed: np.ndarray, missed: np.ndarray) -> str:
    """Bands of speeds as text: rows that are missed, those near to each other joined."""
    rows = np.flatnonzero(missed)
    near = max(2, round(NEAR_BANDS * len(speed)))
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > near) + 1)
    rpm = speed * TO_RPM
    ends = [(f"{rpm[run[0]]:.0f}", f"{rpm[run[-1]]:.0f}") for run in runs]
    return ", ".join(low if low == high else f"{low}-{high}" for low, high in ends) + " rpm"


def equivalent_force(
    comparison: TwinComparison, point: ParameterPoint, residual: np.ndarray, flags: Sequence[Misfit]
) -> dict[str, Any]:
    """Spectral lines of the equivalent force in flagged records, its direction and growth exponents."""
    lines: list[dict[str, Any]] = []
    growth, taken = _growth(comparison, residual, flags)
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
        "calibrated_share": taken,
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
    """Order of a frequency [Hz] that is a whole one or below 1X; None for others, for lines of the exciter, at rest."""
    near = np.abs(trial.frequencies - f) < 0.51 * trial.frequencies[1]
    if abs(trial.speed) <= TURNING or (not trial.orders and (trial.excited & near).any()):
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


def _growth(
    comparison: TwinComparison, residual: np.ndarray, flags: Sequence[Misfit]
) -> tuple[dict[str, float], float | None]:
    """Exponents of a fit  force ~ speed^a pressure^b amplitude^c  to the worst group over records, and a share.

    The force is that of the machine file as given: what the re-calibration has taken up of it is the share.
    """
    flags = [f for f in flags if f.group != UNSTEADY]
    if not flags or comparison.trials[flags[0].number].orders:
        return {}, None
    layout, trials, group = comparison.layout, comparison.trials, comparison.layout.groups.index(flags[0].group)
    origin = ParameterPoint()
    before = comparison.residual(origin) * comparison.sigma
    rows: list[list[float]] = []
    sizes: list[float] = []
    for i, t in enumerate(trials):
        lines = layout.group[comparison.numbers_of(i)[0]][: t.spectra.shape[2] - 1] == group
        if not lines.any() or t.speed <= 1 or t.orders or t.other_plane:
            continue
        with suppress(*FAILURES):
            rows.append([1.0, np.log(t.speed), np.log(max(t.pressure, 1.0)), np.log(max(t.amplitude, 1e-3))])
            sizes.append(float(np.log(max(_force_of(comparison, origin, i, before, lines), 1e-12))))
    own = layout.group == group
    taken = 1 - float(np.linalg.norm((residual * comparison.sigma)[own])) / max(
        float(np.linalg.norm(before[own])), 1e-300
    )
    names = ("", "speed", "pressure", "amplitude")
    A = np.array(rows)
    vary = [k for k in range(4) if k == 0 or (len(A) and np.ptp(A[:, k]) > 0.1)]
    if len(rows) < len(vary) + 1:
        return {}, None
    x = answer(np.linalg.lstsq, A[:, vary], np.array(sizes), rcond=None)[0]
    return {names[k]: float(v) for k, v in zip(vary, x, strict=True) if k}, max(taken, 0.0)


def _force_of(comparison: TwinComparison, point: ParameterPoint, i: int, left: np.ndarray, wanted: np.ndarray) -> float:
    """Size [N] of the force on the disc that makes the wanted lines (k,) of what is left (n,) [m] in trial i."""
    trial = comparison.trials[i]
    values = point.setting(comparison.twin, trial.speed, trial.pressure, trial.changes)
    a, probes = comparison.twin.set(values), _probes(comparison.twin, trial, values)
    plant = linearise(
        a, settle(a, trial.speed, comparison.twin.regulator(values, trial.speed, trial.pressure)), trial.speed
    )
    lines, f = comparison.lines_of(i, left), trial.frequencies[1:]
    each = [
        answer(np.linalg.pinv, probes @ answer(plant.transfer, 2j * np.pi * f[k])[:, 2:4]) @ lines[: len(probes), k]
        for k in np.flatnonzero(wanted)
    ]
    return float(np.linalg.norm(each))
