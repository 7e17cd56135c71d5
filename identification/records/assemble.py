"""Record in SI units from the columns of a file and a mapping; `validate` checks it against the schema.

The columns that a mapping takes are cut to the time that all of them cover. A column may bring the times of its samples
[s] and the moment `begin` [s] of its clock's zero. Columns that start whole samples apart are shifted, with a note;
other rates and starts are refused by name. Columns of one sample are settings and have no clock.

Probes that a mapping names give the motion of the disc, or readings of other planes; dead ones are left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.records import schema
from identification.records.columns import (
    CLIPPED,
    FACTORS,
    FULL_SCALE,
    Column,
    DataTable,
    Header,
    agree,
    amplitude_factor,
    clipped,
    dead,
    factor,
    full_scale,
    is_unit,
    is_unit_of,
    measured_by,
    named,
    quantity,
    sensitivity,
)
from identification.records.mapping import ColumnEntry, Mapping
from identification.records.sampling import nominal_rate, problems, unrounded, whole_slices
from identification.records.sensors import MEAN, LabProbe, angle_by_stretches, coordinates, disc_plane, in_plane
from rotorsim.base.display import listing, quote
from rotorsim.base.errors import ReadError

if TYPE_CHECKING:
    import xarray as xr

WHOLE = 0.1
"""Largest distance from a whole number of samples, in samples, at which a start is shifted."""
SHORTEST = 0.5
"""Least length of a channel, as a share of the longest."""
SAME_STEP = 1e-6
"""Largest relative difference of the steps of one rate, beyond the one that shifts the last sample by `WHOLE`."""
_TIME = re.compile(r"(?:^|(?<=[\W_]))(?:t|time|times|timestamp|zeit|temps)(?:$|(?=[\W_\d]))", re.IGNORECASE)
"""Word in a column's name that makes it a time."""


def on_one_clock(table: DataTable, mapping: Mapping, entries: Sequence[ColumnEntry]) -> tuple[DataTable, list[str]]:
    """The table with the mapped columns on one clock, and sentences about what was shifted.

    Raises ReadError if the columns run at several rates, start a part of a sample apart or cover no common time.
    """
    places = {id(column): i for i, column in enumerate(table.columns)}
    paths = {places[id(table.find(entry.column))]: entry.path for entry in entries if table.has(entry.column)}
    own = {i: time for i in paths if (time := table.columns[i].time) is not None and table.columns[i].values.size > 1}
    if not own:
        _check_other_times(table, mapping, paths)
        return table, []
    begins = {i: table.columns[i].begin for i in own}
    first = min((begin for begin in begins.values() if np.isfinite(begin)), default=0.0)
    unknown = [paths[i] for i, begin in begins.items() if not np.isfinite(begin)]
    times = {i: time + (begins[i] - first if np.isfinite(begins[i]) else 0.0) for i, time in own.items()}
    stated = unknown and len(unknown) < len(own)
    notes = [f"{listing(unknown)}: no start is stated; taken to begin with the first channel"] if stated else []
    chosen = max(times, key=lambda i: times[i][0])
    if all(np.array_equal(time, times[chosen]) for time in times.values()):
        return replace(table, time=times[chosen]), notes
    if mapping.time is not None:
        raise ReadError(
            f"time: {paths[chosen]} begins later than other channels, or has another rate, by the file's own clocks; "
            "leave [time] out, so that these count"
        )
    starts = {i: _start(times[i], times[chosen], paths[i], paths[chosen]) for i in times}
    count = min(times[i].size - starts[i] for i in times)
    if count < 2:
        raise ReadError(f"{paths[chosen]} begins after the end of another channel; map channels of one recording")
    short, long = (pick(times, key=lambda i: times[i].size) for pick in (min, max))
    if times[short].size < SHORTEST * times[long].size:
        raise ReadError(
            f"{paths[short]} has {times[short].size} samples and {paths[long]} {times[long].size} of the same rate; "
            "map channels of one recording"
        )
    for i, start in starts.items():
        apart = float(np.abs(times[i][start : start + count] - times[chosen][:count]).max())
        if apart > WHOLE * _step(times[chosen]):
            raise ReadError(
                f"{paths[i]} and {paths[chosen]} are unevenly up to {apart:.4g} s apart; resample them to one clock"
            )
    cut = [
        replace(column, values=column.values[starts[i] : starts[i] + count], time=None) if i in starts else column
        for i, column in enumerate(table.columns)
    ]
    notes.append(_note({paths[i]: times[i] for i in times}, count))
    return replace(table, columns=tuple(cut), time=times[chosen][:count]), notes


