"""Orbits of disc and journal, at planes of probes too, dots at whole turns of the shaft; their parts at 1X and 2X.

Also what an orbit does over the speed: vectors of the orders in a polar diagram, the centreline of the shaft.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from identification.records.schema import notes_of
from identification.records.sensors import probe_outputs
from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.plant.simulation import journal_room
from rotorsim.report.page import AXIS_COLOURS, GRID, INK, NEUTRAL, compact, faint, style
from rotorsim.report.run import (
    AnalysedRun,
    VectorRun,
    end_of_run,
    need_orders,
    need_plane,
    need_time,
    need_turns,
    record_section,
    slow_roll_text,
)
from rotorsim.report.units import displacement, quantity
from rotorsim.signals.record_blocks import displacement_name, envelopes, need, probe_planes

TURNS, MOST_POINTS, MOST_ORBITS = 4, 1500, 4
COLOURS = {"disc": "#0072B2", "journal": NEUTRAL}
ORDERS = (1, 2)
Planes = Sequence[tuple[str, ...]]


@dataclass(frozen=True)
class Instant:
    """A moment worth an orbit: why, time [s] and speed [rpm]."""

    label: str
    time: float
    rpm: float


def instants(run: AnalysedRun) -> list[Instant]:
    """The largest resonances at distinct speeds, in order of speed, then the end of the run."""
    speeds = run.summary["speed_rpm"]
    last = 0.0 if isinstance(run, VectorRun) else run.time_reach[1]
    chosen: list[Instant] = []
    for peak in sorted(run.summary["peaks"], key=lambda p: -p["um"]):
        apart = all(abs(peak["rpm"] - other.rpm) > 0.07 * abs(speeds["max"]) for other in chosen)
        if peak["local_maximum"] and apart and len(chosen) < MOST_ORBITS - 1:
            chosen.append(Instant(f"{peak['order']}X peak", peak["time_s"], peak["rpm"]))
    return [*sorted(chosen, key=lambda i: i.rpm), Instant("end", last, speeds["last"])]


def orbits_caption(run: AnalysedRun, _: None) -> str:
    """Number of revolutions, the largest orbit and the clearance."""
    largest, count = run.summary["largest_orbit"], len(instants(run))
    text = (
        f"{TURNS} revolutions at {count} instant{'s' * (count > 1)}, the disc about its middle; dots mark whole turns "
        "of the shaft. The largest distance of the disc from its mean is "
        f"{quantity(largest['um'], 'µm')} at {largest['rpm']:.0f} rpm{end_of_run(largest)}."
    )
    if "journal" in run.record and run.machine and run.machine.film:
        gaps = dict.fromkeys(displacement(film.clearance) for film in run.machine.films)
        text += f" The dashed line is where a journal touches; the clearance is {' and '.join(gaps)}"
        text += ", without what bends the foil." if any(film.foil for film in run.machine.films) else "."
    return text


def _need_orbit(run: AnalysedRun) -> None:
    need_time(run)
    need_turns(run)
    need_plane(run)


@record_section("Orbits", _need_orbit, orbits_caption)
def orbits(run: AnalysedRun, _: None) -> go.Figure:
    """Orbits of disc and journal [um] at the resonances and at the end.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.orbits(runup)
    """
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


def journal_names(run: AnalysedRun) -> list[str]:
    """Names of the bearings whose journals a record holds, 'journal' for the only one."""
    return _bearings(run) or ["journal"] * ("journal" in run.record)


def _bearings(run: AnalysedRun) -> list[str]:
    return [str(name) for name in run.record["bearing"].values] if "journals" in run.record else []


def _add_orbit(figure: go.Figure, run: AnalysedRun, name: str, moment: Instant, row: int, column: int) -> None:
    d, angle = cut(run, name, moment)
    journals = journal_names(run)
    if name in journals:
        _add_room(figure, run, journals.index(name), row, column)
    else:
        d = middle(d)
    colour = COLOURS["journal" if name in journals else "disc"]
    draw_orbit(figure, d, angle, colour, (row, column, len(instants(run))))


def _add_room(figure: go.Figure, run: AnalysedRun, film: int, row: int, column: int) -> None:
    """Room of a journal, whose edge its centre cannot cross without contact: in a plain sleeve the clearance circle."""
    if run.machine is None or film >= len(run.machine.films):
        return
    turn = np.linspace(0, 2 * np.pi, 121)
    c = journal_room(run.machine, film, turn, float(np.abs(run.record["speed"]).max())) * TO_UM
    line = {"color": "#8a949e", "width": 1.5, "dash": "dash"}
    figure.add_trace(go.Scatter(x=compact(c * np.cos(turn)), y=compact(c * np.sin(turn)), mode="lines", line=line,
                                fill="toself", fillcolor=faint(GRID, 0.35),
                                hoverinfo="skip", showlegend=False), row, column)  # fmt: skip


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


def about_zero(figure: go.Figure, largest: float, row: int, column: int) -> None:
    """The same range on both axes of a panel, with 0 in its middle."""
    edge = 1.12 * largest or 1.0
    figure.update_xaxes(range=[-edge, edge], row=row, col=column)
    figure.update_yaxes(range=[-edge, edge], row=row, col=column)


def cut(run: AnalysedRun, name: str, moment: Instant) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [um] (n, 2) and angle [rad] of some revolutions about a moment, within the record."""
    part = stretch(run, moment)
    bearings = _bearings(run)
    if name in bearings:
        part = part.isel(bearing=bearings.index(name)).rename({"journals": name})
    return np.asarray(part[name].values, float) * TO_UM, np.asarray(part["angle"].values, float)


