"""Run of a sweep in memory, on one process or several, and its result.

A result is labelled data, the best point of each quantity, cells without a result, tables and files.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.analysis.axes import labelled
from rotorsim.analysis.sweep_definition import (
    ANALYSES,
    QUANTITIES,
    REASON,
    WHAT,
    Over,
    SweepDefinition,
    SweepQuantity,
    make_sweep,
)
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.files import make_folder, write_csv
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.base.interrupt import finishing
from rotorsim.base.processes import spread
from rotorsim.base.rounding import first_of_highest
from rotorsim.machine.schema import Machine
from rotorsim.plant.plant import Plant

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.analysis.sweep_definition import SweepDefinition

NETCDF, TABLE = "sweep.nc", "sweep.csv"
PENDING = "not computed"


@dataclass(frozen=True, eq=False)
class SweepResult:
    """Quantities in SI over the axes that change them, NaN where there is none; `NAME_reason` gives the causes.

    Coordinates are in the units that the axes were given in; their `long_name` is the path.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.sweep("dtu_gas_bearing", ["pressure=0.4 MPa, 0.5 MPa"], "flow")
    >>> found.data["flow"].dims
    ('pressure',)
    """

    data: xr.Dataset

    @property
    def quantities(self) -> tuple[SweepQuantity, ...]:
        """Quantities of the sweep, in their order."""
        return tuple(QUANTITIES[str(name)] for name in self.data.data_vars if str(name) in QUANTITIES)

    @property
    def best(self) -> dict[str, dict[str, Any]]:
        """Best value [shown unit] of each quantity, whether that is the highest or the lowest, and its point.

        A quantity without any number is left out.
        """
        return {q.name: _best(self.data[q.name], q) for q in self.quantities if np.isfinite(self.data[q.name]).any()}

    @property
    def reasons(self) -> dict[str, dict[str, int]]:
        """Number of cells without a result, by quantity and reason."""
        counted = {q.name: Counter(map(str, self.data[f"{q.name}_reason"].values.ravel())) for q in self.quantities}
        return {name: {r: n for r, n in found.items() if r} for name, found in counted.items() if set(found) - {""}}

    @property
    def complete(self) -> bool:
        """Whether every cell was computed."""
        return not any(PENDING in found for found in self.reasons.values())

    def table(self) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
        """Head with units and a row per cell of all axes; None where there is no number."""
        axes = [str(name) for name in self.data.sizes]
        head = (*(heading(self.data, name) for name in axes), *(q.heading for q in self.quantities))
        rows = []
        for place in product(*(range(self.data.sizes[name]) for name in axes)):
            at = dict(zip(axes, place, strict=True))
            values = (self.data[name].values[k].item() for name, k in at.items())
            here = ((q, self.data[q.name]) for q in self.quantities)
            found = [float(v.isel({str(dim): at[str(dim)] for dim in v.dims})) * q.factor for q, v in here]
            rows.append((*values, *(number if np.isfinite(number) else None for number in found)))
        return head, rows

    def numbers(self) -> dict[str, Any]:
        """Axes, best points and reasons as plain values."""
        axes = {heading(self.data, str(name)): self.data[name].values.tolist() for name in self.data.sizes}
        return {"axes": axes, "best": self.best, "without_result": self.reasons, "complete": self.complete}

    def write(self, folder: str | Path) -> dict[str, str]:
        """Write `sweep.nc` (SI) and `sweep.csv` (units in its head) into a folder; returns the paths by kind.

        Raises
        ------
        WriteError
            If a file cannot be written.
        """
        folder = make_folder(folder)
        write_netcdf(folder / NETCDF, self.data)
        write_csv(folder / TABLE, *self.table())
        return {"sweep": str(folder / NETCDF), "table": str(folder / TABLE)}


def heading(data: xr.Dataset, axis: str) -> str:
    """Path and unit of an axis."""
    attrs = data[axis].attrs
    unit = attrs.get("units", "1")
    return str(attrs.get("long_name", axis)) + ("" if unit == "1" else f" [{unit}]")


def text_of(axis: xr.DataArray, value: float) -> str:
    """A value of an axis with its unit."""
    unit = axis.attrs.get("units", "1")
    return f"{value:.6g}" if unit == "1" else f"{value:.6g} {unit}"


def _best(values: xr.DataArray, quantity: SweepQuantity) -> dict[str, Any]:
    sign = 1.0 if quantity.best == "highest" else -1.0
    place = np.unravel_index(first_of_highest(sign * values.values.ravel()), values.shape)
    at = {}
    for dim, k in zip(map(str, values.dims), place, strict=True):
        at[str(values[dim].attrs.get("long_name", dim))] = text_of(values[dim], float(values[dim].values[k]))
    number = float(values.values[place]) * quantity.factor
    return {"value": number, "unit": quantity.shown, "best": quantity.best, "at": at}


def result_of(sweep: SweepDefinition, rows: Iterable[tuple[str, tuple[int, ...], dict[str, Any]]]) -> SweepResult:
    """Result of rows (analysis, place among its axes, quantities); cells without a row are not computed."""
    import xarray as xr

    found: dict[str, dict[tuple[int, ...], dict[str, Any]]] = {}
    for kind, place, row in rows:
        found.setdefault(kind, {})[place] = row
    variables: dict[str, Any] = {}
    for quantity in sweep.quantities:
        axes = sweep.axes_of(quantity.kind)
        shape, dims = tuple(len(a.values) for a in axes), tuple(a.name for a in axes)
        values, reasons = np.full(shape, np.nan), np.full(shape, PENDING, object)
        for place, row in found.get(quantity.kind.name, {}).items():
            number = row.get(quantity.name)
            values[place] = np.nan if number is None else number
            reasons[place] = "" if number is not None else str(row.get(REASON, "no result"))
        label = {"units": quantity.unit, "long_name": quantity.meaning}
        variables[quantity.name] = (dims, values, label)
        variables[f"{quantity.name}_reason"] = (dims, reasons.astype(str), {"long_name": f"why {quantity.name} is NaN"})
    coords = {f.name: (f.name, list(f.numbers), labelled(f)) for f in sweep.fields}
    attrs = {"kind": "sweep", "machine": sweep.machine.text, "machine_hash": sweep.machine.hash, "speed": sweep.speed,
             "pressure": sweep.pressure, "highest_speed": sweep.highest}  # fmt: skip
    return SweepResult(xr.Dataset(variables, coords, attrs))


def sweep(
    machine: Plant | Machine | str,
    over: Over,
    what: str | tuple[str, ...] | list[str] = WHAT,
    speed: float | str = 0.0,
    pressure: float | str = 0.5e6,
    highest_speed: float | str | None = None,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> SweepResult:
    """Quantities of a machine over values of its file, over speed and supply pressure.

    Parameters
    ----------
    machine : Plant, Machine or str
        The machine, its name or its file.
    over : mapping or sequence of str
        Axes: values by path of the machine file, or of `speed` and `pressure`, as 'FROM:TO:COUNT', as values with
        commas, or in percent of the machine's own value; or texts 'PATH=VALUES'. A star stands for every entry of a
        list: 'bearings.*.clearance'.
    what : str or sequence of str
        Quantities: lift_off [Pa], onset [rad/s], load [N], flow [kg/s], damping, frequency [rad/s], peak [m].
    speed, pressure : float or str
        Operating point [rad/s], [Pa, gauge] where these are not axes.
    highest_speed : float or str, optional
        Speed [rad/s] up to which onset and peak are searched; by default 40000 rpm, or four times the rotor's first
        natural frequency where that is more.
    workers : int
        Processes.
    progress : callable, optional
        Called with the cells done and in all.

    Returns
    -------
    SweepResult
        Over the axes; NaN where a cell has no result, with the reason. After Ctrl-C it holds what was done.

    Raises
    ------
    DataError, MachineFileError
        For an unknown path or quantity, values without a unit, beyond a limit or not ascending, or too many cells.

    Examples
    --------
    >>> import rotorsim as rs
    >>> over = {"bearings.1.clearance": "24 um, 26 um"}
    >>> found = rs.analysis.sweep("dtu_gas_bearing", over, "flow", pressure="0.5 MPa")
    >>> found.best["flow"]["at"]
    {'bearings.1.clearance': '24 um'}
    """
    defined = make_sweep(machine, over, what, speed, pressure, highest_speed)
    if workers < 1:
        raise DataError(f"workers = {workers}: give the number of processes, 1 or more")
    cells = list(defined.cells())
    cases = ((kind, *defined.case(kind, place)) for kind, place in cells)
    jobs = [(defined.machine.text, tuple(values), kind.name, vars(case)) for kind, case, values in cases]
    rows: list[tuple[str, tuple[int, ...], dict[str, Any]]] = []
    try:
        for number, row in spread(_cell, jobs, workers):
            rows.append((cells[number][0].name, cells[number][1], row))
            if progress:
                progress(len(rows), len(cells))
    except KeyboardInterrupt:
        if not rows:
            raise
        finishing()
    return result_of(defined, rows)


def _cell(text: str, values: tuple[tuple[str, Any], ...], kind: str, parameters: dict[str, float]) -> dict[str, Any]:
    """Result of a cell, in this process or another."""
    try:
        plant = _plant(text, values)
    except MachineFileError as error:
        return {REASON: error.problems[0]}
    return ANALYSES[kind](**parameters).run(plant)


@lru_cache(maxsize=4)
def _plant(text: str, values: tuple[tuple[str, Any], ...]) -> Plant:
    machine = Machine.from_text(text)
    for path, value in values:
        machine = machine.replace(path, value)
    return Plant(machine)
