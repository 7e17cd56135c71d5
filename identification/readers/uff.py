"""Universal file format, dataset 58 (function at nodal degree of freedom), ASCII and binary (58b).

Eleven header records of fixed columns, then values. Record 6: function type (1 is a time response; others are left),
response node and direction; record 7: type of the values (2, 4 real in single, double precision; 5, 6 complex), their
number, even or uneven abscissa, its start and step; records 8 and 9: label and unit of abscissa and ordinate. The
format is that of SDRC, binary as laid down by the University of Cincinnati. No size is believed before it is counted.

Own code, because pyuff 2.5 reads a file that was cut off as one with fewer datasets, and 12 values where the header
states 7: `test_uff.py` has these cases.
"""

from codecs import BOM_UTF8
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from identification.readers import reader
from identification.records.columns import MAX_VALUES, Column, DataTable, factor, is_unit_of
from rotorsim.base.display import quote
from rotorsim.base.errors import ReadError

_END = b"-1"
_DIRECTIONS = {0: "", 1: "+X", 2: "+Y", 3: "+Z", 4: "+RX", 5: "+RY", 6: "+RZ"}
_DIRECTIONS |= {-n: text.replace("+", "-") for n, text in list(_DIRECTIONS.items()) if n}
_FIELDS = {(2, True): (13,) * 6, (4, True): (20,) * 4, (2, False): (13,) * 6, (4, False): (13, 20, 13, 20)}
"""Widths of the fields of a line, by the type of the values and whether the abscissa is even."""


@dataclass(frozen=True)
class Response:
    """A time response: its name in words and as node and direction, unit, time (n,) [s] and values (n,)."""

    title: str
    freedom: str
    unit: str | None
    time: np.ndarray
    values: np.ndarray


@reader(".uff", ".unv", magic=rb"[ \t\r\f\v]*-1[ \t\r\f\v]*(\n|\Z)")
def read_uff(path: Path) -> DataTable:
    """Table of the time responses in a file; raises ReadError if there is none or the file is damaged."""
    data = path.read_bytes().removeprefix(BOM_UTF8)
    responses: list[Response] = []
    others: dict[str, str] = {}
    damaged: dict[str, str] = {}
    system = ""
    for number, (kind, body) in enumerate(_datasets(data), 1):
        if kind[:6].strip() == b"58":
            try:
                found = _response(kind, body)
            except ReadError as error:
                title = _text(_line(body, 0)[0].decode("latin-1"))
                damaged[title or f"dataset {number}"] = f"dataset {number} (58): {error}"
                continue
            if isinstance(found, Response):
                responses.append(found)
            else:
                others[f"dataset {number}"] = found
        elif kind[:6].strip() == b"164":
            # values of another system than SI, 1, have no known unit: its factors leave room for doubt
            code = body[:10].strip().decode("latin-1")
            system = system if code in ("1", "") else code
    if damaged and not responses:
        raise ReadError(next(iter(damaged.values())))
    others |= {name: f"cannot be read: {fault}" for name, fault in damaged.items()}
    if not responses:
        why = next((f": dataset 58 {reason}" for reason in others.values()), "")
        raise ReadError(f"holds no time response in a dataset 58{why}; export time histories")
    if system:
        responses = [replace(r, unit=f"{r.unit or '?'} of unit system {system} (dataset 164)") for r in responses]
    return _table(responses, others)


def _table(responses: list[Response], others: dict[str, str]) -> DataTable:
    shared: list[np.ndarray] = []
    titles = [r.title for r in responses]
    columns = []
    for r in responses:
        titled = r.title and titles.count(r.title) == 1
        time = next((one for one in shared if np.array_equal(one, r.time)), r.time)
        shared += [] if any(one is time for one in shared) else [time]
        columns.append(Column(r.title if titled else r.freedom, r.values, r.unit, (r.freedom, r.title), time))
    return DataTable("UFF 58", tuple(columns), others)


