"""TDMS files of LabVIEW, read with nptdms (`pip install "rotorsim[tdms]"`).

A column is a channel, named `group/channel` or by the channel alone where that is clear. Waveform channels carry their
clock (`wf_increment`); all that share it make the table's clock.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from identification.errors import ReadError
from identification.records.table import MAX_VALUES, Column, Table
from rotorsim.base.sentences import quote


def read_tdms(path: Path) -> Table:
    """Table of a TDMS file; raises ReadError if nptdms is missing or the file is damaged."""
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise ReadError("TDMS needs the package nptdms; install it with: pip install 'rotorsim[tdms]'") from error
    try:
        with _silence(), TdmsFile.open(str(path)) as file:
            return _table(file, path.stat().st_size)
    except ReadError:
        raise
    except Exception as error:  # nptdms answers damage with anything from struct.error to KeyError
        raise ReadError("is a damaged or cut off TDMS file; copy it again") from error


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


def _table(file: Any, size: int) -> Table:
    if getattr(file, "file_status", None) is not None and file.file_status.incomplete_final_segment:
        raise ReadError("is a cut off TDMS file, its last segment is incomplete; copy it again")
    columns: list[Column] = []
    others: dict[str, str] = {}
    clocks: set[tuple[float, float, int]] = set()
    for channel in (channel for group in file.groups() for channel in group.channels()):
        _add(channel, size, columns, others, clocks)
    if not columns:
        raise ReadError("holds no channel of numbers; export the right group")
    if len(clocks) > 1:
        raise ReadError("its channels run on different clocks; export those of one rate and start to one file")
    names = [column.name for column in columns]
    time = None
    if clocks:
        step, offset, n = clocks.pop()
        time = offset + np.arange(n) * step
    single = [column.aliases[0] for column in columns]
    renamed = tuple(
        Column(alias if single.count(alias) == 1 else name, c.values, c.unit, (name, alias))
        for c, name, alias in zip(columns, names, single, strict=True)
    )
    return Table("TDMS", renamed, others, time)


def _add(channel: Any, size: int, columns: list[Column], others: dict[str, str], clocks: set[Any]) -> None:
    """Take a channel as a column, or note why not."""
    name, properties = f"{channel.group_name}/{channel.name}", channel.properties
    kind = np.dtype(channel.dtype).kind if len(channel) else ""
    if kind not in ("f", "i", "u", "b", "M"):
        others[name] = "holds no numbers; export plain numbers"
        return
    if len(channel) > MAX_VALUES or len(channel) > size:
        raise ReadError(f"{quote(name)} declares {len(channel)} values, more than the file holds; copy it again")
    values = np.asarray(channel[:])
    unit = str(properties.get("unit_string") or "").strip() or None
    if kind == "M":  # time stamps become seconds from the first
        values, unit = (values - values[0]) / np.timedelta64(1, "s"), "s"
    elif (step := float(properties.get("wf_increment", 0) or 0)) > 0:
        clocks.add((step, float(properties.get("wf_start_offset", 0) or 0), len(channel)))
    columns.append(Column(name, values.astype(float), unit, (channel.name,)))
