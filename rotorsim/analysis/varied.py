"""Parameter study: any analysis repeated over values of machine-file fields."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from rotorsim.analysis.axes import Field
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant

if TYPE_CHECKING:
    import xarray as xr


def with_fields(machine: Machine, fields: Sequence[Field], values: Sequence[Any]) -> Machine:
    """The machine with one value of each field; raises MachineFileError where it would not be valid."""
    for field, value in zip(fields, values, strict=True):
        machine = machine.replace(field.path, value)
    return machine


def over_fields(plant: Plant, fields: Sequence[Field], analysis: Callable[[Plant], xr.Dataset]) -> xr.Dataset:
    """`analysis` of the machine at every combination of the fields' values: a Dataset over (fields..., its own dims).

    ``over_fields(plant, [read_field("bearings.1.clearance=24 um, 26 um")], lambda p: whirl_onset(p, [0.5e6]))``

    Examples
    --------
    >>> import rotorsim as rs
    >>> fields = [rs.analysis.read_field("bearings.1.clearance=24 um, 26 um")]
    >>> found = rs.analysis.over_fields(plant, fields, lambda one: rs.analysis.critical_speeds(one, [0.5e6], (1,)))
    >>> found.sizes["bearings_1_clearance"]
    2
    """
    import xarray as xr

    if not fields:
        return analysis(plant)
    first, *others = fields
    parts = [over_fields(Plant(with_fields(plant.machine, [first], [v])), others, analysis) for v in first.values]
    axis = xr.DataArray(list(first.numbers), dims=first.name, name=first.name, attrs=labelled(first))
    return xr.concat(parts, axis, data_vars="all", coords="minimal", compat="equals", join="exact")


def labelled(field: Field) -> dict[str, str]:
    """Attributes of a field's coordinate."""
    return {"units": field.unit or "1", "long_name": field.path}
