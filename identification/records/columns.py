"""Columns of a data file as they stand there, and the units that they state.

A dead sensor's column never moves, a clipped one rests at a limit of its range. A quantised signal stays at its extreme
value for a few samples too, but there it stays little longer than at the next value; a clipped one stays there much
longer than anywhere near.

The spelling of a unit counts, so that mPa and MPa stay apart; further spellings of laboratories (Volts, m/s2, G) stand
in `SPELLINGS` of `rotorsim.base.units`. Pressures are gauge, here as everywhere; an absolute pressure is not a unit but
another quantity. `Hz` of a shaft speed is revolutions per second.
"""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import inf, isfinite, sqrt
from typing import Any

import numpy as np

from rotorsim.base.display import listing, quote
from rotorsim.base.errors import ReadError
from rotorsim.base.input_files import parse_json
from rotorsim.base.units import CHARACTERS, NUMBER, SPELLINGS, TABLE

MARK = "rotorsim record"
"""First words of the header of a file that rotorsim wrote."""
CLIPPED = "clipped"
"""Attribute with a sentence for every clipped sensor."""
MAX_VALUES = 2**29
"""No column or matrix of more values is read: 4 GB."""
MAX_NAME = 200
"""Longest name of a column."""
OTHER_UNITS = frozenset(
    {"A", "mA", "°C", "degC", "C", "K", "F", "°F", "Nm", "N*m", "N·m", "W", "kW", "dB", "dB(A)", "%", "l/min", "L/min"}
    | {"nl/min", "Nl/min", "kg/h", "Ohm", "Ω", "lux", "lx", "µm/m", "um/m", "counts", "digits"}
)
"""Units of quantities that no channel of a record has; they are no part of a name."""
_OVER = re.compile(r"(.*?)(?:\s*\bin |(?<=\w)\s*/\s*)(\S+)")
"""Heading such as 'CH1 in V' and 't / s'; 'once/rev' is none."""
_NAME = re.compile(r"([^\[\]]+)(?:\[([^\[\]]*)\]|\(([^()]*)\))")


@dataclass(frozen=True)
class Column:
    """Numbers (n,) as they stand in the file; `unit` as the file states it, None if it does not.

    `time` (n,) [s] is the column's own clock, whose zero lies `begin` [s] after a moment that all columns share, NaN
    where the file states it of others alone.
    `unread` names what else the file states about it and no reader takes; `fault` states why its values cannot be used.
    """

    name: str
    values: np.ndarray
    unit: str | None = None
    aliases: tuple[str, ...] = ()
    time: np.ndarray | None = None
    begin: float = 0.0
    unread: tuple[str, ...] = ()
    fault: str = ""


@dataclass(frozen=True)
class Header:
    """Header that rotorsim wrote with a record."""

    attrs: dict[str, Any] = field(default_factory=dict)
    variables: dict[str, dict[str, Any]] = field(default_factory=dict)
    samples: int = 0
    probes: dict[str, list[Any]] = field(default_factory=dict)
    """Names and coordinates of the probes, as `schema.make_record` takes them."""


@dataclass(frozen=True)
class DataTable:
    """Columns of a file, what else is in it (name and reason why it is no column) and the file's clock [s]."""

    format: str
    columns: tuple[Column, ...]
    others: dict[str, str] = field(default_factory=dict)
    time: np.ndarray | None = None
    header: Header | None = None
    notes: tuple[str, ...] = ()
    """Sentences about how the file was read, and about its statements that no reader takes."""
    rate: float | None = None
    """Sampling rate [Hz] that the file states and that no column of times shows."""

    @property
    def clocked(self) -> bool:
        """Whether the file brings the times of its samples."""
        return self.time is not None or any(column.time is not None for column in self.columns)

    def find(self, wanted: str | int) -> Column:
        """The column of a name or of a number from 1; raises ReadError if there is none, more than one, or a fault."""
        column = self._find(wanted)
        if column.fault:
            raise ReadError(column.fault)
        return column

    def _find(self, wanted: str | int) -> Column:
        if isinstance(wanted, int):
            if not 1 <= wanted <= len(self.columns):
                raise ReadError(f"no column {wanted}; the file has columns 1 to {len(self.columns)}")
            return self.columns[wanted - 1]
        found = [c for c in self.columns if wanted in (c.name, f"{c.name} [{c.unit}]", f"{c.name} ({c.unit})")]
        found = found or [c for c in self.columns if wanted in c.aliases]
        if len(found) > 1:
            raise ReadError(f"column {quote(wanted)} is there {len(found)} times; give the column's number instead")
        if not found and wanted in self.others:
            raise ReadError(f"{quote(wanted)} {self.others[wanted]}")
        if not found:
            raise ReadError(f"no column {quote(wanted)}; the file has {listing(c.name for c in self.columns)}")
        return found[0]

    def has(self, wanted: str | int) -> bool:
        """Whether `find` gives a column."""
        try:
            self.find(wanted)
        except ReadError:
            return False
        return True