def _step(time: np.ndarray) -> float:
    return abs(float(time[-1] - time[0])) / (time.size - 1)


def _start(time: np.ndarray, chosen: np.ndarray, path: str, last: str) -> int:
    """Sample of `time` at which `chosen` begins."""
    steps = [_step(time), _step(chosen)]
    usual = max(steps) or 1.0
    length = min(time.size, chosen.size)
    if not abs(steps[0] - steps[1]) * length < max(WHOLE, SAME_STEP * length) * usual:
        raise ReadError(
            f"{path} is sampled every {steps[0]:.6g} s and {last} every {steps[1]:.6g} s, on different clocks; map "
            "channels of one rate"
        )
    place = (chosen[0] - time[0]) / usual
    start = round(place)
    if abs(place - start) > WHOLE:
        raise ReadError(
            f"{last} begins {chosen[0] - time[0]:.6g} s after {path}, {place:.4g} samples and no whole number of them; "
            "resample them to one clock"
        )
    return start


def _note(times: dict[str, np.ndarray], count: int) -> str:
    first = min(time[0] for time in times.values())
    starts = ", ".join(f"{path} {time[0] - first:.6g} s" for path, time in list(times.items())[:6])
    more = f" and {len(times) - 6} more" if len(times) > 6 else ""
    if all(time[0] == first for time in times.values()):
        return f"channels end apart: all are cut to the {count} samples they share"
    return f"channels start apart ({starts}{more} after the first): all are cut to the {count} samples they share"


def _check_other_times(table: DataTable, mapping: Mapping, numbers: dict[int, str]) -> None:
    """Raise ReadError if a mapped column has another column of times than the mapping's, which differs."""
    if mapping.time is None or not table.has(mapping.time.column):
        return
    stated = table.find(mapping.time.column)
    others = [i for i, one in enumerate(table.columns) if one is not stated and _is_time(one) and i not in numbers]
    for i, path in numbers.items():
        column = table.columns[i]
        if column is stated or column.values.size < 2:
            continue
        own = _own_time(table, i, others, stated)
        if own is not None and not _alike(own, stated, mapping.time.unit):
            raise ReadError(
                f"{path}: the times of {quote(column.name)} are those of {quote(own.name)}, which starts "
                f"at {own.values[0]:.6g} and not at {stated.values[0]:.6g} as {quote(stated.name)}; read each with its "
                "own times, or bring them on one clock"
            )


def _is_time(column: Column) -> bool:
    values = column.values[np.isfinite(column.values)]
    named = _TIME.search(column.name) or (column.unit and is_unit_of(column.unit, "s"))
    return bool(named) and values.size > 1 and bool(np.all(np.diff(values) > 0))


def _own_time(table: DataTable, i: int, others: Iterable[int], stated: Column) -> Column | None:
    """The column of times of a column: named after it, alone with it in a group, or next to its left as in pairs."""
    name = table.columns[i].name
    group = name.rpartition("/")[0]
    for j in others:
        other = table.columns[j]
        rest = _TIME.sub("", other.name.rpartition("/")[2]).strip(" _-()[].")
        if rest and rest == name.rpartition("/")[2]:
            return other
        if group and other.name.startswith(f"{group}/") and not stated.name.startswith(f"{group}/"):
            return other
    if table.format != "CSV":
        return None
    left = [j for j, one in enumerate(table.columns[:i]) if one is stated or j in others]
    nearest = table.columns[left[-1]] if left else stated
    return None if nearest is stated else nearest


def _alike(own: Column, stated: Column, unit: str | None) -> bool:
    """Whether two columns of times agree, within a tenth of a sample."""
    units = (own.unit or stated.unit or unit, stated.unit or unit)
    seconds = (factor(one, "s") if one and is_unit_of(one, "s") else 1.0 for one in units)
    a, b = (column.values * scale for column, scale in zip((own, stated), seconds, strict=True))
    if a.size != b.size:
        return False
    step = float(np.median(np.diff(b)))
    return bool(np.nanmax(np.abs(a - b)) <= WHOLE * abs(step))


