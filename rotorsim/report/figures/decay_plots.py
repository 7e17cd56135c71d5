"""Impact figures over time: force pulse, ring-down and its decay envelope."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_UM
from rotorsim.report.export.display_units import quantity
from rotorsim.report.figures.theme import AXIS_COLOURS, INK, compact, style
from rotorsim.signals.impact import RingDown

MOST_POINTS = 4000
PULSE_REACH = (-0.5, 2.0)
"""The force is drawn from before to after the pulse, in lengths of the pulse."""


def ring_down_figure(downs: list[RingDown]) -> go.Figure:
    """A column per axis hit: force [N] over ms above, disc [um] over s with the fitted envelope below."""
    titles = [f"impact along {'xy'[d.pulse.axis]}: {quantity(d.pulse.peak, 'N')}" for d in downs]
    figure = make_subplots(2, len(downs), subplot_titles=titles, vertical_spacing=0.16, horizontal_spacing=0.09,
                           row_heights=[0.32, 0.68])  # fmt: skip
    for column, down in enumerate(downs, 1):
        _add_force(figure, down, column)
        _add_motion(figure, down, column)
    figure.update_xaxes(title_text="time after the pulse begins [ms]", row=1)
    figure.update_xaxes(title_text="time after the pulse begins [s]", row=2)
    figure.update_yaxes(title_text="force [N]", row=1, col=1)
    figure.update_yaxes(title_text="disc [µm]", row=2, col=1)
    return style(figure, 600)


def _add_force(figure: go.Figure, down: RingDown, column: int) -> None:
    time, length = down.values["time"], max(down.pulse.stop - down.pulse.start, 2)
    dt = (time[-1] - time[0]) / (len(time) - 1)
    near = (time >= (PULSE_REACH[0] * length - 2) * dt) & (time <= (PULSE_REACH[1] * length) * dt)
    force = down.values["force"][near, down.pulse.axis]
    figure.add_trace(go.Scatter(x=compact(time[near] * 1e3), y=compact(force), mode="lines+markers", marker={"size": 4},
                                line={"color": INK, "width": 1.5}, showlegend=False,
                                hovertemplate="%{y:.3g} N at %{x:.1f} ms<extra></extra>"), 1, column)  # fmt: skip


def _add_motion(figure: go.Figure, down: RingDown, column: int) -> None:
    time, d = down.values["time"], down.values["disc"] * TO_UM
    shown = slice(0, _end(down))
    step = 1 + len(time[shown]) // MOST_POINTS
    for k in (1 - down.pulse.axis, down.pulse.axis):
        axis = "xy"[k]
        line = {"color": AXIS_COLOURS[axis], "width": 1.4, "simplify": False}
        figure.add_trace(go.Scatter(x=compact(time[shown][::step]), y=compact(d[shown, k][::step]), mode="lines",
                                    name=f"disc {axis}", legendgroup=axis, legendrank=k,
                                    showlegend=column == 1, line=line,
                                    hovertemplate="%{y:.3g} µm at %{x:.4f} s<extra></extra>"), 2, column)  # fmt: skip
    if down.decay is None:
        return
    at = np.linspace(0, float(time[shown][-1]), 120)
    size = down.decay.amplitude * np.exp(-down.decay.rate * at) * TO_UM
    for sign in (1, -1):
        figure.add_trace(go.Scatter(x=compact(at), y=compact(sign * size), mode="lines", hoverinfo="skip",
                                    name="fitted envelope", legendgroup="fit", legendrank=2,
                                    showlegend=column == 1 and sign > 0,
                                    line={"color": INK, "width": 1.3, "dash": "dash"}), 2, column)  # fmt: skip


def _end(down: RingDown) -> int:
    """Samples drawn: until the fitted envelope has fallen to a fiftieth, or all."""
    time = down.values["time"]
    if down.decay is None or down.decay.rate <= 0:
        return len(time)
    return max(50, int(np.searchsorted(time, np.log(50) / down.decay.rate)))
