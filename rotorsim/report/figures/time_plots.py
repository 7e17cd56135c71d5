"""Overview of a run over time: envelopes of speed, disc, film thickness, mass flow, pressure and contact."""

from __future__ import annotations

from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_RPM, TO_UM
from rotorsim.report.figures.theme import AXIS_COLOURS, NEUTRAL, compact, faint, style
from rotorsim.report.pages.run import Run
from rotorsim.signals.record_blocks import Envelope, displacement_name, envelopes

FILM_COLOURS = (NEUTRAL, "#CC79A7", "#E69F00", "#56B4E9")
PANELS = {
    "speed": ("speed<br>[rpm]", TO_RPM),
    "disc": ("disc<br>[µm]", TO_UM),
    "disc_measured": ("disc<br>[µm]", TO_UM),
    "h_min": ("smallest film<br>[µm]", TO_UM),
    "film_thickness": ("smallest film<br>[µm]", TO_UM),
    "mass_flow": ("mass flow<br>[mg/s]", 1e6),
    "film_flow": ("mass flow<br>[mg/s]", 1e6),
    "pressure": ("injection<br>[MPa gauge]", 1e-6),
    "temperature_rise": ("warmer by<br>[K]", 1.0),
    "contact": ("contact<br>[% of time]", 100.0),
}


BY_BEARING = {"film_thickness": "h_min", "film_flow": "mass_flow"}
"""Variables of each of several films, and those of all that they stand for."""


def overview(run: Run) -> go.Figure:
    """Envelopes against time, one panel per variable, each of several films; contact only if there was any."""
    skipped = {"disc", "disc_measured"} - {displacement_name(run.record)}
    skipped |= {total for name, total in BY_BEARING.items() if name in run.record}
    if not (run.summary["mass_flow"] or {}).get("max_kg_s"):
        skipped |= {"mass_flow", "film_flow", "pressure"} if unfed(run) else set()
    if not (run.summary["contact"] or {}).get("samples"):
        skipped.add("contact")
    if run.fastest == 0:
        skipped.add("speed")
    names = [name for name in PANELS if name in run.record and name not in skipped]
    data = envelopes(run.record, names)
    figure = make_subplots(len(names), 1, shared_xaxes=True, vertical_spacing=0.03)
    for row, name in enumerate(names, 1):
        label, scale = PANELS[name]
        for trace in _panel(run, name, data[name], scale):
            figure.add_trace(trace, row, 1)
        figure.update_yaxes(title_text=label, nticks=4, row=row, col=1)
        if name in ("speed", "pressure", "contact"):
            figure.update_yaxes(rangemode="tozero", row=row, col=1)
    figure.update_xaxes(range=run.time_reach)
    figure.update_xaxes(title_text="time [s]", row=len(names), col=1)
    return style(figure, 90 + 125 * len(names))


def unfed(run: Run) -> bool:
    """Whether the record's machine supplies no gas to its films."""
    return run.machine is not None and not run.machine.fed


def _panel(run: Run, name: str, data: Envelope, scale: float) -> list[go.Scatter]:
    if name == "contact":
        return [_line(data.time, data.mean > 0, data.mean * scale, "#CC3311")]
    if name in BY_BEARING:
        names, legend = run.record["bearing"].values, name == next(n for n in BY_BEARING if n in run.record)
        return [t for i, own in enumerate(names)
                for t in _band(data, scale, FILM_COLOURS[i % len(FILM_COLOURS)], f"film {own}", i, legend)]  # fmt: skip
    if name == "temperature_rise":
        bodies = run.record["body"].values
        return [t for i, body in enumerate(bodies)
                for t in _band(data, scale, FILM_COLOURS[i % len(FILM_COLOURS)], str(body), i)]  # fmt: skip
    if data.least.ndim == 2:
        return [t for i, axis in enumerate("xy") for t in _band(data, scale, AXIS_COLOURS[axis], f"disc {axis}", i)]
    return _band(data, scale, NEUTRAL, "", ...)


def _line(time: np.ndarray, shown: np.ndarray, values: np.ndarray, colour: str) -> go.Scatter:
    return go.Scatter(x=compact(time), y=compact(np.where(shown, values, 0)), mode="lines", fill="tozeroy",
                      line={"color": colour, "width": 1}, showlegend=False, name="contact",
                      hovertemplate="%{y:.1f} % of the time at %{x:.2f} s<extra></extra>")  # fmt: skip


def _band(data: Envelope, scale: float, colour: str, label: str, index: Any, legend: bool = True) -> list[go.Scatter]:
    """The stretch between least and largest value."""
    low, high = (v[:, index] if label else v for v in (data.least, data.most))
    common = {"x": compact(data.time), "mode": "lines", "line": {"color": colour, "width": 1}, "legendgroup": label,
              "hovertemplate": "%{y:.4g} at %{x:.2f} s<extra></extra>"}  # fmt: skip
    return [
        go.Scatter(y=compact(low * scale), showlegend=False, **common),
        go.Scatter(y=compact(high * scale), showlegend=bool(label) and legend, name=label, fill="tonexty",
                   fillcolor=faint(colour), **common),
    ]  # fmt: skip
