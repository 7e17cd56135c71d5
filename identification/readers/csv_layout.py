"""Layout of a text table: delimiter, decimal sign, heading, units and the first line of numbers.

The heading is the first line with as many cells as the first row of numbers. Lines before it with fewer cells are a
preamble, and so are those that begin with a name and a colon; a line after it may hold units. A table may come without
a heading: then columns go by their numbers.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections import Counter
from dataclasses import dataclass, replace
from io import TextIOWrapper
from pathlib import Path
from typing import TextIO

from identification.errors import ReadError
from identification.records.table import MARK, MAX_NAME, split_name
from identification.records.units import is_unit
from rotorsim.base.sentences import quote

MAX_COLUMNS, MAX_PREAMBLE = 1000, 500
_DELIMITERS = {"tab": "\t", "semicolon": ";", "comma": ",", "space": None}
_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan|inf|infinity)", re.ASCII | re.IGNORECASE)
_STATED = re.compile(r"[^\W\d][^:,;]{0,60}:(\s|$)")
"""First cell of a line that states something about the file, such as 'Point Name:, DE X'; never a heading."""
_COMMENT = ("#", "%", "//")
UTF8, LATIN = "utf-8-sig", "latin-1"


@dataclass(frozen=True)
class Layout:
    """`first`: lines before the numbers; `delimiter` None: spaces; `comma`: decimal comma; `header`: ours, as JSON."""

    names: tuple[tuple[str, str | None], ...]
    delimiter: str | None
    comma: bool
    first: int
    header: str = ""
    encoding: str = UTF8


def is_number(cell: str) -> bool:
    """Whether a cell is a plain decimal number, or nan or inf."""
    return _NUMBER.fullmatch(cell) is not None


def cells(line: str, delimiter: str | None) -> list[str]:
    """The cells of a line without their blanks and quotes."""
    found = (cell.strip() for cell in line.strip("\r\n").split(delimiter))
    return [cell[1:-1].strip() if len(cell) > 1 and cell[0] == cell[-1] == '"' else cell for cell in found]


def find_layout(path: Path, stated: dict[str, str], longest: int) -> Layout:
    """Layout from the first lines; raises ReadError if no table of numbers begins there.

    The text is in the `encoding` that is stated, else in UTF-8, else in Latin-1, which gives every byte a meaning.
    """
    encodings = [stated["encoding"]] if "encoding" in stated else encodings_of(path)
    for encoding in encodings[:-1]:
        try:
            return replace(_found(path, stated, longest, encoding), encoding=encoding)
        except UnicodeDecodeError:
            continue
    return replace(_found(path, stated, longest, encodings[-1]), encoding=encodings[-1])


def encodings_of(path: Path) -> list[str]:
    """The encodings in which a text may be, in the order to try them."""
    with path.open("rb") as file:
        return ["utf-16"] if file.read(2) in (BOM_UTF16_LE, BOM_UTF16_BE) else [UTF8, LATIN]


def opened(path: Path, encoding: str, newline: str | None = None) -> TextIOWrapper:
    """A text from behind its byte order mark; that of UTF-8 also stands before texts in other encodings."""
    file = path.open("rb")
    if file.read(len(BOM_UTF8)) != BOM_UTF8:
        file.seek(0)
    return TextIOWrapper(file, encoding=encoding, newline=newline)


def _found(path: Path, stated: dict[str, str], longest: int, encoding: str) -> Layout:
    with opened(path, encoding) as file:
        lines = _start(file, longest)
    header = "".join(line[2:] for line in lines[1:2]) if lines and lines[0].startswith(f"# {MARK}") else ""
    for i, line in enumerate(lines):
        delimiter, comma = _separators(line, stated)
        row = _cells(line, delimiter, comma)
        if _is_row(row):
            return _layout(lines[:i], len(row), delimiter, comma, header)
    first = _mixed(lines, stated)
    if first is None:
        raise ReadError(_no_numbers(lines, stated))
    delimiter, comma = _separators(lines[first], stated)
    return _layout(lines[:first], len(cells(lines[first], delimiter)), delimiter, comma, header)


def _mixed(lines: list[str], stated: dict[str, str]) -> int | None:
    """The first row below the heading of a table that has texts, such as dates, in some columns; None without."""
    rows = []
    for line in lines:
        delimiter, comma = _separators(line, stated)
        rows.append(tuple(not cell or is_number(cell) for cell in _cells(line, delimiter, comma)))
    usual, count = Counter(rows).most_common(1)[0] if rows else ((), 0)
    if count < 2 or not any(usual):
        return None
    headings = [i for i, row in enumerate(rows) if len(row) == len(usual) and not any(row)]
    first = headings[-1] + 1 if headings else rows.index(usual)
    return first if rows[first:].count(usual) > 0.5 * len(rows[first:]) else None


def _start(file: TextIO, longest: int) -> list[str]:
    lines: list[str] = []
    while len(lines) < MAX_PREAMBLE and (line := file.readline(longest + 1)):
        if (
            len(line) > longest
            and not line.startswith(f"# {MARK}")
            and not (lines and lines[0].startswith(f"# {MARK}"))
        ):
            raise ReadError(f"line {len(lines) + 1}: is longer than {longest} characters; is it a table?")
        while not line.endswith("\n") and (more := file.readline(longest)):
            line += more
        if "\0" in line:
            raise ReadError(f"line {len(lines) + 1}: holds NUL characters; the file is binary or damaged")
        lines.append(line)
    return lines


def _separators(line: str, stated: dict[str, str]) -> tuple[str | None, bool]:
    """Delimiter and whether a comma is the decimal sign, from one line."""
    fitting = next((d for d in ("\t", ";", ",") if d in line), None)
    delimiter = _DELIMITERS[stated["delimiter"]] if "delimiter" in stated else fitting
    if "decimal" in stated:
        comma = stated["decimal"] == "comma"
        return (None if comma and delimiter == "," and "delimiter" not in stated else delimiter), comma
    return delimiter, delimiter != "," and bool(re.search(r"\d,\d|^,\d|\d,$", line)) and "." not in line


def _cells(line: str, delimiter: str | None, comma: bool) -> list[str]:
    found = cells(line, delimiter)
    return [cell.replace(",", ".") if "." not in cell else cell + "," for cell in found] if comma else found


def _is_row(row: list[str]) -> bool:
    return any(map(is_number, row)) and all(not cell or is_number(cell) for cell in row)


def _layout(above: list[str], width: int, delimiter: str | None, comma: bool, header: str) -> Layout:
    """Layout from the lines above the first row of numbers, which has `width` cells."""
    if width > MAX_COLUMNS:
        raise ReadError(f"{width} columns are above the limit of {MAX_COLUMNS}; cut the file")
    rows = [(i, cells(line, delimiter)) for i, line in enumerate(above) if line.strip() and not _is_comment(line)]
    rows = [(i, row) for i, row in rows if not _STATED.match(row[0])]
    full = [(i, row) for i, row in rows if len(row) == width]
    first = len(above)
    if not full:
        if rows and width > 1:
            i, row = rows[-1]
            raise ReadError(f"line {i + 1}: a heading of {len(row)} cells above rows of {width}; correct the heading")
        return Layout(tuple((f"column {i + 1}", None) for i in range(width)), delimiter, comma, first, header)
    names = [split_name(cell) for cell in full[0][1]]
    rest = [(i, row) for i, row in rows if i > full[0][0]]
    if rest and _is_units(rest[0][1], width):
        names = [
            (name, unit or cell.strip("[]()") or None) for (name, unit), cell in zip(names, rest[0][1], strict=True)
        ]
        rest = rest[1:]
    if rest:
        raise ReadError(_bad_row(rest[0], names))
    for i, (name, _) in enumerate(names):
        if len(name) > MAX_NAME or not name.isprintable():
            raise ReadError(f"line {full[0][0] + 1}: {quote(name)} is not a valid name for column {i + 1}; rename it")
    return Layout(tuple(names), delimiter, comma, first, header)


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENT)


def _is_units(row: list[str], width: int) -> bool:
    """Whether a line holds units: each cell is known as one, in brackets, or empty."""
    bracketed = [cell[:1] in "[(" and cell[-1:] in "])" if cell else True for cell in row]
    known = [not cell or is_unit(cell) for cell in row]
    return len(row) == width and any(row) and (all(bracketed) or all(known))


def _bad_row(line: tuple[int, list[str]], names: list[tuple[str, str | None]]) -> str:
    i, row = line
    if len(row) != len(names):
        return f"line {i + 1}: {len(row)} cells, expected {len(names)}; correct or remove the line"
    j = next((j for j, cell in enumerate(row) if cell and not is_number(cell)), 0)
    return f"line {i + 1}, column {quote(names[j][0])}: {quote(row[j])} is not a number; correct or remove the line"


def _no_numbers(lines: list[str], stated: dict[str, str]) -> str:
    rows = [(i, line) for i, line in enumerate(lines) if line.strip() and not _is_comment(line)]
    if len(rows) < 2:
        return "no row of numbers; is it a table?"
    delimiter, _ = _separators(rows[0][1], stated)
    names = [split_name(cell) for cell in cells(rows[0][1], delimiter)]
    i, line = rows[1]
    return f"no row of numbers; {_bad_row((i, cells(line, delimiter)), names)}"
