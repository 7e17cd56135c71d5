"""Probes of a record: orbits at the planes where two of them see x and y, and every reading over time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from identification.records.sensors import probe_outputs
from rotorsim.base.constants import TO_UM
from rotorsim.report.figures.orbit_plots import COLOURS, draw_orbit, instants, middle, stretch
from rotorsim.report.figures.theme import PIN_COLOURS, compact, faint, style
from rotorsim.report.pages.run import Run
from rotorsim.signals.probes import READINGS, SHOWN, names, units
from rotorsim.signals.record_blocks import envelopes

Planes = Sequence[tuple[str, ...]]


def plane_orbits(run: Run, planes: Planes) -> go.Figure:
    """Orbits [um] at each plane, a row, at the resonances and at the end, about their middle."""
    moments = instants(run)
    titles = [f"{i.label}, {i.rpm:.0f} rpm" for i in moments] + [""] * len(moments) * (len(planes) - 1)
    figure = make_subplots(
        len(planes), len(moments), subplot_titles=titles, vertical_spacing=0.4 / (len(planes) + 2),
        horizontal_spacing=0.08,
    )  # fmt: skip
    for row, plane in enumerate(planes, 1):
        for column, moment in enumerate(moments, 1):
            part = stretch(run, moment)
            d = probe_outputs(part, plane)["disc_measured"].values * TO_UM
            angle = np.asarray(part["angle"].values, float)
            draw_orbit(figure, middle(d), angle, COLOURS["disc"], (row, column, len(moments)))
        figure.update_yaxes(title_text=f"{', '.join(plane)}<br>y [µm]", row=row, col=1)
        figure.update_xaxes(title_text="x [µm]", row=row)
    return style(figure, 100 + 330 * len(planes), showlegend=False)


def probe_readings(run: Run) -> go.Figure:
    """Envelopes of all readings against time, one panel for each probe."""
    known, scales = names(run.record), [SHOWN[unit] for unit in units(run.record)]
    data = envelopes(run.record, [READINGS])[READINGS]
    figure = make_subplots(len(known), 1, shared_xaxes=True, vertical_spacing=0.12 / (len(known) + 2))
    for k, (name, (unit, scale)) in enumerate(zip(known, scales, strict=True)):
        colour = PIN_COLOURS[k % len(PIN_COLOURS)]
        common = {"x": compact(data.time), "mode": "lines", "line": {"color": colour, "width": 1},
                  "hovertemplate": "%{y:.4g} at %{x:.2f} s<extra></extra>"}  # fmt: skip
        figure.add_trace(go.Scatter(y=compact(data.least[:, k] * scale), **common), k + 1, 1)
        figure.add_trace(
            go.Scatter(y=compact(data.most[:, k] * scale), fill="tonexty", fillcolor=faint(colour), **common), k + 1, 1
        )
        figure.update_yaxes(title_text=f"{name}<br>[{unit}]", nticks=4, row=k + 1, col=1)
    figure.update_xaxes(range=run.time_reach)
    figure.update_xaxes(title_text="time [s]", row=len(known), col=1)
    return style(figure, 90 + 125 * len(known), showlegend=False)
