"""Figures of static gain and actuator hysteresis from a staircase."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_UM
from rotorsim.report.figures.theme import AXIS_COLOURS, INK, PIN_COLOURS, compact, faint, style
from rotorsim.signals.static_gain import Branches, HysteresisLoop

SYMBOLS = {True: "triangle-up", False: "triangle-down-open"}


def gain_figure(gains: list[Branches]) -> go.Figure:
    """A column per input: rests of disc x and y [um] over the reference [V] with their line; below, deviations."""
    titles = [f"reference {'xy'[g.axis]}" for g in gains]
    figure = make_subplots(2, len(gains), shared_xaxes=True, shared_yaxes="rows", subplot_titles=titles,
                           vertical_spacing=0.06, horizontal_spacing=0.05, row_heights=[0.62, 0.38])  # fmt: skip
    for column, gain in enumerate(gains, 1):
        for k, axis in enumerate("xy"):
            _add_fit(figure, gain, k, axis, column)
            for row, values in ((1, gain.position - gain.offset), (2, gain.deviation)):
                for rising in (True, False):
                    figure.add_trace(_rests(gain, values[:, k] * TO_UM, rising, axis, row == column == 1), row, column)
        figure.update_xaxes(title_text=f"reference {'xy'[gain.axis]} [V]", row=2, col=column)
    figure.update_yaxes(title_text="disc at rest, from the<br>line's value at 0 V [µm]", row=1, col=1)
    figure.update_yaxes(title_text="deviation from<br>the line [µm]", row=2, col=1)
    figure.add_hline(y=0, line={"color": faint(INK, 0.5), "width": 1}, row=2)
    return style(figure, 600)


def _rests(gain: Branches, um: np.ndarray, rising: bool, axis: str, legend: bool) -> go.Scatter:
    chosen = gain.rising == rising
    return go.Scatter(
        x=compact(gain.reference[chosen]), y=compact(um[chosen]), mode="markers", showlegend=legend,
        name=f"disc {axis}, {'rising' if rising else 'falling'}", legendgroup=f"{axis}{rising}",
        marker={"color": AXIS_COLOURS[axis], "symbol": SYMBOLS[rising], "size": 8, "line": {"width": 1.2}},
        hovertemplate="%{y:.3g} µm at %{x:.3g} V<extra></extra>",
    )  # fmt: skip


def _add_fit(figure: go.Figure, gain: Branches, k: int, axis: str, column: int) -> None:
    ends = np.array([gain.reference.min(), gain.reference.max()])
    figure.add_trace(go.Scatter(x=compact(ends), y=compact(gain.gain[k] * ends * TO_UM), mode="lines", hoverinfo="skip",
                                line={"color": faint(AXIS_COLOURS[axis], 0.6), "width": 1.5},
                                showlegend=False), 1, column)  # fmt: skip


def loop_figure(loops: list[HysteresisLoop]) -> go.Figure:
    """Pin positions at rest [um] over the reference [V], a panel per driving axis, lines in order of time."""
    axes = sorted({loop.axis for loop in loops})
    figure = make_subplots(1, len(axes), shared_yaxes=True, horizontal_spacing=0.05,
                           subplot_titles=[f"pins driven by reference {'xy'[a]}" for a in axes])  # fmt: skip
    for loop in loops:
        figure.add_trace(_loop(loop), 1, axes.index(loop.axis) + 1)
    for column, axis in enumerate(axes, 1):
        figure.update_xaxes(title_text=f"reference {'xy'[axis]} [V]", row=1, col=column)
    figure.update_yaxes(title_text="pin at rest [µm]", row=1, col=1)
    return style(figure, 460)


def _loop(loop: HysteresisLoop) -> go.Scatter:
    colour = PIN_COLOURS[(loop.injector - 1) % len(PIN_COLOURS)]
    symbols = [SYMBOLS[bool(r)] for r in loop.rising]
    return go.Scatter(
        x=compact(loop.reference), y=compact(loop.pin * TO_UM), mode="lines+markers", name=f"pin {loop.injector}",
        line={"color": colour, "width": 1.3}, marker={"symbol": symbols, "size": 7},
        hovertemplate=f"pin {loop.injector}: %{{y:.4g}} µm at %{{x:.3g}} V<extra></extra>",
    )  # fmt: skip
