"""Units of recorded data and their conversion factors to the units of the schema.

Spelling counts, so that mPa and MPa stay apart; further spellings of laboratories (Volts, m/s2, G) stand in `SPELLINGS`
of `rotorsim.base.units`. Pressures are gauge, here as everywhere; an absolute pressure is not a unit but another
quantity. `Hz` of a shaft speed is revolutions per second.
"""

from __future__ import annotations

import re
from math import inf, isfinite, sqrt
from typing import Any

from identification.errors import ReadError
from rotorsim.base.display import quote
from rotorsim.base.units import CHARACTERS, NUMBER, SPELLINGS, TABLE

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


def _article(noun: str) -> str:
    return f"{'an' if noun[0] in 'aeio' else 'a'} {noun}"


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
            f"unit {quote(unit)} is not a known unit of {_NAMES[si]}; write one of {', '.join(filter(None, known))}"
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
        raise ReadError(f"{quote(value)} is not {_article(_NAMES[si])} with its unit; write e.g. '{example}'")
    number = float(match[1]) * factor(match[2], si)
    if not isfinite(number):
        raise ReadError(f"{quote(value)} is too large a number; write a smaller one")
    return number


def quantity_at(path: str, value: Any, si: str) -> float:
    """`quantity` of an entry of a mapping; raises ReadError that begins with its path."""
    try:
        return quantity(value, si)
    except ReadError as error:
        raise ReadError(f"{path}: {error}") from error


def amplitude_at(path: str, value: Any) -> float:
    """Amplitude [m, 0-pk] of an entry such as '8 um pp'; raises ReadError that begins with its path."""
    match = _TEXT.fullmatch(value) if isinstance(value, str) else None
    if not match or not match[2]:
        raise ReadError(f"{path}: {quote(value)} is not an amplitude with its unit; write e.g. '8 um pp'")
    try:
        return float(match[1]) * amplitude_factor(match[2])
    except ReadError as error:
        raise ReadError(f"{path}: {error}") from error


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
    column, kind = _dimension(raw)
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


def _dimension(unit: str) -> tuple[str, dict[str, float]]:
    for si, kind in FACTORS.items():
        if is_unit_of(unit, si):
            return si, kind
    raise ReadError(f"unit {quote(unit)} is unknown; write e.g. 'V'")
