"""Columns on one clock: those that a mapping takes are cut to the time that all of them cover.

A column may bring the times of its samples [s] and the moment `begin` [s] of its clock's zero. Columns that start whole
samples apart are shifted, with a note; other rates and starts are refused by name. Columns of one sample are settings
and have no clock. Columns that a mapping does not take have no say.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from identification.errors import ReadError
from identification.records.mapping import ColumnEntry, Mapping
from identification.records.table import Column, DataTable
from identification.records.units import factor, is_unit_of
from rotorsim.base.display import listing, quote

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

    Raises
    ------
    ReadError
        If the columns run at several rates, start a part of a sample apart or cover no common time.
    """
    numbers = {_place(table, entry): entry.path for entry in entries if table.has(entry.column)}
    clocked = {i: path for i, path in numbers.items() if _has_clock(table.columns[i])}
    if not clocked:
        _check_other_times(table, mapping, numbers)
        return table, []
    columns = {i: table.columns[i] for i in clocked}
    first = min((c.begin for c in columns.values() if np.isfinite(c.begin)), default=0.0)
    unknown = [clocked[i] for i, column in columns.items() if not np.isfinite(column.begin)]
    times = {i: _times(c) + (c.begin - first if np.isfinite(c.begin) else 0.0) for i, c in columns.items()}
    notes = [f"{listing(unknown)}: no start is stated; taken to begin with the first channel"] if unknown else []
    notes = notes if len(unknown) < len(columns) else []
    chosen = max(times, key=lambda i: times[i][0])
    if all(_equal(times[i], times[chosen]) for i in times):
        return replace(table, time=times[chosen]), notes
    if mapping.time is not None:
        raise ReadError(
            f"time: {clocked[chosen]} begins later than other channels, or has another rate, by the file's own clocks; "
            "leave [time] out, so that these count"
        )
    starts = {i: _start(times[i], times[chosen], clocked[i], clocked[chosen]) for i in times}
    count = min(times[i].size - starts[i] for i in times)
    if count < 2:
        raise ReadError(f"{clocked[chosen]} begins after the end of another channel; map channels of one recording")
    _check_lengths({clocked[i]: times[i] for i in times})
    for i, start in starts.items():
        apart = float(np.abs(times[i][start : start + count] - times[chosen][:count]).max())
        if apart > WHOLE * _step(times[chosen]):
            raise ReadError(
                f"{clocked[i]} and {clocked[chosen]} are unevenly up to {apart:.4g} s apart; resample them to one clock"
            )
    cut = [
        replace(column, values=column.values[starts[i] : starts[i] + count], time=None) if i in starts else column
        for i, column in enumerate(table.columns)
    ]
    notes.append(_note({clocked[i]: times[i] for i in times}, count))
    return replace(table, columns=tuple(cut), time=times[chosen][:count]), notes


def _place(table: DataTable, entry: ColumnEntry) -> int:
    column = table.find(entry.column)
    return next(i for i, one in enumerate(table.columns) if one is column)


def _has_clock(column: Column) -> bool:
    return column.time is not None and column.values.size > 1


def _times(column: Column) -> np.ndarray:
    assert column.time is not None
    return column.time


def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    return a is b or (a.size == b.size and bool(np.array_equal(a, b)))


def _check_lengths(times: dict[str, np.ndarray]) -> None:
    """Raise ReadError if one channel is much shorter than another, which would cut the record to it."""
    short, long = (pick(times, key=lambda path: times[path].size) for pick in (min, max))
    if times[short].size < SHORTEST * times[long].size:
        raise ReadError(
            f"{short} has {times[short].size} samples and {long} {times[long].size} of the same rate; map channels of "
            "one recording"
        )


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
    a, b = (c.values * _seconds(u) for c, u in ((own, own.unit or stated.unit or unit), (stated, stated.unit or unit)))
    if a.size != b.size:
        return False
    step = float(np.median(np.diff(b)))
    return bool(np.nanmax(np.abs(a - b)) <= WHOLE * abs(step))


def _seconds(unit: str | None) -> float:
    return factor(unit, "s") if unit and is_unit_of(unit, "s") else 1.0
