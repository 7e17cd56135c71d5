"""Summary values of a case, stored in the index: modes, orders, resonances and others, by name.

Names end in their unit (`_um`, `_rpm`, `_hz`); two numbers of x and y end in `.x` and `.y`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.units import TO_UM
from rotorsim.experiments.summary import summarise_experiment
from rotorsim.signals.orders import find_resonances, track_orders
from rotorsim.signals.spectra import largest_sub_synchronous, waterfall

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.experiments import Experiment
    from rotorsim.plant import Plant

Numbers = dict[str, Any]
MODES = 4


def numbers(plant: Plant, experiment: Experiment, record: xr.Dataset) -> Numbers:
    """Mean, rms and peak of the disc, smallest film thickness, contact, and results of the experiment's kind."""
    return {name: value for name, value in summarise_experiment(record).items() if name != "experiment"}


def modes(plant: Plant, experiment: Experiment, record: xr.Dataset) -> Numbers:
    """Natural frequencies, damping ratios, static gain and delay at the experiment's initial equilibrium.

    `modes_proven` states whether no mode is missing.
    """
    model = plant.linearise(*experiment.initial())
    found: Numbers = {"f_hz": (model.wn[:MODES] / (2 * np.pi)).tolist(), "zeta": model.zeta[:MODES].tolist()}
    found["modes_proven"] = model.proven
    if model.inputs:
        gain = np.asarray(model.static_gain)
        found |= {"gain_um_per_v": {"x": (gain[:, 0] * TO_UM).tolist(), "y": (gain[:, 1] * TO_UM).tolist()}}
        found |= {"delay_ms": (np.asarray(model.delay) * 1e3).tolist()}
    return found


def orders(plant: Plant, experiment: Experiment, record: xr.Dataset) -> Numbers:
    """Mean 1X, 2X and 3X amplitudes of the disc."""
    amplitude = np.abs(track_orders(record)["amplitude"].values)
    mean = amplitude.mean(axis=0) * TO_UM if len(amplitude) else np.full((3, 2), np.nan)
    return {f"{order}x_um": mean[order - 1].tolist() for order in (1, 2, 3)}


def resonances(plant: Plant, experiment: Experiment, record: xr.Dataset) -> Numbers:
    """Speed and amplitude of the largest 1X peak on each axis; None if the run passes none."""
    tracked = track_orders(record)
    found: Numbers = {}
    for axis in "xy":
        peak = next((p for p in find_resonances(tracked, 1, axis) if p["local_maximum"]), {})
        found[axis] = {"rpm": peak.get("rpm"), "um": peak.get("um")}
    return found


def sub_synchronous(plant: Plant, experiment: Experiment, record: xr.Dataset) -> Numbers:
    """Largest subsynchronous component."""
    return largest_sub_synchronous(waterfall(record)) or {}


Summary = Callable[["Plant", "Experiment", "xr.Dataset"], Numbers]
SUMMARIES: dict[str, Summary] = {f.__name__: f for f in (numbers, modes, orders, resonances, sub_synchronous)}


def summarise(names: Sequence[str], plant: Plant, experiment: Experiment, record: xr.Dataset) -> dict[str, Any]:
    """Summary row of a case: dotted names, prefixed by the post-processing, to numbers, text or None."""
    return {f"{name}.{key}": value for name in names for key, value in flat(SUMMARIES[name](plant, experiment, record))}


def flat(value: Any) -> Iterator[tuple[str, Any]]:
    """Dotted names and plain values of nested tables and pairs."""
    if isinstance(value, Mapping):
        items = [(str(key), below) for key, below in value.items()]
    elif isinstance(value, (list, tuple)):
        items = list(zip("xy" if len(value) == 2 else map(str, range(1, len(value) + 1)), value, strict=True))
    else:
        yield "", _plain(value)
        return
    for key, below in items:
        for rest, number in flat(below):
            yield f"{key}.{rest}".rstrip("."), number


def _plain(value: Any) -> Any:
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if isfinite(value) else None
    return value
