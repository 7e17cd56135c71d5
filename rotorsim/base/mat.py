"""MATLAB files (v5) of state-space systems: A, B, C, D and Ts as `ss(A, B, C, D, Ts)` takes them, names as cells."""

from __future__ import annotations

import struct
import warnings
import zlib
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.base.display import listing, quote
from rotorsim.base.errors import DataError, NotCarried
from rotorsim.base.files import replacing
from rotorsim.base.units import TABLE

SYSTEM = ("A", "B", "C", "D")
DELAYS = ("InputDelay", "OutputDelay", "IODelay", "ioDelay", "InternalDelay")
"""Delays of a system of MATLAB, which no matrix here has."""
SAVE = "[A, B, C, D, Ts] = ssdata(sys); save('system.mat', 'A', 'B', 'C', 'D', 'Ts', '-v7')"
"""MATLAB commands that save a system so that it can be read here."""


LARGEST = 100_000_000
"""Largest size [byte] of a file, packed or unpacked: a system of 1000 states takes 8 MB."""
HEADER = 128
"""Size [byte] of the head of a v5 file, before its first variable."""
COMPRESSED = 15
"""Type number of a packed variable in a v5 file."""
CHUNK = 1_000_000
"""Size [byte] of a piece that is unpacked at once."""


def is_mat(path: str | Path) -> bool:
    """Whether a name ends as MATLAB files do."""
    return Path(path).suffix.lower() == ".mat"


def cells(texts: Sequence[str]) -> np.ndarray:
    """Texts as a row of cells."""
    found = np.empty((1, len(texts)), object)
    found[0] = list(texts)
    return found


def write_mat(path: str | Path, content: Mapping[str, Any]) -> None:
    """Write variables as a .mat file (v5), complete or not at all; raises WriteError."""
    from scipy.io import savemat

    with replacing(path) as part, part.open("wb") as file:
        savemat(file, dict(content), long_field_names=True, oned_as="row")


def read_mat(path: str | Path) -> dict[str, Any]:
    """Variables of a .mat file with a state-space system; texts are str, cells of texts lists, the rest arrays.

    Raises
    ------
    DataError
        With a sentence that does not begin with the file's name, if it cannot be read or lacks A, B, C, D or Ts.
    """
    from scipy.io import loadmat

    large = Path(path).stat().st_size > LARGEST
    data = b"" if large else Path(path).read_bytes()
    if large or _unpacked(data) > LARGEST:
        raise DataError(f"unpacks to more than {LARGEST / 1e6:g} MB; save the system alone: {SAVE}")
    try:
        raw = loadmat(BytesIO(data), mat_dtype=True)
    except NotImplementedError as error:
        raise DataError("is a MATLAB file of version 7.3; save it with the option '-v7'") from error
    except Exception as error:  # damage ends in anything from IndexError to zlib.error
        raise DataError(f"cannot be read as a MATLAB file ({str(error)[:200]}); save it in MATLAB by {SAVE}") from error
    found = {name: _plain(value) for name, value in raw.items() if not name.startswith("__")}
    wrong = [n for n in SYSTEM if not isinstance(found.get(n), np.ndarray) or found[n].dtype.kind not in "fiu"]
    if wrong:
        raise DataError(f"holds no matrix {', '.join(wrong)}; save it in MATLAB by {SAVE}")
    if "Ts" not in found:
        raise DataError(f"holds no Ts; save Ts too (0 for continuous): {SAVE}")
    return found


def _unpacked(data: bytes) -> int:
    """Bytes of the packed variables of a v5 file, counted no further than beyond `LARGEST`."""
    order, total, place = ("<" if data[126:128] == b"IM" else ">"), 0, HEADER
    while place + 8 <= len(data) and total <= LARGEST:
        kind, size = struct.unpack_from(f"{order}II", data, place)
        packed = data[place + 8 : place + 8 + size]
        place += 8 + size
        if kind != COMPRESSED:
            continue
        stream = zlib.decompressobj()
        with suppress(zlib.error):  # which loadmat will meet again
            while packed and total <= LARGEST:
                total += len(stream.decompress(packed, CHUNK))
                packed = stream.unconsumed_tail
    return total


