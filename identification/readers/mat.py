"""MATLAB files of versions 5 to 7.3: numeric vectors and matrices with one row per sample.

A matrix gives a column per column, `name_1`, `name_2` ...; one named like a variable of the schema over x and y gives
`name_x`, `name_y`.

Versions 5 to 7 are parsed for numeric arrays and text. The file is 128 bytes of header and then elements, each a type,
a size and, deflated or not, a matrix: flags (its class), dimensions, name, values. An opaque object has no dimensions.
Own code, because scipy cannot list a file with such objects and crashes on some damaged ones; anything but arrays of
numbers and text is skipped. Version 7.3 is HDF5 with MATLAB's class attributes and transposed matrices.
"""

import zlib
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np

from identification.readers import reader
from identification.readers.hdf5 import HDF5, opened
from identification.records.columns import MAX_VALUES, Column, DataTable, parse_header
from identification.records.schema import AXES, VARIABLES
from rotorsim.base.display import quote
from rotorsim.base.errors import ReadError

Order = Literal["little", "big"]
CLASSES = (
    *("", "cell", "struct", "object", "char", "sparse", "double", "single", "int8", "uint8", "int16", "uint16"),
    *("int32", "uint32", "int64", "uint64", "function", "opaque"),
)
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {1: "latin-1", 2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16"}
MAX_DIMS = 16
_HEADER, _MATRIX, _DEFLATED, _START = 128, 14, 15, 4096


@dataclass(frozen=True)
class MatlabVariable:
    """One variable: MATLAB's class, whether it is complex, and where its element lies in the file."""

    name: str
    shape: tuple[int, ...]
    kind: str
    is_complex: bool
    at: int
    length: int


def variables(path: Path) -> list[MatlabVariable]:
    """Variables of a v5 file; raises ReadError or another exception where it is damaged."""
    size, at, found = path.stat().st_size, _HEADER, []
    with path.open("rb") as file:
        order = _order(file)
        while at < size:
            start, length = _element(file, at, order, _START)
            if at + 8 + length > size:
                raise ReadError("is a damaged or cut off .mat file; its last variable is incomplete: save it again")
            variable, _ = _head(start, order, at, length)
            if variable.name:  # MATLAB keeps its functions' workspace in a matrix without a name
                found.append(variable)
            at += 8 + length
    return found


def values(path: Path, variable: MatlabVariable) -> np.ndarray:
    """Numbers of a variable, as doubles in its shape."""
    kind, content, order = _content(path, variable)
    dtype = np.dtype(_TYPES[kind]).newbyteorder("<" if order == "little" else ">")
    array = np.frombuffer(content, dtype)
    if array.size != prod(variable.shape):
        raise ReadError(f"{quote(variable.name)} holds {array.size} values for shape {variable.shape}; save it again")
    return array.astype(float).reshape(variable.shape, order="F")


def text(path: Path, variable: MatlabVariable) -> str:
    """Characters of a text in one row."""
    kind, content, order = _content(path, variable)
    encoding = _TEXTS[kind]
    return content.decode(f"{encoding}-{order[0]}e" if encoding == "utf-16" else encoding)


def _content(path: Path, variable: MatlabVariable) -> tuple[int, bytes, Order]:
    """Type and bytes of a variable's values."""
    with path.open("rb") as file:
        order = _order(file)
        # no more is inflated than the shape can need
        data, length = _element(file, variable.at, order, _START + 8 * prod(variable.shape))
    _, at = _head(data, order, variable.at, length)
    kind, content, _ = _part(data, at, order)
    return kind, content, order


def _order(file: BinaryIO) -> Order:
    file.seek(126)
    return "little" if file.read(2) == b"IM" else "big"


def _element(file: BinaryIO, at: int, order: Order, most: int) -> tuple[bytes, int]:
    """The first `most` bytes of an element's matrix, inflated, and the element's length in the file."""
    file.seek(at)
    tag = file.read(8)
    kind, length = _whole(tag[:4], order), _whole(tag[4:], order)
    content = file.read(min(length, most))
    if kind == _DEFLATED:
        return zlib.decompressobj().decompress(content, most), length
    if kind != _MATRIX:
        raise ReadError("is a damaged .mat file, it holds no matrix where one should begin; save it again")
    return tag + content, length


def _head(data: bytes, order: Order, at: int, length: int) -> tuple[MatlabVariable, int]:
    """The variable that a matrix is, and where its values begin."""
    _, flags, here = _part(data, 8, order)
    code, mark = (flags[0], flags[1]) if order == "little" else (flags[3], flags[2])
    kind = CLASSES[code]
    shape: tuple[int, ...] = (1, 1)
    if kind != "opaque":
        _, sizes, here = _part(data, here, order)
        shape = tuple(_whole(sizes[i : i + 4], order) for i in range(0, len(sizes), 4))
        if not 2 <= len(shape) <= MAX_DIMS:
            raise ReadError(f"is a damaged .mat file, one of its matrices has {len(shape)} dimensions; save it again")
    _, name, here = _part(data, here, order)
    return MatlabVariable(name.decode("latin-1"), shape, kind, bool(mark & 0x08), at, length), here


def _part(data: bytes, at: int, order: Order) -> tuple[int, bytes, int]:
    """Type and content of a part of a matrix and where the next begins; up to four bytes may stand in the tag."""
    tag = _whole(data[at : at + 4], order)
    if tag >> 16:
        return tag & 0xFFFF, data[at + 4 : at + 4 + (tag >> 16)], at + 8
    length = _whole(data[at + 4 : at + 8], order)
    if at + 8 + length > len(data):
        raise ReadError("is a damaged or cut off .mat file; save it again")
    return tag, data[at + 8 : at + 8 + length], at + 8 + -(-length // 8) * 8


def _whole(data: bytes, order: Order) -> int:
    if len(data) != 4:
        raise ReadError("is a damaged or cut off .mat file; save it again")
    return int.from_bytes(data, order)


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


@reader(".mat")
@reader(magic=rb"(?!.{512}\x89HDF).{126}(IM|MI)")
def read_mat(path: Path) -> DataTable:
    """Table of a v5 file; raises ReadError if it is cut off or holds no numbers."""
    with path.open("rb") as file:
        if file.read(_HEADER)[126:] not in (b"IM", b"MI"):
            raise ReadError("does not begin like a .mat file of version 5 to 7.3; save it with save(..., '-v7')")
    found = variables(path)
    names = [variable.name for variable in found]
    twice = [name for name in names if names.count(name) > 1] if len(names) <= MAX_NAMES else names[:1]
    if twice:
        raise ReadError(f"holds {quote(twice[0])} twice, or more than {MAX_NAMES} variables; save it again")
    others = {v.name: reason for v in found if (reason := refusal(v.shape, "complex" if v.is_complex else v.kind))}
    numbers = [variable for variable in found if variable.name not in others]
    total = sum(prod(variable.shape) for variable in numbers)
    if total > min(MAX_VALUES, INFLATION * path.stat().st_size):
        raise ReadError(f"declares {total} values, more than it can hold or this program reads; save it again")
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


def build(kind: str, arrays: dict[str, Any], others: dict[str, str], header: str | None) -> DataTable:
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
    return DataTable(kind, tuple(columns), others, header=parsed)


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


@reader(".mat", magic=HDF5)
@reader(".mat", magic=rb"MATLAB.{506}\x89HDF")
def read_mat73(path: Path) -> DataTable:
    """Table of a v7.3 file; references, cells and objects are not followed."""
    import h5py

    arrays, others, header = {}, {}, None
    with opened(path) as file:
        for name, item in file.items():
            if name.startswith("#"):  # where MATLAB keeps what references lead to
                continue
            kind = _kind(item)
            if name == HEADER and kind == "char":
                header = "".join(map(chr, np.ravel(item[()]).astype(int)))
                continue
            shape = tuple(reversed(item.shape)) if isinstance(item, h5py.Dataset) and item.shape else (0, 0)
            if reason := refusal(shape, kind):
                others[name] = reason
            else:
                arrays[name] = np.asarray(item[()]).T
    return build("MATLAB v7.3", arrays, others, header)


def _kind(item: Any) -> str:
    """MATLAB's class of an object; without it, by its type in HDF5."""
    import h5py

    if "MATLAB_object_decode" in item.attrs:
        return "opaque"
    named = item.attrs.get("MATLAB_class")
    if named is not None:
        text = named.decode("ascii", "replace") if isinstance(named, bytes) else str(named)
        kind = "function" if text == "function_handle" else text
        numeric = isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub"
        return kind if numeric or kind in ("cell", "function", "opaque") else "struct"
    if not isinstance(item, h5py.Dataset):
        return "struct"
    return "double" if item.dtype.kind in "fiub" else "object"
