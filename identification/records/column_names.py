"""Automatic mapping of columns with schema names, such as `disc_measured_x [um]` or `amplitude_1X_y`.

A name of the schema without a unit stands for the schema's own unit. Other columns are left alone.
"""

from __future__ import annotations

import re
from collections import Counter

from identification.errors import ReadError
from identification.records.mapping import ColumnEntry, Mapping
from identification.records.schema import AXES, VARIABLES, VECTORS
from identification.records.table import Column, DataTable
from rotorsim.base.display import closest, listing

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
    entries = {key: _entry(column, table) for column in table.columns if (key := meaning(column.name))}
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
    return closest(text, names) or ("" if stem in {"", *VARIABLES.keys() - plain} else closest(stem, plain))


def schema_unit(key: tuple[str, str, str]) -> str:
    """SI unit of what a column means."""
    known = VECTORS.get(key[0]) or VARIABLES.get(key[0])
    return known.units if known else "s"


def _entry(column: Column, table: DataTable) -> ColumnEntry:
    key = meaning(column.name)
    assert key is not None
    unit = column.unit if column.unit is not None else schema_unit(key)
    if key[0] == "probe_measured" and table.header and key[1] in table.header.probes.get("probe", ()):
        unit = table.header.probes["probe_unit"][table.header.probes["probe"].index(key[1])]
    # the number, so that a name which another column has as its alias stays clear
    return ColumnEntry(column.name, table.columns.index(column) + 1, unit)