def number(content: Mapping[str, Any], name: str, default: float) -> float:
    """A scalar of a file; the default where it is missing; raises DataError for anything else."""
    value = content.get(name)
    if value is None:
        return default
    if not isinstance(value, np.ndarray) or value.size != 1 or value.dtype.kind not in "fiub":
        raise DataError(f"{name} is not a number; give one")
    return float(value.flat[0])


def check_rest(content: Mapping[str, Any], read: Collection[str]) -> None:
    """Name what a file states of its system besides what is `read`.

    Raises
    ------
    DataError
        For what changes the motion: delays, a descriptor matrix E, another unit of time than seconds.

    Warns
    -----
    NotCarried
        For everything else.
    """
    for name in DELAYS:
        if np.any(content.get(name, 0.0)):
            raise DataError(f"{name} is not 0, which has no counterpart; put it into the states: absorbDelay or pade")
    E = content.get("E")
    if isinstance(E, np.ndarray) and E.size and not (E.ndim == 2 and np.array_equal(E, np.eye(len(E)))):
        raise DataError("E is not the unit matrix; save the explicit system: sys = ss(sys, 'explicit')")
    if (unit := content.get("TimeUnit", "")) not in ("", "s", "seconds"):
        raise DataError(f"TimeUnit is {quote(unit)}; save it in seconds: sys = chgTimeUnit(sys, 'seconds')")
    name_rest(set(content) - {*read, *DELAYS, *SYSTEM, "E", "TimeUnit", "Ts", "kind"})


def name_rest(names: Collection[str]) -> None:
    """Warn, as `NotCarried`, of entries of a file of a system that no reader takes."""
    if names:
        text = f"{listing(sorted(names))} of the file not carried over; there is no counterpart"
        warnings.warn(text, NotCarried, stacklevel=3)


def in_si(
    content: Mapping[str, Any], B: np.ndarray, C: np.ndarray, D: np.ndarray, inputs: str, outputs: str
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """B, C, D between SI units, from those that InputUnit and OutputUnit state; without these they are SI already.

    Raises
    ------
    DataError
        For a unit of another quantity.
    """
    into = [_factor(unit, inputs) for unit in _units(content, "InputUnit", D.shape[1])]
    out = [_factor(unit, outputs) for unit in _units(content, "OutputUnit", D.shape[0])]
    if set(into) | set(out) <= {1.0}:
        return B, C, D
    more = (1,) * (D.ndim - 2)  # operating points
    columns, rows = np.reshape(into, (1, -1, *more)), np.reshape(out, (-1, 1, *more))
    return B / columns, C * rows, D * rows / columns


def _units(content: Mapping[str, Any], name: str, count: int) -> list[str]:
    value = content.get(name)
    found = [value] * count if isinstance(value, str) else value
    return found if isinstance(found, list) and len(found) == count else [""] * count


def _factor(unit: str, si: str) -> float:
    known = TABLE[si].factors | TABLE[si].recorded
    if unit and unit not in known:
        raise DataError(f"unit {quote(unit)} is not one of {TABLE[si].name}; give the system's signals in V and m")
    return float(known[unit]) if unit else 1.0


def texts(content: Mapping[str, Any], name: str, default: Sequence[str]) -> tuple[str, ...]:
    """Cells of texts, or the default where they are missing or empty."""
    value = content.get(name)
    found = [value] if isinstance(value, str) else value
    return tuple(found) if isinstance(found, list) and all(found) and len(found) == len(default) else tuple(default)


def _plain(value: Any) -> Any:
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype.kind == "U":
        return str(value.flat[0]) if value.size else ""
    if value.dtype.kind == "O":
        parts = [_plain(one) for one in value.ravel()]
        return parts if all(isinstance(one, str) for one in parts) else value
    return value
