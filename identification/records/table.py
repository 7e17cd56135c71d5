"""Raw content of a data file before a mapping: named columns of numbers, dead and clipped ones.

A dead sensor's column never moves, a clipped one rests at a limit of its range. A quantised signal stays at its extreme
value for a few samples too, but there it stays little longer than at the next value; a clipped one stays there much
longer than anywhere near.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from identification.errors import ReadError
from identification.records.units import is_unit
from rotorsim.base.display import listing, quote
from rotorsim.base.input_files import parse_json

MARK = "rotorsim record"
"""First words of the header of a file that rotorsim wrote."""
MAX_VALUES = 2**29
"""No column or matrix of more values is read: 4 GB."""
MAX_NAME = 200
"""Longest name of a column."""
_NAME = re.compile(r"([^\[\]]+)(?:\[([^\[\]]*)\]|\(([^()]*)\))")


@dataclass(frozen=True)
class Column:
    """Numbers (n,) as they stand in the file; `unit` as the file states it, None if it does not.

    `time` (n,) [s] is the column's own clock, whose zero lies `begin` [s] after a moment that all columns share, NaN
    where the file states it of others alone.
    `unread` names what else the file states about it and no reader takes; `fault` states why its values cannot be used.
    """

    name: str
    values: np.ndarray
    unit: str | None = None
    aliases: tuple[str, ...] = ()
    time: np.ndarray | None = None
    begin: float = 0.0
    unread: tuple[str, ...] = ()
    fault: str = ""


@dataclass(frozen=True)
class Header:
    """Header that rotorsim wrote with a record."""

    attrs: dict[str, Any] = field(default_factory=dict)
    variables: dict[str, dict[str, Any]] = field(default_factory=dict)
    samples: int = 0
    probes: dict[str, list[Any]] = field(default_factory=dict)
    """Names and coordinates of the probes, as `schema.make_record` takes them."""


@dataclass(frozen=True)
class DataTable:
    """Columns of a file, what else is in it (name and reason why it is not a column) and the file's own clock [s]."""

    format: str
    columns: tuple[Column, ...]
    others: dict[str, str] = field(default_factory=dict)
    time: np.ndarray | None = None
    header: Header | None = None
    notes: tuple[str, ...] = ()
    """Sentences about how the file was read, and about its statements that no reader takes."""

    @property
    def clocked(self) -> bool:
        """Whether the file brings the times of its samples."""
        return self.time is not None or any(column.time is not None for column in self.columns)

    def find(self, wanted: str | int) -> Column:
        """The column of a name or of a number from 1; raises ReadError if there is none, more than one, or a fault."""
        column = self._find(wanted)
        if column.fault:
            raise ReadError(column.fault)
        return column

    def _find(self, wanted: str | int) -> Column:
        if isinstance(wanted, int):
            if not 1 <= wanted <= len(self.columns):
                raise ReadError(f"no column {wanted}; the file has columns 1 to {len(self.columns)}")
            return self.columns[wanted - 1]
        found = [c for c in self.columns if wanted in (c.name, f"{c.name} [{c.unit}]", f"{c.name} ({c.unit})")]
        found = found or [c for c in self.columns if wanted in c.aliases]
        if len(found) > 1:
            raise ReadError(f"column {quote(wanted)} is there {len(found)} times; give the column's number instead")
        if not found and wanted in self.others:
            raise ReadError(f"{quote(wanted)} {self.others[wanted]}")
        if not found:
            raise ReadError(f"no column {quote(wanted)}; the file has {listing(c.name for c in self.columns)}")
        return found[0]

    def has(self, wanted: str | int) -> bool:
        """Whether `find` gives a column."""
        try:
            self.find(wanted)
        except ReadError:
            return False
        return True


def not_read(names: Sequence[str]) -> tuple[str, ...]:
    """A note about properties of a file that no reader takes; none where there are none."""
    return (f"{listing(names)} of the file: not read",) if names else ()


def split_name(text: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as 'X probe [um]'; what stands in round brackets counts if it is a known unit."""
    text = text.strip()
    match = _NAME.fullmatch(text) if len(text) <= MAX_NAME else None
    if not match or not match[1].strip() or (match[3] is not None and not is_unit(match[3])):
        return text, None
    return match[1].strip(), (match[2] or match[3] or "").strip() or None


def parse_header(text: str) -> Header:
    """Header from its JSON text; raises ReadError if it is none."""
    try:
        found = parse_json(text)
        header = Header(found["attrs"], found["variables"], found["samples"], found.get("probes", {}))
    except (ValueError, KeyError, TypeError) as error:
        raise ReadError("the header of the record is damaged; take the original file") from error
    good = isinstance(header.attrs, dict) and isinstance(header.variables, dict) and isinstance(header.samples, int)
    good = good and isinstance(header.probes, dict) and all(isinstance(v, list) for v in header.probes.values())
    if not good or not all(isinstance(attrs, dict) for attrs in header.variables.values()):
        raise ReadError("the header of the record is damaged; take the original file")
    return header


STUCK = 5
"""Samples of a run at the extreme of a clipped channel."""
SHARE = 0.005
"""Share of the record that such runs make up."""
LONGER = 4.0
"""Time at the extreme as a multiple of the time at the value next to it."""
FEWEST = 100
"""Samples of a column from which few different values show that it is dead."""
VALUES = 3
"""Most different values of a dead column."""


def dead(values: np.ndarray) -> str:
    """Reason why a sensor's column (n,) shows nothing; empty if it moves."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "all NaN or infinite"
    low, high = float(finite.min()), float(finite.max())
    if low == high and finite.size > 1:
        return f"constant at {low:.6g}"
    # a disconnected input flickers between two or three neighbouring codes of the converter
    if finite.size >= FEWEST and np.unique(finite[:: max(1, finite.size // 100_000)]).size <= VALUES:
        return f"never leaves {VALUES} values from {low:.6g} to {high:.6g}"
    return ""


def clipped(values: np.ndarray) -> tuple[tuple[float, float], ...]:
    """Limits at which a sensor's column (n,) rests, each with the share of the samples there; empty if at none."""
    finite = values[np.isfinite(values)]
    if finite.size < 2 or finite.min() == finite.max():
        return ()
    found = []
    low, high = float(finite.min()), float(finite.max())
    for at, inner in ((low, finite[finite > low].min()), (high, finite[finite < high].max())):
        share = _resting(values, at)
        if share and np.count_nonzero(finite == at) >= LONGER * np.count_nonzero(finite == inner):
            found.append((at, share))
    return tuple(found)


def _resting(values: np.ndarray, at: float) -> float:
    """Share of the samples in runs of STUCK or more at a value; 0 below SHARE."""
    edges = np.diff(np.concatenate(([0], (values == at).astype(np.int8), [0])))
    lengths = np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)
    resting = int(lengths[lengths >= STUCK].sum())
    return resting / values.size if resting >= max(STUCK, SHARE * values.size) else 0.0
