"""Tables of 1X vectors: conditions of a rotor with known or unknown added unbalance, and the mapping of their columns.

::

    [conditions]
    column = ["cond", "id"]          # the first that a file has; rows with the same text are repeats of one condition
    speed = "speed"                  # text of the nominal speed; without it all rows have one
    [speed]
    column = "rpm"
    unit = "rpm"
    [readings.p1x]                   # a displacement probe
    real = "p1x_re"                  # or: amplitude and phase (a lag, in degrees), or amplitude alone in all readings
    imaginary = "p1x_im"
    unit = "mil"                     # 0-pk
    position = "120 mm"
    angle = "0 deg"
    [planes.disc_1]
    amount = "U1"                    # empty or absent in rows whose unbalance is unknown
    angle = "U1_deg"
    unit = "g*mm"
    position = "160 mm"
    radius = "30 mm"                 # of the holes for correction weights
    holes = 16
"""

import csv
import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from identification.readers.csv import encodings_of, opened
from identification.records.columns import amplitude_factor, factor
from rotorsim.base.display import did_you_mean, listing, quote
from rotorsim.base.errors import DataError
from rotorsim.base.input_files import parse_toml
from rotorsim.base.units import parse

READING = ("real", "imaginary", "amplitude", "phase", "unit", "position", "angle", "conjugated")
PLANE = ("amount", "angle", "unit", "position", "radius", "holes")
_COMMA, _POINT = (re.compile(rf"[+-]?(\d+{s}\d*|{s}\d+)([eE][+-]?\d+)?", re.ASCII) for s in (",", r"\."))
"""Numbers with a decimal comma, which a file with another delimiter may have, and with a decimal point."""
SECTIONS = {"conditions": ("column", "speed"), "speed": ("column", "unit")}


@dataclass(frozen=True)
class Reading:
    """A probe: position along the shaft [m] and angle from x towards y [rad], None where it is not stated.

    Its vectors have no phase, and are real and positive, where it is not `phased`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.balance.Reading("X", position=0.15, angle=0.0).name
    'X'
    """

    name: str
    position: float | None = None
    angle: float | None = None
    phased: bool = True


@dataclass(frozen=True)
class Plane:
    """A balancing plane: position along the shaft [m], radius [m] and number of its holes, the first at angle 0.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.balance.Plane("disc", position=0.12, radius=0.03, holes=16).holes
    16
    """

    name: str
    position: float | None = None
    radius: float | None = None
    holes: int | None = None


@dataclass(frozen=True, eq=False)
class Conditions:
    """1X vectors of a rotor at the same speeds in several conditions.

    Attributes
    ----------
    labels : names of the conditions (n,)
    speeds : names of the nominal speeds (s,)
    speed : measured speeds [rad/s] (n, s), NaN where a condition was not measured
    vectors : complex (n, s, readings) [m 0-pk], mean of the repeats; x(t) = Re(vector exp(i angle))
    unbalance : complex added unbalance (n, planes) [kg m], NaN where unknown

    Examples
    --------
    >>> import rotorsim as rs
    >>> speed, unbalance = np.full((3, 1), 300.0), 1e-5 * np.array([[0.0], [1.0], [np.nan]]) + 0j
    >>> vectors = 1e-6 * np.array([[[1.0]], [[2.0]], [[1.5]]]) + 0j
    >>> x, disc = rs.balance.Reading("X", angle=0.0), rs.balance.Plane("disc", radius=0.03)
    >>> names = ("none", "trial", "now")
    >>> made = rs.balance.Conditions(names, ("3000 rpm",), speed, vectors, unbalance, (x,), (disc,))
    >>> made.known.tolist()
    [True, True, False]
    """

    labels: tuple[str, ...]
    speeds: tuple[str, ...]
    speed: np.ndarray
    vectors: np.ndarray
    unbalance: np.ndarray
    readings: tuple[Reading, ...]
    planes: tuple[Plane, ...]

    @property
    def known(self) -> np.ndarray:
        """Which conditions have a known unbalance (n,)."""
        return np.asarray(np.isfinite(self.unbalance).all(axis=1))

    @property
    def flat(self) -> np.ndarray:
        """Vectors (n, speeds x readings)."""
        return self.vectors.reshape(len(self.labels), -1)


