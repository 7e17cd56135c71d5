"""CSV and text tables with decimal point or comma; comma, semicolon, tab or spaces as delimiter.

The first lines show the layout; every line below the heading must be a full row. An empty cell is a missing value.
A column with what is not a number has a fault that names line and column; it is never interpreted, and where no mapping
takes the column it does no harm.

The heading is the lowest line of words above the numbers that has as many cells as they; below it may stand a line of
units. Lines before it are a preamble, as `key;value` of loggers, also those with a colon, in longer tables also lines
that a spreadsheet filled up with empty cells. Its statement of a sampling rate is kept. A table may come without a
heading: then columns go by their numbers.
"""

import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from io import TextIOWrapper
from pathlib import Path
from typing import TextIO

import numpy as np

from identification.readers import reader
from identification.records.columns import (
    FACTORS,
    MARK,
    MAX_NAME,
    MAX_VALUES,
    Column,
    DataTable,
    is_written_unit,
    parse_header,
    split_name,
)
from rotorsim.base.display import quote
from rotorsim.base.errors import ReadError

MAX_COLUMNS, MAX_PREAMBLE = 1000, 500
_DELIMITERS = {"tab": "\t", "semicolon": ";", "comma": ",", "space": None}
_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan|inf|infinity)", re.ASCII | re.IGNORECASE)
_STATED = re.compile(r"[^\W\d][^:,;]{0,60}:(\s|$)")
"""First cell of a line that states something about the file, such as 'Point Name:, DE X'; never a heading."""
_RATE = re.compile(
    r"(?:((?:sampl|abtast|mess)\w*[ _-]?(?:rate|freq\w*|frek\w*)|fr.quence d.\w*chantillonnage|\bfs\b)"
    r"|((?:sampl|abtast)\w*[ _-]?(?:interval\w*|period\w*)|\bdelta_x\b))"
    r"[^\d\n]*?(\d{1,3}(?:[ '’\u00a0\u202f]\d{3})+(?:[.,]\d+)?(?!\d)|\d[\d.,]*(?:[eE][+-]?\d+)?)"
    r"[\s;,]*([a-zµ]?(?:Hz|s)\b)?",
    re.IGNORECASE,
)
"""Statement of a sampling rate or of the time between samples, its number and unit."""
_GAPS = re.compile(r"[ '’\u00a0\u202f]")
"""Separators of thousands that are no decimal sign anywhere."""
_WITH_POINT = re.compile(r"(\d+|[1-9]\d{0,2}(,\d{3})+)(\.\d*)?([eE][+-]?\d+)?", re.ASCII)
"""Number with a decimal point and, between thousands, commas or nothing."""
_WITH_COMMA_WORDS = re.compile(r"abtast|mess|fr.quence|freque?nz|frekven", re.IGNORECASE)
"""Names of a sampling rate in languages that write a decimal comma."""
_NO_LANGUAGE = re.compile(r"\bfs\b|delta_x", re.IGNORECASE)
FASTEST = 1e7
"""Sampling rate [Hz] that no recorder of vibrations reaches."""
AMBIGUOUS_RATE = (
    "the sampling rate {text} is {low:.9g} Hz or {high:.9g} Hz, by its decimal sign, which the file does not show; it"
    " is left out: state it as [time] sample_rate"
)
"""Note on a stated rate whose one separator may be that of thousands."""
_BRACKETS = re.compile(r"[\[(][^\])]*[\])]")
_COMMENT = ("#", "%", "//")
SWAP = str.maketrans(",.", ".,")
MATCH = 0.05
"""Relative difference of a stated rate from that of the times up to which both are the same."""
UTF8, LATIN = "utf-8-sig", "latin-1"


@dataclass(frozen=True)
class StatedRate:
    """Sampling rate that a file states: its number as written, and the rate [Hz] by each decimal sign it may have.

    `usual` is the decimal sign of the language of the statement; empty where that is not known.
    """

    text: str
    by_sign: Mapping[str, float]
    usual: str

    @property
    def rates(self) -> list[float]:
        """The rates [Hz] that it may be, the lowest first."""
        return sorted(set(self.by_sign.values()))


