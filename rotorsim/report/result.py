"""Report of a result by its type."""

from __future__ import annotations

from pathlib import Path

import xarray as xr

from rotorsim.base.errors import DataError
from rotorsim.discrepancy import Diagnosis
from rotorsim.report import control, diagnosis, record
from rotorsim.report.page.page import RESULT_PAGES, write_page
from rotorsim.verify import Verification

CHAPTERS = (control, diagnosis, record)
"""Modules that register pages of results."""


def write(
    result: Diagnosis | Verification | xr.Dataset, path: str | Path, units: str = "metric", figures: str | None = None
) -> Path:
    """Write the HTML report of a diagnosis, a verification or a record, complete or not at all.

    `units` are "metric" or "imperial"; with `figures` "png", "svg" or "csv" every figure is a file too. Raises
    DataError for others and for any other type, WriteError for a path that cannot be written.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.report.write(record, "page.html").name
    'page.html'
    """
    make = next((maker for kind, maker in RESULT_PAGES.items() if isinstance(result, kind)), None)
    if make is None:
        given = type(result).__name__
        raise DataError(f"report: {given} is not a Diagnosis, a Verification or a record; for a file use write_report")
    return write_page(lambda: make(result), path, units, figures)
