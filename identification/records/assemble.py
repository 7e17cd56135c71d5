"""Record in SI units from the columns of a file and a mapping; `validate` checks it against the schema."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import ReadError
from identification.records.column_values import one_unit, replaced, unit_of, values
from identification.records.lab.column_faults import clipped, dead
from identification.records.lab.keyphasor import angle_by_stretches
from identification.records.lab.probe_columns import read_probes
from identification.records.mapping import Entry, Mapping
from identification.records.notes import with_notes
from identification.records.sampling import nominal_rate, problems
from identification.records.schema import AXES, PROBE_UNITS, VARIABLES, make_record
from identification.records.table import Header, Table
from identification.records.units import FACTORS, full_scale, is_unit_of, measured_by
from identification.records.vectors import VECTORS, make_vectors
from rotorsim.base.sentences import listing, quote

if TYPE_CHECKING:
    import xarray as xr

CLIPPED = "clipped"
"""Attribute with a sentence for every clipped sensor."""
MOST = 6
"""Sentences about parts that were left out."""
RATE = 1e-3
"""Largest relative difference between a stated sample rate and the file's own clock."""


def assemble(table: Table, mapping: Mapping) -> xr.Dataset:
    """Record, or run-up vectors, from the columns that a mapping names; raises ReadError with one sentence."""
    record = _vectors(table, mapping) if mapping.vectors else _series(table, mapping)
    for name, attrs in (table.header or Header()).variables.items():
        if name in record:
            record[name].attrs.update(attrs)
    return record


def used(mapping: Mapping) -> list[Entry]:
    """All entries of a mapping."""
    single = [entry for entry in (mapping.time, mapping.speed) if entry]
    single += [entry for entry, _ in (*mapping.probes.values(), *filter(None, [mapping.keyphasor]))]
    return [*single, *mapping.channels.values(), *mapping.vectors.values()]


def _series(table: Table, mapping: Mapping) -> xr.Dataset:
    groups: dict[str, dict[str, np.ndarray]] = {}
    for (name, label), entry in mapping.channels.items():
        si = _probe_unit(table, entry) if name == "probe_measured" else VARIABLES[name].units
        groups.setdefault(name, {})[label] = values(table, entry, si)
    seen = read_probes(table, mapping) if mapping.probes else None
    for name, parts in seen.groups.items() if seen else ():
        groups[name] = groups.get(name, {}) | parts
    if "disc_measured" in groups and not seen:
        one_unit(table, [entry for (name, _), entry in mapping.channels.items() if name == "disc_measured"])
    n = max(column.size for parts in groups.values() for column in parts.values())
    time = _time(table, mapping, n)
    arrays = {name: _joined(name, parts, time.size) for name, parts in groups.items()}
    if mapping.keyphasor:
        arrays = _turning(table, mapping, time) | arrays
    arrays |= {name: np.full(time.size, value) for name, value in mapping.constants.items()}
    probes = _probes(table, mapping, list(groups.get("probe_measured", ())), seen.coordinates if seen else {})
    record = make_record(time, {name: arrays[name] for name in VARIABLES if name in arrays}, probes=probes)
    record = with_notes(record, seen.notes if seen else ())
    if seen and seen.position is not None:
        record.attrs["disc_position"] = seen.position
    if (limits := _clipped(table, mapping)) and table.header is None:
        record.attrs[CLIPPED] = limits
    if "pin" in groups:
        record = record.assign_coords(injector=sorted(map(int, groups["pin"])))
    return record


def _probes(table: Table, mapping: Mapping, names: list[str], own: dict[str, Any]) -> dict[str, Any]:
    """Coordinates of `probe_measured`: those of the file's header or the mapping, or what columns state."""
    known = (table.header or Header()).probes
    if names and known.get("probe") == names:
        return known
    if names == own.get("probe", []):
        return own
    units = {name: "m" for name in own.get("probe", ())}
    units |= {
        name: _probe_unit(table, entry) for (key, name), entry in mapping.channels.items() if key == "probe_measured"
    }
    return {"probe": names, "probe_unit": [units[name] for name in names]}


def _clipped(table: Table, mapping: Mapping) -> list[str]:
    """Sentences about clipped displacement sensors, as their columns stand in the file."""
    entries = {name: entry for name, (entry, _) in mapping.probes.items()}
    entries |= {
        " ".join(key).strip(): entry
        for key, entry in mapping.channels.items()
        if key[0] in ("disc_measured", "journal")
    }
    found = []
    for name, entry in entries.items():
        column = table.find(entry.column) if table.has(entry.column) else None
        if column is None or dead(column.values):
            continue
        unit = entry.unit or column.unit or ""
        found += [
            f"{name}: rests at {at:.6g} {unit} for {100 * share:.2g} % of the record"
            for at, share in clipped(column.values)
        ]
    return found


def _probe_unit(table: Table, entry: Entry) -> str:
    """SI unit of a probe's readings, by the unit of its column, or by what its sensitivity leads to."""
    if entry.sensitivity is not None:
        try:
            return measured_by(entry.sensitivity, unit_of(table.find(entry.column), entry)[0])
        except ReadError as error:
            raise ReadError(f"{entry.path}: {error}") from error
    unit = full_scale(entry.full_scale)[1] if entry.full_scale else entry.unit or table.find(entry.column).unit or ""
    found = [si for si in PROBE_UNITS if si in FACTORS and is_unit_of(unit, si)]
    if not found:
        raise ReadError(f"{entry.path}: unit {quote(unit)} is none of a probe; write e.g. 'um', 'mm/s', 'm/s^2' or 'V'")
    return found[0]