@dataclass(frozen=True)
class TextLayout:
    """`first`: lines before the numbers; `delimiter` None: spaces; `comma`: decimal comma; `header`: ours, as JSON."""

    names: tuple[tuple[str, str | None], ...]
    delimiter: str | None
    comma: bool
    first: int
    header: str = ""
    rate: StatedRate | None = None
    encoding: str = UTF8


def is_number(cell: str) -> bool:
    """Whether a cell is a plain decimal number, or nan or inf."""
    return _NUMBER.fullmatch(cell) is not None


def cells(line: str, delimiter: str | None) -> list[str]:
    """The cells of a line without their blanks and quotes."""
    found = (cell.strip() for cell in line.strip("\r\n").split(delimiter))
    return [cell[1:-1].strip() if len(cell) > 1 and cell[0] == cell[-1] == '"' else cell for cell in found]


def find_layout(path: Path, stated: dict[str, str], longest: int) -> TextLayout:
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


def _found(path: Path, stated: dict[str, str], longest: int, encoding: str) -> TextLayout:
    with opened(path, encoding) as file:
        lines = _start(file, longest)
    header = "".join(line[2:] for line in lines[1:2]) if lines and lines[0].startswith(f"# {MARK}") else ""
    found = {i: row for i, line in enumerate(lines) if (row := _numeric(line, stated))}
    if found:
        # a preamble may hold a line of numbers alone; the table has the most
        width = Counter(map(len, found.values())).most_common(1)[0][0]
        start = min(i for i, row in found.items() if len(row) == width)
        delimiter, comma = _separators(lines[start], stated)
        return _layout(lines[:start], found[start], delimiter, comma, header)
    first = _mixed(lines, stated)
    if first is None:
        raise ReadError(_no_numbers(lines, stated))
    delimiter, comma = _separators(lines[first], stated)
    return _layout(lines[:first], cells(lines[first], delimiter), delimiter, comma, header)


def _numeric(line: str, stated: dict[str, str]) -> list[str]:
    """The cells of a row of numbers and missing values; none of any other line."""
    row = _cells(line, *_separators(line, stated))
    return row if any(map(is_number, row)) and all(not cell or is_number(cell) for cell in row) else []


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


def _layout(above: list[str], row: list[str], delimiter: str | None, comma: bool, header: str) -> TextLayout:
    """Layout from the lines above the first row of numbers."""
    width, first = len(row), len(above)
    if width > MAX_COLUMNS:
        raise ReadError(f"{width} columns are above the limit of {MAX_COLUMNS}; cut the file")
    lines = [(i, cells(line, delimiter)) for i, line in enumerate(above) if line.strip() and not _is_comment(line)]
    rows = [(i, _fitted(line, row)) for i, line in lines if not _STATED.match(line[0])]
    full = [(i, line) for i, line in rows if len(line) == width]
    words = [(i, line) for i, line in full if not is_number(line[0])] or full[:1]
    rate = None if header else _stated_rate(above, delimiter)
    if not words:
        if rows and width > 1:
            i, line = rows[-1]
            raise ReadError(f"line {i + 1}: a heading of {len(line)} cells above rows of {width}; correct the heading")
        return TextLayout(tuple((f"column {i + 1}", None) for i in range(width)), delimiter, comma, first, header, rate)
    units = [""] * width
    if len(words) > 1 and _is_units(words[-1][1]):
        units = [cell.strip("[]()") for cell in words.pop()[1]]
    filled = [(i, line) for i, line in words if sum(map(bool, line)) >= 0.5 * width]
    at, heading = (filled or words)[-1]
    names = [(name, unit or below or None) for (name, unit), below in zip(map(split_name, heading), units, strict=True)]
    if wrong := [(i, line) for i, line in full if i > at and is_number(line[0])]:
        raise ReadError(_bad_row(wrong[0], names))
    for i, (name, _) in enumerate(names):
        if len(name) > MAX_NAME or not name.isprintable():
            raise ReadError(f"line {at + 1}: {quote(name)} is not a valid name for column {i + 1}; rename it")
    return TextLayout(tuple(names), delimiter, comma, first, header, rate)


def _fitted(line: list[str], row: list[str]) -> list[str]:
    """A line above a row of numbers, without a delimiter or a column of comments that only one of both ends with."""
    if len(line) == len(row) + 1 and line[-1].lower() in ("", "comment"):
        return line[:-1]
    return [*line, ""] if len(line) == len(row) - 1 and not row[-1] else line


