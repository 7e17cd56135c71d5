"""Files of a page: the page in the units that its reader wants, and its figures next to it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rotorsim.base.files import write_text
from rotorsim.report.export.display_units import check_units, page_system
from rotorsim.report.export.figure_files import check_kind, save_figures


def check_wanted(units: str, figures: str | None) -> None:
    """Raise DataError for units or a kind of figure files that are not known, and where no figure can be drawn."""
    check_units(units)
    if figures is not None:
        check_kind(figures)


def write_page(make: Callable[[], str], path: str | Path, units: str, figures: str | None) -> Path:
    """Make the text of a page, write it, complete or not at all, then its figures; return its path.

    `units` are "metric" or "imperial"; `figures` "png", "svg" or "csv", None for no files. Raises DataError for others,
    WriteError for a path that cannot be written.
    """
    check_wanted(units, figures)
    path = Path(path)
    with page_system(units):
        text = make()
    write_text(path, text)
    if figures is not None:
        save_figures(path, figures)
    return path
