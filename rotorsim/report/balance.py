"""Page of a balancing: unbalance estimated against known, vectors before and after the correction weights."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.balance import Assessment, Conditions, Correction, LeftOut
from rotorsim.balance.unbalance import estimate_table, result_rows
from rotorsim.base.units import TO_UM
from rotorsim.report.page import Block, Page, write_page
from rotorsim.report.theme import INK, NEUTRAL, PIN_COLOURS, compact, curve, style

G_MM = 1e6
"""g mm in a kg m."""


def write_balance(found: Assessment, path: str | Path, units: str = "metric", figures: str | None = None) -> Path:
    """Write the page of a balancing; raises WriteError where it cannot be written.

    `units` and `figures` as for `write_report`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.balance.assess("bently_rk4", conditions)
    >>> rs.report.write_balance(found, "balance.html").name
    'balance.html'
    """
    return write_page(lambda: balance_page(found), path, units, figures)


def balance_page(found: Assessment) -> Page:
    """Page of a balancing."""
    tests, fix = found.tests, found.correction
    blocks = [Block("Results", "Unbalances are in g mm.", ("quantity", "value"), result_rows(found))]
    if tests:
        blocks.append(
            Block("Every label estimated from the others", "Lines lead from the known unbalance to the estimate.",
                  figure=left_out_figure(tests, found.conditions))
        )  # fmt: skip
    if fix is not None:
        blocks.append(
            Block("1X vectors before and after the correction weights", "After: predicted, not measured.",
                  figure=correction_figure(fix, found.conditions))
        )  # fmt: skip
    if found.estimates:
        heads, rows = estimate_table(found)
        text = f"Estimated by {found.method}; sd is the standard deviation of either component."
        blocks.append(Block("Unbalance of the records without a label", text, heads, rows))
    return Page("Balancing", "Unbalance from measured 1X vectors.", blocks)


def left_out_figure(tests: Mapping[str, LeftOut], conditions: Conditions) -> go.Figure:
    """Known and estimated unbalance in the plane of each disc; a row a method."""
    names = [p.name for p in conditions.planes]
    titles = [f"{method}, {name}" for method in tests for name in names]
    figure = make_subplots(len(tests), len(names), subplot_titles=titles, vertical_spacing=0.14,
                           horizontal_spacing=0.1)  # fmt: skip
    for row, test in enumerate(tests.values(), start=1):
        for k in range(len(names)):
            truth, found = test.truth[:, k] * G_MM, test.estimates[:, k] * G_MM
            lines = np.stack([truth, found, np.full(len(truth), np.nan)], axis=1).ravel()
            figure.add_trace(curve(lines.real, lines.imag, INK, width=1, hoverinfo="skip", showlegend=False),
                             row, k + 1)  # fmt: skip
            for values, name, colour, symbol in (
                (truth, "known", NEUTRAL, "circle-open"), (found, "estimated", PIN_COLOURS[1], "x-thin-open"),
            ):  # fmt: skip
                figure.add_trace(go.Scatter(x=compact(values.real), y=compact(values.imag), mode="markers", name=name,
                                            text=list(test.labels), legendgroup=name, showlegend=row == 1 and k == 0,
                                            marker={"color": colour, "symbol": symbol, "size": 8}),
                                 row, k + 1)  # fmt: skip
    figure.update_xaxes(title_text="at 0 deg [g mm]")
    figure.update_yaxes(title_text="at 90 deg [g mm]", col=1)
    for x, y in zip(figure.select_xaxes(), figure.select_yaxes(), strict=True):  # a degree is a degree in every panel
        y.update(scaleanchor=x.plotly_name.replace("axis", ""))
    return style(figure, 460 * len(tests))


def correction_figure(fix: Correction, conditions: Conditions) -> go.Figure:
    """1X vectors of every probe and speed, before and after."""
    figure = go.Figure()
    names = [f"{r.name} {s}".strip() for s in conditions.speeds for r in conditions.readings]
    for values, name, colour in (
        (fix.before, "before", PIN_COLOURS[0]),
        (fix.after, "after, predicted", PIN_COLOURS[1]),
    ):
        figure.add_trace(go.Bar(x=names, y=compact(np.abs(values) * TO_UM), name=name, marker_color=colour))
    figure.update_yaxes(title_text="1X [µm 0-pk]")
    return style(figure, 380)
