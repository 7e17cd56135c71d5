"""Record as flat columns with a JSON header, for formats without dimensions and attributes."""

from __future__ import annotations

import json
from collections.abc import Hashable
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import SchemaError
from identification.records.notes import with_notes
from identification.records.schema import PROBE_COORDINATES, known_variable
from identification.records.vectors import VECTORS

if TYPE_CHECKING:
    import xarray as xr

_IMPLIED = ("units", "long_name")


def over_time(record: xr.Dataset) -> xr.Dataset:
    """The record without what is not over time, such as snapshots of the film, which its notes name."""
    left = [str(name) for name in record.data_vars if "time" not in record[name].dims]
    if "speed" in record.dims or not left:
        return record
    kept = record.drop_vars(left)
    kept = kept.drop_vars([name for name in kept.coords if not set(kept[name].dims) <= _dims(kept)])
    return with_notes(kept, [f"left out, not over time (a .nc file keeps it): {', '.join(left)}"])


def _dims(record: xr.Dataset) -> set[Hashable]:
    """Dimensions of the variables, and the axes, which every record has."""
    return {dim for name in record.data_vars for dim in record[name].dims} | {"time", "axis"}


def flat_columns(record: xr.Dataset) -> dict[str, tuple[str, np.ndarray]]:
    """Unit and values (n,) by the names that `identification.records.column_names` knows."""
    return _vector_columns(record) if "speed" in record.dims else _series_columns(record)


def header(record: xr.Dataset) -> str:
    """Attributes and number of samples as one line of ASCII; raises SchemaError for what is neither text nor number."""
    extra = {str(name): _extra(variable.attrs) for name, variable in record.variables.items()}
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


def _extra(attrs: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in attrs.items() if name not in _IMPLIED}


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays as Python's."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(type(value).__name__)