def read_conditions(paths: Sequence[str | Path], mapping: str | Path | Mapping[str, Any]) -> Conditions:
    """Conditions of CSV files with the columns that a mapping names; rows of one condition are averaged.

    Raises
    ------
    DataError
        For a file that cannot be read, a missing column or entry, or a value that is not a number: one sentence.

    Examples
    --------
    >>> import rotorsim as rs
    >>> conditions = rs.balance.read_conditions(["open.csv"], "balance.toml")
    """
    tables = _tables(mapping)
    rows = [(path, row) for path in paths for row in _rows(Path(path))]
    if not rows:
        raise DataError(f"{listing(str(p) for p in paths)}: no rows")
    names = _section("conditions", tables.get("conditions", {}), SECTIONS["conditions"])
    clock = _section("speed", tables.get("speed", {}), SECTIONS["speed"])
    for part, key in ((names, "column"), (clock, "column")):
        if key not in part:
            raise DataError("mapping: [conditions] and [speed] must name a column")
    readings = {n: _section(f"readings.{n}", t, READING) for n, t in _parts(tables, "readings")}
    planes = {n: _section(f"planes.{n}", t, PLANE) for n, t in _parts(tables, "planes")}
    if not readings or not planes:
        raise DataError("mapping: name at least one probe in [readings.NAME] and one plane in [planes.NAME]")
    bare = [name for name, entry in readings.items() if not _phased(entry)]
    if bare and len(bare) < len(readings):
        raise DataError(
            f"mapping: readings {listing(bare)} have no phase and the others one; give it to all of them, or to none"
        )
    return _collect(rows, names, clock, readings, planes)


def _collect(rows: list[Any], names: Any, clock: Any, readings: Any, planes: Any) -> Conditions:
    labels = tuple(dict.fromkeys(_text(p, r, names["column"]) for p, r in rows))
    speeds = tuple(sorted(dict.fromkeys(_text(p, r, names["speed"]) if "speed" in names else "" for p, r in rows)))
    shape = (len(labels), len(speeds))
    values: dict[tuple[int, int], list[np.ndarray]] = {}
    speed, unbalance = np.full(shape, np.nan), np.full((len(labels), len(planes)), np.nan, dtype=complex)
    for path, row in rows:
        i = labels.index(_text(path, row, names["column"]))
        j = speeds.index(_text(path, row, names["speed"]) if "speed" in names else "")
        values.setdefault((i, j), []).append(np.array([_vector(path, row, n, t) for n, t in readings.items()]))
        speed[i, j] = factor(clock.get("unit", "rpm"), "rad/s") * _number(path, row, clock["column"])
        added = [_added(path, row, n, t) for n, t in planes.items()]
        if np.isfinite(unbalance[i]).all() and not np.allclose(unbalance[i], added, equal_nan=True):
            raise DataError(f"{path}: condition {quote(labels[i])} has two different labels; correct one")
        unbalance[i] = added
    vectors = np.full((*shape, len(readings)), np.nan, dtype=complex)
    for at, repeats in values.items():
        vectors[at] = np.mean(repeats, axis=0)
    return Conditions(
        labels,
        speeds,
        speed,
        vectors,
        unbalance,
        tuple(Reading(n, _stated(t, "position"), _stated(t, "angle", "rad"), _phased(t)) for n, t in readings.items()),
        tuple(Plane(n, _stated(t, "position"), _stated(t, "radius"), t.get("holes")) for n, t in planes.items()),
    )


def _phased(entry: Mapping[str, Any]) -> bool:
    return not ("amplitude" in entry and "phase" not in entry and "real" not in entry)


def _vector(path: Any, row: dict[str, str], name: str, entry: dict[str, Any]) -> complex:
    scale = amplitude_factor(entry.get("unit", "m"))
    if "real" in entry and "imaginary" in entry:
        value = complex(_number(path, row, entry["real"]), _number(path, row, entry["imaginary"]))
    elif "amplitude" in entry and "phase" in entry:
        lag = math.radians(_number(path, row, entry["phase"]))
        value = _number(path, row, entry["amplitude"]) * complex(math.cos(lag), -math.sin(lag))
    elif "amplitude" in entry and "real" not in entry and "imaginary" not in entry:
        value = complex(abs(_number(path, row, entry["amplitude"])))
    else:
        raise DataError(f"mapping: [readings.{name}] needs real and imaginary, amplitude and phase, or amplitude alone")
    return scale * (value.conjugate() if entry.get("conjugated") else value)


