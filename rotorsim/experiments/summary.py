"""Summaries in engineering units, read in blocks: of any experiment's record, and of a run over the speed.

A run over the speed has extremes with their times and speeds, resonances, air consumption, whirl below 1X.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from identification.records.sampling import nominal_rate
from rotorsim.base.errors import MachineFileError
from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.experiments.experiment import EXPERIMENTS
from rotorsim.experiments.running import warnings_of
from rotorsim.machine import Gas, Machine
from rotorsim.signals.orders import after_start, find_resonances, start_settled, start_transient
from rotorsim.signals.record_blocks import blocks, displacement_name, probe_numbers
from rotorsim.signals.spectra import largest_sub_synchronous, waterfall

if TYPE_CHECKING:
    import xarray as xr


def summarise_experiment(record: xr.Dataset) -> dict[str, Any]:
    """Summary ready for JSON, of any record that an experiment made.

    Returns
    -------
    dict
        experiment, duration_s, samples, start_transient_s, start_settled (false where the numbers still hold
        a part of it), speed_rpm {first, last}; disc {mean_um, rms_um, peak_um}
        (x, y), rms and peak about the mean; largest_orbit_um from the mean, all of these without the start transient;
        smallest_film_um and contact_samples (None without a film); reference_peak_v and force_peak_n (x, y); and the
        `findings` of the experiment, such as the static_gain of a staircase or the deceleration of a coast-down.
        `probes` of a record that has them, see `rotorsim.signals.record_blocks.probe_numbers`; `beyond_checked_range`,
        sentences, of one beyond the range in which the model was checked.
    """
    name = str(record.attrs.get("experiment", ""))
    seen = scan(record)
    if numbers := probe_numbers(record):
        seen["probes"] = numbers
    findings = EXPERIMENTS[name].findings(record) if name in EXPERIMENTS else {}
    return {"experiment": name, **seen, **findings, **warnings_of(record)}


def scan(record: xr.Dataset) -> dict[str, Any]:
    """Numbers that every experiment has, in two passes: the mean, then what is measured from it."""
    disc, n = displacement_name(record), record.sizes["time"]
    begin, orbiting = start_transient(record), after_start(record)
    settled = orbiting.sizes["time"]
    mean = sum(block[disc].sum(axis=0) for block in blocks(orbiting, [disc])) / settled
    names = [name for name in ("h_min", "contact", "reference", "disc_force") if name in record]
    square, peak, orbit = np.zeros(2), np.zeros(2), 0.0
    film, touched, largest = np.inf, 0, {"reference": np.zeros(2), "disc_force": np.zeros(2)}
    for block in blocks(orbiting, [disc]):
        off = block[disc] - mean
        square += (off**2).sum(axis=0)
        peak = np.maximum(peak, np.abs(off).max(axis=0))
        orbit = max(orbit, float(np.hypot(*off.T).max()))
    for block in blocks(record, names) if names else ():
        film = min(film, float(block["h_min"].min())) if "h_min" in block else film
        touched += int((block["contact"] > 0).sum()) if "contact" in block else 0
        for name in largest.keys() & block.keys():
            largest[name] = np.maximum(largest[name], np.abs(block[name]).max(axis=0))
    return {
        "duration_s": n / sampling_rate(record),
        "samples": int(n),
        "start_transient_s": begin,
        "start_settled": start_settled(record),
        "speed_rpm": in_rpm(record, first=float(record["speed"][0]), last=float(record["speed"][-1])),
        "disc": {"mean_um": (mean * TO_UM).tolist(), "rms_um": (np.sqrt(square / settled) * TO_UM).tolist(),
                 "peak_um": (peak * TO_UM).tolist()},
        "largest_orbit_um": orbit * TO_UM,
        "smallest_film_um": film * TO_UM if "h_min" in record else None,
        "contact_samples": touched if "contact" in record else None,
        "reference_peak_v": largest["reference"].tolist() if "reference" in record else None,
        "force_peak_n": largest["disc_force"].tolist() if "disc_force" in record else None,
    }  # fmt: skip


def in_rpm(record: xr.Dataset, **speeds: float) -> dict[str, float]:
    """Speeds [rad/s] of a record in rpm by name; one within the last sample's change is 0: the shaft has stopped."""
    step = abs(float(record["speed"][-2:].diff("time").sum()))
    return {name: 0.0 if abs(speed) < step else speed * TO_RPM for name, speed in speeds.items()}


