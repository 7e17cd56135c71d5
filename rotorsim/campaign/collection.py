"""Collection of a campaign's records as one lazy Dataset and of its summaries as a CSV table.

Records are read when their numbers are asked for, some at a time, so a campaign may be larger than memory. Cases are
the first dimension; the axes of the plan are coordinates along it.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.files import replacing
from rotorsim.campaign.errors import StoreError
from rotorsim.campaign.index import DONE, IndexRow
from rotorsim.campaign.plan import Plan
from rotorsim.campaign.record_files import StackedVariable, opened, stacked
from rotorsim.campaign.store import open_store, record_path

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class FinishedCases:
    """Finished cases of one experiment in a store."""

    folder: Path
    plan: Plan
    experiment: str
    rows: tuple[IndexRow, ...]

    @property
    def paths(self) -> tuple[Path, ...]:
        """Records in the order of the rows."""
        return tuple(record_path(self.folder, row.key) for row in self.rows)


def collect(folder: str | Path, experiment: str | None = None, variables: Sequence[str] | None = None) -> xr.Dataset:
    """Records and summaries of all finished cases.

    Parameters
    ----------
    folder : Path
        The store; a campaign may be running in it.
    experiment : str, optional
        Name of the experiment in the plan; may be left out if there is only one.
    variables : sequence of str, optional
        Variables of the records; all that were kept if not given, none for an empty sequence.

    Returns
    -------
    Dataset
        Dimension `case` first, then those of a record, with dask arrays. Shorter records end in NaN. Coordinates along
        `case`: `number`, `key`, `seed`, `repeat` and the plan's axes [SI]. Summaries are variables with dotted names.

    Raises
    ------
    StoreError
        If there is no store, no such experiment, no such variable, or nothing is done yet.

    Examples
    --------
    >>> import rotorsim as rs
    >>> records = rs.campaign.collect("mine", "steady")
    """
    import xarray as xr

    found = _finished(Path(folder), experiment)
    columns = {name: ("case", values) for name, values in _columns(found.rows).items()}
    data = xr.Dataset(columns, _coordinates(found), {"kind": "collected", "campaign": found.plan.name,
                                                           "experiment": found.experiment})  # fmt: skip
    if found.plan.keep == () or (variables is not None and not variables):
        return data
    records = _records(found, variables)
    return data.assign(records.data_vars).assign_coords(records.coords)


def _finished(folder: Path, experiment: str | None) -> FinishedCases:
    store = open_store(folder)
    names = [entry.name for entry in store.plan.entries]
    if experiment is None and len(names) > 1:
        raise StoreError(f"{folder}: has the experiments {', '.join(names)}; choose one with --experiment")
    name = experiment or names[0]
    if name not in names:
        raise StoreError(f"{folder}: has no experiment '{name}'; choose one of {', '.join(names)}")
    index = store.index()
    try:
        rows = tuple(index.rows(DONE, name))
    finally:
        index.close()
    if not rows:
        raise StoreError(f"{folder}: no case of {name} is done yet; run the campaign first")
    return FinishedCases(folder, store.plan, name, rows)


def _coordinates(found: FinishedCases) -> dict[str, Any]:
    rows = found.rows
    coordinates: dict[str, Any] = {
        "number": ("case", np.array([row.number for row in rows])),
        "key": ("case", np.array([row.key for row in rows])),
        "seed": ("case", np.array([row.seed for row in rows])),
        "repeat": ("case", np.array([row.repeat for row in rows])),
    }
    entry = next(entry for entry in found.plan.entries if entry.name == found.experiment)
    for axis in found.plan.axes_of(entry):
        if axis.name != "seed":
            values = np.array([row.parameters[axis.name] for row in rows])
            attrs = {} if axis.target.unit is None else {"units": axis.target.unit}
            coordinates[f"set_{axis.name}"] = ("case", values, attrs)
    return coordinates


def _columns(rows: Iterable[IndexRow]) -> dict[str, Any]:
    """Summaries by name; numbers where all are, with NaN for what is missing."""
    rows = list(rows)
    names = list(dict.fromkeys(name for row in rows for name in row.summary))
    columns = {}
    for name in names:
        values = [row.summary.get(name) for row in rows]
        words = any(isinstance(value, str) for value in values)
        columns[name] = np.array([str(v) for v in values] if words else [np.nan if v is None else v for v in values])
    return columns


def _records(found: FinishedCases, variables: Sequence[str] | None) -> xr.Dataset:
    import xarray as xr

    from rotorsim.signals.record_blocks import open_record

    _check_sizes(found)
    lengths = _lengths(found)
    longest = int(lengths.argmax())
    with open_record(found.paths[longest]) as sample:
        names = [str(name) for name in sample.data_vars] if variables is None else list(variables)
        for name in names:
            if name not in sample.data_vars:
                known = ", ".join(map(str, sample.data_vars))
                raise StoreError(f"{found.folder}: no variable '{name}' in its records; choose of {known}")
        arrays = {
            name: (
                ("case", *sample[name].dims),
                stacked(StackedVariable(found.paths, name, sample[name].shape, sample[name].dtype)),
                dict(sample[name].attrs),
            )
            for name in names
        }
        coordinates = {name: sample[name].load() for name in sample.coords}
    return xr.Dataset(arrays, coordinates).assign_coords(samples=("case", lengths))


def _check_sizes(found: FinishedCases) -> None:
    """Raise StoreError for records that are not as long as they were written."""
    lost = [path for path, row in zip(found.paths, found.rows, strict=True) if _size(path) != row.bytes]
    if lost:
        raise StoreError(
            f"{lost[0]}: is gone or cut, as {len(lost)} of {len(found.rows)} records are; "
            "run the campaign again, which makes them anew"
        )


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return -1


def _lengths(found: FinishedCases) -> np.ndarray:
    """Samples of every record, from the summary or, without one, from the file."""
    samples = [row.summary.get("numbers.samples") for row in found.rows]
    if all(n is not None for n in samples):
        return np.array(samples, int)
    lengths = []
    for path in found.paths:
        with opened(path) as file:
            lengths.append(file["time"].shape[0])
    return np.array(lengths, int)


def write_table(folder: str | Path, path: str | Path) -> int:
    """Write parameters, status and summary of every case into a CSV file; returns the number of cases.

    Examples
    --------
    >>> import rotorsim as rs
    >>> cases = rs.campaign.write_table("mine", "cases.csv")
    """
    store = open_store(folder)
    index = store.index()
    try:
        names = header(store.plan, index.rows())
        with replacing(Path(path)) as part, part.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(names)
            count = 0
            for row in index.rows():
                writer.writerow(line(row, names))
                count += 1
    finally:
        index.close()
    return count


FIRST = ("number", "experiment", "repeat", "seed")
LAST = ("status", "error", "duration", "cpu", "bytes", "host", "versions", "finished", "attempts", "key")


def header(plan: Plan, rows: Iterable[IndexRow]) -> tuple[str, ...]:
    """Column names of the table: axis values, results, status; values in SI."""
    axes = [f"set.{axis.name}" for axis in plan.axes if axis.name != "seed"]
    found = dict.fromkeys(name for row in rows for name in row.summary)
    return (*FIRST, *axes, *found, *LAST)


def line(row: IndexRow, names: Iterable[str]) -> list[Any]:
    """Values of a row; empty where there is none."""
    own = set(FIRST + LAST)
    values = {f"set.{name}": value for name, value in row.parameters.items()} | row.summary
    return [getattr(row, name) if name in own else values.get(name) for name in names]
