"""Summary of an experiment's record in engineering units, read in blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from identification.records.sampling import nominal_rate
from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.experiments.catalogue import EXPERIMENTS
from rotorsim.experiments.limits import beyond_of
from rotorsim.signals.orders import after_start, start_transient
from rotorsim.signals.record_blocks import blocks, displacement_name, probe_numbers

if TYPE_CHECKING:
    import xarray as xr


def summarise_experiment(record: xr.Dataset) -> dict[str, Any]:
    """Summary ready for JSON, of any record that an experiment made.

    Returns
    -------
    dict
        experiment, duration_s, samples, start_transient_s, speed_rpm {first, last}; disc {mean_um, rms_um, peak_um}
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
    return {"experiment": name, **seen, **findings, **beyond_of(record)}


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
