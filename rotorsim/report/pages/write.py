"""Report of a result by its type."""

from __future__ import annotations

from pathlib import Path

from rotorsim.base.files import write_text
from rotorsim.discrepancy import Diagnosis
from rotorsim.report.pages import diagnosis, verification
from rotorsim.verify import Verification


def write(result: Diagnosis | Verification, path: str | Path) -> Path:
    """Write the HTML report of a diagnosis or a verification, complete or not at all; raises WriteError."""
    write_text(Path(path), diagnosis.page(result) if isinstance(result, Diagnosis) else verification.page(result))
    return Path(path)
