"""Identified values over the operating grid, compared with the linearised physics; figures of claims over a factor."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.report.export.display_units import quantity
from rotorsim.report.figures.theme import PIN_COLOURS, compact, style

LINE = 60
Points = Sequence[tuple[float, float | None]]
Band = tuple[float, tuple[float, float]]
COLUMNS = 3
"""Panels in a row of figures over a factor."""
MARKS = (("circle", 7), ("x-thin-open", 8), ("diamond-open", 7))


@dataclass(frozen=True)
class Panel:
    """A quantity: title, values (k,) by the name of where they come from, surface f(speed, pressure) or None."""

    title: str
    values: dict[str, np.ndarray]
    surface: Callable[[float, float], float] | None = None


def over_speed(points: np.ndarray, panels: Sequence[Panel]) -> go.Figure:
    """A panel per quantity over speed [rpm], a colour per pressure, a mark per source; points (k, 2) [rad/s, Pa]."""
    columns = 2
    count = -(-len(panels) // columns)
    figure = make_subplots(count, columns, subplot_titles=[p.title for p in panels], vertical_spacing=0.25 / count,
                           horizontal_spacing=0.09)  # fmt: skip
    for number, panel in enumerate(panels):
        at = {"row": number // columns + 1, "col": number % columns + 1}
        for k, pressure in enumerate(np.unique(np.round(points[:, 1], -3))):
            chosen = np.abs(points[:, 1] - pressure) < 1500
            colour = PIN_COLOURS[k % len(PIN_COLOURS)]
            for trace in _traces(panel, points, chosen, float(pressure), colour, number == 0):
                figure.add_trace(trace, **at)
    figure.update_xaxes(title_text="speed [rpm]", row=count)
    return style(figure, 240 * count + 160)


def _traces(
    panel: Panel, points: np.ndarray, chosen: np.ndarray, pressure: float, colour: str, first: bool
) -> list[go.Scatter]:
    rpm, name, made = points[chosen, 0] * TO_RPM, f"{quantity(pressure * TO_MPA, 'MPa', '.2f')}", []
    for (label, values), (symbol, size) in zip(panel.values.items(), MARKS, strict=False):
        marker = {"color": colour, "symbol": symbol, "size": size, "line": {"color": colour, "width": 1.5}}
        made.append(go.Scatter(x=compact(rpm), y=compact(np.asarray(values)[chosen]), mode="markers", marker=marker,
                               name=f"{label}, {name}", legendgroup=name, showlegend=first))  # fmt: skip
    if panel.surface is not None and chosen.any():
        grid = np.linspace(points[chosen, 0].min(), points[chosen, 0].max(), LINE)
        heights = np.array([panel.surface(float(w), pressure) for w in grid])
        made.append(go.Scatter(x=compact(grid * TO_RPM), y=compact(heights), mode="lines", name=name,
                               legendgroup=name, showlegend=False, hoverinfo="skip",
                               line={"color": colour, "width": 1}))  # fmt: skip
    return made


def fits_by_model(rows: Sequence[tuple[str, dict[str, np.ndarray]]]) -> go.Figure:
    """Validation fits [%], mean of x and y, by model; a line per operating point."""
    figure = go.Figure()
    for k, (at, fits) in enumerate(rows):
        means, colour = [100 * float(np.mean(f)) for f in fits.values()], PIN_COLOURS[k % len(PIN_COLOURS)]
        figure.add_trace(go.Scatter(x=list(fits), y=means, name=at, mode="lines+markers", line={"color": colour}))
    figure.update_yaxes(title_text="fit on the second record [%]")
    return style(figure, 420)


def over_factor(curves: Mapping[str, Points], bands: Mapping[str, Band]) -> go.Figure:
    """A panel for each figure, by its words: points (factor, value or None), the thesis' number and its interval."""
    count = -(-len(curves) // COLUMNS)
    figure = make_subplots(count, COLUMNS, subplot_titles=list(curves), vertical_spacing=0.3 / count)
    for k, (words, points) in enumerate(curves.items()):
        at = {"row": k // COLUMNS + 1, "col": k % COLUMNS + 1}
        known = [(f, v) for f, v in points if v is not None and isfinite(v)]
        thesis, (low, high) = bands[words]
        if isfinite(high):
            figure.add_hrect(low, high, fillcolor=PIN_COLOURS[2], opacity=0.15, line_width=0, **at)
        figure.add_hline(thesis, line={"dash": "dot", "width": 1}, **at)
        x, y = (compact(np.array(part, float)) for part in zip(*known, strict=True)) if known else ([], [])
        marker = {"color": PIN_COLOURS[0]}
        figure.add_trace(go.Scatter(x=x, y=y, mode="lines+markers", marker=marker, showlegend=False), **at)
    figure.update_xaxes(title_text="factor", row=count)
    return style(figure, 220 * count + 120)
