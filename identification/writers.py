"""Writers of records and run-up vectors; a file is replaced only once it is complete.

What is written here `identification.read` reads back as the same Dataset. Formats without dimensions and attributes
take flat columns, named like those that `identification.records.proposal` recognises, with a header in JSON. They
have no place for what is not over time (snapshots of the film), which the notes of the written record name, and several
bearings are columns alone. Other programs take tables: pandas, and the layout of a MATLAB timetable.
"""

from __future__ import annotations

import json
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.readers.mat import HEADER, MAX_WIDTH
from identification.records.columns import MARK
from identification.records.sampling import sampling_time
from identification.records.schema import PROBE_COORDINATES, VECTORS, known_variable, named_axes, validate, with_notes
from rotorsim.base.errors import SchemaError
from rotorsim.base.files import replacing
from rotorsim.base.foreign_systems import cells, write_mat
from rotorsim.base.hdf5 import write_netcdf

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_IMPLIED = ("units", "long_name")
"""Attributes that the schema gives by itself."""
ROWS = 10_000
"""Rows of a CSV file that become text at a time."""


def save(record: xr.Dataset, path: str | Path) -> Path:
    """Write a record or run-up vectors as .csv, .mat (v5) or .nc (netCDF-4), by the suffix.

    What is not over time is left out of .csv and .mat, see `held`.

    Raises
    ------
    SchemaError
        If the record does not fit the schema, the suffix is another, or the format cannot hold part of it.
    WriteError
        If the file cannot be written; what was there stays.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.save(record, "copy.mat").name
    'copy.mat'
    """
    path = Path(path)
    writers = {".csv": _write_csv, ".mat": _write_mat, ".nc": _write_netcdf}
    if path.suffix.lower() not in writers:
        raise SchemaError(f"{path}: unknown suffix {path.suffix.lower()!r}; write .csv, .mat or .nc")
    writers[path.suffix.lower()](held(named_axes(validate(record)), path), path)
    return path


def held(record: xr.Dataset, path: str | Path) -> xr.Dataset:
    """The part of a record that a file of this suffix holds; a note names what is left out of .csv and .mat.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.held(record, "run.csv").identical(record)
    True
    """
    return record if Path(path).suffix.lower() == ".nc" else _over_time(record, Path(path).name)


def _over_time(record: xr.Dataset, name: str) -> xr.Dataset:
    """The record without what is not over time, such as snapshots of the film, which its notes name.

    The note stays with the record in whatever file it is written later, so it names the file that lacks them.
    """
    left = [str(one) for one in record.data_vars if "time" not in record[one].dims]
    if "speed" in record.dims or not left:
        return record
    kept = record.drop_vars(left)
    dims = {dim for one in kept.data_vars for dim in kept[one].dims} | {"time", "axis"}  # every record has axes
    kept = kept.drop_vars([one for one in kept.coords if not set(kept[one].dims) <= dims])
    lost = [one for one in left if record[one].size]
    return with_notes(kept, [f"not over time and so left out of {name}: {', '.join(lost)}"] if lost else [])


def _flat_columns(record: xr.Dataset) -> dict[str, tuple[str, np.ndarray]]:
    """Unit and values (n,) by the names that `identification.records.proposal` knows."""
    return _vector_columns(record) if "speed" in record.dims else _series_columns(record)


def _header(record: xr.Dataset) -> str:
    """Attributes and number of samples as one line of ASCII; raises SchemaError for what is neither text nor number."""
    extra = {
        str(name): {key: value for key, value in variable.attrs.items() if key not in _IMPLIED}
        for name, variable in record.variables.items()
    }
    samples = record.sizes["speed" if "speed" in record.dims else "time"]
    content = {"attrs": record.attrs, "variables": {n: a for n, a in extra.items() if a}, "samples": samples}
    if "probe_measured" in record:
        content["probes"] = {
            name: record[name].values.tolist() for name in ("probe", *PROBE_COORDINATES) if name in record
        }
    try:
        return json.dumps(content, default=_plain)
    except (TypeError, ValueError) as error:
        raise SchemaError(
            f"record: an attribute is neither text nor number ({error}); drop it or convert it"
        ) from error


def _series_columns(record: xr.Dataset) -> dict[str, tuple[str, np.ndarray]]:
    columns = {"time": ("s", np.asarray(record["time"].values, float))}
    for name in map(str, record.data_vars):
        known = known_variable(name)
        values = np.asarray(record[name].values, float)
        if not known.dims:
            columns[name] = (known.units, values)
            continue
        if len(known.dims) > 1:  # (bearing, axis)
            pairs = product(*(record[dim].values for dim in known.dims))
            flat = zip(pairs, values.reshape(len(values), -1).T, strict=True)
            columns |= {f"{name}_{outer}_{inner}": (known.units, column) for (outer, inner), column in flat}
            continue
        labels = record[known.dims[0]].values
        units = record["probe_unit"].values.tolist() if known.dims == ("probe",) else [known.units] * len(labels)
        for i, label in enumerate(labels):
            columns[f"{name}_{label}"] = (units[i], values[:, i])
    return columns