def _stated_rate(above: list[str], delimiter: str | None) -> StatedRate | None:
    """Sampling rate that a line above the table states, as 'Abtastrate;12800' and 'Delta_X 7.8E-5'."""
    for line in above:
        if not (found := _RATE.search(line)):
            continue
        # behind a comma that ends a cell the next one ends the number
        ended = delimiter == "," and line[: found.start(3)].rstrip().endswith(",")
        text = found[3].split(",")[0] if ended else found[3]
        unit = found[4] or next((one.strip("[]() ") for one in _BRACKETS.findall(line[: found.start(3)])), "")
        factor = FACTORS["s" if found[2] else "Hz"].get(unit, 1.0)
        values = {sign: number * factor for sign, number in _readings(text).items() if number > 0}
        rates = {sign: 1 / value if found[2] else value for sign, value in values.items()}
        if likely := {sign: rate for sign, rate in rates.items() if rate < FASTEST}:
            words = found[1] or found[2]
            usual = "" if _NO_LANGUAGE.search(words) else "," if _WITH_COMMA_WORDS.search(words) else "."
            return StatedRate(quote(f"{text.rstrip('.,')} {unit}".strip()), likely, usual)
    return None


def _readings(text: str) -> dict[str, float]:
    """The number that a text is by each decimal sign with which it is one: of 12,800 there are two, of 12,8 one."""
    plain = _GAPS.sub("", text).rstrip(".,")
    written = {".": plain, ",": plain.translate(SWAP)}
    return {sign: float(t.replace(",", "")) for sign, t in written.items() if _WITH_POINT.fullmatch(t)}


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENT)


def _is_units(row: list[str]) -> bool:
    """Whether a line holds units: each cell is in brackets or empty, or most are known as units."""
    filled = [cell for cell in row if cell]
    bracketed = all(cell[:1] in "[(" and cell[-1:] in "])" for cell in filled)
    return bool(filled) and (bracketed or 2 * sum(map(is_written_unit, filled)) > len(filled))


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


MAX_LINE = 1_000_000
"""Longest line, in characters."""


@reader(".csv", ".txt", ".tsv", ".dat", ".asc", ".lvm", takes_layout=True)
def read_csv(path: Path, file: dict[str, str] | None = None) -> DataTable:
    """Table of a text file; `file` may state delimiter and decimal sign (see `identification.records.mapping`)."""
    try:
        layout = find_layout(path, file or {}, MAX_LINE)
        values, faults = _numbers(path, layout, "decimal" in (file or {}))
    except UnicodeDecodeError as error:
        name = (file or {}).get("encoding", "UTF-8")
        raise ReadError(
            f"byte {error.start + 1}: is no text in {name}; state another, e.g. [file] encoding = 'latin-1'"
        ) from error
    header = parse_header(layout.header) if layout.header else None
    if header and len(values) != header.samples:
        raise ReadError(f"{len(values)} rows, its header states {header.samples}; the file was cut off: copy it again")
    columns = enumerate(zip(layout.names, values.T, strict=True))
    guessed = layout.encoding == LATIN and "encoding" not in (file or {})
    notes = [f"read as {LATIN}, for it is not UTF-8; state another as [file] encoding"] if guessed else []
    found = tuple(Column(name, column, unit, fault=faults.get(i, "")) for i, ((name, unit), column) in columns if name)
    if all(column.fault for column in found):
        raise ReadError(found[0].fault if found else "no column with a name; name them in the heading")
    rate = _settled_rate(layout.rate, found, path, layout) if layout.rate else None
    if layout.rate and rate is None:
        low, high = layout.rate.rates
        notes.append(AMBIGUOUS_RATE.format(text=layout.rate.text, low=low, high=high))
    return DataTable("CSV", found, header=header, notes=tuple(notes), rate=rate)


