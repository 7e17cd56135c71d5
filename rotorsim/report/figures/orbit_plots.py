"""Orbits of disc and journal at the resonances and at the end of a run, with keyphasor marks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_UM
from rotorsim.plant.journal_room import journal_room
from rotorsim.report.figures.theme import GRID, INK, NEUTRAL, compact, faint, style
from rotorsim.report.pages.run import Run
from rotorsim.signals.record_blocks import displacement_name

TURNS, MOST_POINTS, MOST_ORBITS = 4, 1500, 4
COLOURS = {"disc": "#0072B2", "journal": NEUTRAL}


@dataclass(frozen=True)
class Instant:
    """A moment worth an orbit: why, time [s] and speed [rpm]."""

    label: str
    time: float
    rpm: float


def instants(run: Run) -> list[Instant]:
    """The largest resonances at distinct speeds, in order of speed, then the end of the run."""
    speeds = run.summary["speed_rpm"]
    chosen: list[Instant] = []
    for peak in sorted(run.summary["peaks"], key=lambda p: -p["um"]):
        apart = all(abs(peak["rpm"] - other.rpm) > 0.07 * abs(speeds["max"]) for other in chosen)
        if peak["local_maximum"] and apart and len(chosen) < MOST_ORBITS - 1:
            chosen.append(Instant(f"{peak['order']}X peak", peak["time_s"], peak["rpm"]))
    return [*sorted(chosen, key=lambda i: i.rpm), Instant("end", run.time_reach[1], speeds["last"])]


def orbits(run: Run) -> go.Figure:
    """Four revolutions of the disc about its mean, and of each journal within its clearance circle [um]."""
    moments = instants(run)
    rows = [displacement_name(run.record), *journal_names(run)]
    titles = [f"{i.label}, {i.rpm:.0f} rpm" for i in moments] + [""] * len(moments) * (len(rows) - 1)
    figure = make_subplots(
        len(rows), len(moments), subplot_titles=titles, vertical_spacing=0.13, horizontal_spacing=0.08
    )
    for column, moment in enumerate(moments, 1):
        for row, name in enumerate(rows, 1):
            _add_orbit(figure, run, name, moment, row, column)
    for row, name in enumerate(rows, 1):
        shown = f"journal {name}" if name in _bearings(run) else name.split("_")[0]
        figure.update_yaxes(title_text=f"{shown} y [µm]", row=row, col=1)
        figure.update_xaxes(title_text=f"{shown} x [µm]", row=row)
    return style(figure, 100 + 330 * len(rows), showlegend=False)


def journal_names(run: Run) -> list[str]:
    """Names of the bearings whose journals a record holds, 'journal' for the only one."""
    return _bearings(run) or ["journal"] * ("journal" in run.record)


def _bearings(run: Run) -> list[str]:
    return [str(name) for name in run.record["bearing"].values] if "journals" in run.record else []


def _add_orbit(figure: go.Figure, run: Run, name: str, moment: Instant, row: int, column: int) -> None:
    d, angle = cut(run, name, moment)
    journals = journal_names(run)
    if name in journals:
        _add_room(figure, run, journals.index(name), row, column)
    else:
        d = middle(d)
    colour = COLOURS["journal" if name in journals else "disc"]
    draw_orbit(figure, d, angle, colour, (row, column, len(instants(run))))


def middle(d: np.ndarray) -> np.ndarray:
    """Displacement (n, 2) about the middle of its range."""
    return np.asarray(d - (d.max(axis=0) + d.min(axis=0)) / 2)


def draw_orbit(figure: go.Figure, d: np.ndarray, angle: np.ndarray, colour: str, place: tuple[int, int, int]) -> None:
    """An orbit (n, 2) [um] with dots at whole turns of the angle [rad], in a panel: row, column, columns in all."""
    row, column, columns = place
    dots = marks(d, angle)
    step = 1 + len(d) // MOST_POINTS
    shown = {"showlegend": False, "hovertemplate": "x %{x:.2f} µm, y %{y:.2f} µm<extra></extra>"}
    line = {"color": colour, "width": 1.5, "simplify": False}
    figure.add_trace(go.Scatter(x=compact(d[::step, 0]), y=compact(d[::step, 1]), mode="lines", line=line, **shown),
                     row, column)  # fmt: skip
    figure.add_trace(go.Scatter(x=compact(dots[:, 0]), y=compact(dots[:, 1]), mode="markers",
                                marker={"color": INK, "size": 5}, **shown), row, column)  # fmt: skip
    square_axes(figure, (row - 1) * columns + column, row, column)


def square_axes(figure: go.Figure, number: int, row: int, column: int) -> None:
    """The same scale on both axes of panel `number`, counted from 1."""
    figure.update_xaxes(constrain="domain", row=row, col=column)
    figure.update_yaxes(scaleanchor=f"x{number}" if number > 1 else "x", constrain="domain", row=row, col=column)


def cut(run: Run, name: str, moment: Instant) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [um] (n, 2) and angle [rad] of some revolutions about a moment, within the record."""
    part = stretch(run, moment)
    bearings = _bearings(run)
    if name in bearings:
        part = part.isel(bearing=bearings.index(name)).rename({"journals": name})
    return np.asarray(part[name].values, float) * TO_UM, np.asarray(part["angle"].values, float)


def stretch(run: Run, moment: Instant) -> xr.Dataset:
    """Part of the record with some revolutions about a moment."""
    n = run.record.sizes["time"]
    first = float(run.record["time"].isel(time=0))
    rate = (n - 1) / run.summary["duration_s"]
    turn = min(60 / abs(moment.rpm) if moment.rpm else 1.0, 10.0)
    count = int(min(n, max(2, round(TURNS * turn * rate) + 1)))
    start = int(np.clip(round((moment.time - first) * rate) - count // 2, 0, n - count))
    return run.record.isel(time=slice(start, start + count))


def marks(d: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Positions (k, 2) where the shaft has turned whole revolutions."""
    turns = angle / (2 * np.pi)
    i = np.flatnonzero(np.diff(np.floor(turns)))
    share = (np.maximum(np.floor(turns[i]), np.floor(turns[i + 1])) - turns[i]) / (turns[i + 1] - turns[i])
    return d[i] + share[:, None] * (d[i + 1] - d[i])


def _add_room(figure: go.Figure, run: Run, film: int, row: int, column: int) -> None:
    """Room of a journal, whose edge its centre cannot cross without contact: in a plain sleeve the clearance circle."""
    if run.machine is None or film >= len(run.machine.films):
        return
    turn = np.linspace(0, 2 * np.pi, 121)
    c = journal_room(run.machine, film, turn, float(np.abs(run.record["speed"]).max())) * TO_UM
    line = {"color": "#8a949e", "width": 1.5, "dash": "dash"}
    figure.add_trace(go.Scatter(x=compact(c * np.cos(turn)), y=compact(c * np.sin(turn)), mode="lines", line=line,
                                fill="toself", fillcolor=faint(GRID, 0.35),
                                hoverinfo="skip", showlegend=False), row, column)  # fmt: skip
