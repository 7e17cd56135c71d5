"""Result of a sweep: labelled data, best point of each quantity, cells without a result, tables and files."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.analysis.cases import REASON
from rotorsim.analysis.sweeps.quantities import QUANTITIES, SweepQuantity
from rotorsim.analysis.varied import labelled
from rotorsim.base.files import make_folder, write_text
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.base.rounding import first_of_highest

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.analysis.sweeps.definition import Sweep

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
        """By quantity its best value [shown unit], whether that is the highest or the lowest, and its point.

        A quantity without any number is left out.
        """
        return {q.name: _best(self.data[q.name], q) for q in self.quantities if np.isfinite(self.data[q.name]).any()}

    @property
    def reasons(self) -> dict[str, dict[str, int]]:
        """By quantity the number of cells without a result, by reason."""
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
            rows.append((*values, *(_number(self.data[q.name], at, q) for q in self.quantities)))
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
        text = io.StringIO()
        head, rows = self.table()
        csv.writer(text).writerows([head, *rows])
        write_text(folder / TABLE, text.getvalue())
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


def _number(values: xr.DataArray, at: dict[str, int], quantity: SweepQuantity) -> float | None:
    number = float(values.isel({str(dim): at[str(dim)] for dim in values.dims})) * quantity.factor
    return number if np.isfinite(number) else None


def result_of(sweep: Sweep, rows: Iterable[tuple[str, tuple[int, ...], dict[str, Any]]]) -> SweepResult:
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
    return SweepResult(xr.Dataset(variables, coords, dict(_attrs(sweep))))


def _attrs(sweep: Sweep) -> Iterator[tuple[str, Any]]:
    yield "kind", "sweep"
    yield "machine", sweep.machine.text
    yield "machine_hash", sweep.machine.hash
    yield "speed", sweep.speed
    yield "pressure", sweep.pressure
    yield "highest_speed", sweep.highest


__all__ = ["NETCDF", "TABLE", "SweepResult", "heading", "result_of", "text_of"]
