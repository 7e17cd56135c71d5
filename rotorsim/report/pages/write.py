"""Report of a result by its type."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import xarray as xr

from rotorsim.base.errors import DataError
from rotorsim.discrepancy import Diagnosis
from rotorsim.report.export.page_files import check_wanted, write_page
from rotorsim.report.pages import diagnosis, verification
from rotorsim.report.pages.page import page
from rotorsim.report.pages.run import analyse
from rotorsim.verify import Verification

PAGES: Mapping[type, Callable[[Any], str]] = {Diagnosis: diagnosis.page, Verification: verification.page,
                                                   xr.Dataset: lambda record: page(analyse(record))}  # fmt: skip
"""Types of results and what makes their pages."""


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
    make = next((maker for kind, maker in PAGES.items() if isinstance(result, kind)), None)
    if make is None:
        given = type(result).__name__
        raise DataError(f"report: {given} is not a Diagnosis, a Verification or a record; for a file use write_report")
    check_wanted(units, figures)
    return write_page(lambda: make(result), path, units, figures)
