"""Identified values over the operating grid against the linearised physics, and fits by model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.report.page.theme import PIN_COLOURS, compact, style
from rotorsim.report.page.units import quantity

LINE = 60
MARKS = (("circle", 7), ("x-thin-open", 8), ("diamond-open", 7))


@dataclass(frozen=True)
class ComparedQuantity:
    """A quantity: title, values (k,) by the name of where they come from, surface f(speed, pressure) or None."""

    title: str
    values: dict[str, np.ndarray]
    surface: Callable[[float, float], float] | None = None


def over_speed(points: np.ndarray, panels: Sequence[ComparedQuantity]) -> go.Figure:
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
    panel: ComparedQuantity, points: np.ndarray, chosen: np.ndarray, pressure: float, colour: str, first: bool
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
