"""Mappings that nobody wrote: columns with the schema's names, a template to fill in, a proposal with guesses.

A column named like the schema, such as `disc_measured_x [um]` or `amplitude_1X_y`, is recognised; without a unit it is
in the schema's own. Other columns are left alone. A proposal guesses columns and units from names, stated units and
values, and marks each guess. It is read before it is used: the text notes where each unit comes from, and columns that
are not known stand as comments.
"""

import json
import re
import tomllib
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from identification.records.column_meaning import GAP, ColumnGuess, guess_columns, schema_unit
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


PAIRS = ("reference", "disc_force")
"""Kinds that need both axes."""
LABELLED = ("pin", "pin_measured", "journal", "disc", "film_force", "probe_measured", "reference_external")
"""Kinds that only the schema's names give, with an axis, a number or a name."""


def propose(table: DataTable, file: str) -> tuple[str, int]:
    """TOML text of a mapping for a file's columns, and the number of columns without a complete entry there.

    Examples
    --------
    >>> import rotorsim as rs
    >>> text, incomplete = rs.identification.propose(rs.identification.columns("run.csv"), "run.csv")
    """
    guesses = guess_columns(table, meaning)
    known = [guess for guess in guesses if guess.kind]
    vectors = all(any(g.kind == kind for g in known) for kind in VECTORS)
    known = [g for g in known if vectors or g.kind not in VECTORS]
    parts = [f"# Proposed for {_safe(file)} from names, units and values; check every line before use.\n"]
    if not table.clocked and not vectors and not any(g.kind == "time" for g in known):
        if table.rate:
            parts.append(f'[time]\nsample_rate = "{table.rate:.9g} Hz"    # from the file\n')
        else:
            why = "".join(f"# {_safe(note)}\n" for note in table.notes)
            parts.append('# No time was found: [time] with column = "..." and unit = "s", or with\n'
                         f'# sample_rate = "5 kHz"\n{why}')  # fmt: skip
    parts += _vectors(known) if vectors else _series(known)
    numbers = {g.number for g in known}
    unknown = [g for g in guesses if g.number not in numbers]
    parts += [
        f"# not known: column {g.number}, {_quoted(g.column.name)}, "
        + "; ".join(dict.fromkeys(filter(None, (g.column.fault or _range(g.column), g.why))))
        + "\n"
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


def _series(known: Sequence[ColumnGuess]) -> list[str]:
    seen: set[str] = set()
    parts = []
    for g, section in zip(known, _sections(known), strict=True):
        alone = g.kind == "reference" and {"x", "y"} - {o.axis for o in known if o.kind == g.kind}
        why = "the second of its kind:" if section in seen else "the other axis is not known:" if alone else ""
        if g.kind == "disc_force" and not g.axis:
            why = "its direction is not known:"
        if g.kind == "angle" and any(o.kind == "keyphasor" for o in known):
            why = "the keyphasor shows the angle too:"
        seen.add(section)
        text = _entry(section, g)
        parts.append("".join(f"# {line}\n" for line in [why, *text.splitlines()]) if why else text)
    return parts


def _sections(known: Sequence[ColumnGuess]) -> list[str]:
    """Section of the mapping for each guess: probes of one plane make the disc's motion, all others are readings."""
    probes = [g for g in known if g.kind == "probe" and g.label != "schema"]
    planes: dict[str, list[ColumnGuess]] = {}
    for g in probes:
        if _angle_of(g) is not None:
            planes.setdefault(g.label, []).append(g)
    seen = [g for plane in planes.values() for g in plane]
    if len({_angle_of(g) for g in seen}) == len(seen):
        disc = seen  # whatever they are called, no two stand at one angle
    else:
        disc = next((plane for plane in planes.values() if 1 < len(plane) == len({_angle_of(g) for g in plane})), [])
    plain = sorted(g.axis for g in disc) == ["x", "y"] and all(g.angle is None for g in disc)
    found, labels = [], Counter[str]()
    for g in known:
        label = _label(g.column.name)
        labels[label] += 1
        label += f"_{labels[label]}" if labels[label] > 1 else ""
        if g.kind == "probe" and (g in disc or g.label == "schema"):
            found.append(f"channels.disc_measured.{g.axis}" if plain or g.label == "schema" else f"probes.{label}")
        elif g.kind in ("probe", "acceleration", "velocity"):
            found.append(f"channels.probe_measured.{label}")
        elif g.kind == "disc_force" and g.blows:
            found.append("hammer")
        elif g.kind in PAIRS:
            found.append(f"channels.{g.kind}.{g.axis or 'x'}")
        else:
            section = g.kind if g.kind in ("time", "keyphasor") else f"channels.{g.kind}"
            found.append(section + (f".{g.axis}" if g.kind in LABELLED else ""))
    return found


def _angle_of(g: ColumnGuess) -> float | None:
    """Angle [deg] of a probe from x towards y; None where its name does not hold it."""
    return g.angle if g.angle is not None else {"x": 0.0, "y": 90.0}.get(g.axis)


def _entry(section: str, g: ColumnGuess) -> str:
    column = _quoted(g.column.name) if g.alone else str(g.number)
    lines = [f"[{section}]", f"column = {column}    # {_range(g.column)}", _unit_line(g)]
    angled, volts = section.startswith("probes."), is_unit_of(g.unit, "V")
    if g.edge and g.kind == "keyphasor":
        lines.append(f'edge = "{g.edge}"    # from the values')
        lines += [f"pulses = {g.pulses}    # of a turn, from the values"] if g.pulses > 1 else []
    if g.kind == "probe" and volts:
        mean = float(np.nanmean(g.column.values)) if np.isfinite(g.column.values).any() else 0.0
        lines.append('sensitivity = "200 mV/mil"    # guessed: the usual 7.87 V/mm; take that of the calibration')
        if angled and mean < -GAP[0]:
            lines += ['coupling = "DC"', f'gap = "{mean:.4g} V"    # the mean of this record; take that at rest']
    if g.kind in ("acceleration", "velocity") and volts:
        of = {"acceleration": "100 mV/g", "velocity": "4 mV/(mm/s)"}[g.kind]
        lines.append(f'sensitivity = "{of}"    # guessed; take that of the calibration')
    if angled:
        where = "from the name, seen from the driver" if g.angle is not None else "guessed from the axis"
        lines.append(f'angle = "{_angle_of(g):g} deg"    # {where}; from x towards y')
    elif section.startswith("channels.probe_measured.") and g.kind == "probe":
        known = _angle_of(g)
        lines.append(
            f"# of another plane: with its position it may be [probes.{section.rpartition('.')[2]}], "
            f'angle = "{known:g} deg"'
            if known is not None
            else f'# not known: with its angle it may be [probes.{section.rpartition(".")[2]}], e.g. angle = "45 deg"'
        )
    if section == "hammer":
        angle = {"x": '"0 deg"', "y": '"90 deg"'}.get(g.axis, '"?"')
        lines.append(
            f'angle = {angle}    # {len(g.blows)} blows; from x towards y; position = "..." if not at the disc'
        )
    return "\n".join(lines) + "\n"


def _vectors(known: Sequence[ColumnGuess]) -> list[str]:
    parts = [_entry("speed", g) for g in known if g.kind == "speed"][:1]
    parts = parts or ['# No speed was found: [speed] with column = "..." and unit = "rpm"\n']
    for order, axis in sorted({(g.order or 1, g.axis or "x") for g in known if g.kind in ("amplitude", "phase")}):
        lines = [f"[vectors.{order}X.{axis}]"]
        for kind in ("amplitude", "phase"):
            own = [g for g in known if g.kind == kind and (g.order or 1, g.axis or "x") == (order, axis)]
            note = "0-pk unless 'pp' or 'rms' stands there" if kind == "amplitude" else "a lag, else add sign = -1"
            for i, g in enumerate(own):
                unit = f", unit = {_quoted(g.unit)}" if g.unit else ""
                start = f"{'# the second: ' if i else ''}{kind} = {{ column = {_quoted(g.column.name)}{unit} }}"
                lines.append(f"{start}    # unit {f'from {g.source}' if unit else 'not stated'}; {note}")
            lines += [] if own else [f"# no {kind} was found for it"]
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
