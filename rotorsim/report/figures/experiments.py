"""Figures of claims as functions of a factor on a number of the machine, with the interval that they are met in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.report.figures.theme import PIN_COLOURS, compact, style

Points = Sequence[tuple[float, float | None]]
Band = tuple[float, tuple[float, float]]
COLUMNS = 3


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
