"""Parser of MATLAB v5 files for numeric arrays and text.

The file is 128 bytes of header and then elements, each a type, a size and, deflated or not, a matrix: flags (its
class), dimensions, name, values. An opaque object has no dimensions. Own code, because scipy cannot list a file with
such objects and crashes on some damaged ones; anything but arrays of numbers and text is skipped.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import BinaryIO, Literal

import numpy as np

from identification.errors import ReadError
from rotorsim.base.sentences import quote

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
class Variable:
    """One variable: MATLAB's class, whether it is complex, and where its element lies in the file."""

    name: str
    shape: tuple[int, ...]
    kind: str
    is_complex: bool
    at: int
    length: int


def is_v5(path: Path) -> bool:
    """Whether a file begins like one of versions 5 to 7."""
    with path.open("rb") as file:
        return file.read(_HEADER)[126:] in (b"IM", b"MI")


def variables(path: Path) -> list[Variable]:
    """All variables of a v5 file; raises ReadError or another exception where it is damaged."""
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


def values(path: Path, variable: Variable) -> np.ndarray:
    """Numbers of a variable, as doubles in its shape."""
    kind, content, order = _content(path, variable)
    dtype = np.dtype(_TYPES[kind]).newbyteorder("<" if order == "little" else ">")
    array = np.frombuffer(content, dtype)
    if array.size != prod(variable.shape):
        raise ReadError(f"{quote(variable.name)} holds {array.size} values for shape {variable.shape}; save it again")
    return array.astype(float).reshape(variable.shape, order="F")


def text(path: Path, variable: Variable) -> str:
    """Characters of a text in one row."""
    kind, content, order = _content(path, variable)
    encoding = _TEXTS[kind]
    return content.decode(f"{encoding}-{order[0]}e" if encoding == "utf-16" else encoding)


def _content(path: Path, variable: Variable) -> tuple[int, bytes, Order]:
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


def _head(data: bytes, order: Order, at: int, length: int) -> tuple[Variable, int]:
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
    return Variable(name.decode("latin-1"), shape, kind, bool(mark & 0x08), at, length), here


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