def _vector_columns(vectors: xr.Dataset) -> dict[str, tuple[str, np.ndarray]]:
    columns = {"speed": ("rad/s", np.asarray(vectors["speed"].values, float))}
    for name in map(str, vectors.data_vars):
        if name not in VECTORS:
            raise SchemaError(f"vectors.{name}: not a variable of the schema; drop it or save as .nc")
        for order in vectors["order"].values:
            for axis in vectors["axis"].values:
                values = vectors[name].sel(order=order, axis=axis).values
                columns[f"{name}_{order}X_{axis}"] = (VECTORS[name].units, np.asarray(values, float))
    return columns


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays as Python's."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(type(value).__name__)


def _write_csv(record: xr.Dataset, path: Path) -> None:
    """Write a record or run-up vectors as comma-separated text."""
    columns = _flat_columns(record)
    lines = [f"# {MARK}, version 1", f"# {_header(record)}"]
    lines.append(",".join(f"{name} [{unit}]" for name, (unit, _) in columns.items()))
    values = [column for _, column in columns.values()]
    with replacing(path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
        file.write("\n".join(lines) + "\n")
        for start in range(0, len(values[0]), ROWS):
            block = np.column_stack([column[start : start + ROWS] for column in values]).tolist()
            file.writelines(",".join(map(repr, row)) + "\n" for row in block)


def _write_mat(record: xr.Dataset, path: Path) -> None:
    """Write a record or run-up vectors as a .mat file."""
    from scipy.io import savemat

    columns = _flat_columns(record)
    content: dict[str, Any] = {name: column[:, None] for name, (_, column) in columns.items()}
    units = {name: unit for name, (unit, _) in columns.items()}
    for name in map(str, record.data_vars):
        if name not in VECTORS and record[name].ndim == 2 and _is_plain(record, name):
            parts = [content.pop(f"{name}_{label}") for label in record[record[name].dims[1]].values]
            for label in record[record[name].dims[1]].values:
                units[name] = units.pop(f"{name}_{label}")
            content[name] = np.hstack(parts)
    with replacing(path) as part, part.open("wb") as file:
        savemat(file, {**content, "units": units, HEADER: _header(record)}, long_field_names=True, do_compression=True)


def _is_plain(record: xr.Dataset, name: str) -> bool:
    """Whether the columns' labels are those that the reader gives them back, and the shape is one it takes."""
    labels = record[record[name].dims[1]].values.tolist()
    return 1 < len(labels) <= min(record.sizes["time"], MAX_WIDTH) and labels in (
        ["x", "y"],
        list(range(1, len(labels) + 1)),
    )


def _write_netcdf(record: xr.Dataset, path: Path) -> None:
    try:
        write_netcdf(path, record)
    except (TypeError, ValueError) as error:
        raise SchemaError(f"record: netCDF cannot hold part of it ({error}); drop or convert that") from error


ONE_LINE = (
    "s = load('run.mat'); t = array2timetable(s.Data, 'RowTimes', seconds(s.Time), 'VariableNames', s.VariableNames); "
    "t.Properties.VariableUnits = s.VariableUnits;"
)
"""Commands by which MATLAB makes a timetable of the file."""


def to_pandas(record: xr.Dataset) -> pd.DataFrame:
    """A record as a DataFrame: a row a sample, columns disc_x, disc_y, ..., time [s] as index.

    Parameters
    ----------
    record : Dataset
        Of the schema; run-up vectors have a row a speed.

    Returns
    -------
    DataFrame
        SI values; `attrs["units"]` has the unit of each column.

    Raises
    ------
    SchemaError
        If the record does not fit the schema.

    Examples
    --------
    >>> import rotorsim as rs
    >>> record = rs.experiments.steady("plain_rotor", speed=100.0, duration=0.01)
    >>> table = rs.identification.to_pandas(record)
    >>> table.attrs["units"]["disc_x"]
    'm'
    """
    import pandas as pd

    columns = _table(record)
    first = next(iter(columns))
    table = pd.DataFrame({name: values for name, (_, values) in columns.items()}).set_index(first)
    table.attrs["units"] = {name: unit for name, (unit, _) in columns.items()}
    return table


def save_timetable(record: xr.Dataset, path: str | Path) -> Path:
    """Write a record as .mat laid out as a timetable: Time [s], Data, VariableNames, VariableUnits, SampleRate [Hz].

    A timetable itself is an object that only MATLAB writes; `HowTo` in the file is the line that makes one.

    Raises
    ------
    SchemaError
        If the record does not fit the schema.
    WriteError
        If the file cannot be written.

    Examples
    --------
    >>> import rotorsim as rs
    >>> record = rs.experiments.steady("plain_rotor", speed=100.0, duration=0.01)
    >>> rs.identification.save_timetable(record, "run.mat").name
    'run.mat'
    """
    columns = _table(record)
    (first, (_, axis)), *rest = columns.items()
    content: dict[str, Any] = {
        "Time" if first == "time" else "Speed": axis[:, None],
        "Data": np.column_stack([values for _, (_, values) in rest]),
        "VariableNames": cells([name for name, _ in rest]),
        "VariableUnits": cells([unit for _, (unit, _) in rest]),
        "HowTo": ONE_LINE.replace("run.mat", Path(path).name),
    }
    if first == "time":
        content["SampleRate"] = 1 / sampling_time(record)
    write_mat(path, content)
    return Path(path)


def _table(record: xr.Dataset) -> dict[str, tuple[str, np.ndarray]]:
    return _flat_columns(_over_time(named_axes(validate(record)), "the table"))
