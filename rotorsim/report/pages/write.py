"""Report of a result by its type."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_text
from rotorsim.discrepancy import Diagnosis
from rotorsim.report.pages import diagnosis, verification
from rotorsim.verify import Verification

PAGES: Mapping[type, Callable[[Any], str]] = {Diagnosis: diagnosis.page, Verification: verification.page}
"""Types of results and what makes their pages."""


def write(result: Diagnosis | Verification, path: str | Path) -> Path:
    """Write the HTML report of a diagnosis or a verification, complete or not at all.

    Raises DataError for any other type, WriteError for a path that cannot be written.
    """
    page = next((make for kind, make in PAGES.items() if isinstance(result, kind)), None)
    if page is None:
        known, given = " or ".join(kind.__name__ for kind in PAGES), type(result).__name__
        raise DataError(f"report: {given} is not a {known}; for a record use report.write_report")
    write_text(Path(path), page(result))
    return Path(path)