def sampling_rate(record: xr.Dataset) -> float:
    """Samples a second of a record [Hz]."""
    return nominal_rate(record["time"].values)


def summarise(record: xr.Dataset, tracked: xr.Dataset, spectra: xr.Dataset | None = None) -> dict[str, Any]:
    """Numbers of a run, ready for JSON, in engineering units (rpm, um 0-pk, kg/s, normal litres per minute).

    `tracked` is that of `track_orders`, `spectra` that of `waterfall`; what the record lacks (film, contact) is None.

    Returns
    -------
    dict
        duration_s, samples, start_transient_s, start_settled, speed_rpm, peaks, largest_orbit, smallest_film,
        contact, mass_flow, sub_synchronous.
        A peak with ``local_maximum = False`` is a largest amplitude that is no resonance, with ``at_end`` "start" or
        "end" in the first or last window. The start transient, see `start_transient`, is left out of peaks, of the
        largest orbit and of sub_synchronous; it is in smallest_film and contact. The largest orbit is measured from the
        slowly moving mean; it and the smallest film have ``at_end`` too. A record with probes also has `probes`, see
        `probe_numbers`; contact has what `lift_off` finds; one with several films `films`: by bearing smallest_um,
        flow_kg_s; one beyond the range in which the model was checked `beyond_checked_range`, sentences.
    """
    spectra = waterfall(record) if spectra is None else spectra
    begin = start_transient(record)
    seen = _scan(record, tracked, begin)
    flow, contact = seen.get("mass_flow"), seen.get("contact")
    return {
        "duration_s": seen["time"]["last"] - seen["time"]["first"],
        "samples": int(record.sizes["time"]),
        "start_transient_s": begin,
        "start_settled": start_settled(record),
        "speed_rpm": in_rpm(record, **{k: seen["speed"][k] for k in ("first", "last", "min", "max")}),
        "peaks": [p for n in tracked["order"].values for axis in "xy" for p in find_resonances(tracked, int(n), axis)],
        "largest_orbit": _extreme(seen["radius"], "max", 0.0),
        "smallest_film": _extreme(seen["h_min"], "min", begin) if "h_min" in seen else None,
        **_of_films(record),
        "contact": contact and {"samples": contact["positive"], "first_time_s": contact["first_time"],
                                "first_rpm": contact["first_speed"]} | lift_off(record),
        "mass_flow": flow and _flow(flow, normal_density(record)),
        "sub_synchronous": largest_sub_synchronous(spectra),
    } | ({"probes": numbers} if (numbers := probe_numbers(record)) else {}) | warnings_of(record)  # fmt: skip


def lift_off(record: xr.Dataset) -> dict[str, dict[str, float]]:
    """Lift-off and touch-down of a shaft by these names, each with `rpm` and `time_s`, where it has them.

    It has left where contact ends before a whole revolution without any: the first such end is `lift_off`. The last
    contact that begins after a whole revolution without any, of the start too, is `touch_down`.
    """
    if "contact" not in record or "angle" not in record or not record.sizes["time"]:
        return {}
    names = ("contact", "angle", "time", "speed")
    touched = [np.array([b[n][b["contact"] > 0] for n in names[1:]]) for b in blocks(record, names)]
    ends = [[float(record[n][k]) for n in names[1:]] for k in (0, -1)]
    marks = np.column_stack([ends[0], *touched, ends[1]])
    free = np.flatnonzero(np.abs(np.diff(marks[0])) >= 2 * np.pi)
    left, back = free[free > 0], free[free < marks.shape[1] - 2] + 1
    found = {"lift_off": left[:1], "touch_down": back[-1:]}
    return {
        name: {"rpm": float(marks[2, k[0]]) * TO_RPM, "time_s": float(marks[1, k[0]])}
        for name, k in found.items()
        if k.size
    }


