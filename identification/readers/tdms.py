"""TDMS files of LabVIEW, read with nptdms (`pip install "rotorsim[tdms]"`).

A column is a channel, named `group/channel` or by the channel alone where that is clear. Waveform channels carry their
clocks (`wf_increment`, `wf_start_offset`, `wf_start_time`), each its own.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from identification.readers import reader
from identification.records.columns import MAX_VALUES, Column, DataTable, factor, is_unit_of, not_read
from rotorsim.base.display import quote
from rotorsim.base.errors import ReadError

_READ = {"wf_increment", "wf_start_offset", "wf_start_time", "unit_string", "NI_UnitDescription", "wf_xunit_string"}
_IGNORED = ("wf_samples", "wf_xname", "wf_time_pref", "name", "NI_ChannelName", "NI_ChannelLength", "NI_DataType",
            "NI_Scal", "NI_Number_Of_Scales", "displaytype", "datatype", "registertxt", "NI_CR", "monotony",
            "minimum", "maximum", "novaluekey")  # fmt: skip
"""Beginnings of properties that the channel shows by itself: nptdms applies scales."""


@reader(".tdms", magic=rb"TDSm")
def read_tdms(path: Path) -> DataTable:
    """Table of a TDMS file; raises ReadError if nptdms is missing or the file is cut off."""
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise ReadError("TDMS needs the package nptdms; install it with: pip install 'rotorsim[tdms]'") from error
    with _silence(), TdmsFile.open(str(path)) as file:
        return _table(file, path.stat().st_size)


@contextmanager
def _silence() -> Iterator[None]:
    """Keep nptdms' log of damage off the terminal; the error message names the damage."""
    from nptdms.log import log_manager

    level = log_manager.log_level
    log_manager.set_level(logging.CRITICAL + 1)
    try:
        yield
    finally:
        log_manager.set_level(level)


def _table(file: Any, size: int) -> DataTable:
    if getattr(file, "file_status", None) is not None and file.file_status.incomplete_final_segment:
        raise ReadError("is a cut off TDMS file, its last segment is incomplete; copy it again")
    channels = [channel for group in file.groups() for channel in group.channels()]
    others: dict[str, str] = {}
    found = [(channel, column) for channel in channels if (column := _column(channel, size, others)) is not None]
    if not found:
        raise ReadError("holds no channel of numbers; export the right group")
    single = [channel.name for channel, _ in found]
    columns = [
        replace(column, name=alias if single.count(alias) == 1 else column.name, aliases=(column.name, alias))
        for (_, column), alias in zip(found, single, strict=True)
    ]
    unread = [*file.properties, *(f"{group.name}/{key}" for group in file.groups() for key in group.properties)]
    return DataTable("TDMS", tuple(_clocked(channels, found, columns)), others, notes=not_read(_others(unread)))


def _column(channel: Any, size: int, others: dict[str, str]) -> Column | None:
    """A channel as a column without its clock; None, with the reason in `others`, where it is none."""
    name, properties = f"{channel.group_name}/{channel.name}", channel.properties
    kind = np.dtype(channel.dtype).kind if len(channel) else ""
    if kind not in ("f", "i", "u", "b", "M"):
        others[name] = "holds no numbers; export plain numbers"
        return None
    if len(channel) > MAX_VALUES or len(channel) > size:
        raise ReadError(f"{quote(name)} declares {len(channel)} values, more than the file holds; copy it again")
    abscissa = _text(properties, "wf_xunit_string")
    if abscissa and not is_unit_of(abscissa, "s"):
        others[name] = f"stands over an abscissa in {quote(abscissa)}; export it over time"
        return None
    values = np.asarray(channel[:])
    unit = _text(properties, "unit_string") or _text(properties, "NI_UnitDescription")
    if kind == "M":  # time stamps become seconds from the first
        values, unit = (values - values[0]) / np.timedelta64(1, "s"), "s"
    return Column(name, values.astype(float), unit, unread=tuple(_others(properties)))


def _clocked(channels: list[Any], found: list[tuple[Any, Column]], columns: list[Column]) -> Iterator[Column]:
    """The columns with their clocks; a clock that several share is one array."""
    begins = [at for channel in channels if (at := channel.properties.get("wf_start_time")) is not None]
    first = min(begins, default=None)
    shared: dict[tuple[float, float, int], np.ndarray] = {}
    for (channel, _), column in zip(found, columns, strict=True):
        properties = channel.properties
        seconds = factor(_text(properties, "wf_xunit_string") or "s", "s")
        step, offset = (float(properties.get(key) or 0) * seconds for key in ("wf_increment", "wf_start_offset"))
        if not step > 0:
            yield column
            continue
        key = (step, offset, column.values.size)
        time = shared.setdefault(key, offset + np.arange(column.values.size) * step)
        at = properties.get("wf_start_time")
        unknown = np.nan if begins else 0.0
        yield replace(column, time=time, begin=unknown if at is None else float((at - first) / np.timedelta64(1, "s")))


def _text(properties: Any, key: str) -> str | None:
    return str(properties.get(key) or "").strip() or None


def _others(names: Any) -> list[str]:
    """Names of properties that no reader takes."""
    return [name for name in map(str, names) if name not in _READ and not name.startswith(_IGNORED)]
