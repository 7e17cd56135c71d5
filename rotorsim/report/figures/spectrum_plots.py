"""Spectra of a steady motion with order marks."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_UM
from rotorsim.report.figures.theme import AXIS_COLOURS, INK, NEUTRAL, compact, faint, style
from rotorsim.signals.spectra import SensorError, Spectrum

ORDERS = (1, 2, 3)
DECADES = 5.0


def spectrum_figure(spectrum: Spectrum, turning: float) -> go.Figure:
    """Disc x and disc y (single-sided) above the full spectrum of x + i y, amplitudes 0-pk [um]; 1X at `turning` Hz."""
    figure = make_subplots(2, 1, vertical_spacing=0.18)
    add_single(figure, spectrum, 1)
    figure.add_trace(_line(spectrum.signed, spectrum.full, "x + i y", NEUTRAL), 2, 1)
    figure.update_xaxes(range=[0, float(spectrum.frequency[-1])], row=1)
    edge = float(np.abs(spectrum.signed).max())
    figure.update_xaxes(range=[-edge, edge], title_text="frequency [Hz], backward below 0, forward above", row=2)
    figure.update_xaxes(title_text="frequency [Hz]", row=1)
    for row, values, what in ((1, spectrum.single, "disc x, disc y"), (2, spectrum.full, "x + i y")):
        set_log_axis(figure, values, row)
        figure.update_yaxes(title_text=f"{what}<br>[µm 0-pk]", row=row)
    mark_orders(figure, turning, float(spectrum.frequency[-1]), 1, ORDERS)
    mark_orders(figure, turning, edge, 2, (-3, -2, -1, *ORDERS))
    return style(figure, 640)


def difference_figure(difference: SensorError, turning: float) -> go.Figure:
    """Spectrum of measured less true displacement, amplitudes 0-pk [um]."""
    spectrum = difference.spectrum
    figure = make_subplots(1, 1)
    add_single(figure, spectrum, 1)
    figure.update_xaxes(title_text="frequency [Hz]", range=[0, float(spectrum.frequency[-1])])
    set_log_axis(figure, spectrum.single, 1)
    figure.update_yaxes(title_text="difference [µm 0-pk]")
    mark_orders(figure, turning, float(spectrum.frequency[-1]), 1, ORDERS)
    return style(figure, 380)


def add_single(figure: go.Figure, spectrum: Spectrum, row: int) -> None:
    """Lines of x and y."""
    for k, axis in enumerate("xy"):
        trace = _line(spectrum.frequency, spectrum.single[:, k], f"disc {axis}", AXIS_COLOURS[axis])
        figure.add_trace(trace.update(showlegend=True), row, 1)


def _line(frequency: np.ndarray, size: np.ndarray, name: str, colour: str) -> go.Scatter:
    return go.Scatter(x=compact(frequency, 6), y=compact(np.maximum(size * TO_UM, 1e-9)), mode="lines", name=name,
                      showlegend=False, line={"color": colour, "width": 1.2, "simplify": False},
                      hovertemplate="%{y:.3g} µm at %{x:.1f} Hz<extra></extra>")  # fmt: skip


def set_log_axis(figure: go.Figure, values: np.ndarray, row: int) -> None:
    """Decades below the largest value, no further than just below the usual floor."""
    um = np.maximum(values * TO_UM, 1e-9)
    top = float(np.log10(um.max())) + 0.4
    floor = max(float(np.log10(np.median(um))) - 1.0, top - DECADES)
    figure.update_yaxes(type="log", range=[min(floor, top - 2), top], dtick=1, exponentformat="power", row=row)


def mark_orders(figure: go.Figure, turning: float, edge: float, row: int, orders: tuple[int, ...]) -> None:
    """Dotted lines at multiples of `turning` [Hz] within the axis, far enough apart to be read."""
    for n in orders if turning > edge / 100 else ():
        if abs(n) * turning < edge:
            figure.add_vline(x=n * turning, line={"color": faint(INK, 0.55), "width": 1, "dash": "dot"}, row=row, col=1,
                             annotation={"text": f"{n}X".replace("-", "−"), "yanchor": "bottom"},
                             annotation_position="top")  # fmt: skip
