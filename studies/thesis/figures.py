"""Figures of the studies: impact responses, impact sizes, waterfalls, reachable speeds; numbers over a factor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.units import MPA, TO_RPM
from rotorsim.report.page import AXIS_COLOURS, GRID, INK, NEUTRAL, PIN_COLOURS, SPECTRUM_SCALE, compact, style
from rotorsim.report.units import quantity

Points = Sequence[tuple[float, float | None]]
Band = tuple[float, tuple[float, float]]
COLUMNS = 3
"""Panels in a row of figures over a factor."""


def ratios_figure(ratios: dict[str, np.ndarray]) -> go.Figure:
    """Closed over open norms of the impact response (points, 2) by law: a dot for each point, a bar for the mean."""
    figure = go.Figure()
    for axis, name in enumerate("xy"):
        colour = AXIS_COLOURS[name]
        offset = 0.18 * (2 * axis - 1)
        at = np.arange(len(ratios))
        means = np.array([r[:, axis].mean() for r in ratios.values()])
        figure.add_trace(go.Bar(x=at + offset, y=compact(means), width=0.32, marker_color=colour, opacity=0.35,
                                name=f"hits along {name}, mean"))  # fmt: skip
        xs = np.concatenate([np.full(len(r), k + offset) for k, r in enumerate(ratios.values())])
        ys = np.concatenate([r[:, axis] for r in ratios.values()])
        figure.add_trace(go.Scatter(x=xs, y=compact(ys), mode="markers", marker={"color": colour, "size": 5},
                                    name=f"along {name}, points"))  # fmt: skip
    figure.add_hline(y=1, line={"color": INK, "width": 1, "dash": "dot"})
    figure.update_xaxes(tickvals=list(range(len(ratios))), ticktext=list(ratios))
    figure.update_yaxes(title_text="closed over open loop", type="log", tickvals=[0.3, 0.5, 0.7, 1, 2, 5, 10])
    return style(figure, 440)


def sizes_figure(rows: dict[str, list[dict[str, Any]]]) -> go.Figure:
    """Closed over open loop over the size of the hit, a panel per law, a line per operating point."""
    figure = make_subplots(1, len(rows), subplot_titles=list(rows), shared_yaxes=True)
    for column, own in enumerate(rows.values(), 1):
        points = list(dict.fromkeys((row["speed"], row["pressure"]) for row in own))
        for k, (speed, pressure) in enumerate(points):
            at = [row for row in own if (row["speed"], row["pressure"]) == (speed, pressure)]
            ratio = [max(c / o for c, o in zip(row["closed"], row["open"], strict=True)) for row in at]
            name = f"{speed * TO_RPM:.0f} rpm, {quantity(pressure / MPA, 'MPa', '.1f')}"
            figure.add_trace(go.Scatter(x=[row["peak"] for row in at], y=ratio, name=name, legendgroup=name,
                                        showlegend=column == 1, line={"color": PIN_COLOURS[k]}), 1, column)  # fmt: skip
        figure.add_hline(y=1, line={"color": INK, "width": 1, "dash": "dot"}, row=1, col=column)
    figure.update_xaxes(title_text="peak of the hit [N]", type="log", tickvals=[1, 2, 5, 10, 20])
    figure.update_yaxes(title_text="closed over open, worse axis", col=1)
    return style(figure, 380)


def waterfalls_figure(runs: dict[str, dict[str, Any]]) -> go.Figure:
    """Spectra of y over speed, a panel per law, one colour scale; where the circle was left is a line."""
    columns = 3
    count = -(-len(runs) // columns)
    figure = make_subplots(count, columns, subplot_titles=list(runs), shared_xaxes=True, shared_yaxes=True,
                           vertical_spacing=0.2 / count, horizontal_spacing=0.03)  # fmt: skip
    top = 5.0
    for k, run in enumerate(runs.values()):
        at = {"row": k // columns + 1, "col": k % columns + 1}
        spectra = run["spectra"]
        rpm = np.array(spectra["speed"]) * TO_RPM / 1000
        figure.add_trace(go.Heatmap(x=compact(np.array(spectra["frequency"])), y=compact(rpm),
                                    z=compact(np.array(spectra["heights"]), 3), zmin=0, zmax=top,
                                    colorscale=SPECTRUM_SCALE, showscale=k == 0,
                                    colorbar={"title": "µm", "len": 0.5}), **at)  # fmt: skip
        line = {"color": INK, "width": 1, "dash": "dot"}
        figure.add_trace(go.Scatter(x=compact(rpm * 1000 / 60), y=compact(rpm), mode="lines", name="shaft speed",
                                    showlegend=k == 0, line=line), **at)  # fmt: skip
        for value, name, colour in ((run["speed"] if run["left"] else None, "circle left", AXIS_COLOURS["y"]),
                                    (run["onset"], "onset of whirl", NEUTRAL)):  # fmt: skip
            height = [np.nan if value is None else value * TO_RPM / 1000] * 2
            figure.add_trace(go.Scatter(x=[0, 400], y=height, mode="lines", name=name, legendgroup=name,
                                        showlegend=k == 0, line={"color": colour, "width": 1.5}), **at)  # fmt: skip
    last = max(max(run["spectra"]["speed"]) for run in runs.values()) * TO_RPM / 1000
    figure.update_xaxes(range=[0, 400])
    figure.update_yaxes(range=[0, last])
    for k in range(max(len(runs) - columns, 0), len(runs)):
        figure.update_xaxes(title_text="frequency [Hz]", showticklabels=True, row=k // columns + 1, col=k % columns + 1)
    figure.update_yaxes(title_text="speed [krpm]", col=1)
    return style(figure, 300 * count + 80)


def reach_figure(runs: dict[str, dict[str, Any]]) -> go.Figure:
    """Shaft speed [Hz] at which the circle was left and at which whirl set on, by law."""
    figure = go.Figure()
    names = list(runs)
    hertz = 1 / (2 * np.pi)
    ends = [run["speed"] * hertz for run in runs.values()]
    figure.add_trace(go.Bar(x=ends, y=names, orientation="h", marker_color=AXIS_COLOURS["x"], opacity=0.6,
                            name="circle left, or end of the run-up (hatched)",
                            marker_pattern_shape=["" if t["left"] else "/" for t in runs.values()]))  # fmt: skip
    onset = [np.nan if t["onset"] is None else t["onset"] * hertz for t in runs.values()]
    figure.add_trace(go.Scatter(x=onset, y=names, mode="markers", name="onset of whirl",
                                marker={"symbol": "diamond", "size": 11, "color": NEUTRAL}))  # fmt: skip
    figure.update_xaxes(title_text="shaft speed [Hz]", gridcolor=GRID)
    figure.update_yaxes(autorange="reversed")
    return style(figure, 90 + 36 * len(runs))


def over_factor(curves: Mapping[str, Points], bands: Mapping[str, Band]) -> go.Figure:
    """A panel for each figure, by its words: points (factor, value or None), the thesis' number and its interval."""
    count = -(-len(curves) // COLUMNS)
    figure = make_subplots(count, COLUMNS, subplot_titles=list(curves), vertical_spacing=0.3 / count)
    for k, (words, points) in enumerate(curves.items()):
        at = {"row": k // COLUMNS + 1, "col": k % COLUMNS + 1}
        known = [(f, v) for f, v in points if v is not None and isfinite(v)]
        thesis, (low, high) = bands[words]
        if isfinite(high):
            figure.add_hrect(low, high, fillcolor=PIN_COLOURS[2], opacity=0.15, line_width=0, **at)
        figure.add_hline(thesis, line={"dash": "dot", "width": 1}, **at)
        x, y = (compact(np.array(part, float)) for part in zip(*known, strict=True)) if known else ([], [])
        marker = {"color": PIN_COLOURS[0]}
        figure.add_trace(go.Scatter(x=x, y=y, mode="lines+markers", marker=marker, showlegend=False), **at)
    figure.update_xaxes(title_text="factor", row=count)
    return style(figure, 220 * count + 120)
