"""Mappings that nobody wrote: columns with the schema's names, a template to fill in, a proposal with guesses.

A column named like the schema, such as `disc_measured_x [um]` or `amplitude_1X_y`, is recognised; without a unit it is
in the schema's own. Other columns are left alone. A proposal guesses columns and units from names, stated units and
values, and marks each guess. It is read before it is used: the text notes where each unit comes from, and columns that
are not known stand as comments.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.records.columns import FACTORS, Column, DataTable, is_unit_of
from identification.records.mapping import ColumnEntry, Mapping
from identification.records.schema import AXES, VARIABLES, VECTORS
from rotorsim.base.display import closest, listing
from rotorsim.base.errors import ReadError

_VECTOR = re.compile(rf"({'|'.join(VECTORS)})_([1-9]\d{{0,2}})X_({'|'.join(AXES)})", re.ASCII)
_PROBE = re.compile(r"(probe_measured)_([A-Za-z]\w{0,39})", re.ASCII)
_NUMBER = re.compile(r"\d{1,4}$", re.ASCII)
_LETTER = re.compile(r"_([a-z])$", re.ASCII)
_PIN = re.compile(r"[1-9]\d{0,3}", re.ASCII)


def recognise(table: DataTable) -> Mapping:
    """Mapping of the columns that are named like the schema; raises ReadError if a name is there twice or none is."""
    names = Counter(key for column in table.columns if (key := meaning(column.name)))
    twice = [" ".join(filter(None, map(str, key))) for key, count in names.items() if count > 1]
    if twice:
        raise ReadError(f"columns {listing(twice)} are there more than once; rename them or choose one in a mapping")
    for name, reason in table.others.items():
        if meaning(name) or name in VARIABLES:
            raise ReadError(f"{name!r} {reason}")
    entries = {key: _recognised(column, table) for column in table.columns if (key := meaning(column.name))}
    vectors = {(n, int(order), axis): entries[n, order, axis] for n, order, axis in entries if n in VECTORS}
    if vectors:
        speed = entries.get(("speed", "", ""))
        if not speed:
            raise ReadError("columns of run-up vectors, but none named 'speed'; rename it or give a mapping")
        return Mapping(speed=speed, vectors=vectors)
    channels = {(name, label): entries[name, label, axis] for name, label, axis in entries if name != "time"}
    if not channels:
        columns = listing(column.name for column in table.columns)
        meant = next(filter(None, (likely(column.name) for column in table.columns)), "")
        hint = f"did you mean '{meant}'? Else " if meant else ""
        raise ReadError(
            f"no column is named like a channel ({columns}); {hint}give a mapping, "
            "'rotorsim data check FILE --propose mapping.toml' proposes one"
        )
    return Mapping(time=entries.get(("time", "", "")), channels=channels)


def meaning(name: str) -> tuple[str, str, str] | None:
    """(variable, label, '') or (quantity, order, axis) of a column's name; None if it means nothing."""
    if match := _VECTOR.fullmatch(name):
        return match[1], match[2], match[3]
    if name == "time" or (name in VARIABLES and not VARIABLES[name].dims):
        return name, "", ""
    if match := _PROBE.fullmatch(name):
        return match[1], match[2], ""
    variable, _, label = name.rpartition("_")
    dims = VARIABLES[variable].dims if variable in VARIABLES else ()
    if (dims == ("axis",) and label in AXES) or (dims == ("injector",) and _PIN.fullmatch(label)):
        return variable, label, ""
    return None


def likely(name: str) -> str:
    """The schema's name that a column's is probably meant to be; empty where it is none of them.

    A number at its end is that of an injector, and an axis at its end stays.
    """
    if meaning(name):
        return ""
    text = name.strip().lower()
    number, letter = _NUMBER.search(text), _LETTER.search(text)
    labels: dict[tuple[str, ...], tuple[str, ...]]
    if number:
        labels = {("injector",): (f"_{int(number[0])}",) if int(number[0]) else ()}
    elif letter:
        labels = {("axis",): (f"_{letter[1]}",) if letter[1] in AXES else ()}
    else:
        labels = {(): ("",), ("axis",): tuple(f"_{axis}" for axis in AXES), ("injector",): ("_1",)}
        if text[-1:] in AXES:  # 'pressurex' is none of the numbers, 'disc_measuredy' is one axis
            labels |= {("axis",): (f"_{text[-1]}",), ("injector",): ()}
    names = [variable + label for variable, known in VARIABLES.items() for label in labels.get(known.dims, ())]
    plain = [variable for variable, known in VARIABLES.items() if not known.dims]
    label = number or letter
    stem = text[: label.start()].rstrip("_ ") if label else ""  # 'speed_1', 'pressure_a'
    return closest(text, names if stem in {"", *VARIABLES.keys() - plain} else [*names, *plain])


