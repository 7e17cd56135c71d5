"""Page that compares results of several machines: responses, Campbell diagrams or maps in one picture, and a table."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from rotorsim.analysis.campbell import critical_rows
from rotorsim.analysis.unbalance_response import peak_of
from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.report.export.display_units import in_page_units
from rotorsim.report.figures.comparison_plots import Results, common_kind, compare_results
from rotorsim.report.pages.study import Block, save_study_page

Row = dict[str, Any]
ABOUT = {
    "response": "Unbalance responses at the measuring plane",
    "campbell": "Natural frequencies over the speed",
    "map": "Least damping ratios over the speed",
}


def result_rows(results: Results) -> list[Row]:
    """The key figures of each result: peaks, critical speeds at 1X, or onset and lift-off by pressure.

    Raises
    ------
    DataError
        If the results are of several kinds.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.campbell(rs.Plant("plain_rotor"), [0.0, 100.0, 200.0], modes=4)
    >>> rs.report.result_rows({"plain": found})[0]["result"]
    'plain'
    """
    rows = ROWS[common_kind(results)]
    return [{"result": name, **row} for name, found in results.items() for row in rows(found)]


@in_page_units
def write_result_comparison(
    results: Results, path: str | Path, units: str = "metric", figures: str | None = None
) -> Path:
    """Write the page; raises DataError for results of several kinds, WriteError where it cannot be written.

    `units` and `figures` as for `write_report`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.unbalance_response(plant, [200.0, 300.0, 400.0], 0.5e6)
    >>> rs.report.write_result_comparison({"before": found, "after": found}, "two.html").name
    'two.html'
    """
    kind, rows = common_kind(results), result_rows(results)
    heads = tuple(dict.fromkeys(key for row in rows for key in row))
    table = [tuple(_text(row.get(key)) for key in heads) for row in rows]
    names = " and ".join(results)
    blocks = [Block(ABOUT[kind], "", figure=compare_results(results)), Block("Key figures", "", heads, table)]
    save_study_page(f"Comparison: {names}", f"{ABOUT[kind]} of {names}.", blocks, Path(path), units, figures)
    return Path(path)


def _text(value: object) -> str:
    return "-" if value is None else f"{value:.5g}" if isinstance(value, float) else str(value)


def _number(value: Any, scale: float) -> float | None:
    return None if np.isnan(value) else float(value) * scale


def _peak(found: xr.Dataset) -> Iterator[Row]:
    peak = peak_of(found, str(found["place"].values[0]))
    if peak is not None:
        yield {"speed [rpm]": peak["rpm"], "peak [µm 0-pk]": peak["um"]}


def _critical(found: xr.Dataset) -> Iterator[Row]:
    rows = [row for row in critical_rows(found) if row[0] == 1]
    for _, rpm, direction, zeta, whirl, mode in rows:
        yield {"1X critical speed [rpm]": rpm, "passes": direction, "damping ratio": zeta, "whirl": whirl, "mode": mode}
    if not rows:
        yield {"1X critical speed [rpm]": None}


def _onset(found: xr.Dataset) -> Iterator[Row]:
    onset = found["onset_speed"].values if "onset_speed" in found else np.full(found.sizes["pressure"], np.nan)
    for pressure, speed, row in zip(found["pressure"].values, onset, found["zeta_least"].values, strict=True):
        least = float(np.nanmin(row)) if np.isfinite(row).any() else np.nan
        yield {
            "pressure [MPa]": float(pressure) * TO_MPA, "whirl onset [rpm]": _number(speed, TO_RPM),
            "least damping ratio": _number(least, 1.0),
        }  # fmt: skip


ROWS: dict[str, Callable[[xr.Dataset], Iterator[Row]]] = {"response": _peak, "campbell": _critical, "map": _onset}
"""Key figures of a result of each kind."""
