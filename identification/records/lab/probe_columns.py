"""Readings of the probes that a mapping names: motion of the disc, other planes, and what dead probes leave."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from identification.errors import ReadError
from identification.records.column_values import one_unit, scale_of, unit_of, values
from identification.records.lab.column_faults import dead
from identification.records.lab.lab_probes import MEAN, LabProbe, coordinates, disc_plane, in_plane
from identification.records.mapping import Entry, Mapping
from identification.records.table import Table
from identification.records.units import factor


@dataclass(frozen=True)
class ProbeColumns:
    """Columns (n,) [m] by variable and label, coordinates of `probe_measured`, and notes."""

    groups: dict[str, dict[str, np.ndarray]]
    coordinates: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    position: float | None = None
    """Plane of the disc's probes [m], where they state it."""


def read_probes(table: Table, mapping: Mapping) -> ProbeColumns:
    """Motion of the disc from the probes of its plane, and `probe_measured` of all others.

    Dead and missing probes are left out and noted; where the rest at the disc's plane does not see both x and y, their
    readings are `probe_measured` too. Raises ReadError where nothing is left.
    """
    probes = {name: probe for name, (_, probe) in mapping.probes.items()}
    entries = {name: entry for name, (entry, _) in mapping.probes.items()}
    plane = disc_plane(probes, mapping.disc)
    left_out = _left_out(table, entries)
    alive = [name for name in probes if name not in left_out]
    if not alive:
        raise ReadError(f"probes: none is left ({'; '.join(left_out.values())}); check the sensors or the mapping")
    one_unit(table, [entries[name] for name in alive])
    readings = {name: _reading(table, entries[name], probes[name]) for name in alive}
    disc = {name: readings[name] for name in plane if name in readings}
    motion = in_plane(disc, probes) if disc else None
    if motion is None and len(disc) > 1:
        raise ReadError(f"probes {', '.join(disc)}: do not see both x and y; add one at another angle")
    others = {name: column for name, column in readings.items() if motion is None or name not in disc}
    notes = [f"probe {text}, and was left out" for text in left_out.values()]
    if motion is None and disc:
        notes.append(
            f"probe {next(iter(disc))} alone does not see both x and y of the disc: its readings are probe_measured"
        )
    elif motion is None:
        notes.append("no probe at the disc's plane is left: there is no disc_measured")
    coupled = [name for name in alive if probes[name].coupling == "AC"]
    if coupled:
        notes.append(f"AC-coupled, without a mean position: {', '.join(coupled)}")
    position = probes[next(iter(disc))].position if motion else None
    groups = ({"disc_measured": motion} if motion else {}) | ({"probe_measured": others} if others else {})
    return ProbeColumns(groups, coordinates({name: probes[name] for name in others}), tuple(notes), position)


def _left_out(table: Table, entries: dict[str, Entry]) -> dict[str, str]:
    """Name and reason of the probes whose column is missing or dead."""
    found = {}
    for name, entry in entries.items():
        try:
            column = table.find(entry.column)
        except ReadError as error:
            found[name] = f"{name} is missing ({error})"
            continue
        if reason := dead(column.values):
            found[name] = f"{name} is dead ({reason} {column.unit or entry.unit or ''})".replace(" )", ")")
    return found


def _reading(table: Table, entry: Entry, probe: LabProbe) -> np.ndarray:
    """Displacement (n,) [m] along a probe, from its gap voltage or its mean where the mapping states one."""
    found = values(table, entry, "m")
    if probe.gap is None:
        return found
    if probe.gap == MEAN:
        return found - np.nanmean(found)
    assert isinstance(probe.gap, float)
    unit, scale = unit_of(table.find(entry.column), entry)
    try:
        volts = scale * factor(unit, "V")
    except ReadError as error:
        raise ReadError(f"{entry.path}.gap: the column is not in volts ({error})") from error
    return found - probe.gap * scale_of(table, entry, "m") / volts
