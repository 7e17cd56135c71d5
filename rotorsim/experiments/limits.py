"""End of a run at a limit of its machine, and the sentences about the range that its film model exceeds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.errors import LimitError
from rotorsim.base.units import TO_RPM
from rotorsim.experiments.recording import FEWEST
from rotorsim.machine.limits import at_speed, first_passed, limits_of
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.kernels.layout import COLUMNS, HEAT_COLUMNS
from rotorsim.plant.simulation import Simulation
from rotorsim.plant.validity import beyond, choked_share

if TYPE_CHECKING:
    import xarray as xr

BEYOND = "beyond_checked_range"
"""Attribute of a record whose run exceeds the range in which the model was checked."""
SPEED = COLUMNS.index("speed")


def passed(a: Assembly, table: np.ndarray) -> tuple[int, str] | None:
    """First sample of a sample table beyond a limit, and the sentence; None if there is none."""
    warm = HEAT_COLUMNS * len(a.films) if a.rig.n_heat else 0
    return first_passed(a.machine, table[:, SPEED], table[:, a.columns - warm : a.columns] if warm else None)


def choked(simulation: Simulation) -> str:
    """Why a run ends where a simulation stands: too many feed holes are choked; empty if they are not."""
    a = simulation.assembly
    limit = limits_of(a.machine).choked_feeds
    for k, name in enumerate(a.machine.film_names if limit is not None else ()):
        share = choked_share(simulation, k)
        if limit is not None and share > limit:
            what = f"{100 * share:.0f} % of the feed holes of {name} are choked where they enter the film"
            what += f", above limits.choked_feeds {100 * limit:g} %"
            return at_speed(float(simulation.w[a.rotor.speed]), what)
    return ""


def cut(record: xr.Dataset, a: Assembly) -> xr.Dataset:
    """A record up to where its run passed a limit of the machine; raises LimitError if it began beyond one.

    With the attributes `ended` and, where the run exceeds it, about the range in which the model was checked.
    """
    rises = (
        record["temperature_rise"].values.reshape(record.sizes["time"], -1) if "temperature_rise" in record else None
    )
    found = first_passed(a.machine, record["speed"].values, rises)
    if found is not None:
        if found[0] < FEWEST:
            raise LimitError(f"the run {found[1]}; begin lower or raise it", argument="limits", value=found[1])
        record = record.isel(time=slice(found[0]))
    pressures = record["pressure"].values if "pressure" in record else 0.0
    ended = {"ended": "complete" if found is None else found[1]}
    return record.assign_attrs(ended | beyond_attrs(a, record["speed"].values, pressures))


def check_begin(simulation: Simulation) -> None:
    """Raise LimitError if a run would begin beyond a limit."""
    a = simulation.assembly
    row = np.zeros((1, a.columns))
    row[0, SPEED] = simulation.w[a.rotor.speed]
    if a.rig.n_heat:
        warm = HEAT_COLUMNS * len(a.films)
        row[0, a.columns - warm :] = simulation.w[a.rig.heat : a.rig.heat + warm]
    found = passed(a, row)
    sentence = found[1] if found else choked(simulation)
    if sentence:
        what = sentence.partition(": ")[2]
        speed = float(simulation.w[a.rotor.speed]) * TO_RPM
        raise LimitError(
            f"the run would begin beyond a limit, at {speed:.0f} rpm: {what}; begin lower or raise it",
            argument="limits",
            value=sentence,
        )


def extremes(speeds: np.ndarray, more: np.ndarray) -> np.ndarray:
    """Lowest and highest size (2,) of speeds and of more of them; empty while there are none."""
    size = np.abs(np.concatenate([speeds, more]))
    return np.array([size.min(), size.max()]) if size.size else size


def beyond_attrs(a: Assembly, speeds: np.ndarray, pressures: np.ndarray | float) -> dict[str, Any]:
    """Attribute about the range that a run with these speeds [rad/s] and gauge pressures [Pa] exceeds, if it does."""
    tabled = any(bearing.speeds.size for bearing in a.machine.bearings)
    if not speeds.size or (not a.films and not tabled and a.machine.checked is None):
        return {}
    slowest, fastest = extremes(np.zeros(0), speeds)
    ends = sorted({float(np.min(pressures)), float(np.max(pressures))})
    found = [text for pressure in ends for text in beyond(a, float(slowest), float(fastest), pressure)]
    return {BEYOND: "\n".join(dict.fromkeys(found))} if found else {}


def sentences(attrs: Mapping[str, Any]) -> list[str]:
    """Sentences about the range that a record's run exceeds."""
    return str(attrs.get(BEYOND, "")).splitlines()


def beyond_of(record: xr.Dataset) -> dict[str, list[str]]:
    """Part of a summary: the sentences, if there are any."""
    found = sentences(record.attrs)
    return {BEYOND: found} if found else {}
