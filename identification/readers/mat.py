"""MATLAB files of versions 5 to 7: numeric vectors and matrices with one row per sample.

A matrix gives a column per column, `name_1`, `name_2` ...; one named like a variable of the schema over x and y gives
`name_x`, `name_y`.
"""

from __future__ import annotations

from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from identification.errors import ReadError
from identification.readers.mat_v5 import Variable, is_v5, text, values, variables
from identification.records.schema import AXES, VARIABLES
from identification.records.table import MAX_VALUES, Column, Table, parse_header
from rotorsim.base.sentences import quote

HEADER = "rotorsim_record"
"""Text variable with the header of a file that rotorsim wrote."""
MAX_WIDTH, MAX_NAMES = 64, 1000
NUMERIC = ("double", "single", "logical", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)))
INFLATION = 1100
"""No byte of a compressed file stands for more bytes than this."""
_WAYS_OUT = {
    "struct": "is a struct; save its fields with save('out.mat', '-struct', 'name')",
    "cell": "is a cell array; save plain vectors of numbers",
    "char": "is text; save plain vectors of numbers",
    "complex": "holds complex values; save real and imaginary part apart",
    "sparse": "is a sparse matrix; save full(name)",
    "function": "is a function handle, which is never evaluated; save plain vectors of numbers",
    "object": "is a MATLAB object, which is never opened; save plain vectors of numbers",
    "opaque": "is a MATLAB object (table, timetable, string ...), which is never opened; save plain vectors of numbers",
}


def read_mat(path: Path) -> Table:
    """Table of a v5 file; raises ReadError if it is damaged or holds no numbers."""
    if not is_v5(path):
        raise ReadError("does not begin like a .mat file of version 5 to 7.3; save it with save(..., '-v7')")
    try:
        return _table(path, variables(path))
    except ReadError:
        raise
    except Exception as error:  # damage ends in anything from IndexError to zlib.error
        raise ReadError("is a damaged or cut off .mat file; save it again") from error


def _table(path: Path, found: list[Variable]) -> Table:
    _check_names([variable.name for variable in found])
    others = {v.name: reason for v in found if (reason := refusal(v.shape, "complex" if v.is_complex else v.kind))}
    numbers = [variable for variable in found if variable.name not in others]
    _check_sizes(path, numbers)
    header = next((text(path, v) for v in found if v.name == HEADER and v.kind == "char"), None)
    return build("MATLAB v5", {v.name: values(path, v) for v in numbers}, others, header)


def refusal(shape: tuple[int, ...], kind: str) -> str:
    """Reason why a variable is not a column; empty if it is one."""
    if kind not in NUMERIC:
        return _WAYS_OUT.get(kind, f"is of the kind {quote(kind)}; save plain vectors of numbers")
    if len(shape) > 2 or 0 in shape:
        return f"has shape {shape}; save a column vector, one row per sample"
    if 1 not in shape and shape[1] > min(shape[0], MAX_WIDTH):
        return f"has shape {shape}; transpose it to one row per sample and at most {MAX_WIDTH} columns"
    return ""


def build(kind: str, arrays: dict[str, Any], others: dict[str, str], header: str | None) -> Table:
    """Table from arrays of a MATLAB file; raises ReadError if there is none or if samples are missing."""
    columns = [column for name, array in arrays.items() for column in _columns(name, np.asarray(array), others)]
    if not columns:
        why = "; ".join(f"{quote(name)} {reason}" for name, reason in list(others.items())[:1])
        raise ReadError(f"holds no vector of numbers{': ' + why if why else '; save some'}")
    parsed = parse_header(header) if header is not None else None
    if parsed:
        others = {name: reason for name, reason in others.items() if name not in (HEADER, "units")}
    if parsed and parsed.samples != max(column.values.size for column in columns):
        raise ReadError("holds another number of samples than its header states; take the original file")
    return Table(kind, tuple(columns), others, header=parsed)


def _columns(name: str, array: np.ndarray, others: dict[str, str]) -> list[Column]:
    if array.dtype.kind not in "fiub":
        others[name] = "holds no real numbers; save real and imaginary part apart"
        return []
    array = array.astype(float)
    if array.ndim < 2 or 1 in array.shape:
        return [Column(name, array.ravel())]
    labels = [str(i + 1) for i in range(array.shape[1])]
    if name in VARIABLES and VARIABLES[name].dims == ("axis",) and array.shape[1] == len(AXES):
        labels = list(AXES)
    return [Column(f"{name}_{label}", column) for label, column in zip(labels, array.T, strict=True)]


def _check_sizes(path: Path, found: list[Variable]) -> None:
    """Raise ReadError if the file declares more than it can hold."""
    total = sum(prod(variable.shape) for variable in found)
    if total > min(MAX_VALUES, INFLATION * path.stat().st_size):
        raise ReadError(f"declares {total} values, more than it can hold or this program reads; save it again")


def _check_names(names: list[str]) -> None:
    twice = [name for name in names if names.count(name) > 1] if len(names) <= MAX_NAMES else names[:1]
    if twice:
        raise ReadError(f"holds {quote(twice[0])} twice, or more than {MAX_NAMES} variables; save it again")
