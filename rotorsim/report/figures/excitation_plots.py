"""Excitation and response over time: envelopes of the whole record and a short stretch with every sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_UM
from rotorsim.report.figures.theme import AXIS_COLOURS, PIN_COLOURS, compact, faint, style
from rotorsim.report.pages.run import Run
from rotorsim.signals.record_blocks import Envelope, envelopes, eventful_stretch

PANELS = {"reference": ("reference<br>[V]", 1.0), "disc_force": ("force on disc<br>[N]", 1.0),
          "pin": ("pins<br>[µm]", TO_UM), "disc": ("disc<br>[µm]", TO_UM)}  # fmt: skip


@dataclass(frozen=True)
class Line:
    """A line of a panel: variable, column of it, name in the legend, colour, and whether it is drawn faintly."""

    variable: str
    column: int
    name: str
    colour: str
    faint: bool = False


def panels(run: Run) -> dict[str, list[Line]]:
    """Lines per panel of what the record holds and what moves."""
    shown: dict[str, list[Line]] = {}
    for name in ("reference", "disc_force"):
        if name in run.driven:
            shown[name] = [Line(name, k, axis, AXIS_COLOURS[axis]) for k, axis in enumerate("xy")]
    if "pin" in run.record and "reference" in run.driven:
        count = min(run.record["pin"].shape[1], len(PIN_COLOURS))
        shown["pin"] = [Line("pin", k, f"pin {k + 1}", PIN_COLOURS[k]) for k in range(count)]
    both = "disc" in run.record and "disc_measured" in run.record
    shown["disc"] = [Line(run.output, k, axis, AXIS_COLOURS[axis], both) for k, axis in enumerate("xy")]
    shown["disc"] += [Line("disc", k, axis, AXIS_COLOURS[axis]) for k, axis in enumerate("xy") if both]
    return shown


def excitation_figure(run: Run) -> go.Figure:
    """Panels of reference [V], force [N], pins [um] and disc [um] as far as they move."""
    shown = panels(run)
    stretch = eventful_stretch(run.record, sorted(run.driven), run.fastest)
    names = sorted({line.variable for lines in shown.values() for line in lines})
    data = envelopes(run.record, names)
    figure = make_subplots(len(shown), 2, shared_xaxes="columns", column_widths=[0.6, 0.4], vertical_spacing=0.035,
                           horizontal_spacing=0.07,
                           subplot_titles=["whole record", "every sample of a stretch"])  # fmt: skip
    seen: set[str] = set()
    for row, (panel, lines) in enumerate(shown.items(), 1):
        label, scale = PANELS[panel]
        for line in lines:
            for trace in _band(data[line.variable], line, scale):
                figure.add_trace(trace, row, 1)
            figure.add_trace(_samples(run, line, scale, stretch, line.name not in seen), row, 2)
            seen |= set() if line.faint else {line.name}
        figure.update_yaxes(title_text=label, nticks=5, row=row, col=1)
        figure.update_yaxes(nticks=5, row=row, col=2)
    ends = run.record["time"].isel(time=[stretch.start, stretch.stop - 1]).values
    figure.update_xaxes(title_text="time [s]", row=len(shown))
    figure.update_xaxes(range=run.time_reach, col=1)
    figure.update_xaxes(range=[float(ends[0]), float(ends[1])], col=2)
    return style(figure, 110 + 165 * len(shown))


def _band(data: Envelope, line: Line, scale: float) -> list[go.Scatter]:
    """The stretch between least and largest value of each bin."""
    common = {"x": compact(data.time), "mode": "lines", "line": {"color": line.colour, "width": 1}, "showlegend": False,
              "legendgroup": line.name, "hovertemplate": "%{y:.4g} at %{x:.2f} s<extra></extra>"}  # fmt: skip
    return [
        go.Scatter(y=compact(data.least[:, line.column] * scale), **common),
        go.Scatter(
            y=compact(data.most[:, line.column] * scale), fill="tonexty", fillcolor=faint(line.colour), **common
        ),
    ]


def _samples(run: Run, line: Line, scale: float, stretch: slice, legend: bool) -> go.Scatter:
    part = run.record[line.variable].isel(time=stretch)
    values = np.asarray(part.values[:, line.column], float) * scale
    held = line.variable in ("reference", "disc_force")
    colour = faint(line.colour, 0.4) if line.faint else line.colour
    return go.Scatter(
        x=compact(run.record["time"].isel(time=stretch).values, 7), y=compact(values), mode="lines", name=line.name,
        line={"color": colour, "width": 1.5, "shape": "vh" if held else "linear", "simplify": False},
        showlegend=legend and not line.faint, legendgroup=line.name, 
        hovertemplate="%{y:.4g} at %{x:.4f} s<extra></extra>",
    )  # fmt: skip