def schema_unit(key: tuple[str, str, str]) -> str:
    """SI unit of what a column means."""
    known = VECTORS.get(key[0]) or VARIABLES.get(key[0])
    return known.units if known else "s"


def _recognised(column: Column, table: DataTable) -> ColumnEntry:
    key = meaning(column.name)
    assert key is not None
    unit = column.unit if column.unit is not None else schema_unit(key)
    if key[0] == "probe_measured" and table.header and key[1] in table.header.probes.get("probe", ()):
        unit = table.header.probes["probe_unit"][table.header.probes["probe"].index(key[1])]
    # the number, so that a name which another column has as its alias stays clear
    return ColumnEntry(column.name, table.columns.index(column) + 1, unit)


_HELP = """\
# Mapping for {file}: take away the '#' of a section, write the channel's name, check column and unit.
# Channels over x and y: {axis}; pin.1, pin.2 ..., pin_measured.1 ...
# Others: {plain}
# Run-up vectors: [speed] and [vectors.1X.x] with amplitude (unit e.g. 'um pp') and phase (a LAG; sign = -1 for a lead).
# An entry may also have: sensitivity = "8 V/mm", scale = 2.0, sign = -1, offset = "0.1 mm".
"""


def mapping_template(table: DataTable, file: str) -> str:
    """TOML text that `identification.records.mapping` reads once it is filled in; `file` is the name shown.

    Examples
    --------
    >>> import rotorsim as rs
    >>> "column" in rs.identification.mapping_template(rs.identification.columns("run.csv"), "run.csv")
    True
    """
    axis = ", ".join(f"{name}.x" for name, variable in VARIABLES.items() if variable.dims == ("axis",))
    plain = ", ".join(name for name, variable in VARIABLES.items() if not variable.dims)
    safe = "".join(c if c.isprintable() else "?" for c in file)
    parts = [_HELP.format(file=safe, axis=axis, plain=plain), *_clock(table)]
    taken: set[tuple[str, str, str]] = set()
    for number, column in enumerate(table.columns, 1):
        if column.fault:
            parts.append(f"# not usable: column {number}, {column.fault}\n")
            continue
        key = meaning(column.name)
        fresh = key is not None and key not in taken and key[0] not in VECTORS
        parts.append(_known_entry(column, key) if key and fresh else _unknown_entry(column, number, table))
        taken |= {key} if key else set()
    parts += [f"# not usable: {_quoted(name)} {reason}\n" for name, reason in table.others.items()]
    return "\n".join([*parts, '# [constants]\n# pressure = "0.3 MPa"\n'])


def _clock(table: DataTable) -> list[str]:
    if table.clocked:
        return ["# The file has its own clock; no [time] is needed.\n"]
    if any(column.name == "time" for column in table.columns):
        return []
    return ['# [time]\n# column = "..."\n# unit = "s"\n# or, without such a column: sample_rate = "5 kHz"\n']


def _known_entry(column: Column, key: tuple[str, str, str]) -> str:
    section = "time" if key[0] == "time" else ".".join(filter(None, ("channels", *key)))
    unit = column.unit if column.unit is not None else schema_unit(key)
    return f"# {_count_and_extent(column)}\n[{section}]\ncolumn = {_quoted(column.name)}\nunit = {_quoted(unit)}\n"


def _unknown_entry(column: Column, number: int, table: DataTable) -> str:
    unit = f"unit = {_quoted(column.unit)}" if column.unit is not None else 'unit = "?"'
    clear = sum(other.name == column.name for other in table.columns) == 1
    name = f"column = {_quoted(column.name) if clear else number}"
    return f"# column {number}: {_count_and_extent(column)}\n# [channels.NAME.x]\n# {name}\n# {unit}\n"


def _count_and_extent(column: Column) -> str:
    finite = column.values[np.isfinite(column.values)]
    if not finite.size:
        return f"{column.values.size} values, none of them finite"
    return f"{column.values.size} values from {finite.min():.6g} to {finite.max():.6g}"


