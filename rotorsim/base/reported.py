"""Results with a report: `rotorsim/__init__.py` sets how it is written, so that no result imports the reports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar


class Reported:
    """Base of results that `rotorsim.report.write` makes a page of."""

    writer: ClassVar[Callable[[Any, str | Path], Path]]

    def report(self, path: str | Path) -> Path:
        """Write the HTML report, complete or not at all; raises WriteError."""
        return Reported.writer(self, path)
