"""Figure of runout over the shaft angle and its harmonics."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_UM
from rotorsim.report.figures.theme import AXIS_COLOURS, compact, faint, style
from rotorsim.signals.probes import RunoutProfile


def runout_figure(runout: RunoutProfile) -> go.Figure:
    """Mean per angle [um] with a band of one standard deviation, next to the harmonics' amplitudes 0-pk [um]."""
    figure = make_subplots(1, 2, column_widths=[0.66, 0.34], horizontal_spacing=0.1,
                           subplot_titles=["mean over the revolutions", "harmonics"])  # fmt: skip
    for k, axis in enumerate("xy"):
        for trace in _profile(runout, k, axis):
            figure.add_trace(trace, 1, 1)
        figure.add_trace(_bars(runout, k, axis), 1, 2)
    figure.update_xaxes(title_text="shaft angle [deg]", range=[0, 360], tickvals=[0, 90, 180, 270, 360], col=1)
    figure.update_xaxes(title_text="order", dtick=1, col=2)
    figure.update_yaxes(title_text="runout [µm]", col=1)
    figure.update_yaxes(title_text="amplitude [µm 0-pk]", rangemode="tozero", col=2)
    return style(figure, 440, barmode="group")


def _profile(runout: RunoutProfile, k: int, axis: str) -> list[go.Scatter]:
    degrees, mean, spread = np.degrees(runout.angle), runout.mean[:, k] * TO_UM, runout.scatter[:, k] * TO_UM
    edge = {"x": compact(degrees), "mode": "lines", "line": {"width": 0}, "showlegend": False, "hoverinfo": "skip"}
    return [
        go.Scatter(y=compact(mean - spread), **edge),
        go.Scatter(y=compact(mean + spread), fill="tonexty", fillcolor=faint(AXIS_COLOURS[axis]), **edge),
        go.Scatter(x=compact(degrees), y=compact(mean), mode="lines", name=f"disc {axis}", legendgroup=axis,
                   line={"color": AXIS_COLOURS[axis], "width": 2},
                   hovertemplate="%{y:.3g} µm at %{x:.0f} deg<extra></extra>"),
    ]  # fmt: skip


def _bars(runout: RunoutProfile, k: int, axis: str) -> go.Bar:
    size = np.abs(runout.harmonic[:, k]) * TO_UM
    return go.Bar(x=np.arange(1, size.size + 1), y=compact(size), marker={"color": AXIS_COLOURS[axis]},
                  name=f"disc {axis}", legendgroup=axis, showlegend=False,
                  hovertemplate="%{x}X: %{y:.3g} µm<extra></extra>")  # fmt: skip