def _datasets(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Identifier record and body of every dataset."""
    at = 0
    while at < len(data):
        line, at = _line(data, at)
        if not line.strip():
            continue
        if line.strip() != _END:
            raise ReadError(f"byte {at}: {quote(line[:20])} where a dataset begins with -1; the file is damaged")
        kind, start = _line(data, at)
        end, at = _binary_end(data, start, kind) if _is_binary(kind) else _text_end(data, start)
        yield kind, data[start:end]


def _is_binary(kind: bytes) -> bool:
    return kind[:6].strip() == b"58" and kind[6:7].lower() == b"b"


def _text_end(data: bytes, at: int) -> tuple[int, int]:
    """End of a body of text, and beginning of the next dataset."""
    while at < len(data):
        end = at
        line, at = _line(data, at)
        if line.strip() == _END:
            return end, at
    raise ReadError("its last dataset does not end with -1; the file was cut off: copy it again")


def _binary_end(data: bytes, at: int, kind: bytes) -> tuple[int, int]:
    """The same for values in binary, whose number of bytes the identifier record states."""
    for _ in range(11):
        _, at = _line(data, at)
    size = _whole(kind[31:43], "number of bytes")
    if size < 0 or at + size > len(data):
        raise ReadError(f"declares {size} bytes but the file has {len(data) - at}; it was cut off: copy it again")
    line, after = _line(data, at + size)
    if not line.strip():
        line, after = _line(data, after)
    if line.strip() != _END:
        raise ReadError("a binary dataset 58 does not end with -1; the file is damaged or was cut off")
    return at + size, after


def _line(data: bytes, at: int) -> tuple[bytes, int]:
    end = data.find(b"\n", at)
    return (data[at:], len(data)) if end < 0 else (data[at:end], end + 1)


def _response(kind: bytes, body: bytes) -> Response | str:
    """The response, or the reason why it is none."""
    records, at = [], 0
    for _ in range(11):
        record, at = _line(body, at)
        records.append(record.rstrip(b"\r").decode("latin-1"))
    function = _whole(records[5][:5], "function type")
    if function not in (0, 1):
        return f"holds functions of type {function} and no time response (type 1)"
    if _whole(records[7][:10] or "0", "abscissa type") not in (0, 17):
        return "has an abscissa other than time"
    form, n, spacing = (_whole(records[6][i : i + 10], "record 7") for i in (0, 10, 20))
    if form not in (2, 4):
        return f"holds values of type {form}; export real ones (2 or 4)"
    even = spacing == 1
    values = _binary(kind, body[at:], form) if _is_binary(kind) else _ascii(body[at:], _FIELDS[form, even])
    values = _without_padding(values, n * (1 if even else 2))
    if n < 0 or n > MAX_VALUES or values.size != n * (1 if even else 2):
        raise ReadError(f"declares {n} samples but holds {values.size // (1 if even else 2)}; copy the file again")
    if even:
        start, step = (_real(records[6][i : i + 13]) for i in (30, 43))
        time, ordinate = start + np.arange(n) * step, values
    else:
        time, ordinate = values[::2].copy(), values[1::2].copy()
    abscissa = _text(records[7][46:67]) or "s"
    if not is_unit_of(abscissa, "s"):
        return f"stands over an abscissa in {quote(abscissa)}; export it over time"
    if (seconds := factor(abscissa, "s")) != 1:
        time = time * seconds
    node, direction = _whole(records[5][41:51], "response node"), _whole(records[5][51:55], "response direction")
    freedom = f"{node}:{_DIRECTIONS.get(direction, direction)}"
    return Response(_text(records[0]), freedom, _text(records[8][46:67]) or None, time, ordinate)


def _binary(kind: bytes, data: bytes, form: int) -> np.ndarray:
    order, floating = _whole(kind[7:13], "byte order"), _whole(kind[13:19], "floating point format")
    if order not in (1, 2) or floating != 2:
        raise ReadError(f"byte order {order} and number format {floating}; export IEEE numbers (1 or 2, and 2)")
    dtype = np.dtype("f4" if form == 2 else "f8").newbyteorder("<" if order == 1 else ">")
    rest = len(data) % dtype.itemsize
    if data[len(data) - rest :].strip(b"\0 \r\n"):
        raise ReadError("its bytes are not a whole number of values; the file is damaged")
    return np.frombuffer(data[: len(data) - rest], dtype).astype(float)


def _without_padding(values: np.ndarray, count: int) -> np.ndarray:
    """The values without zeros or blanks (a double of blanks is about 6e-154) that fill the block behind the last."""
    blanks = [np.frombuffer(b" " * size, kind)[0] for size, kind in ((4, "f4"), (8, "f8"))]
    more = values[count:] if 0 < count < values.size else values[:0]
    return values[:count] if more.size and np.isin(more, [0.0, *blanks]).all() else values


def _ascii(data: bytes, widths: tuple[int, ...]) -> np.ndarray:
    """Values of fixed-width lines; neighbours may touch, so blanks do not separate them."""
    fields: list[bytes] = []
    stops = np.cumsum((0, *widths)).tolist()
    for line in data.replace(b"D", b"E").replace(b"d", b"e").splitlines():
        fields += [field for a, b in pairwise(stops) if (field := line[a:b].strip())]
        if line[stops[-1] :].strip():
            raise ReadError(f"a line of values is longer than its format: {quote(line)}")
    try:
        return np.array([float(field) for field in fields])
    except ValueError as error:
        raise ReadError(f"holds what is not a number ({error}); the file is damaged") from error


def _text(field: str) -> str:
    text = "".join(c for c in field.strip() if c.isprintable())
    return "" if text.upper() == "NONE" else text


def _whole(field: str | bytes, what: str) -> int:
    try:
        return int(field)
    except ValueError as error:
        raise ReadError(f"{what} is {quote(field)} and not a whole number; the file is damaged") from error


def _real(field: str) -> float:
    try:
        return float(field.replace("D", "E").replace("d", "e"))
    except ValueError as error:
        raise ReadError(f"{quote(field)} is not a number; the file is damaged") from error