def _of_films(record: xr.Dataset) -> dict[str, Any]:
    """Smallest thickness [um] and mean flow [kg/s] by bearing, of a record with several films."""
    if "film_thickness" not in record:
        return {}
    names = [str(name) for name in record["bearing"].values]
    low, total, count = np.full(len(names), np.inf), np.zeros(len(names)), 0
    for block in blocks(record, ["film_thickness", "film_flow"]):
        low = np.minimum(low, block["film_thickness"].min(axis=0))
        total, count = total + block["film_flow"].sum(axis=0), count + len(block["film_flow"])
    return {"films": {name: {"smallest_um": float(low[k]) * TO_UM, "flow_kg_s": float(total[k]) / count}
                      for k, name in enumerate(names)}}  # fmt: skip


def _extreme(seen: dict[str, Any], which: str, begin: float) -> dict[str, Any]:
    """An extreme [um] with its speed and time; `at_end` where it lies in the first or last revolution, or the start.

    A revolution may last longer than the run, so that the nearer end counts.
    """
    time, speed = seen[f"{which}_time"], seen[f"{which}_speed"]
    revolution = 2 * np.pi / abs(speed) if speed else 0.0
    ends = {"start": time - max(seen["begin_time"], begin), "end": seen["last_time"] - time}
    nearer = min(ends, key=lambda end: ends[end])
    at_end = nearer if ends[nearer] <= revolution else ""
    return {"um": seen[which] * TO_UM, "rpm": speed * TO_RPM, "time_s": time, "at_end": at_end}


def _flow(seen: dict[str, Any], density: float) -> dict[str, float]:
    """Mass flow [kg/s] and in normal litres per minute (273.15 K, 101325 Pa)."""
    mean = {"mean": seen["sum"] / seen["count"], "min": seen["min"], "max": seen["max"]}
    return {f"{k}_kg_s": v for k, v in mean.items()} | {f"{k}_nl_min": v / density * 6e4 for k, v in mean.items()}


def _scan(record: xr.Dataset, tracked: xr.Dataset, begin: float) -> dict[str, dict[str, Any]]:
    """Extremes, sums and ends of all scalars and, from `begin` [s] on, of the disc's distance from its mean."""
    name = displacement_name(record)
    scalars = [v for v in ("time", "speed", "h_min", "mass_flow", "contact") if v in record.variables]
    seen: dict[str, dict[str, Any]] = {}
    for block in blocks(record, [*scalars, name]):
        block["radius"] = np.hypot(*(block[name] - _centre(tracked, block["time"], block[name])).T)
        for key in scalars:
            _note(seen.setdefault(key, {}), block[key], block["time"], block["speed"])
        on = block["time"] >= begin - 1e-9
        if on.any():
            _note(seen.setdefault("radius", {}), block["radius"][on], block["time"][on], block["speed"][on])
    return seen


def _centre(tracked: xr.Dataset, time: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Slowly moving mean (n, 2) of the disc; of the block where the shaft stands still."""
    if tracked.sizes["window"] == 0:
        return d.mean(axis=0, keepdims=True)
    return np.column_stack([np.interp(time, tracked["time"], tracked["mean"][:, i]) for i in range(2)])


def _note(seen: dict[str, Any], values: np.ndarray, time: np.ndarray, speed: np.ndarray) -> None:
    """Take a block into the running numbers of one variable."""
    seen.setdefault("first", float(values[0]))
    seen.setdefault("begin_time", float(time[0]))
    seen["last"], seen["last_time"] = float(values[-1]), float(time[-1])
    seen["sum"] = seen.get("sum", 0.0) + float(values.sum())
    seen["count"] = seen.get("count", 0) + len(values)
    positive = np.flatnonzero(values > 0)
    seen["positive"] = seen.get("positive", 0) + len(positive)
    if seen.setdefault("first_time", None) is None and positive.size:
        seen["first_time"], seen["first_speed"] = float(time[positive[0]]), float(speed[positive[0]] * TO_RPM)
    seen.setdefault("first_speed", None)
    for key, i in (("min", values.argmin()), ("max", values.argmax())):
        better = key not in seen or (values[i] < seen[key] if key == "min" else values[i] > seen[key])
        if better:
            seen |= {key: float(values[i]), f"{key}_time": float(time[i]), f"{key}_speed": float(speed[i])}


def normal_density(record: xr.Dataset) -> float:
    """Density [kg/m^3] of the machine's gas at 273.15 K and 101325 Pa; of air if the record names no machine."""

    try:
        gas = Machine.from_text(str(record.attrs.get("machine", ""))).gas
    except MachineFileError:
        gas = Gas()
    return 101325 / (gas.R * 273.15)
