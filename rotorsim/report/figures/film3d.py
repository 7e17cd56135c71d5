"""Film pressure figures: unrolled maps of the snapshots, and a 3D surface round the journal."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from rotorsim.base.constants import TO_RPM
from rotorsim.report.figures.theme import INK, PRESSURE_SCALE, compact, style
from rotorsim.report.pages.run import Run

MOST_MAPS, COLUMNS = 6, 3
LIFT = 0.8
"""Height of the highest pressure above the journal in the picture, as a share of the journal's radius."""


def snapshots(run: Run) -> list[int]:
    """At most six snapshots, those that follow hard on another left out."""
    time = run.record["snapshot_time"].values
    apart = 0.2 * np.max(np.diff(time), initial=0.0)
    kept = [i for i in range(time.size) if i == time.size - 1 or time[i + 1] - time[i] >= apart]
    return [kept[i] for i in np.unique(np.linspace(0, len(kept) - 1, MOST_MAPS).round().astype(int))]


def film_maps(run: Run) -> go.Figure:
    """Pressure over angle and axial position at the snapshots, one colour scale [MPa, absolute]."""
    chosen = snapshots(run)
    rows = -(-len(chosen) // COLUMNS)
    time, speed = (run.record[f"snapshot_{k}"].values for k in ("time", "speed"))
    titles = [f"{speed[i] * TO_RPM:.0f} rpm, {time[i]:.1f} s" for i in chosen]
    figure = make_subplots(rows, COLUMNS, subplot_titles=titles, shared_xaxes=True, shared_yaxes=True,
                           vertical_spacing=0.12, horizontal_spacing=0.03)  # fmt: skip
    for k, i in enumerate(chosen):
        figure.add_trace(_map(run, i), k // COLUMNS + 1, k % COLUMNS + 1)
        figure.add_trace(_injectors(run), k // COLUMNS + 1, k % COLUMNS + 1)
    figure.update_xaxes(tickvals=[0, 90, 180, 270, 360], range=[0, 360], showgrid=False)
    figure.update_xaxes(title_text="angle from x to y [deg]", row=rows)
    edge = float(np.abs(run.record["z"].values).max()) * 1e3
    figure.update_yaxes(range=[-edge, edge], showgrid=False)
    figure.update_yaxes(title_text="axial position [mm]", col=1)
    return style(figure, 110 + 210 * rows, coloraxis=_colours(run), showlegend=False)


def _pressure(run: Run, index: int) -> np.ndarray:
    """Pressure (theta, z) [MPa, absolute], closed round the bearing."""
    p = np.asarray(run.record["film_pressure"].isel(snapshot=index).values, float) * 1e-6
    return np.vstack((p, p[:1]))


def _colours(run: Run) -> dict[str, object]:
    p = [_pressure(run, i) for i in snapshots(run)]
    return {"colorscale": PRESSURE_SCALE, "cmin": float(np.min(p)), "cmax": float(np.max(p)),
            "colorbar": {"title": {"text": "MPa<br>absolute"}, "thickness": 14, "outlinewidth": 0}}  # fmt: skip


def _theta(run: Run) -> np.ndarray:
    return np.append(run.record["theta"].values, run.record["theta"].values[0] + 2 * np.pi)


def _map(run: Run, index: int) -> go.Heatmap:
    return go.Heatmap(
        x=compact(np.degrees(_theta(run))), y=compact(run.record["z"].values * 1e3), z=compact(_pressure(run, index).T),
        zsmooth="best", coloraxis="coloraxis",
        hovertemplate="%{z:.4f} MPa at %{x:.0f} deg, %{y:.1f} mm<extra></extra>",
    )  # fmt: skip


def _injectors(run: Run) -> go.Scatter:
    """Open circles where the injectors are, if the record holds its machine."""
    places = run.machine.injectors if run.machine else ()
    ring = {"symbol": "circle-open", "size": 11, "color": INK, "line": {"width": 1.5}}
    return go.Scatter(
        x=[round(float(np.degrees(i.angle) % 360), 3) for i in places], y=[i.offset * 1e3 for i in places],
        mode="markers", cliponaxis=False, marker=ring,
        text=[f"injector {k}" for k, _ in enumerate(places, 1)], hovertemplate="%{text}<extra></extra>",
    )  # fmt: skip


def film_surface(run: Run) -> go.Figure:
    """The last snapshot round the journal: the further out, the higher the pressure; the shaft is drawn in grey."""
    p = _pressure(run, -1)
    known = run.machine.film if run.machine else None
    edge = float(np.abs(run.record["z"].values).max()) * 1e3
    radius = known.diameter / 2 * 1e3 if known else edge
    lifted = radius * (1 + LIFT * (p - p.min()) / max(np.ptp(p), 1e-12))
    theta, z = _theta(run)[:, None], run.record["z"].values[None, :] * 1e3
    surface = go.Surface(
        x=compact(z + 0 * theta), y=compact(lifted * np.cos(theta)), z=compact(lifted * np.sin(theta)),
        surfacecolor=compact(p), coloraxis="coloraxis", hovertemplate="%{surfacecolor:.4f} MPa<extra></extra>",
        lighting={"ambient": 0.92, "diffuse": 0.2, "specular": 0.0},
    )  # fmt: skip
    figure = go.Figure([_shaft(radius, 1.7 * edge), surface])
    unit = "mm" if known else "not to scale"
    look = {"backgroundcolor": "white", "gridcolor": "#e4e8ec", "showspikes": False, "nticks": 5}
    scene: dict[str, object] = {f"{a}axis": look | {"title": {"text": t}} for a, t in
             (("x", "axial [mm]"), ("y", f"x [{unit}]"), ("z", f"y [{unit}]"))}  # fmt: skip
    scene |= {"aspectmode": "data", "camera": _camera(run, p)}
    style(figure, 580, coloraxis=_colours(run), scene=scene)
    return figure.update_layout(margin={"l": 10, "r": 10, "t": 30, "b": 5})


def _shaft(radius: float, reach: float) -> go.Surface:
    """A plain cylinder with closed ends."""
    turn = np.linspace(0, 2 * np.pi, 97)[:, None]
    z, r = np.array([[-reach, -reach, reach, reach]]), 0.97 * radius * np.array([[0, 1, 1, 0]])
    grey = [[0, "#b4bcc4"], [1, "#b4bcc4"]]
    return go.Surface(
        x=compact(z + 0 * turn), y=compact(r * np.cos(turn)), z=compact(r * np.sin(turn)),
        colorscale=grey, showscale=False, hoverinfo="skip", lighting={"ambient": 0.75, "diffuse": 0.4, "specular": 0},
    )  # fmt: skip


def _camera(run: Run, p: np.ndarray) -> dict[str, dict[str, float]]:
    """A look at the side of the highest pressure, from a quarter turn further round."""
    side = float(_theta(run)[int(p.max(axis=1).argmax())]) + np.radians(100)
    eye = {"x": 0.95, "y": 1.65 * float(np.cos(side)), "z": 1.65 * float(np.sin(side))}
    return {"eye": eye, "center": {"x": 0.0, "y": 0.0, "z": -0.13}}
