"""Notes on a record: sentences about what reading left out or changed, kept in its attribute `notes`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

NOTES = "notes"


def notes_of(record: xr.Dataset) -> list[str]:
    """The notes on a record; a file may keep a single one as text.

    Examples
    --------
    >>> import rotorsim as rs
    >>> notes = rs.identification.notes_of(record)
    """
    found = record.attrs.get(NOTES, [])
    return [found] if isinstance(found, str) else [str(text) for text in found]


def with_notes(record: xr.Dataset, sentences: Sequence[str]) -> xr.Dataset:
    """The record with further notes, each once."""
    new = list(dict.fromkeys([*notes_of(record), *sentences]))
    return record.assign_attrs({NOTES: new}) if new else record
