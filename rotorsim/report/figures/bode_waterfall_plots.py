"""Bode plots of the orders and waterfall plots over speed."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_UM
from rotorsim.report.figures.phase import FAINTEST, phase_axes, phase_lag
from rotorsim.report.figures.theme import AXIS_COLOURS, INK, SPECTRUM_SCALE, compact, faint, style
from rotorsim.report.pages.run import Run

MOST_POINTS, MOST_LINES = 1500, 250
FEW = 8
"""So many windows are marked each."""
DECADES = 3.5
"""Range of the colour scale of spectra."""


def bode(run: Run) -> go.Figure:
    """Amplitude (0-pk, um) over phase lag (deg) of every tracked order against speed."""
    orders = [int(n) for n in run.tracked["order"].values]
    least = faintest(run)
    figure = make_subplots(2, len(orders), shared_xaxes=True, vertical_spacing=0.06, horizontal_spacing=0.07,
                           row_heights=[0.6, 0.4], subplot_titles=[f"{n}X" for n in orders])  # fmt: skip
    for column, n in enumerate(orders, 1):
        for axis in AXIS_COLOURS:
            for row, trace in enumerate(order_traces(run, n, axis), 1):
                figure.add_trace(trace.update(showlegend=row == column == 1), row, column)
        own = float(np.abs(run.tracked["amplitude"].sel(order=n).values).max(initial=0.0))
        figure.update_yaxes(range=[0, 1.06 * TO_UM * max(own, least)] if least else None, row=1, col=column)
    figure.update_xaxes(range=run.reach)
    figure.update_xaxes(title_text=run.abscissa(run.tracked)[1], row=2)
    figure.update_yaxes(title_text="amplitude [µm 0-pk]", row=1, col=1)
    phase_axes(figure, 2)
    return style(figure, 560)


def order_traces(run: Run, order: int, axis: str) -> tuple[go.Scatter, go.Scatter]:
    """Amplitude and phase lag of one order and axis."""
    tracked = run.tracked.isel(window=slice(None, None, 1 + run.tracked.sizes["window"] // MOST_POINTS))
    at, label = run.abscissa(tracked)
    a = tracked["amplitude"].sel(order=order, axis=axis).values
    unit = label.split("[")[1][:-1]
    common = {"x": compact(at, 6), "name": f"disc {axis}", "legendgroup": axis,
              "mode": "lines" if tracked.sizes["window"] > FEW else "lines+markers",
              "line": {"color": AXIS_COLOURS[axis], "width": 2, "simplify": False}}  # fmt: skip
    hover = f"{order}X {axis}: %{{y:.3g}} {{}} at %{{x:.0f}} {unit}<extra></extra>"
    return (
        go.Scatter(y=compact(np.abs(a) * TO_UM), hovertemplate=hover.replace("{}", "µm"), **common),
        go.Scatter(y=compact(phase_lag(a, faintest(run))), hovertemplate=hover.replace("{}", "deg"), **common),
    )


def faintest(run: Run) -> float:
    """Amplitude [m] below which an order counts as absent."""
    return FAINTEST * float(np.abs(run.tracked["amplitude"].values).max(initial=0.0))


def waterfall_map(run: Run) -> go.Figure:
    """Amplitude spectra of disc x and disc y against speed, with the order lines."""
    figure = make_subplots(1, 2, shared_yaxes=True, horizontal_spacing=0.06, subplot_titles=["disc x", "disc y"])
    for column, axis in enumerate("xy", 1):
        size = run.spectra["amplitude"].sel(axis=axis).values
        figure.add_trace(spectrum_trace(run, "frequency", size), 1, column)
        add_order_lines(figure, run, (1, 2, 3), 1, column)
    return _finish(figure, run, 460, "frequency [Hz]")


def full_spectrum_map(run: Run) -> go.Figure:
    """Spectra of x + i y against speed: forward whirl above zero, backward whirl below."""
    figure = make_subplots(1, 1)
    figure.add_trace(spectrum_trace(run, "signed_frequency", run.spectra["full"].values), 1, 1)
    add_order_lines(figure, run, (-3, -2, -1, 1, 2, 3), 1, 1)
    figure.add_hline(y=0, line={"color": INK, "width": 1})
    for text, y in (("forward", 0.98), ("backward", 0.02)):
        figure.add_annotation(text=text, x=0.01, y=y, xref="paper", yref="paper", showarrow=False)
    return _finish(figure, run, 520, "frequency [Hz]")


def spectrum_trace(run: Run, axis: str, size: np.ndarray) -> go.Heatmap:
    """Heat map of the decimal logarithm of amplitudes (line, frequency) [m], at most 250 frequencies."""
    frequency = run.spectra[axis].values
    group = -(-frequency.size // MOST_LINES)
    starts = np.arange(0, frequency.size, group)
    um = np.maximum.reduceat(size, starts, axis=1).T * TO_UM
    at = np.add.reduceat(frequency, starts) / np.diff(np.append(starts, frequency.size))
    across, label = run.abscissa(run.spectra)
    unit, rising = label.split("[")[1][:-1], np.argsort(across, kind="stable")
    um = um[:, rising]
    return go.Heatmap(
        x=compact(across[rising], 6), y=compact(at), z=compact(np.log10(np.maximum(um, 1e-9)), 4),
        customdata=compact(um, 3), coloraxis="coloraxis",
        hovertemplate=f"%{{customdata:.3g}} µm at %{{y:.0f}} Hz, %{{x:.0f}} {unit}<extra></extra>",
    )  # fmt: skip


def add_order_lines(figure: go.Figure, run: Run, orders: tuple[int, ...], row: int, col: int) -> None:
    """Dotted lines at multiples of the shaft speed, each labelled at its right end."""
    at, turning = run.abscissa(run.spectra)[0], np.abs(run.spectra["speed"].values) / (2 * np.pi)
    right = int(at.argmax())
    for n in orders if turning[right] > 0 else ():
        line = {"color": faint(INK, 0.45), "width": 1, "dash": "dot"}
        figure.add_trace(go.Scatter(x=compact(at), y=compact(n * turning), mode="lines", line=line,
                                    showlegend=False, hoverinfo="skip"), row, col)  # fmt: skip
        figure.add_annotation(x=max(float(at[right]), *run.reach), y=n * turning[right], 
                              text=f"{n}X".replace("-", "−"), showarrow=False,
                              xanchor="left", yanchor="middle", xshift=2, row=row, col=col)  # fmt: skip


def colour_axis(run: Run) -> dict[str, object]:
    """Logarithmic colour scale in um, the same for all spectra of a run."""
    largest = max(float(run.spectra["full"].max()), float(run.spectra["amplitude"].max())) * TO_UM
    top = np.log10(max(largest, 1e-6))
    ticks = np.arange(np.ceil(top - DECADES), np.floor(top) + 1)
    bar = {"title": {"text": "µm 0-pk", "side": "right"}, "x": 1.04, "thickness": 14, "outlinewidth": 0,
           "tickvals": ticks, "ticktext": [f"{10.0**t:g}" for t in ticks]}  # fmt: skip
    return {"colorscale": SPECTRUM_SCALE, "cmin": top - DECADES, "cmax": top, "colorbar": bar}


def _finish(figure: go.Figure, run: Run, height: int, label: str) -> go.Figure:
    figure.update_xaxes(title_text=run.abscissa(run.spectra)[1], range=run.reach)
    frequency = figure.data[0].y
    figure.update_yaxes(range=[min(0.0, float(frequency[0])), float(frequency[-1])])
    figure.update_yaxes(title_text=label, col=1)
    style(figure, height, coloraxis=colour_axis(run))
    for side in (figure.update_xaxes, figure.update_yaxes):
        side(showgrid=False)
    return figure