def _quoted(text: str) -> str:
    """A TOML string; JSON's escapes are TOML's, but for DEL and for what stands outside the first plane."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


KINDS: tuple[tuple[str, str, str], ...] = (
    ("time", r"^(t|time|zeit|seconds?|x axis( value)?)( (s|sec|ms|us|min))?$", "s"),
    ("keyphasor", r"key ?ph|phasor|\bkey\b|tach|trig|pulse|once per", "V"),
    ("phase", r"\b\d ?x\b.*(phase|phas|lag|deg)|^phase\b", "rad"),
    ("amplitude", r"\b\d ?x\b.*(amp|ampl|mag)|^(amp|amplitude)\b", "m"),
    ("speed", r"\bk?rpm\b|speed|drehzahl|\bomega\b|^n( hz)?$", "rad/s"),
    ("pressure", r"press|druck|supply|^p( (k|m)?pa| m?bar| psi)?$", "Pa"),
    ("disc_force", r"force|hammer|kraft|\bf ?[xy]\b", "N"),
    ("acceleration", r"acc|\ba ?[xyz]\b", "m/s^2"),
    ("velocity", r"\bvel", "m/s"),
    ("reference", r"\bref|drive|command|excit|\bu ?[12xy]\b|piezo", "V"),
    ("probe", r"probe|prox|disp|weg|orbit|shaft|disc|\b[xy]\b|\d+ ?(l|r|left|right)\b|y axis value", "m"),
)
"""Kind of a column, pattern of its name in plain words, SI unit of its quantity; the first that fits counts."""
_AXIS = re.compile(r"(?:^|[ \d])([xy])(?:[ \d]|$)")
_ANGLE = re.compile(r"(\d{1,3}) ?(?:deg)? ?(left|right|l|r)?\b")
_CAPITAL = re.compile(r"(?<=[a-z])(?!(?<=\b[kmu])(?:V|Hz|Pa|N)\b)(?=[A-Z])")
"""Places where a word begins with a capital letter; the units mV, kHz, kPa and the like stay whole."""
_PREFIXED = re.compile(r"(?:(?<![a-z])[ku]|m)(?:V|Hz|Pa|N)$")
_ORDER = re.compile(r"\b(\d) ?x\b")
_GUESSES: dict[str, tuple[tuple[float, str], ...]] = {
    "s": ((0.05, "s"), (50.0, "ms"), (np.inf, "us")),
    "rad/s": ((200.0, "Hz"), (np.inf, "rpm")),
    "Pa": ((3.0, "MPa"), (20.0, "bar"), (500.0, "psi"), (np.inf, "Pa")),
    "rad": ((6.5, "rad"), (np.inf, "deg")),
    "m": ((1e-4, "m"), (0.5, "mil"), (np.inf, "um")),
    "m/s": ((np.inf, "mm/s"),),
    "m/s^2": ((np.inf, "m/s^2"),),
}
"""Unit to guess by the largest absolute value, up to each limit; of a time by its step."""
PAIRS = ("reference", "disc_force")
"""Kinds that need both axes."""
LABELLED = ("pin", "pin_measured", "journal", "disc", "film_force", "probe_measured", "reference_external")
"""Kinds that only the schema's names give, with an axis, a number or a name."""
GAP = (3.0, 22.0)
"""Mean [V] below 0 of a proximity probe."""


@dataclass(frozen=True)
class ColumnGuess:
    """Probable meaning of a column: kind, axis, order, angle [deg], unit, and where the unit comes from."""

    column: Column
    number: int
    kind: str
    axis: str = ""
    order: int = 0
    angle: float | None = None
    unit: str = ""
    source: str = ""


def propose(table: DataTable, file: str) -> tuple[str, int]:
    """TOML text of a mapping for a file's columns, and the number of columns without a complete entry there.

    Examples
    --------
    >>> import rotorsim as rs
    >>> text, incomplete = rs.identification.propose(rs.identification.columns("run.csv"), "run.csv")
    """
    guesses = [_guess(column, number) for number, column in enumerate(table.columns, 1)]
    known = [guess for guess in guesses if guess.kind]
    vectors = any(g.kind in ("amplitude", "phase") for g in known)
    parts = [f"# Proposed for {_safe(file)} from names, units and values; check every line before use.\n"]
    if not table.clocked and not vectors and not any(g.kind == "time" for g in known):
        parts.append('# No time was found: [time] with column = "..." and unit = "s", or with\n'
                     '# sample_rate = "5 kHz"\n')  # fmt: skip
    parts += _vectors(known) if vectors else _series(known)
    unknown = [g for g in guesses if not g.kind]
    parts += [
        f"# not known: column {g.number}, {_quoted(g.column.name)}, {g.column.fault or _range(g.column)}\n"
        for g in unknown
    ]
    if not vectors:
        parts += _missing({g.kind for g in known})
    text = "\n".join(parts)
    return text, len(guesses) - sum(_complete(tomllib.loads(text)))


