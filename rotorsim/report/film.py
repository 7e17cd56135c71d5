"""Pressure of the gas films: where gas enters, unrolled maps of the snapshots, and a surface round the journal."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from rotorsim.base.units import TO_MPA, TO_RPM
from rotorsim.machine import GasFilm, Machine
from rotorsim.report.page import INK, PRESSURE_SCALE, compact, style
from rotorsim.report.run import AnalysedRun, record_section
from rotorsim.report.units import number, quantity
from rotorsim.signals.record_blocks import need

MOST_MAPS, COLUMNS = 6, 3
MOST_LARGE = 8
"""Places where gas enters a film that are drawn as large circles."""
LIFT = 0.8
"""Height of the highest pressure above the journal in the picture, as a share of the journal's radius."""


@dataclass(frozen=True)
class FilmPart:
    """A film: pressure (snapshot, theta, z) [Pa, absolute], axial places z [m] from its middle, its entry if known.

    The name is empty for the only film of a record. `feeds` are angle [rad], offset [m] and name of each place where
    gas enters, position [m] that of the film's middle along the shaft.
    """

    name: str
    pressure: xr.DataArray
    z: np.ndarray
    film: GasFilm | None
    feeds: tuple[tuple[float, float, str], ...]

    @property
    def position(self) -> float:
        """Position of the film's middle along the shaft [m]; 0 where it is not known."""
        return 0.0 if self.film is None else self.film.position

    @property
    def edge(self) -> float:
        """Half the length that the pressures cover [m]."""
        return float(np.abs(self.z).max())


def film_parts(run: AnalysedRun) -> tuple[FilmPart, ...]:
    """The films whose pressures a record holds."""
    pressure = run.record["film_pressure"]
    if "bearing" not in pressure.dims:
        return (_part("", pressure, run.record["z"].values, run.machine, 0),)
    names = [str(name) for name in run.record["bearing"].values]
    places = run.record["film_z"].transpose("bearing", "z").values
    return tuple(
        _part(name, pressure.isel(bearing=k), places[k], run.machine, k) for k, name in enumerate(names)
    )  # fmt: skip


def _part(name: str, pressure: xr.DataArray, z: np.ndarray, machine: Machine | None, number: int) -> FilmPart:
    known = machine is not None and number < len(machine.films)
    if machine is None or not known:
        return FilmPart(name, pressure, z, None, ())
    return FilmPart(name, pressure, z, machine.films[number], tuple(feeds(machine, number)))


def feeds(machine: Machine, number: int) -> list[tuple[float, float, str]]:
    """Angle [rad], offset [m] and name of each injector and orifice of a film."""
    pinned = machine.injectors if number == machine.pinned_film else ()
    found = [(i.angle, i.offset, f"injector {k}") for k, i in enumerate(pinned, 1)]
    rows = machine.films[number].orifices
    for row, orifices in enumerate(rows, 1):
        place = f", row {row}" if len(rows) > 1 else ""
        found += [(angle, orifices.offset, f"orifice {k}{place}") for k, angle in enumerate(orifices.angles, 1)]
    return found


def feed_word(machine: Machine | None) -> str:
    """'injectors', 'orifices', both, or nothing where no gas is supplied or the machine is not known."""
    if machine is None:
        return "injectors"
    kinds = (("injectors", machine.pinned_film is not None), ("orifices", machine.orifice_count > 0))
    return " and ".join(name for name, there in kinds if there)


def _need_pressures(run: AnalysedRun) -> None:
    need(run.has_snapshots, "The record holds no film pressures.")


def snapshots(run: AnalysedRun) -> list[int]:
    """At most six snapshots, those that follow hard on another left out."""
    time = run.record["snapshot_time"].values
    apart = 0.2 * np.max(np.diff(time), initial=0.0)
    kept = [i for i in range(time.size) if i == time.size - 1 or time[i + 1] - time[i] >= apart]
    return [kept[i] for i in np.unique(np.linspace(0, len(kept) - 1, MOST_MAPS).round().astype(int))]


def film_caption(run: AnalysedRun, _: None) -> str:
    """Range of the pressure over the snapshots and where it is highest."""
    p = run.record["film_pressure"].isel(snapshot=snapshots(run))
    at, word = p.isel(p.argmax(...)), feed_word(run.machine)
    where = f" in the bearing {at['bearing'].item()}" if "bearing" in p.dims else ""
    circles = f"Circles are the {word}; colours" if word else "Colours"
    low, high = number(float(p.min()) * TO_MPA, "MPa"), quantity(float(p.max()) * TO_MPA, "MPa")
    return (
        f"Pressures range from {low} to {high} absolute, highest at {float(np.degrees(at['theta'])):.0f} deg{where}. "
        f"{circles} are interpolated between {p.sizes['theta']} × {p.sizes['z']} cells."
    )


