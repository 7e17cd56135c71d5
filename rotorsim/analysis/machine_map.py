"""Whole map of a machine: operating points, the safe region, on request lift-off, onset and critical speeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.analysis.axes import Field, over_fields, with_fields
from rotorsim.analysis.campbell import critical_speeds
from rotorsim.analysis.load_capacity import lift_off
from rotorsim.analysis.operating_map import operating_map
from rotorsim.analysis.safe_region import safe_region
from rotorsim.analysis.supply import felt
from rotorsim.analysis.whirl_onset import whirl_onset
from rotorsim.base.errors import DataError
from rotorsim.base.interrupt import finishing
from rotorsim.base.units import TO_UM
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant

if TYPE_CHECKING:
    import xarray as xr


def map_machine(
    plant: Plant,
    speeds: Sequence[float] | np.ndarray,
    pressures: Sequence[float] | np.ndarray,
    fields: Sequence[Field] = (),
    frequencies: Sequence[float] | None = None,
    least_film: float | None = None,
    onset: bool = False,
    critical: bool = False,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Equilibria, modes, gains and film coefficients over a grid of operating points, with the safe region.

    Parameters
    ----------
    plant : Plant
    speeds, pressures : arrays
        Axes [rad/s] and [Pa, gauge]; pressure 0 alone for a machine without feed.
    fields : sequence of Field
        Further axes: fields of the machine file, see `read_field`.
    frequencies : sequence of float, optional
        Whirl frequencies [rad/s] of the film's K and C; by default 0 and those of the modes.
    least_film : float, optional
        Film [m] that counts as lift-off, 0 for what the plant runs on; None leaves the lift-off pressure out.
    onset, critical : bool
        Whether to search the onset of whirl, and the critical speeds of the orders 1, 2, 3.
    workers : int, optional
        Processes; by default as many as pay.
    progress : callable, optional
        Called with the points done and in all.

    Returns
    -------
    Dataset
        Over speed, pressure and the further axes; `attrs["ended"]` is "complete" or "interrupted".

    Raises
    ------
    DataError
        For a quantity that the machine does not have, or an axis that does not ascend.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.map_machine(rs.Plant("dtu_gas_bearing"), [0.0, 300.0], [0.5e6])
    >>> found["wn"].sizes["speed"]
    2
    """
    check_quantities(plant, least_film is not None, onset)
    found = safe_region(
        operating_map(
            plant, speeds, felt(machines_at_ends(plant, fields), pressures), fields, frequencies, workers, progress
        )
    )
    if found.attrs["ended"] == "complete":
        found = _more(plant, fields, found, least_film, onset, critical)
    return found


def machines_at_ends(plant: Plant, fields: Sequence[Field]) -> list[Machine]:
    """The machine at the first and at the last value of each field."""
    return [with_fields(plant.machine, fields, [field.values[end] for field in fields]) for end in (0, -1)]


def check_quantities(plant: Plant, with_lift_off: bool, with_onset: bool) -> None:
    """Refuse, before any computation, quantities that the machine does not have."""
    if with_onset and plant.machine.film is None:
        raise DataError("--whirl-onset: the machine has no gas film; leave the option out")
    if with_lift_off and not plant.machine.fed:
        raise DataError("--lift-off: the machine has no injectors, so no pressure lifts it; leave the option out")


def _more(
    plant: Plant, fields: Sequence[Field], found: xr.Dataset, film: float | None, with_onset: bool, critical: bool
) -> xr.Dataset:
    """The extra analyses at every value of the further axes; an interrupt keeps those before."""
    pressures, speeds = found["pressure"].values, found["speed"].values

    def crossings(plant: Plant) -> xr.Dataset:
        extra = critical_speeds(plant, pressures).rename(mode="mode_crossing", searched="crossing_searched")
        return extra.rename(
            {name: str(name).replace("critical", "crossing") for name in extra if "critical" in str(name)}
        )

    asked: list[tuple[bool, Callable[[Plant], xr.Dataset]]] = [
        (film is not None, lambda plant: _lift_off(plant, speeds, film or 0.0)),
        (with_onset, lambda plant: whirl_onset(plant, pressures)),
        (critical, crossings),
    ]
    try:
        for wanted, analysis in asked:
            if wanted:
                found = found.merge(over_fields(plant, fields, analysis))
    except KeyboardInterrupt:
        finishing()
        found = found.assign_attrs(ended="interrupted")
    return found


def _lift_off(plant: Plant, speeds: np.ndarray, film: float) -> xr.Dataset:
    import xarray as xr

    unit = {"units": "Pa", "long_name": f"pressure that leaves {film * TO_UM:.3g} um of film, gauge"}
    pressure = ("speed", lift_off(plant, speeds, least_film=film), unit)
    return xr.Dataset({"lift_off_pressure": pressure}, {"speed": speeds})