def _complete(tables: dict[str, Any], angled: bool = False) -> Iterator[bool]:
    """Whether each entry of a column states a unit and, for a probe at some angle, the angle."""
    for name, table in tables.items():
        if isinstance(table, dict) and "column" in table:
            yield "unit" in table and ("angle" in table or not angled)
        elif isinstance(table, dict):
            yield from _complete(table, name == "probes")


def _guess(column: Column, number: int) -> ColumnGuess:
    if column.fault:
        return ColumnGuess(column, number, "")
    words = " ".join(_CAPITAL.sub(" ", re.sub(r"[_-]", " ", column.name)).lower().split())
    if key := meaning(column.name):
        unit, source = (column.unit, "the file") if column.unit else (schema_unit(key), "the schema's name")
        kind = {"disc_measured": "probe", "time": "time"}.get(key[0], key[0])
        own = int(key[1]) if kind in ("amplitude", "phase") else 0
        return ColumnGuess(column, number, kind, key[2] or key[1], own, None, unit, source)
    kind, si = next(((kind, si) for kind, pattern, si in KINDS if re.search(pattern, words)), ("", ""))
    if not kind:
        return ColumnGuess(column, number, "")
    axis, order = _AXIS.search(words), _ORDER.search(words)
    unit, source = _unit(column, words, si, kind)
    angle = None
    if kind == "probe" and (found := _ANGLE.search(words)) and (found[2] or "deg" in words):
        # 45 deg right of the top, seen from the driver, is 45 deg from x towards y; 45 deg left is 135 deg
        angle = float(found[1]) if not found[2] else 90.0 + float(found[1]) * (1 if found[2][0] == "l" else -1)
    letter = axis[1] if axis else {"1": "x", "2": "y"}.get(words[-1], "") if kind in PAIRS else ""
    return ColumnGuess(column, number, kind, letter, int(order[1]) if order else 0, angle, unit, source)


def _unit(column: Column, words: str, si: str, kind: str) -> tuple[str, str]:
    """Unit of a column, and where it is from."""
    if column.unit:
        return column.unit, "the file"
    if named := _named_unit(column.name, words, si):
        return named, "the name"
    finite = column.values[np.isfinite(column.values)]
    mean = float(np.mean(finite)) if finite.size else 0.0
    if kind == "probe" and -GAP[1] < mean < -GAP[0]:
        return "V", "the values, as a gap voltage"
    largest = float(np.abs(finite).max(initial=0.0))
    if kind == "time" and finite.size > 1:
        largest = float(np.median(np.abs(np.diff(finite))))
    guess = next((unit for limit, unit in _GUESSES.get(si, ()) if largest <= limit), si)
    return guess, "the values"


def _named_unit(name: str, words: str, si: str) -> str:
    """Unit that ends a column's name without brackets, as in 'time ms' and 'speed_rad_s'; empty if there is none."""
    first, *rest = words.split()
    last = rest[-1] if rest else first
    if rest[-2:] == ["rad", "s"]:
        last = "rad/s"
    plain = {"v": "V", "mv": "mV", "hz": "Hz", "khz": "kHz", "pa": "Pa", "kpa": "kPa", "mpa": "MPa"}.get(last, last)
    if prefixed := _PREFIXED.search(name.rstrip()):
        plain = prefixed[0]
    if plain in ("1", "-") or (plain in ("m", "s", "g") and not (rest and name.rstrip().endswith(plain))):
        return ""  # a letter alone, or a capital one, is a name
    return plain if is_unit_of(plain, si) or is_unit_of(plain, "V") else ""