def _turning(table: Table, mapping: Mapping, time: np.ndarray) -> dict[str, np.ndarray]:
    """Angle and speed of the shaft from the keyphasor."""
    assert mapping.keyphasor is not None
    entry, how = mapping.keyphasor
    signal = values(table, entry, "V")
    if signal.size != time.size:
        raise ReadError(f"keyphasor: {signal.size} samples but {time.size} times; take columns of one length")
    try:
        angle, speed = angle_by_stretches(time, signal, how)
    except ReadError as error:
        raise ReadError(f"keyphasor: {error}") from error
    return {"angle": angle, "speed": speed}


def _joined(name: str, parts: dict[str, np.ndarray], n: int) -> np.ndarray:
    """The columns of one variable side by side, (n,) or (n, dim); a single value of a plain one holds throughout."""
    dims = VARIABLES[name].dims
    if not dims and parts[""].size == 1:
        return np.full(n, parts[""][0])
    for label, column in parts.items():
        if column.size != n:
            place = f"{name}_{label}".strip("_")
            raise ReadError(f"{place}: {column.size} samples but {n} times; take columns of one length")
    if not dims:
        return parts[""]
    if dims == ("probe",):
        return np.column_stack(list(parts.values()))
    labels = list(AXES) if dims == ("axis",) else sorted(parts, key=_number)
    missing = [label for label in labels if label not in parts]
    if missing:
        raise ReadError(f"{name}: only {', '.join(parts)} and no {missing[0]}; name or map the other column too")
    unknown = [label for label in parts if label not in labels]
    if unknown:
        raise ReadError(f"{name}: unknown axis {quote(unknown[0])}; write x or y")
    return np.column_stack([parts[label] for label in labels])


def _number(label: str) -> int:
    if not (label.isascii() and label.isdecimal() and 1 <= len(label) <= 4):
        raise ReadError(f"pin: {quote(label)} is not the number of an injector; write e.g. [channels.pin.1]")
    return int(label)


def _time(table: Table, mapping: Mapping, n: int) -> np.ndarray:
    """Time of the samples [s] from a column, the file's clock or the sample rate."""
    time = values(table, mapping.time, "s") if mapping.time else table.time
    if time is None:
        if mapping.sample_rate is None:
            raise ReadError(
                "no time; a mapping needs [time] with a column or a sample_rate, else a column must be named 'time'"
            )
        return np.arange(n) / mapping.sample_rate
    if mapping.sample_rate is not None and time.size > 1:
        found = 1 / np.median(np.diff(time)) if problems(time) else nominal_rate(time)
        if not abs(found / mapping.sample_rate - 1) < RATE:
            raise ReadError(
                f"time.sample_rate: {mapping.sample_rate:.6g} Hz, but the file's time gives {found:.6g} Hz; drop one"
            )
    return time


def _vectors(table: Table, mapping: Mapping) -> xr.Dataset:
    assert mapping.speed is not None
    speed = values(table, mapping.speed, "rad/s")
    orders = sorted({order for _, order, _ in mapping.vectors})
    axes = sorted({axis for _, _, axis in mapping.vectors})
    arrays = {name: np.empty((speed.size, len(orders), len(axes))) for name in VECTORS}
    for name, known in VECTORS.items():
        for i, order in enumerate(orders):
            for j, axis in enumerate(axes):
                entry = mapping.vectors.get((name, order, axis))
                if entry is None:
                    raise ReadError(f"{name} of {order}X: no axis {axis}; name or map its column too")
                column = values(table, entry, known.units)
                if column.size != speed.size:
                    raise ReadError(f"{entry.path}: {column.size} rows but {speed.size} speeds; take one table")
                arrays[name][:, i, j] = column
    attrs = {} if mapping.disc is None else {"disc_position": mapping.disc}
    return make_vectors(speed, arrays["amplitude"], arrays["phase"], orders, attrs, axes)


def left_out(table: Table, mapping: Mapping) -> list[str]:
    """Sentences about units that the mapping replaced, and about what the file holds and no reader takes."""
    taken = [(entry, table.find(entry.column)) for entry in used(mapping) if table.has(entry.column)]
    found = replaced(table, [entry for entry, _ in taken])
    unread: dict[tuple[str, ...], list[str]] = {}
    for entry, column in taken:
        unread.setdefault(column.unread, []).append(entry.path)
    found += [f"{listing(what)} of {', '.join(who)} in the file: not read" for what, who in unread.items() if what]
    found += table.notes
    lost = [f"{quote(one.name)} was left out: {one.fault}" for one in table.columns if one.fault]
    if table.header is None:
        lost += [f"{quote(name)} was left out: it {reason}" for name, reason in table.others.items()]
    found += lost[:MOST]
    if len(lost) > MOST:
        found.append(f"{len(lost) - MOST} more parts of the file were left out")
    return found


def provenance(table: Table, mapping: Mapping, path: Any, digest: str) -> dict[str, Any]:
    """Attributes of a record: those it was written with, or where foreign data came from."""
    taken = {id(table.find(entry.column)) for entry in used(mapping) if table.has(entry.column)}
    left = [column.name for column in table.columns if id(column) not in taken]
    unused = {"unused_columns": left} if left else {}
    if table.header is not None:
        return dict(table.header.attrs) | mapping.conditions | unused
    attrs: dict[str, Any] = {"source": str(path), "source_format": table.format, "source_sha256": digest}
    attrs |= {"mapping": mapping.text} if mapping.text else {}
    attrs |= mapping.conditions
    return attrs | unused