def values(table: DataTable, entry: ColumnEntry, si: str) -> np.ndarray:
    """Values of a channel (n,) in SI units; raises ReadError that begins with the entry's path."""
    with named(entry.path):
        column = table.find(entry.column)
        scale = scale_of(table, entry, si)
        result = column.values if scale == 1 else column.values * scale
        return result + quantity(entry.offset, si) if entry.offset is not None else result


def unit_of(column: Column, entry: ColumnEntry) -> tuple[str, float]:
    """Unit of a column's numbers and the factor to it, which is 1 but for shares of a full scale.

    A unit that the mapping states replaces the file's (see `replaced`).

    Raises ReadError where neither the file nor the mapping states a unit, or where one is a share of a full scale.
    """
    if entry.full_scale is not None:
        if column.unit not in (FULL_SCALE, None):
            raise ReadError(
                f"full_scale: the column is in {quote(column.unit)}, not in shares of full scale; remove it"
            )
        number, stated = full_scale(entry.full_scale)
        return stated, number
    unit = entry.unit if entry.unit is not None else column.unit
    if unit == FULL_SCALE or column.unit == FULL_SCALE:
        raise ReadError("the column is in shares of full scale; write e.g. full_scale = '10 V' in place of the unit")
    if unit is None:
        raise ReadError("no unit, neither here nor in the file; write e.g. unit = 'um'")
    return unit, 1.0


def replaced(table: DataTable, entries: Iterable[ColumnEntry]) -> list[str]:
    """A sentence for each entry whose unit stands in place of another one that the file states."""
    found = []
    for entry in entries:
        unit = table.find(entry.column).unit if table.has(entry.column) else None
        if entry.unit and unit and not agree(entry.unit, unit):
            found.append(
                f"{entry.path}: read in {quote(entry.unit)}, which the mapping states; the file states {quote(unit)}"
            )
    return found


def _factor(column: Column, entry: ColumnEntry, si: str) -> float:
    unit, scale = unit_of(column, entry)
    try:
        if entry.sensitivity is not None:
            return scale * sensitivity(entry.sensitivity, unit, si)
        if entry.path.endswith("amplitude") or entry.path.startswith("amplitude_"):
            return scale * amplitude_factor(unit)
        return scale * factor(unit, si)
    except ReadError as error:
        if unit == column.unit and not is_unit(unit):  # the file's own word
            raise ReadError(f"{error}; or state the unit in a mapping, in place of the file's") from error
        raise


def scale_of(table: DataTable, entry: ColumnEntry, si: str) -> float:
    """Factor from an entry's column to SI units, without the offset."""
    return entry.factor * _factor(table.find(entry.column), entry, si)


def one_unit(table: DataTable, entries: Iterable[ColumnEntry]) -> None:
    """Raise ReadError where a file states several units of one quantity and the mapping none."""
    stated = {(entry.path, table.find(entry.column).unit) for entry in entries if entry.unit is None}
    units = {unit for _, unit in stated if unit}
    if any(not agree(a, b) for a in units for b in units):
        shown = ", ".join(f"{path} in {unit}" for path, unit in sorted(stated, key=str))
        raise ReadError(f"the file mixes units ({shown}); state the unit of each in the mapping")


@dataclass(frozen=True)
class ProbeColumns:
    """Columns (n,) [m] by variable and label, coordinates of `probe_measured`, and notes."""

    groups: dict[str, dict[str, np.ndarray]]
    coordinates: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    position: float | None = None
    """Plane of the disc's probes [m], where they state it."""
    angles: dict[str, float] = field(default_factory=dict)
    """Angles [rad] from x towards y of the probes that the motion of the disc is made of."""


def read_probes(table: DataTable, mapping: Mapping) -> ProbeColumns:
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
    angles = {name: probes[name].angle for name in disc} if motion else {}
    return ProbeColumns(groups, coordinates({name: probes[name] for name in others}), tuple(notes), position, angles)


def _left_out(table: DataTable, entries: dict[str, ColumnEntry]) -> dict[str, str]:
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


def _reading(table: DataTable, entry: ColumnEntry, probe: LabProbe) -> np.ndarray:
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


MOST_STRETCHES = 1000
"""Stretches between gaps, above which the gaps are those of rounded stamps."""
MOST = 6
"""Sentences about parts that were left out."""
RATE = 1e-3
"""Largest relative difference between a stated sample rate and the file's own clock."""


