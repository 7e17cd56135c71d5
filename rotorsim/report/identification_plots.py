"""Identified values over the operating grid beside those of the linearised physics."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.report.theme import PIN_COLOURS, compact, style

LINE = 60


def over_speed(
    points: np.ndarray,
    panels: Sequence[tuple[str, np.ndarray, np.ndarray | None, Callable[[float, float], float] | None]],
) -> go.Figure:
    """A panel per quantity over speed [rpm], a colour per pressure.

    panels: title, identified (k,) as dots, physics (k,) as crosses or None, surface f(speed, pressure) as line or None;
    points (k, 2) [rad/s, Pa].
    """
    columns = 2 if len(panels) < 5 else 4
    count = -(-len(panels) // columns)
    figure = make_subplots(count, columns, subplot_titles=[p[0] for p in panels], vertical_spacing=0.22 / count,
                           horizontal_spacing=0.07)  # fmt: skip
    pressures = np.unique(np.round(points[:, 1], -3))
    for number, (_, dots, crosses, surface) in enumerate(panels):
        at = {"row": number // columns + 1, "col": number % columns + 1}
        for k, pressure in enumerate(pressures):
            chosen = np.abs(points[:, 1] - pressure) < 1500
            colour, first = PIN_COLOURS[k % len(PIN_COLOURS)], number == 0
            rpm, name = points[chosen, 0] * 30 / np.pi, f"{pressure * 1e-6:.2f} MPa"
            drawn = [("identified", dots, "circle", 7)] + (
                [("physics", crosses, "x-thin-open", 8)] if crosses is not None else []
            )
            for label, values, symbol, size in drawn:
                marker = {"color": colour, "symbol": symbol, "size": size}
                figure.add_trace(go.Scatter(x=compact(rpm), y=compact(np.asarray(values)[chosen]), mode="markers",
                                            name=f"{label}, {name}", legendgroup=name, showlegend=first,
                                            marker=marker), **at)  # fmt: skip
            if surface is not None and chosen.any():
                grid = np.linspace(points[chosen, 0].min(), points[chosen, 0].max(), LINE)
                heights = np.array([surface(float(w), float(pressure)) for w in grid])
                figure.add_trace(go.Scatter(x=compact(grid * 30 / np.pi), y=compact(heights), mode="lines", name=name,
                                            legendgroup=name, showlegend=False, hoverinfo="skip",
                                            line={"color": colour, "width": 1}), **at)  # fmt: skip
    figure.update_xaxes(title_text="speed [rpm]", row=count)
    return style(figure, 260 * count + 120)
