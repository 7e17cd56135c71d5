"""Base class of results with an HTML report; the report writer is set by `rotorsim/__init__.py`, not imported here."""

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