def assemble(table: DataTable, mapping: Mapping) -> xr.Dataset:
    """Record, or run-up vectors, from the columns that a mapping names; raises ReadError with one sentence."""
    record = _vectors(table, mapping) if mapping.vectors else _series(table, mapping)
    for name, attrs in (table.header or Header()).variables.items():
        if name in record:
            record[name].attrs.update(attrs)
    return record


def used(mapping: Mapping) -> list[ColumnEntry]:
    """Entries of a mapping."""
    single = [entry for entry in (mapping.time, mapping.speed) if entry]
    single += [entry for entry, _ in (*mapping.probes.values(), *filter(None, [mapping.keyphasor, mapping.hammer]))]
    return [*single, *mapping.channels.values(), *mapping.vectors.values()]


def _series(table: DataTable, mapping: Mapping) -> xr.Dataset:
    groups: dict[str, dict[str, np.ndarray]] = {}
    for (name, label), entry in mapping.channels.items():
        si = _probe_unit(table, entry) if name == "probe_measured" else schema.VARIABLES[name].units
        groups.setdefault(name, {})[label] = values(table, entry, si)
    seen = read_probes(table, mapping) if mapping.probes else None
    for name, parts in seen.groups.items() if seen else ():
        groups[name] = groups.get(name, {}) | parts
    if mapping.hammer:
        groups["disc_force"] = mapping.hammer[1].along(_blows(table, mapping.hammer[0]))
    if "disc_measured" in groups and not seen:
        one_unit(table, [entry for (name, _), entry in mapping.channels.items() if name == "disc_measured"])
    n = max(column.size for parts in groups.values() for column in parts.values())
    time = _time(table, mapping, n)
    arrays = {name: _joined(name, parts, time.size) for name, parts in groups.items()}
    if mapping.keyphasor:
        arrays = _turning(table, mapping, time) | arrays
    arrays |= {name: np.full(time.size, value) for name, value in mapping.constants.items()}
    probes = _probes(table, mapping, list(groups.get("probe_measured", ())), seen.coordinates if seen else {})
    record = schema.make_record(
        time, {name: arrays[name] for name in schema.VARIABLES if name in arrays}, probes=probes
    )
    record = schema.with_notes(record, [*(seen.notes if seen else ()), *_rounding(table, mapping, time)])
    if seen and seen.position is not None:
        record.attrs["disc_position"] = seen.position
    if mapping.hammer and mapping.hammer[1].position is not None:
        record.attrs["force_position"] = mapping.hammer[1].position
    if seen and seen.angles:
        record.attrs |= {"disc_probes": ", ".join(seen.angles), "disc_probe_angles": list(seen.angles.values())}
    if (limits := _clipped(table, mapping)) and table.header is None:
        record.attrs[CLIPPED] = limits
    numbers = {name: sorted(map(int, groups[name])) for name in schema.PINS if name in groups}
    if len({tuple(found) for found in numbers.values()}) > 1:
        raise ReadError(f"pins: {numbers} are not the same injectors; map each of them in both")
    return record.assign_coords(injector=next(iter(numbers.values()))) if numbers else record


def _probes(table: DataTable, mapping: Mapping, names: list[str], own: dict[str, Any]) -> dict[str, Any]:
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


def _clipped(table: DataTable, mapping: Mapping) -> list[str]:
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


def _probe_unit(table: DataTable, entry: ColumnEntry) -> str:
    """SI unit of a probe's readings, by the unit of its column, or by what its sensitivity leads to."""
    if entry.sensitivity is not None:
        with named(entry.path):
            return measured_by(entry.sensitivity, unit_of(table.find(entry.column), entry)[0])
    unit = full_scale(entry.full_scale)[1] if entry.full_scale else entry.unit or table.find(entry.column).unit or ""
    found = [si for si in schema.PROBE_UNITS if si in FACTORS and is_unit_of(unit, si)]
    if not found:
        raise ReadError(f"{entry.path}: unit {quote(unit)} is none of a probe; write e.g. 'um', 'mm/s', 'm/s^2' or 'V'")
    return found[0]


def _blows(table: DataTable, entry: ColumnEntry) -> np.ndarray:
    """Force (n,) [N] of a hammer; raises ReadError where its column shows none."""
    force = values(table, entry, "N")
    finite = force[np.isfinite(force)]
    if not finite.size or finite.min() == finite.max():
        reason = f"constant at {finite[0]:.6g} N" if finite.size else "missing throughout"
        raise ReadError(f"{entry.path}: the force is {reason}, no blow; check the channel or remove [hammer]")
    return force


