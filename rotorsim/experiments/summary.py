"""Summary of an experiment's record in engineering units, read in blocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.records.sampling import nominal_rate
from rotorsim.base import toml_text as tomllib
from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.base.errors import DataError
from rotorsim.base.units import parse
from rotorsim.experiments.experiment import REFERENCE_LIMIT
from rotorsim.experiments.limits import beyond_of
from rotorsim.signals.order_tracking import after_start, start_transient
from rotorsim.signals.probes import probe_numbers
from rotorsim.signals.record_blocks import blocks, displacement_name
from rotorsim.signals.static_gain import static_gain_map

if TYPE_CHECKING:
    import xarray as xr


def summarise_experiment(record: xr.Dataset) -> dict[str, Any]:
    """Summary ready for JSON, of any record that an experiment made.

    Returns
    -------
    dict
        experiment, duration_s, samples, start_transient_s, speed_rpm {first, last}; disc {mean_um, rms_um, peak_um}
        (x, y), rms and peak about the mean; largest_orbit_um from the mean, all of these without the start transient;
        smallest_film_um and contact_samples (None without a film); reference_peak_v and force_peak_n (x, y); and what
        the experiment is made for: static_gain of a staircase, deceleration of a coast-down, runout of a slow roll,
        impulse of impacts, saturation of a closed loop.
        `probes` of a record that has them, see `rotorsim.signals.probes.probe_numbers`; `beyond_checked_range`,
        sentences, of one beyond the range in which the model was checked.
    """
    name = str(record.attrs.get("experiment", ""))
    seen = scan(record)
    if numbers := probe_numbers(record):
        seen["probes"] = numbers
    return {"experiment": name, **seen, **SPECIAL.get(name, _nothing)(record, seen), **beyond_of(record)}


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
    speed = record["speed"]
    return {
        "duration_s": n / sampling_rate(record),
        "samples": int(n),
        "start_transient_s": begin,
        "speed_rpm": {"first": float(speed[0]) * TO_RPM, "last": float(speed[-1]) * TO_RPM},
        "disc": {"mean_um": (mean * TO_UM).tolist(), "rms_um": (np.sqrt(square / settled) * TO_UM).tolist(),
                 "peak_um": (peak * TO_UM).tolist()},
        "largest_orbit_um": orbit * TO_UM,
        "smallest_film_um": film * TO_UM if "h_min" in record else None,
        "contact_samples": touched if "contact" in record else None,
        "reference_peak_v": largest["reference"].tolist() if "reference" in record else None,
        "force_peak_n": largest["disc_force"].tolist() if "disc_force" in record else None,
    }  # fmt: skip


def sampling_rate(record: xr.Dataset) -> float:
    """Samples a second of a record [Hz]."""
    return nominal_rate(record["time"].values)


def _nothing(record: xr.Dataset, seen: dict[str, Any]) -> dict[str, Any]:
    return {}


def _gains(record: xr.Dataset, seen: dict[str, Any]) -> dict[str, Any]:
    if record.attrs.get("ended", "complete") != "complete":
        return {}
    try:
        found = static_gain_map(record)
    except DataError:  # steps too short or too few for a map
        return {}
    gains: dict[str, Any] = {}
    for axis in found["input"].values:
        column = found.sel(input=axis)
        gains[str(axis)] = {"gain_um_per_v": (column["gain"].values * TO_UM).tolist()}
        gains[str(axis)] |= {
            f"{name}_um": (column[name].values * TO_UM).tolist()
            for name in ("deviation_max", "deviation_rms", "hysteresis")
        }
    return {"static_gain": gains}


def _deceleration(record: xr.Dataset, seen: dict[str, Any]) -> dict[str, Any]:
    speeds = np.asarray(record["speed"].isel(time=[0, -1]).values, float)
    time = (record.sizes["time"] - 1) / sampling_rate(record)
    reached = bool(speeds[1] <= record.attrs["stop_speed"] + 1e-9)
    mean = float((speeds[0] - speeds[1]) / time * TO_RPM) if time else 0.0
    return {"deceleration": {"time_s": time, "mean_rpm_per_s": mean, "reached_stop": reached}}


def _runout(record: xr.Dataset, seen: dict[str, Any]) -> dict[str, Any]:
    """Largest distance of what the sensors see from the true displacement."""
    if "disc" not in record or "disc_measured" not in record:
        return {}
    pairs = blocks(record, ["disc", "disc_measured"])
    apart = np.max([np.abs(block["disc_measured"] - block["disc"]).max(axis=0) for block in pairs], axis=0)
    return {"sensor_error_peak_um": (apart * TO_UM).tolist()}


def _impulse(record: xr.Dataset, seen: dict[str, Any]) -> dict[str, Any]:
    total = sum(block["disc_force"].sum(axis=0) for block in blocks(record, ["disc_force"])) / sampling_rate(record)
    return {"impulse_n_s": np.asarray(total).tolist()}


def _limit(record: xr.Dataset) -> float:
    """Largest reference [V] of the machine that the record names; see `reference_range`."""
    actuators = tomllib.loads(str(record.attrs.get("machine", ""))).get("actuators", {})
    return (
        min(parse(actuators["reference_limit"], "V"), REFERENCE_LIMIT)
        if "reference_limit" in actuators
        else REFERENCE_LIMIT
    )


def _saturation(record: xr.Dataset, seen: dict[str, Any]) -> dict[str, Any]:
    limit = _limit(record)
    limited = [np.any(np.abs(b["reference"]) >= limit, axis=1).sum() for b in blocks(record, ["reference"])]
    alarms = {key: str(record.attrs[key]) for key in ("controller_alarms",) if key in record.attrs}
    return {"saturated_samples": int(np.sum(limited)), **alarms}


SPECIAL: dict[str, Callable[[xr.Dataset, dict[str, Any]], dict[str, Any]]] = {
    "staircase": _gains,
    "coastdown": _deceleration,
    "slow_roll": _runout,
    "impact": _impulse,
    "controlled": _saturation,
}