def _series(known: Sequence[ColumnGuess]) -> list[str]:
    probes = [g for g in known if g.kind == "probe"]
    axes = [g.axis for g in probes]
    plain = sorted(axes) == ["x", "y"] and all(g.angle is None for g in probes)
    seen: set[str] = set()
    parts = []
    for g in known:
        if g.kind == "probe":
            section = f"channels.disc_measured.{g.axis}" if plain else f"probes.{_label(g.column.name)}"
        elif g.kind in ("acceleration", "velocity"):
            section = f"channels.probe_measured.{_label(g.column.name)}"
        elif g.kind in PAIRS:
            section = f"channels.{g.kind}.{g.axis or 'x'}"
        else:
            section = g.kind if g.kind in ("time", "keyphasor") else f"channels.{g.kind}"
            section += f".{g.axis}" if g.kind in LABELLED else ""
        text = _entry(section, g, not plain)
        alone = g.kind in PAIRS and {"x", "y"} - {o.axis for o in known if o.kind == g.kind}
        why = "the second of its kind:" if section in seen else "the other axis is not known:" if alone else ""
        seen.add(section)
        parts.append("".join(f"# {line}\n" for line in [why, *text.splitlines()]) if why else text)
    return parts


def _entry(section: str, g: ColumnGuess, angled: bool) -> str:
    lines = [f"[{section}]", f"column = {_quoted(g.column.name)}    # {_range(g.column)}", _unit_line(g)]
    if g.kind == "probe" and is_unit_of(g.unit, "V"):
        mean = float(np.nanmean(g.column.values)) if np.isfinite(g.column.values).any() else 0.0
        lines.append('sensitivity = "200 mV/mil"    # guessed: the usual 7.87 V/mm; take that of the calibration')
        if angled and mean < -GAP[0]:
            lines += ['coupling = "DC"', f'gap = "{mean:.4g} V"    # the mean of this record; take that at rest']
    if g.kind in ("acceleration", "velocity") and is_unit_of(g.unit, "V"):
        of = {"acceleration": "100 mV/g", "velocity": "4 mV/(mm/s)"}[g.kind]
        lines.append(f'sensitivity = "{of}"    # guessed; take that of the calibration')
    if g.kind == "probe" and angled:
        known = g.angle if g.angle is not None else {"x": 0.0, "y": 90.0}.get(g.axis)
        where = "from the name, seen from the driver" if g.angle is not None else "guessed from the axis"
        if known is None:
            lines.append('# angle = "?"    # not known: from x towards y, e.g. "45 deg"')
        else:
            lines.append(f'angle = "{known:g} deg"    # {where}; from x towards y')
    return "\n".join(lines) + "\n"


def _vectors(known: Sequence[ColumnGuess]) -> list[str]:
    parts = [_entry("speed", g, False) for g in known if g.kind == "speed"][:1]
    parts = parts or ['# No speed was found: [speed] with column = "..." and unit = "rpm"\n']
    for order, axis in sorted({(g.order or 1, g.axis or "x") for g in known if g.kind in ("amplitude", "phase")}):
        lines = [f"[vectors.{order}X.{axis}]"]
        for kind in ("amplitude", "phase"):
            own = [g for g in known if g.kind == kind and (g.order or 1, g.axis or "x") == (order, axis)]
            lines += [
                f"{'# the second: ' if i else ''}{kind} = {{ column = {_quoted(g.column.name)}, "
                f"unit = {_quoted(g.unit)} }}"
                f"    # unit from {g.source}" + ("; 0-pk unless 'pp' or 'rms' stands there" if kind == "amplitude" else
                                                 "; a lag, else add sign = -1")
                for i, g in enumerate(own)
            ] or [f"# no {kind} was found for it"]  # fmt: skip
        parts.append("\n".join(lines) + "\n")
    return parts


def _missing(kinds: set[str]) -> list[str]:
    parts = []
    if not kinds & {"keyphasor", "speed", "angle", "angle_measured", "speed_measured"}:
        parts.append('# No speed, angle or keyphasor was found; at constant speed:\n# [constants]\n# speed = "? rpm"\n')
    if not kinds & {"pressure", "pressure_measured"}:
        parts.append('# For gas bearings:\n# [constants]\n# pressure = "? MPa"\n')
    return parts


def _unit_line(g: ColumnGuess) -> str:
    known = any(is_unit_of(g.unit, si) for si in FACTORS)
    return (
        f"unit = {_quoted(g.unit)}    # from {g.source}"
        if known
        else f'# unit = "?"    # {_quoted(g.unit)} is not known'
    )


def _label(name: str) -> str:
    return re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")[:40] or "probe"


def _safe(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)


def _range(column: Column) -> str:
    finite = column.values[np.isfinite(column.values)]
    return f"from {finite.min():.6g} to {finite.max():.6g}" if finite.size else "no finite value"