def stretch(run: AnalysedRun, moment: Instant) -> xr.Dataset:
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


def _planes(run: AnalysedRun) -> list[tuple[str, ...]]:
    need_turns(run)
    planes = probe_planes(run.record)
    need(bool(planes), "No two displacement probes of one plane see x and y.")
    return planes


def planes_caption(run: AnalysedRun, planes: list[tuple[str, ...]]) -> str:
    """Probes that make the orbit of each row."""
    rows = "; ".join(f"{', '.join(plane)} at {_place_of(run, plane[0])}" for plane in planes)
    return f"x and y of each plane from its probes at their angles: {rows}. {TURNS} revolutions, dots at whole turns."


def _place_of(run: AnalysedRun, probe: str) -> str:
    known = [str(name) for name in run.record["probe"].values]
    return f"z = {quantity(1e3 * float(run.record['probe_position'].values[known.index(probe)]), 'mm', '.6g')}"


@record_section("Orbits at the planes of the probes", _planes, planes_caption)
def probe_orbits(run: AnalysedRun, planes: Planes) -> go.Figure:
    """Orbits [um] at each plane where two displacement probes see x and y, at the resonances and at the end.

    Examples
    --------
    >>> import rotorsim as rs
    >>> record = rs.experiments.runup("probes.toml", stop=300.0)  # doctest: +SKIP
    >>> figure = rs.report.probe_orbits(record)  # doctest: +SKIP
    """
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


def _need_filtered(run: AnalysedRun) -> None:
    need_orders(run)
    need_plane(run)
    need(set(ORDERS[:1]) <= set(run.tracked["order"].values.tolist()), "The vectors hold no 1X.")


def _standing_out(run: AnalysedRun) -> list[int]:
    """Orders of `ORDERS` that a run-up draws: 1X, and 2X where it is resolved above a thousandth of the largest."""
    resolved = {1, *(peak["order"] for peak in run.peaks)}
    return [n for n in ORDERS if n in run.tracked["order"].values and n in resolved]


def mean_orders(tracked: xr.Dataset) -> np.ndarray:
    """Mean over the windows of the complex amplitudes (order, axis) [m] of 1X and 2X."""
    return np.asarray(tracked["amplitude"].sel(order=list(ORDERS)).mean("window").values)


def filtered_caption(run: AnalysedRun, _: None) -> str:
    """Forward and backward part of 1X and 2X."""
    if run.swept:
        orders = " and ".join(f"{n}X" for n in _standing_out(run))
        return f"Parts at {orders} at the resonances and at the end of the run; dots mark whole turns of the shaft."
    parts = []
    for n, (x, y) in zip((1, 2), mean_orders(run.tracked), strict=True):
        f, b = abs(x + 1j * y) / 2 * TO_UM, abs(x - 1j * y) / 2 * TO_UM
        parts.append(f"{n}X: {quantity(f, 'µm')} forward, {quantity(b, 'µm')} backward.")
    return " ".join(parts) + " Dots mark whole turns of the shaft."


