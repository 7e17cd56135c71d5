"""Orbits of a steady motion: unfiltered, 1X and 2X."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.report.figures.orbit_plots import COLOURS, Instant, cut, marks, square_axes
from rotorsim.report.figures.theme import INK, compact, style
from rotorsim.report.pages.run import Run

ORDERS = (1, 2)


def mean_orders(tracked: xr.Dataset) -> np.ndarray:
    """Mean over the windows of the complex amplitudes (order, axis) [m] of 1X and 2X."""
    return np.asarray(tracked["amplitude"].sel(order=list(ORDERS)).mean("window").values)


def ellipse(amplitude: np.ndarray, points: int = 181) -> np.ndarray:
    """Orbit (points, 2) of complex amplitudes (axis,) over one of its own turns."""
    turn = np.linspace(0, 2 * np.pi, points)[:, None]
    return np.real(amplitude[None, :] * np.exp(1j * turn))


def filtered_orbits(run: Run) -> go.Figure:
    """Raw orbit, 1X and 2X of the disc [um] about its middle, each to its own scale; dots where the mark passes."""
    middle = Instant("middle", sum(run.time_reach) / 2, run.mean_speed * TO_RPM)
    raw, angle = cut(run, run.output, middle)
    raw = raw - (raw.max(axis=0) + raw.min(axis=0)) / 2
    parts = [ellipse(a) * TO_UM for a in mean_orders(run.tracked)]
    shown = [(raw, marks(raw, angle)), *((p, p[:1]) for p in parts)]
    figure = make_subplots(1, 3, horizontal_spacing=0.09, subplot_titles=["every sample", "1X", "2X"])
    for column, (path, dots) in enumerate(shown, 1):
        look = {"showlegend": False, "hovertemplate": "x %{x:.3g} µm, y %{y:.3g} µm<extra></extra>"}
        line = {"color": COLOURS["disc"], "width": 1.2 if column == 1 else 2, "simplify": False}
        figure.add_trace(go.Scatter(x=compact(path[:, 0]), y=compact(path[:, 1]), mode="lines", line=line, **look),
                         1, column)  # fmt: skip
        figure.add_trace(go.Scatter(x=compact(dots[:, 0]), y=compact(dots[:, 1]), mode="markers",
                                    marker={"color": INK, "size": 6}, **look), 1, column)  # fmt: skip
        square_axes(figure, column, 1, column)
    figure.update_xaxes(title_text="disc x [µm]")
    figure.update_yaxes(title_text="disc y [µm]", col=1)
    return style(figure, 430)