def _added(path: Any, row: dict[str, str], name: str, entry: dict[str, Any]) -> complex:
    if "amount" not in entry or "angle" not in entry:
        raise DataError(f"mapping: [planes.{name}] needs the columns amount and angle")
    if not row.get(entry["amount"], "").strip():
        return complex(np.nan, np.nan)
    turn = math.radians(_number(path, row, entry["angle"]))
    amount = _quantity(f"1 {entry.get('unit', 'kg*m')}", "kg*m") * _number(path, row, entry["amount"])
    return amount * complex(math.cos(turn), math.sin(turn))


def _tables(mapping: str | Path | Mapping[str, Any]) -> Mapping[str, Any]:
    if isinstance(mapping, Mapping):
        tables = dict(mapping)
    else:
        try:
            tables = parse_toml(Path(mapping).read_text(encoding="utf-8-sig"))
        except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
            raise DataError(f"{mapping}: not a mapping ({error})") from error
    known = (*SECTIONS, "readings", "planes")
    for name in tables:
        if name not in known:
            raise DataError(f"mapping: unknown table [{name}]; {did_you_mean(name, known)}")
    return tables


def _parts(tables: Mapping[str, Any], name: str) -> list[tuple[str, Any]]:
    table = tables.get(name, {})
    if not isinstance(table, Mapping):
        raise DataError(f"mapping: {name} is not a table; write [{name}.NAME] and its entries below")
    return list(table.items())


def _section(name: str, table: Any, known: Sequence[str]) -> dict[str, Any]:
    if not isinstance(table, Mapping):
        raise DataError(f"mapping: {name} is not a table; write [{name}] and its entries below")
    for key, value in table.items():
        if key not in known:
            raise DataError(f"mapping: [{name}] has no entry {quote(key)}; {did_you_mean(key, known)}")
        wanted, good = _form(name, key, value)
        if not good:
            raise DataError(f"mapping: [{name}] {key} = {quote(value)} must be {wanted}")
    return dict(table)


def _form(name: str, key: str, value: Any) -> tuple[str, bool]:
    """Type that an entry must have, and whether it has it."""
    if key == "conjugated":
        return "true or false", isinstance(value, bool)
    if key == "holes":
        return "a whole number of at least 3", isinstance(value, int) and not isinstance(value, bool) and value >= 3
    if (name, key) == ("conditions", "column") and isinstance(value, list):
        return "the names of columns", bool(value) and all(isinstance(one, str) for one in value)
    return "text", isinstance(value, str)


def _rows(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        raise DataError(f"{path}: is not there; give the path of a table of 1X vectors")
    try:
        text = _whole(path)
        heading = text.partition("\n")[0]
        delimiter = next((sign for sign in "\t;" if sign in heading), ",")
        rows = list(csv.DictReader(StringIO(text, newline=""), delimiter=delimiter))
        for number, row in enumerate(rows, 2):
            if more := row.pop(None, None):  # where csv puts cells without a heading
                raise DataError(
                    f"{path}: row {number}: {listing(more)} stands beyond the last heading; correct the row"
                )
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{path}: not a table of values between commas, semicolons or tabs ({error})") from error
    plain = [{name: cell or "" for name, cell in row.items()} for row in rows]
    if delimiter == "," or any(_POINT.fullmatch(cell.strip()) for row in plain for cell in row.values()):
        return plain
    return [
        {name: cell.replace(",", ".") if _COMMA.fullmatch(cell.strip()) else cell for name, cell in row.items()}
        for row in plain
    ]


def _whole(path: Path) -> str:
    """The text of a file, in the encodings in which records are read."""
    *first, last = encodings_of(path)
    for encoding in first:
        with suppress(UnicodeDecodeError), opened(path, encoding, newline="") as file:
            return file.read()
    with opened(path, last, newline="") as file:
        return file.read()


def _text(path: Any, row: dict[str, str], column: str | Sequence[str]) -> str:
    """Text of a column, or of the first that is there of several."""
    for one in [column] if isinstance(column, str) else column:
        if one in row:
            return row[one].strip()
    raise DataError(f"{path}: no column {quote(column)}; the file has {listing(row)}")


def _number(path: Any, row: dict[str, str], column: str) -> float:
    text = _text(path, row, column)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DataError(f"{path}: column {quote(column)} holds {quote(text)}, which is not a number")
    return value


def _stated(table: dict[str, Any], key: str, unit: str = "m") -> float | None:
    return _quantity(table[key], unit) if key in table else None


def _quantity(value: Any, unit: str) -> float:
    try:
        return parse(value, unit)
    except ValueError as error:
        raise DataError(f"mapping: {error}") from None