def _settled_rate(stated: StatedRate, columns: Sequence[Column], path: Path, layout: TextLayout) -> float | None:
    """The one rate [Hz] that a statement may be, or that the times show; None where that stays open.

    Without times the decimal sign of the table shows which, unless the language of the statement has the other one.
    """
    if len(stated.rates) == 1:
        return stated.rates[0]
    for column in columns:
        step = _step(column)
        shown = [rate for rate in stated.rates if abs(rate * step - 1) < MATCH]
        if shown:
            return shown[0]
    sign = _sign(path, layout)
    return stated.by_sign.get(sign) if stated.usual in ("", sign) else None


def _step(column: Column) -> float:
    """Mean step [s] of a column of times with a unit; NaN of any other."""
    times = column.values[np.isfinite(column.values)]
    factor = FACTORS["s"].get(column.unit or "", np.nan)
    return factor * float(times[-1] - times[0]) / (times.size - 1) if times.size > 1 else np.nan


def _numbers(path: Path, layout: TextLayout, stated: bool) -> tuple[np.ndarray, dict[int, str]]:
    """The numbers (rows, columns), the fast way if all are whole and good, and the columns with a fault."""
    guesses = [layout]
    if not stated and not layout.comma and layout.delimiter != ",":
        # the first row may be whole numbers, which do not show the decimal sign
        guesses.append(replace(layout, comma=True))
    for guess in guesses:
        try:
            return _fast(path, guess), {}
        except UnicodeDecodeError:
            raise
        except ValueError:
            continue
    found = _sign(path, layout) == "," if len(guesses) > 1 else layout.comma
    return _careful(path, replace(layout, comma=found))


def _sign(path: Path, layout: TextLayout) -> str:
    """The first decimal sign among the numbers; empty where all are whole."""
    if layout.comma:
        return ","
    signs = re.compile(r"\." if layout.delimiter == "," else "[.,]")
    return next((found[0] for line in _lines(path, layout) if (found := signs.search(line))), "")


def _lines(path: Path, layout: TextLayout) -> Iterator[str]:
    """The lines of numbers; where the comma is the decimal sign it becomes a point, and a point no number."""
    with opened(path, layout.encoding) as file:
        for _ in range(layout.first):
            file.readline()
        if not layout.comma:
            yield from file
        else:
            for line in file:
                yield line.translate(SWAP)


def _fast(path: Path, layout: TextLayout) -> np.ndarray:
    whole = layout.first and not layout.comma  # a first line of numbers may have a byte order mark before it
    values = np.loadtxt(
        path if whole else _lines(path, layout),
        delimiter=layout.delimiter,
        skiprows=layout.first if whole else 0,
        comments=None,
        ndmin=2,
        encoding=layout.encoding,
    )
    if values.shape[1] != len(layout.names):
        raise ValueError("ragged")
    return values


def _careful(path: Path, layout: TextLayout) -> tuple[np.ndarray, dict[int, str]]:
    """The same numbers with NaN for empty cells, and the first fault of a column that has one.

    Raises ReadError, with its line, for a row of another length.
    """
    rows, width, short = [], len(layout.names), ""
    faults: dict[int, str] = {}
    for number, line in enumerate(_lines(path, layout), layout.first + 1):
        if len(line) > MAX_LINE:
            raise ReadError(f"line {number}: is longer than {MAX_LINE} characters; is it a table?")
        if not line.strip():
            continue
        if short:
            raise ReadError(short)
        found = cells(line, layout.delimiter)
        if len(found) != width:
            # raised only once the next line shows whether it is the last one
            short = f"line {number}: {len(found)} cells, expected {width}; correct or remove the line"
            continue
        rows.append([_number(cell, number, i, layout, faults) for i, cell in enumerate(found)])
        if len(rows) * width > MAX_VALUES:
            raise ReadError(f"more than {MAX_VALUES} values; cut the file")
    if short:
        raise ReadError(short.replace("correct or remove the line", "the file may be cut off: copy it again"))
    return np.array(rows, float).reshape(-1, width), faults


def _number(cell: str, line: int, column: int, layout: TextLayout, faults: dict[int, str]) -> float:
    if not cell or column in faults:
        return np.nan
    if is_number(cell):
        return float(cell)
    name = layout.names[column][0] or str(column + 1)
    cell = cell.translate(SWAP) if layout.comma else cell
    faults[column] = f"line {line}, column {quote(name)}: {quote(cell)} is not a number; correct or remove the line"
    return np.nan
