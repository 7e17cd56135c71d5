"""A page in the units that its reader wants."""

from __future__ import annotations

from rotorsim.report.export.display_units import check_units, converted_html
from rotorsim.report.export.figure_units import imperial_figure
from rotorsim.report.pages.html import redrawn


def in_units(page: str, units: str) -> str:
    """Text of a page in "metric" units, as every page is made, or with texts, tables and figures in "imperial" ones.

    Raises DataError for another system of units.
    """
    check_units(units)
    return page if units == "metric" else redrawn(converted_html(page), imperial_figure)