def _turning(table: DataTable, mapping: Mapping, time: np.ndarray) -> dict[str, np.ndarray]:
    """Angle and speed of the shaft from the keyphasor."""
    assert mapping.keyphasor is not None
    entry, how = mapping.keyphasor
    signal = values(table, entry, "V")
    if signal.size != time.size:
        raise ReadError(f"keyphasor: {signal.size} samples but {time.size} times; take columns of one length")
    with named("keyphasor"):
        angle, speed = angle_by_stretches(time, signal, how)
    return {"angle": angle, "speed": speed}


def _joined(name: str, parts: dict[str, np.ndarray], n: int) -> np.ndarray:
    """The columns of one variable side by side, (n,) or (n, dim); a single value of a plain one holds throughout."""
    dims = schema.VARIABLES[name].dims
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
    if name == "disc_force" and set(parts) < set(schema.AXES):  # a hammer along one axis
        parts = {axis: parts.get(axis, np.zeros(n)) for axis in schema.AXES}
    labels = list(schema.AXES) if dims == ("axis",) else sorted(parts, key=lambda label: _number(name, label))
    missing = [label for label in labels if label not in parts]
    if missing:
        lone = ", or map a lone probe as [probes.A]" if name == "disc_measured" else ""
        raise ReadError(f"{name}: only {', '.join(parts)} and no {missing[0]}; name or map the other column too{lone}")
    unknown = [label for label in parts if label not in labels]
    if unknown:
        raise ReadError(f"{name}: unknown axis {quote(unknown[0])}; write x or y")
    return np.column_stack([parts[label] for label in labels])


def _number(name: str, label: str) -> int:
    if not (label.isascii() and label.isdecimal() and 1 <= len(label) <= 4):
        raise ReadError(f"{name}: {quote(label)} is not the number of an injector; write e.g. [channels.{name}.1]")
    return int(label)


def _time(table: DataTable, mapping: Mapping, n: int) -> np.ndarray:
    """Time of the samples [s] from a column, the file's clock or the sample rate."""
    time = values(table, mapping.time, "s") if mapping.time else table.time
    if time is None:
        if mapping.sample_rate is None:
            raise ReadError(
                "no time; a mapping needs [time] with a column or a sample_rate, else a column must be named 'time'"
            )
        return np.arange(n) / mapping.sample_rate
    time = _without_rounding(time)
    if mapping.sample_rate is not None and time.size > 1:
        found = 1 / np.median(np.diff(time)) if problems(time) else nominal_rate(time)
        if not abs(found / mapping.sample_rate - 1) < RATE:
            raise ReadError(
                f"time.sample_rate: {mapping.sample_rate:.6g} Hz, but the file's time gives {found:.6g} Hz; drop one"
            )
    return time


def _rounding(table: DataTable, mapping: Mapping, time: np.ndarray) -> list[str]:
    """A sentence where the times are not the file's stamps, but the even clock that these were rounded from."""
    stamps = values(table, mapping.time, "s") if mapping.time else table.time
    if stamps is None or np.array_equal(stamps, time, equal_nan=True):
        return []
    return [f"time: the stamps are rounded; {nominal_rate(time):.6g} Hz follows from their whole length"]


def _without_rounding(time: np.ndarray) -> np.ndarray:
    """The even clock behind rounded stamps, of the whole or of each stretch between gaps and missing stamps."""
    whole = unrounded(time)
    if whole is not time or not problems(time):
        return whole
    parts = whole_slices(time, ~np.isfinite(time))
    found = time.copy()
    for part in parts if len(parts) < MOST_STRETCHES else ():
        found[part] = unrounded(time[part])
    return found


def _vectors(table: DataTable, mapping: Mapping) -> xr.Dataset:
    assert mapping.speed is not None
    speed = values(table, mapping.speed, "rad/s")
    orders = sorted({order for _, order, _ in mapping.vectors})
    axes = sorted({axis for _, _, axis in mapping.vectors})
    arrays = {name: np.empty((speed.size, len(orders), len(axes))) for name in schema.VECTORS}
    for name, known in schema.VECTORS.items():
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
    return schema.make_vectors(speed, arrays["amplitude"], arrays["phase"], orders, attrs, axes)


def left_out(table: DataTable, mapping: Mapping) -> list[str]:
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


def provenance(table: DataTable, mapping: Mapping, path: Any, digest: str) -> dict[str, Any]:
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
