"""Check of records, and of run-up vectors, against their schema."""

from __future__ import annotations

from typing import TYPE_CHECKING

from identification.records.schema import validate_record
from identification.records.vectors import validate_vectors

if TYPE_CHECKING:
    import xarray as xr


def validate(record: xr.Dataset) -> xr.Dataset:
    """Return the record, or the run-up vectors, if they fit their schema; else raise SchemaError with one sentence.

    Variables that the schema does not know are left alone.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.validate(record) is record
    True
    """
    return validate_vectors(record) if "speed" in record.dims else validate_record(record)