@record_section("Orbit, and its parts at 1X and 2X", _need_filtered, filtered_caption)
def filtered_orbits(run: AnalysedRun, _: None) -> go.Figure:
    """Orbit [um] at constant speed, raw and its parts at 1X and 2X; in a run-up the parts at the resonances.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.filtered_orbits(turning)
    """
    if run.swept:
        return _swept_orbits(run)
    middle = Instant("middle", sum(run.time_reach) / 2, run.mean_speed * TO_RPM)
    raw, angle = cut(run, run.output, middle)
    raw = raw - (raw.max(axis=0) + raw.min(axis=0)) / 2
    parts = [ellipse(a) * TO_UM for a in mean_orders(run.tracked)]
    shown = [(raw, marks(raw, angle)), *((p, p[:1]) for p in parts)]
    figure = make_subplots(1, 3, horizontal_spacing=0.09, subplot_titles=["every sample", "1X", "2X"])
    for column, (path, dots) in enumerate(shown, 1):
        look = {"showlegend": False, "hovertemplate": "x %{x:.3g} µm, y %{y:.3g} µm<extra></extra>"}
        line = {"color": COLOURS["disc"], "width": 1.2 if column == 1 else 2, "simplify": False}
        figure.add_trace(go.Scatter(x=compact(path[:, 0]), y=compact(path[:, 1]), mode="lines", line=line, **look),
                         1, column)  # fmt: skip
        figure.add_trace(go.Scatter(x=compact(dots[:, 0]), y=compact(dots[:, 1]), mode="markers",
                                    marker={"color": INK, "size": 6}, **look), 1, column)  # fmt: skip
        square_axes(figure, column, 1, column)
    figure.update_xaxes(title_text="disc x [µm]")
    figure.update_yaxes(title_text="disc y [µm]", col=1)
    return style(figure, 430)


def _swept_orbits(run: AnalysedRun) -> go.Figure:
    """Parts at each order in a row, at each resonance and at the end in a column."""
    moments = instants(run) if run.summary["peaks"] else []
    orders = _standing_out(run)
    titles = [f"{i.label}, {i.rpm:.0f} rpm" for i in moments] + [""] * len(moments) * (len(orders) - 1)
    figure = make_subplots(
        len(orders), len(moments), subplot_titles=titles, vertical_spacing=0.13, horizontal_spacing=0.08
    )
    speed = run.tracked["speed"].values * TO_RPM
    for column, moment in enumerate(moments, 1):
        amplitude = run.tracked["amplitude"].isel(window=int(np.abs(speed - moment.rpm).argmin()))
        for row, n in enumerate(orders, 1):
            path = ellipse(-amplitude.sel(order=n, axis=["x", "y"]).values) * TO_UM  # from half a turn before the mark
            draw_orbit(figure, path, np.linspace(0, 2 * np.pi, len(path)) - np.pi, COLOURS["disc"],
                       (row, column, len(moments)))  # fmt: skip
            about_zero(figure, float(np.abs(path).max()), row, column)
            figure.update_yaxes(title_text=f"{n}X y [µm]", row=row, col=1)
            figure.update_xaxes(title_text=f"{n}X x [µm]", row=row)
    return style(figure, 100 + 330 * len(orders), showlegend=False)


FAINT = 0.1
"""Size of a curve over the largest of its panel below which no speeds are written to it."""
LABELS = 6
"""Speeds that are written next to a curve."""


def _need_polar(run: AnalysedRun) -> None:
    need_orders(run)
    need(run.swept, "The speed does not change; its vectors are points.")


def polar_caption(run: AnalysedRun, _: None) -> str:
    """Reading of the diagram, and what was subtracted."""
    text = (
        "Amplitude is the distance from the middle, phase lag the angle from the horizontal axis, clockwise; numbers "
        "are speeds in rpm. A resonance is a loop."
    )
    return text + slow_roll_text(run)


@record_section("Polar diagram of the orders", _need_polar, polar_caption)
def polar(run: AnalysedRun, _: None) -> go.Figure:
    """Vectors [um 0-pk] of 1X and 2X over the speed, in the plane.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.polar(runup)
    """
    orders = _standing_out(run)
    figure = make_subplots(1, len(orders), horizontal_spacing=0.12, subplot_titles=[f"{n}X" for n in orders])
    tracked = run.tracked.isel(window=slice(None, None, 1 + run.tracked.sizes["window"] // MOST_POINTS))
    rpm = np.abs(tracked["speed"].values) * TO_RPM
    for column, n in enumerate(orders, 1):
        largest = float(np.abs(tracked["amplitude"].sel(order=n).values).max(initial=0.0)) * TO_UM
        about_zero(figure, largest, 1, column)
        for axis, name in run.axes.items():
            a = tracked["amplitude"].sel(order=n, axis=axis).values * TO_UM
            look = {"color": AXIS_COLOURS[axis], "width": 2, "simplify": False}
            hover = {"customdata": compact(rpm), "hovertemplate": "%{customdata:.0f} rpm<extra></extra>"}
            figure.add_trace(go.Scatter(x=compact(a.real), y=compact(a.imag), mode="lines", line=look, name=name,
                                        legendgroup=axis, showlegend=column == 1, **hover), 1, column)  # fmt: skip
            at = _spread(a) if np.abs(a - a.mean()).max(initial=0.0) > FAINT * largest else np.array([], int)
            figure.add_trace(go.Scatter(x=compact(a.real[at]), y=compact(a.imag[at]), mode="markers+text",
                                        text=[f"{v:.0f}" for v in rpm[at]], textposition="top center",
                                        textfont={"size": 11}, marker={"color": look["color"], "size": 5},
                                        showlegend=False, hoverinfo="skip"), 1, column)  # fmt: skip
        figure.add_trace(go.Scatter(x=[0], y=[0], mode="markers", marker={"color": INK, "symbol": "cross-thin-open"},
                                    showlegend=False, hoverinfo="skip"), 1, column)  # fmt: skip
        square_axes(figure, column, 1, column)
    figure.update_xaxes(title_text="in phase with the mark [µm 0-pk]")
    figure.update_yaxes(title_text="a quarter turn ahead [µm 0-pk]", col=1)
    return style(figure, 520)


def _spread(path: np.ndarray) -> np.ndarray:
    """Points of a complex path, evenly apart along it."""
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(path)))])
    return np.unique(np.searchsorted(along, np.linspace(0, along[-1], LABELS)).clip(0, path.size - 1))


