"""Printed tables of an operating map over speed or pressure and further axes, with units."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from math import isfinite
from typing import TYPE_CHECKING, Any

from rich.markup import escape
from rich.table import Table

from rotorsim.base.constants import TO_RPM
from rotorsim.base.units import show

if TYPE_CHECKING:
    import xarray as xr
LISTED: dict[str, tuple[str, str, float]] = {
    "lift_off_pressure": ("lift_off_mpa", "Lift-off pressure [MPa]", 1e-6),
    "onset_speed": ("whirl_onset_rpm", "Whirl onset [rpm]", TO_RPM),
    "onset_ratio": ("whirl_ratio", "Whirl frequency ratio at the onset", 1.0),
    "crossing_speed": ("crossings_rpm", "Critical speeds [rpm]", TO_RPM),
}
"""By variable: key of the summary, title of the table, factor."""
LOOKED: dict[str, tuple[str, str]] = {
    "onset_speed": ("onset_looked", "whirl_onset_looked"),
    "onset_ratio": ("onset_looked", "whirl_onset_looked"),
    "crossing_speed": ("crossing_searched", "crossings_searched"),
}
"""By variable: the one that is 1 where all of it was looked for, and that one's key of the summary."""


def tables(found: xr.Dataset) -> Iterator[Table]:
    """One table per variable, with the last dimension along the columns and one column for each other one."""
    for name, (_, title, scale) in LISTED.items():
        if name not in found:
            continue
        values = found[name]
        *rows, across = map(str, values.dims)
        made = Table(title=escape(title), title_justify="left")
        for head in (*(_title(found, row) for row in rows), *(_label(found, across, k, True) for k in values[across])):
            made.add_column(escape(head))
        known = found[LOOKED[name][0]].broadcast_like(values).transpose(*values.dims).values if name in LOOKED else None
        for at in product(*(range(values.sizes[row]) for row in rows)):
            cells = [_label(found, row, found[row][k], False) for row, k in zip(rows, at, strict=True)]
            shown = [_number(float(v) * scale, known is None or known[at][k]) for k, v in enumerate(values.values[at])]
            made.add_row(*map(escape, cells), *shown)
        yield made


def _title(found: xr.Dataset, dimension: str) -> str:
    """Path of a field, or the dimension's own name."""
    path = str(found[dimension].attrs.get("long_name", dimension))
    return path if path.replace(".", "_") == dimension else dimension.removesuffix("_crossing")


def _label(found: xr.Dataset, dimension: str, value: Any, named: bool) -> str:
    """A coordinate's value with its unit, after the dimension's name if `named`."""
    unit = str(found[dimension].attrs.get("units", "1"))
    number = value.item()
    if unit == "rad/s":
        text = f"{number * TO_RPM:.5g} rpm"
    else:
        text = show(float(f"{number:.9g}"), unit) if isinstance(number, float) else str(number)
    return f"{_title(found, dimension)} {text}" if named else text


def _number(value: float, looked: Any) -> str:
    """A value; without one, whether there is none or not all was looked at."""
    if isfinite(value):
        return f"{value:.5g}"
    return "none" if looked else "not known"
