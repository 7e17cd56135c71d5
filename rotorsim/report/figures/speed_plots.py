"""Figure of a coast-down: speed and deceleration over time."""

from __future__ import annotations

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_RPM
from rotorsim.report.figures.theme import NEUTRAL, compact, style
from rotorsim.signals.orders import Deceleration


def deceleration_figure(found: Deceleration) -> go.Figure:
    """Speed [rpm] over deceleration [rpm/s]."""
    figure = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06)
    for row, values, unit in ((1, found.speed, "rpm"), (2, found.rate, "rpm/s")):
        figure.add_trace(
            go.Scatter(
                x=compact(found.time),
                y=compact(values * TO_RPM),
                mode="lines",
                showlegend=False,
                line={"color": NEUTRAL, "width": 2},
                hovertemplate=f"%{{y:.4g}} {unit} at %{{x:.2f}} s<extra></extra>",
            ),
            row,
            1,
        )
    figure.update_yaxes(title_text="speed [rpm]", rangemode="tozero", row=1)
    figure.update_yaxes(title_text="deceleration<br>[rpm/s]", rangemode="tozero", row=2)
    figure.update_xaxes(title_text="time [s]", row=2)
    return style(figure, 440)