MEAN_OF = 0.5
"""Least time [s] of a mean position."""
MOST_MEANS = 60
STILL = 0.05
"""Way of the mean position, over the largest orbit, that is none."""


def _centreline(run: AnalysedRun) -> np.ndarray:
    """Mean positions in x and y [m], times [s] and speeds [rad/s], side by side (n, 4)."""
    need_time(run)
    need_plane(run)
    coupled = next((text for text in notes_of(run.record) if text.startswith("AC-coupled")), "")
    need(not coupled, f"The probes have no mean position ({coupled}).")
    seconds = run.summary["duration_s"]
    if run.tracked.sizes["window"] > 1:  # means fitted next to the orders, without a rest of them
        step = 1 + run.tracked.sizes["window"] // MOST_MEANS
        means = run.tracked.isel(window=slice(None, None, step))
        path = np.column_stack([means["mean"].values, means["time"].values, means["speed"].values])
    else:
        need(seconds >= 2 * MEAN_OF, f"The record of {seconds:.2g} s holds one mean position.")
        found = envelopes(run.record, [run.output, "speed"], int(min(seconds / MEAN_OF, MOST_MEANS)))
        mean = found[run.output]
        path = np.column_stack([mean.mean, mean.time, found["speed"].mean])
    moved = float(np.ptp(path[:, :2], axis=0).max()) * TO_UM
    still = STILL * run.summary["largest_orbit"]["um"]
    need(moved > still, f"The mean position stays within {quantity(moved, 'µm')}.")
    return path


def centreline_caption(run: AnalysedRun, path: np.ndarray) -> str:
    """Way of the mean position."""
    way = displacement(float(np.hypot(*(path[-1, :2] - path[0, :2]))))
    numbers = "speeds in rpm" if run.swept else "times in s"
    return (
        f"Mean position of the shaft from the first of {len(path)} stretches; it ends {way} from there. "
        f"Numbers are {numbers}."
    )


@record_section("Shaft centreline", _centreline, centreline_caption)
def centreline(run: AnalysedRun, path: np.ndarray) -> go.Figure:
    """Mean position [um] of the disc along the run.

    Examples
    --------
    >>> import rotorsim as rs
    >>> figure = rs.report.centreline(runup)
    """
    x, y = ((path[:, :2] - path[0, :2]) * TO_UM).T
    shown = path[:, 3] * TO_RPM if run.swept else path[:, 2]
    at = _spread(x + 1j * y)
    look = {"color": COLOURS["disc"], "width": 2, "simplify": False}
    figure = make_subplots(1, 1)
    figure.add_trace(go.Scatter(x=compact(x), y=compact(y), mode="lines+markers", line=look, marker={"size": 4},
                                showlegend=False,
                                hovertemplate="x %{x:.3g} µm, y %{y:.3g} µm<extra></extra>"))  # fmt: skip
    figure.add_trace(go.Scatter(x=compact(x[at]), y=compact(y[at]), mode="markers+text", showlegend=False,
                                text=[f"{v:.4g}" for v in shown[at]], textposition="top center", textfont={"size": 11},
                                marker={"color": INK, "size": 6}, hoverinfo="skip"))  # fmt: skip
    square_axes(figure, 1, 1, 1)
    figure.update_xaxes(title_text="disc x from the start [µm]")
    figure.update_yaxes(title_text="disc y from the start [µm]")
    return style(figure, 520)


def ellipse(amplitude: np.ndarray, points: int = 181) -> np.ndarray:
    """Orbit (points, 2) of complex amplitudes (axis,) over one of its own turns."""
    turn = np.linspace(0, 2 * np.pi, points)[:, None]
    return np.real(amplitude[None, :] * np.exp(1j * turn))