@record_section("Film pressure, unrolled", _need_pressures, film_caption)
def film_pressure(run: AnalysedRun, _: None) -> go.Figure:
    """Film pressure [MPa absolute] over angle and length at the snapshots of a run.

    Examples
    --------
    >>> import rotorsim as rs
    >>> steady = rs.experiments.Steady(speed=300.0, pressure=0.5e6, duration=0.1)
    >>> outcome = rs.record(plant, steady, "film.nc")
    >>> figure = rs.report.film_pressure(rs.open_record("film.nc"))
    """
    parts, chosen = film_parts(run), snapshots(run)
    if len(parts) > 1:
        chosen = [chosen[i] for i in np.unique(np.linspace(0, len(chosen) - 1, COLUMNS).round().astype(int))]
    panels = [(part, i) for part in parts for i in chosen]
    columns = min(COLUMNS, len(chosen)) if len(parts) > 1 else COLUMNS
    rows = -(-len(panels) // columns)
    time, speed = (run.record[f"snapshot_{k}"].values for k in ("time", "speed"))
    titles = [f"{p.name}{', ' * bool(p.name)}{speed[i] * TO_RPM:.0f} rpm, {time[i]:.1f} s" for p, i in panels]
    figure = make_subplots(rows, columns, subplot_titles=titles, shared_xaxes=True, shared_yaxes=True,
                           vertical_spacing=0.36 / (rows + 1), horizontal_spacing=0.03)  # fmt: skip
    for k, (part, i) in enumerate(panels):
        row, edge = k // columns + 1, part.edge * 1e3
        figure.add_trace(_map(run, part, i), row, k % columns + 1)
        figure.add_trace(_feeds(part), row, k % columns + 1)
        figure.update_yaxes(range=[-edge, edge], showgrid=False, row=row)
    figure.update_xaxes(tickvals=[0, 90, 180, 270, 360], range=[0, 360], showgrid=False)
    figure.update_xaxes(title_text="angle from x to y [deg]", row=rows)
    figure.update_yaxes(title_text="axial position [mm]", col=1)
    return style(figure, 110 + 210 * rows, coloraxis=_colours(run), showlegend=False)


def _pressure(part: FilmPart, index: int) -> np.ndarray:
    """Pressure (theta, z) [MPa, absolute], closed round the bearing."""
    p = np.asarray(part.pressure.isel(snapshot=index).values, float) * 1e-6
    return np.vstack((p, p[:1]))


def _colours(run: AnalysedRun) -> dict[str, object]:
    p = [_pressure(part, i) for part in film_parts(run) for i in snapshots(run)]
    return {"colorscale": PRESSURE_SCALE, "cmin": float(np.min(p)), "cmax": float(np.max(p)),
            "colorbar": {"title": {"text": "MPa<br>absolute"}, "thickness": 14, "outlinewidth": 0}}  # fmt: skip


def _theta(run: AnalysedRun) -> np.ndarray:
    return np.append(run.record["theta"].values, run.record["theta"].values[0] + 2 * np.pi)


def _map(run: AnalysedRun, part: FilmPart, index: int) -> go.Heatmap:
    return go.Heatmap(
        x=compact(np.degrees(_theta(run))), y=compact(part.z * 1e3), z=compact(_pressure(part, index).T),
        zsmooth="best", coloraxis="coloraxis",
        hovertemplate="%{z:.4f} MPa at %{x:.0f} deg, %{y:.1f} mm<extra></extra>",
    )  # fmt: skip


def _feeds(part: FilmPart) -> go.Scatter:
    """Open circles where injectors and orifices are, if the record holds its machine."""
    many = len(part.feeds) > MOST_LARGE
    ring = {"symbol": "circle-open", "size": 6 if many else 11, "color": INK, "line": {"width": 1 if many else 1.5}}
    return go.Scatter(
        x=[round(float(np.degrees(angle) % 360), 3) for angle, _, _ in part.feeds],
        y=[offset * 1e3 for _, offset, _ in part.feeds],
        mode="markers", cliponaxis=False, marker=ring,
        text=[name for *_, name in part.feeds], hovertemplate="%{text}<extra></extra>",
    )  # fmt: skip


def surface_caption(run: AnalysedRun, _: None) -> str:
    """Exaggeration of the surface in the picture."""
    p = run.record["film_pressure"].isel(snapshot=-1)
    rpm = float(run.record["snapshot_speed"][-1]) * TO_RPM
    spread = float(p.max() - p.min()) * TO_MPA
    film, its = ("films", "their") if "bearing" in p.dims else ("film", "its")
    return (
        f"The {film} at {rpm:.0f} rpm round the shaft; {its} height, much exaggerated, is the pressure, which differs "
        f"by {quantity(spread, 'MPa')}. Drag to turn."
    )


@record_section("Film pressure round the journal", _need_pressures, surface_caption)
def film_surface(run: AnalysedRun, _: None) -> go.Figure:
    """Film pressure at the last snapshot round the journal: the further out, the higher; the shaft is drawn in grey."""
    parts = film_parts(run)
    pressures = [_pressure(part, -1) for part in parts]
    low, high = min(p.min() for p in pressures), max(p.max() for p in pressures)
    known = all(part.film is not None for part in parts)
    radii = [part.film.diameter / 2 * 1e3 if part.film else part.edge * 1e3 for part in parts]
    origin = parts[0].position if len(parts) == 1 else 0.0
    surfaces, ends = [], []
    for part, p, radius in zip(parts, pressures, radii, strict=True):
        lifted = radius * (1 + LIFT * (p - low) / max(high - low, 1e-12))
        theta, z = _theta(run)[:, None], (part.z[None, :] + part.position - origin) * 1e3
        where = f"{part.name}<br>" if part.name else ""
        surfaces.append(go.Surface(
            x=compact(z + 0 * theta), y=compact(lifted * np.cos(theta)), z=compact(lifted * np.sin(theta)),
            surfacecolor=compact(p), coloraxis="coloraxis",
            hovertemplate=f"{where}%{{surfacecolor:.4f}} MPa<extra></extra>",
            lighting={"ambient": 0.92, "diffuse": 0.2, "specular": 0.0},
        ))  # fmt: skip
        ends += [float(z.min()) - 0.7 * part.edge * 1e3, float(z.max()) + 0.7 * part.edge * 1e3]
    figure = go.Figure([_shaft(min(radii), min(ends), max(ends)), *surfaces])
    unit = "mm" if known else "not to scale"
    look = {"backgroundcolor": "white", "gridcolor": "#e4e8ec", "showspikes": False, "nticks": 5}
    scene: dict[str, object] = {f"{a}axis": look | {"title": {"text": t}} for a, t in
             (("x", "axial [mm]"), ("y", f"x [{unit}]"), ("z", f"y [{unit}]"))}  # fmt: skip
    scene |= {
        "aspectmode": "data",
        "camera": _camera(run, pressures[0], len(parts)),
        "annotations": _names(parts, radii),
    }
    style(figure, 580, coloraxis=_colours(run), scene=scene)
    return figure.update_layout(margin={"l": 10, "r": 10, "t": 30, "b": 5})


def _names(parts: tuple[FilmPart, ...], radii: list[float]) -> list[dict[str, object]]:
    """The names of several bearings above their films."""
    return [
        {"x": part.position * 1e3, "y": 0, "z": (1 + LIFT) * radius, "text": part.name, "showarrow": False,
         "yshift": 14} for part, radius in zip(parts, radii, strict=True) if part.name
    ]  # fmt: skip


def _shaft(radius: float, start: float, end: float) -> go.Surface:
    """A plain cylinder with closed ends."""
    turn = np.linspace(0, 2 * np.pi, 97)[:, None]
    z, r = np.array([[start, start, end, end]]), 0.97 * radius * np.array([[0, 1, 1, 0]])
    grey = [[0, "#b4bcc4"], [1, "#b4bcc4"]]
    return go.Surface(
        x=compact(z + 0 * turn), y=compact(r * np.cos(turn)), z=compact(r * np.sin(turn)),
        colorscale=grey, showscale=False, hoverinfo="skip", lighting={"ambient": 0.75, "diffuse": 0.4, "specular": 0},
    )  # fmt: skip


def _camera(run: AnalysedRun, p: np.ndarray, films: int) -> dict[str, dict[str, float]]:
    """View of one film's side of the highest pressure, from a quarter turn further round; else of all films."""
    if films > 1:
        return {"eye": {"x": -0.35, "y": -1.5, "z": 0.55}, "center": {"x": 0.0, "y": 0.0, "z": -0.13}}
    side = float(_theta(run)[int(p.max(axis=1).argmax())]) + np.radians(100)
    eye = {"x": 0.95, "y": 1.65 * float(np.cos(side)), "z": 1.65 * float(np.sin(side))}
    return {"eye": eye, "center": {"x": 0.0, "y": 0.0, "z": -0.13}}