def not_read(names: Sequence[str]) -> tuple[str, ...]:
    """A note about properties of a file that no reader takes; none where there are none."""
    return (f"{listing(names)} of the file: not read",) if names else ()


def split_name(text: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as 'X probe [um]'; what stands in round brackets counts if it is a known unit."""
    text = text.strip()
    over = _OVER.fullmatch(text) if len(text) <= MAX_NAME and not is_written_unit(text) else None
    if over and over[2] != "rev" and is_written_unit(over[2]):
        return over[1].strip() or text, over[2]
    match = _NAME.fullmatch(text) if len(text) <= MAX_NAME else None
    if not match or not match[1].strip() or (match[3] is not None and not is_written_unit(match[3])):
        return text, None
    return match[1].strip(), (match[2] or match[3] or "").strip() or None


def parse_header(text: str) -> Header:
    """Header from its JSON text; raises ReadError if it is none."""
    try:
        found = parse_json(text)
        header = Header(found["attrs"], found["variables"], found["samples"], found.get("probes", {}))
    except (ValueError, KeyError, TypeError) as error:
        raise ReadError("the header of the record is damaged; take the original file") from error
    good = isinstance(header.attrs, dict) and isinstance(header.variables, dict) and isinstance(header.samples, int)
    good = good and isinstance(header.probes, dict) and all(isinstance(v, list) for v in header.probes.values())
    if not good or not all(isinstance(attrs, dict) for attrs in header.variables.values()):
        raise ReadError("the header of the record is damaged; take the original file")
    return header


STUCK = 5
"""Samples of a run at the extreme of a clipped channel."""
SHARE = 0.005
"""Share of the record that such runs make up."""
LONGER = 4.0
"""Time at the extreme as a multiple of the time at the value next to it."""
FEWEST = 100
"""Samples of a column from which few different values show that it is dead."""
VALUES = 3
"""Most different values of a dead column."""


def dead(values: np.ndarray) -> str:
    """Reason why a sensor's column (n,) shows nothing; empty if it moves."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "all NaN or infinite"
    low, high = float(finite.min()), float(finite.max())
    if low == high and finite.size > 1:
        return f"constant at {low:.6g}"
    # a disconnected input flickers between two or three neighbouring codes of the converter
    if finite.size >= FEWEST and np.unique(finite[:: max(1, finite.size // 100_000)]).size <= VALUES:
        return f"never leaves {VALUES} values from {low:.6g} to {high:.6g}"
    return ""


ROUNDING = 1e-12
"""Range of a column over its largest number that is rounding."""


def clipped(values: np.ndarray) -> tuple[tuple[float, float], ...]:
    """Limits at which a sensor's column (n,) rests, each with the share of the samples there; empty if at none."""
    finite = values[np.isfinite(values)]
    if finite.size < 2 or not moves(finite):
        return ()
    found = []
    low, high = float(finite.min()), float(finite.max())
    for at, inner in ((low, finite[finite > low].min()), (high, finite[finite < high].max())):
        share = _resting(values, at)
        if share and np.count_nonzero(finite == at) >= LONGER * np.count_nonzero(finite == inner):
            found.append((at, share))
    return tuple(found)


def moves(values: np.ndarray) -> bool:
    """Whether finite numbers (n,) differ by more than rounding."""
    return bool(np.ptp(values) > ROUNDING * np.abs(values).max())


def _resting(values: np.ndarray, at: float) -> float:
    """Share of the samples in runs of STUCK or more at a value; 0 below SHARE."""
    edges = np.diff(np.concatenate(([0], (values == at).astype(np.int8), [0])))
    lengths = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
    resting = int(lengths[lengths >= STUCK].sum())
    return resting / values.size if resting >= max(STUCK, SHARE * values.size) else 0.0


KINDS = ("m", "V", "rad/s", "rad", "Pa", "N", "s", "kg/s", "Hz", "m/s", "m/s^2", "kg*m", "1")
"""SI units of recorded quantities, and of trial weights."""
FACTORS = {
    si: {unit: float(factor) for unit, factor in (TABLE[si].factors | TABLE[si].recorded).items()} for si in KINDS
}
"""Factors to the SI unit by unit and SI unit."""
PEAK = {"pp": 0.5, "p-p": 0.5, "pk-pk": 0.5, "pkpk": 0.5, "pk": 1.0, "0-pk": 1.0, "0-p": 1.0, "rms": sqrt(2.0)}
"""Suffixes of an amplitude's unit, with their factors to 0-pk; rms is that of a sine."""
FULL_SCALE = "FS"
"""Unit of a column in shares of a recorder's full scale, which a mapping must state."""
_NAMES = {si: TABLE[si].name for si in KINDS} | {"Pa": "gauge pressure", "Hz": "sample rate"}
_TEXT = re.compile(rf"\s*({NUMBER})\s*(\S.*?)?\s*", re.ASCII)
_POWER = re.compile(r"(?<=[A-Za-z])(-?[1-3])(?=$|[*/) ])")
"""Power behind a unit without its sign: m/s2, min-1."""


def factor(unit: str, si: str) -> float:
    """Factor from `unit` to the SI unit of a variable; raises ReadError for an unknown or wrong unit."""
    known = FACTORS[si]
    plain = _spelled(unit, si)
    if plain.partition(" ")[2].strip() in PEAK:
        raise ReadError(
            f"unit {quote(unit)}: peak-to-peak, pk and rms units are for the amplitudes of run-up vectors; "
            "write the unit alone, e.g. 'um'"
        )
    if plain not in known:
        raise ReadError(
            f"unit {quote(unit)} is not a known unit of {_NAMES[si]}; write one of {', '.join(filter(None, known))}",
            argument="unit",
            value=unit,
        )
    return known[plain]


def amplitude_factor(unit: str) -> float:
    """Factor from the unit of an amplitude, such as 'um' or 'mil pp', to m 0-pk."""
    length, _, peak = _plain(unit).partition(" ")
    if peak and peak.strip() not in PEAK:
        raise ReadError(f"unit {quote(unit)}: {quote(peak)} is unknown; write pp, pk or rms after the length")
    return factor(length, "m") * (PEAK[peak.strip()] if peak else 1.0)


def quantity(value: Any, si: str) -> float:
    """SI value of text such as '0.3 MPa'; raises ReadError for a number without unit or an unknown unit."""
    match = _TEXT.fullmatch(value) if isinstance(value, str) else None
    if not match or not match[2]:
        example = "45 deg" if si == "rad" else f"1 {next(iter(FACTORS[si]))}"
        noun = f"{'an' if _NAMES[si][0] in 'aeio' else 'a'} {_NAMES[si]}"
        raise ReadError(f"{quote(value)} is not {noun} with its unit; write e.g. '{example}'")
    number = float(match[1]) * factor(match[2], si)
    if not isfinite(number):
        raise ReadError(f"{quote(value)} is too large a number; write a smaller one")
    return number


@contextmanager
def named(path: str) -> Iterator[None]:
    """Context of an entry of a mapping: a ReadError in it begins with the entry's path."""
    try:
        yield
    except ReadError as error:
        raise ReadError(f"{path}: {error}") from error


def quantity_at(path: str, value: Any, si: str) -> float:
    """`quantity` of an entry of a mapping; raises ReadError that begins with its path."""
    with named(path):
        return quantity(value, si)


def amplitude_at(path: str, value: Any) -> float:
    """Amplitude [m, 0-pk] of an entry such as '8 um pp'; raises ReadError that begins with its path."""
    match = _TEXT.fullmatch(value) if isinstance(value, str) else None
    with named(path):
        if not match or not match[2]:
            raise ReadError(f"{quote(value)} is not an amplitude with its unit; write e.g. '8 um pp'")
        return float(match[1]) * amplitude_factor(match[2])


def full_scale(value: Any) -> tuple[float, str]:
    """Number and unit of a full scale such as '10 V'; raises ReadError for anything else."""
    match = _TEXT.fullmatch(value) if isinstance(value, str) else None
    if not match or not match[2] or not is_unit(match[2]) or not 0 < float(match[1]) < inf:
        raise ReadError(f"{quote(value)} is not a full scale with its unit; write e.g. '10 V'")
    return float(match[1]), match[2]


def measured_by(value: Any, raw: str) -> str:
    """SI unit of what a sensitivity such as '100 mV/g' leads to from a column in unit `raw`: m, m/s or m/s^2."""
    for si in ("m", "m/s", "m/s^2"):
        try:
            sensitivity(value, raw, si)
        except ReadError:
            continue
        return si
    sensitivity(value, raw, "m")  # raises the sentence
    raise ReadError(f"{quote(value)} is not a sensitivity; write e.g. '8 V/mm'")


def sensitivity(value: Any, raw: str, si: str) -> float:
    """Factor from a column in unit `raw` to `si`, from text such as '8 V/mm' (column per quantity) or '125 um/V'."""
    match = _TEXT.fullmatch(value) if isinstance(value, str) else None
    over, slash, under = match[2].partition("/") if match and match[2] else ("", "", "")
    number = float(match[1]) if match else 0.0
    over, under = over.strip("() "), under.strip("() ")
    if not slash or not isfinite(number) or number == 0:
        raise ReadError(f"{quote(value)} is not a sensitivity; write e.g. '8 V/mm' or '125 um/V'")
    column = next((one for one in FACTORS if is_unit_of(raw, one)), "")
    if not column:
        raise ReadError(f"unit {quote(raw)} is unknown; write e.g. 'V'")
    kind = FACTORS[column]
    if column == si:
        raise ReadError(f"{quote(value)}: the column is in {quote(raw)} already, a {_NAMES[si]}; write 'scale' instead")
    if is_unit_of(over, column):
        return factor(raw, column) / (number * kind[_spelled(over, column)]) * factor(under, si)
    if is_unit_of(under, column):
        return factor(raw, column) * number / kind[_spelled(under, column)] * factor(over, si)
    raise ReadError(f"{quote(value)}: neither side is a unit of the column's {quote(raw)}; write e.g. '8 V/mm'")


def is_unit_of(text: str, si: str) -> bool:
    """Whether a text is a unit of the quantity with this SI unit."""
    return _spelled(text, si) in FACTORS[si]


def is_unit(text: str) -> bool:
    """Whether a text is a unit known here, of whatever quantity."""
    return any(is_unit_of(text, si) for si in KINDS) or _plain(text).partition(" ")[2].strip() in PEAK


def is_written_unit(text: str) -> bool:
    """Whether a text is a unit that files write, known here or of a quantity that is no channel."""
    return is_unit(text) or text in OTHER_UNITS


def agree(unit: str, stated: str) -> bool:
    """Whether a unit is the one that the file states, in other words or more exactly ('um pp' for 'um')."""
    same = any(
        is_unit_of(unit, si) and is_unit_of(stated, si) and factor(unit, si) == factor(stated, si) for si in KINDS
    )
    return same or _plain(unit) == _plain(stated) or _plain(unit).startswith(f"{_plain(stated)} ")


def _plain(unit: str) -> str:
    """A unit in the characters of the table."""
    for character, plain in CHARACTERS.items():
        unit = unit.replace(character, plain)
    return _POWER.sub(r"^\1", " ".join(unit.split()))


def _spelled(unit: str, si: str) -> str:
    """A unit as the table of a quantity spells it; as it is where that has none of its spellings."""
    plain = _plain(unit)
    if plain in FACTORS[si]:
        return plain
    tight = plain.replace(" ", "*")
    words = SPELLINGS.get(si, {})
    found = (words.get(one) for one in (plain, tight, plain.lower(), tight.lower()))
    return next(filter(None, found), tight if tight in FACTORS[si] else plain)
