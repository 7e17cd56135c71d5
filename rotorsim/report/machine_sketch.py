"""A machine from the side: shaft, discs, bearings, injectors and probes, with marked places or with dimensions.

Lengths along the shaft are to scale. In a sketch radii have a scale of their own, in a drawing the same one; those of
discs are of solid discs with the mass and inertia of the machine file.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sin, sqrt

import numpy as np
import plotly.graph_objects as go

from rotorsim.base.units import TO_UM
from rotorsim.machine import Machine
from rotorsim.machine.gas_film import GasFilm, ThrustBearing
from rotorsim.machine.rotor import Disc
from rotorsim.plant.locations import Nozzle, Place, nozzles, probe_plane
from rotorsim.report.page import INK, faint, style
from rotorsim.report.units import number, quantity

Box = tuple[float, float, float, float]
"""Left, right [mm], lower and upper [share of the drawing's height] edge."""
Polygon = list[tuple[float, float]]
"""Corners: coordinate [mm] and height [share of the drawing's height]."""
SHAFT, LAYER, DISC, BEARING, NOZZLE, PROBE = "#c3ccd4", "#dfe4e8", "#9fb0bf", "#56B4E9", "#0072B2", "#009E73"
FOIL = "#B8763A"
MARKS = {
    "found": ("found here", "#D55E00"), "rival": ("or here", "#E69F00"), "force": ("equivalent force", "#CC79A7"),
}  # fmt: skip
"""Name and colour of a mark by its role."""
THIN, THICK = 0.08, 0.7
"""Least radius of the shaft and largest of a disc, as shares of half of the drawing's height."""
PROBE_AT, NAME_AT = 0.88, -0.92
NARROW, MARK = 0.012, 0.03
"""Least widths of a disc and of half a mark, as shares of the shaft's length."""
MARGIN = 0.09
"""Room on both sides, as a share of the shaft's length."""


def machine_sketch(machine: Machine, marked: Sequence[tuple[str, Place]] = ()) -> go.Figure:
    """The machine from the side; `marked` are roles (keys of `MARKS`) and places."""
    figure = go.Figure()
    scale = _scale(machine)
    places = [machine.shaft.start, machine.shaft.end, *(disc.position for disc in machine.discs)]
    start, end = min(places) * 1e3, max(places) * 1e3
    least = NARROW * (end - start)
    _bands(figure, machine, scale, marked)
    _boxes(figure, "bearing", list(_films(machine, scale)), BEARING, 0.6)
    _boxes(figure, "thrust bearing", list(_plates(machine, scale, least)), BEARING, 0.6)
    _polygons(figure, "shaft", list(_sections(machine, scale)), SHAFT, 1.0)
    _polygons(figure, "layer", list(_layers(machine, scale)), LAYER, 1.0)
    _boxes(figure, "arm", [_arm(one, least) for one in machine.discs if one.arm], DISC, 1.0)
    _boxes(figure, "disc", [_disc(one, scale, least) for one in machine.discs], DISC, 1.0)
    _masses(figure, machine)
    _springs(figure, machine, scale)
    _nozzles(figure, machine, scale)
    _marked_nozzles(figure, machine, scale, {p.nozzle: role for role, p in reversed(marked) if p.nozzle})
    _probes(figure, machine)
    _names(figure, machine)
    room = MARGIN * (end - start)
    style(figure, 192, hovermode="closest", dragmode=False)
    figure.update_xaxes(title="position along the shaft [mm]", range=[start - room, end + room], showgrid=False)
    figure.update_yaxes(visible=False, range=[-1.05, 1.02], fixedrange=True)
    figure.update_layout(margin={"l": 12, "r": 12, "t": 6, "b": 42}, showlegend=False)
    return figure


def _bands(figure: go.Figure, machine: Machine, scale: float, marked: Sequence[tuple[str, Place]]) -> None:
    """A band for every marked range along the shaft, in the colour of its first role."""
    least = 1e3 * MARK * machine.shaft.length
    first: dict[Box, str] = {}
    for role, place in marked:
        first.setdefault(_mark(machine, scale, place, least), role)
    for role, (name, colour) in MARKS.items():
        _boxes(figure, name, [box for box, own in first.items() if own == role], colour, 0.35)


def _scale(machine: Machine) -> float:
    """Drawn height of a metre of radius."""
    largest = max([_radius(one) for one in machine.discs] + [0.0])
    shaft = max(max(piece.outer) / 2 for piece in machine.shaft.pieces)
    return float(min(THICK / max(largest, shaft), 0.35 / shaft))


def _radius(disc: Disc) -> float:
    """Radius [m] of a solid disc of the same mass and polar inertia."""
    return sqrt(2 * disc.polar_inertia / disc.mass)


def _width(disc: Disc) -> float:
    """Width [m] of a solid disc of the same mass and inertias."""
    return sqrt(max(12 * (disc.diametral_inertia - disc.polar_inertia / 2) / disc.mass, 0.0))


def _disc(disc: Disc, scale: float, least: float) -> Box:
    half, radius = max(_width(disc) * 1e3, least) / 2, max(_radius(disc) * scale, 2 * THIN)
    return disc.position * 1e3 - half, disc.position * 1e3 + half, -radius, radius


def _arm(disc: Disc, least: float) -> Box:
    """The rigid arm from the seat of a disc to its centre of gravity."""
    left, right = sorted((disc.seated * 1e3, disc.position * 1e3))
    return left - least / 2, right + least / 2, -THIN / 2, THIN / 2


def _sections(machine: Machine, scale: float) -> Iterator[Polygon]:
    for z, one in machine.shaft.placed:
        left, right = (max(diameter / 2 * scale, THIN) for diameter in one.outer)
        a, b = z * 1e3, (z + one.length) * 1e3
        yield [(a, -left), (b, -right), (b, right), (a, left)]


def _layers(machine: Machine, scale: float) -> Iterator[Polygon]:
    """Upper and lower half of every layer."""
    for one in machine.shaft.layers:
        heights = [max(diameter / 2 * scale, THIN) for diameter in (*one.inner, *reversed(one.outer))]
        heights[2:] = [max(outer, inner + THIN / 4) for outer, inner in zip(heights[2:], heights[1::-1], strict=True)]
        a, b = one.position * 1e3, one.end * 1e3
        for sign in (-1, 1):
            yield [(z, sign * height) for z, height in zip((a, b, b, a), heights, strict=True)]


def _masses(figure: go.Figure, machine: Machine) -> None:
    """Point masses as dots on the axis."""
    if machine.point_masses:
        figure.add_scatter(
            x=[one.position * 1e3 for one in machine.point_masses], y=[0.0] * len(machine.point_masses), mode="markers",
            name="point mass", hoverinfo="name", marker={"size": 9, "color": INK},
        )  # fmt: skip


def _at(machine: Machine, z: float, scale: float) -> float:
    """Drawn radius of the shaft at z [m]."""
    return max(machine.shaft.outer_diameter(z) / 2 * scale, THIN)


def _films(machine: Machine, scale: float) -> Iterator[Box]:
    """Upper and lower half of the sleeve of every gas film."""
    for one in machine.films:
        left, right = (one.position - one.length / 2) * 1e3, (one.position + one.length / 2) * 1e3
        inner = _at(machine, one.position, scale) + 0.03
        yield from ((left, right, -inner - 0.2, -inner), (left, right, inner, inner + 0.2))


def _plates(machine: Machine, scale: float, width: float) -> Iterator[Box]:
    """Upper and lower half of the plate of every thrust bearing, at the side from which it pushes."""
    for one in machine.thrust_bearings:
        z, inner, outer = one.position * 1e3, one.inner_diameter / 2 * scale, one.outer_diameter / 2 * scale
        face = z - one.sign * width
        left, right = sorted((face, face - one.sign * width))
        yield from ((left, right, -outer, -inner), (left, right, inner, outer))


def _mark(machine: Machine, scale: float, place: Place, least: float) -> Box:
    """A band over the whole height, at least twice `least` [mm] wide; around the shaft where it is a length of it."""
    middle, half = 0.5e3 * (place.begin + place.end), 0.5e3 * (place.end - place.begin)
    if place.part == "shaft" and half > least:
        height = max(y for piece in _sections(machine, scale) for _, y in piece) + 0.12
        return middle - half, middle + half, -height, height
    half = max(half + least / 3, least)
    return middle - half, middle + half, -0.8, 1.0


def _boxes(figure: go.Figure, name: str, boxes: list[Box], colour: str, opacity: float) -> None:
    """Filled rectangles as one curve."""
    corners = [[(left, low), (right, low), (right, high), (left, high)] for left, right, low, high in boxes]
    _polygons(figure, name, corners, colour, opacity)


def _polygons(
    figure: go.Figure, name: str, polygons: list[Polygon], colour: str, opacity: float, edge: str | None = None
) -> None:
    """Filled polygons as one curve, with edges of their own colour or of another."""
    x: list[float | None] = []
    y: list[float | None] = []
    for corners in polygons:
        x += [*(z for z, _ in corners), corners[0][0], None]
        y += [*(height for _, height in corners), corners[0][1], None]
    if polygons:
        figure.add_scatter(
            x=x, y=y, name=name, mode="lines", fill="toself", fillcolor=faint(colour, opacity),
            line={"color": edge or colour, "width": 0.7 if edge else 1.2}, hoverinfo="name",
        )  # fmt: skip


def _springs(figure: go.Figure, machine: Machine, scale: float) -> None:
    """Bearings without a film as a triangle below and above the shaft."""
    places = [b.position for b in machine.bearings if b.coefficients is not None]
    for sign, symbol in ((-1, "triangle-up"), (1, "triangle-down")):
        figure.add_scatter(
            x=[z * 1e3 for z in places], y=[sign * (_at(machine, z, scale) + 0.1) for z in places], mode="markers",
            name="bearing",
            marker={"symbol": symbol, "size": 13, "color": BEARING, "line": {"color": INK, "width": 1}},
            hoverinfo="name",
        )  # fmt: skip


def _nozzles(figure: go.Figure, machine: Machine, scale: float) -> None:
    """Injectors and orifices as dots where they are seen from the side."""
    found = nozzles(machine)
    if found:
        figure.add_scatter(
            **_dots(machine, found, scale), mode="markers", cliponaxis=False,
            name="injector" if any(one.pinned for one in found) else "orifice",
            customdata=[one.number for one in found], hovertemplate="%{customdata}<extra>injector</extra>",
            marker={"size": 7, "color": NOZZLE, "line": {"color": "white", "width": 1}},
        )  # fmt: skip


def _marked_nozzles(figure: go.Figure, machine: Machine, scale: float, marked: Mapping[Nozzle, str]) -> None:
    """Marked injectors as larger dots with their numbers."""
    for role in dict.fromkeys(marked.values()):
        own = [one for one, its in marked.items() if its == role]
        name, colour = MARKS[role]
        figure.add_scatter(
            **_dots(machine, own, scale), mode="markers+text", cliponaxis=False, name=name, hoverinfo="name",
            text=[f"<b>{one.number}</b>" for one in own], textfont={"size": 15, "color": INK},
            textposition=["top center" if sin(one.angle) > -0.01 else "bottom center" for one in own],
            marker={"size": 14, "color": colour, "line": {"color": "white", "width": 1}},
        )  # fmt: skip


def _dots(machine: Machine, found: Sequence[Nozzle], scale: float) -> dict[str, list[float]]:
    return {
        "x": [one.z * 1e3 for one in found],
        "y": [(_at(machine, one.z, scale) + 0.13) * sin(one.angle) for one in found],
    }


def _probes(figure: go.Figure, machine: Machine) -> None:
    """Planes of the probes above the shaft: that of the displacement signal and those of further probes."""
    planes = {round(probe_plane(machine).begin, 6)}
    planes |= {round(one.position, 6) for one in machine.probes if one.position is not None}
    middle = 0.5 * (machine.shaft.start + machine.shaft.end)
    figure.add_scatter(
        x=[z * 1e3 for z in sorted(planes)], y=[PROBE_AT] * len(planes), mode="markers+text", name="probes",
        text=["  probes  ", *[""] * (len(planes) - 1)], textfont={"size": 12, "color": INK}, cliponaxis=False,
        textposition="middle left" if min(planes) > middle else "middle right", hoverinfo="name+x",
        marker={"symbol": "diamond-tall", "size": 14, "color": PROBE, "line": {"color": "white", "width": 1}},
    )  # fmt: skip


def _names(figure: go.Figure, machine: Machine) -> None:
    """Names of the bearings below them, where they do not overlap."""
    length = machine.shaft.end - machine.shaft.start
    places = sorted((one.position, name) for one, name in zip(machine.bearings, machine.bearing_names, strict=True))
    if any(b[0] - a[0] < 0.2 * length for a, b in pairwise(places)):
        return
    figure.add_scatter(
        x=[z * 1e3 for z, _ in places], y=[NAME_AT] * len(places), mode="text", text=[name for _, name in places],
        textfont={"size": 12, "color": INK}, showlegend=False, hoverinfo="skip", cliponaxis=False,
    )  # fmt: skip


PAPER, ROW = 1000.0, 26.0
"""Width [px] that the shaft of a drawing takes, and height [px] of a row of dimensions."""
TALL = 560.0
"""Greatest height [px] of the machine in a drawing."""
WRITTEN = 0.035
"""Least distance of two dimensions with a number between them, as a share of the shaft's length."""
FLAT, SLEEVE, MOUTH = 0.01, 0.024, 0.004
"""Least width of a disc, thickness of a sleeve and least width of an orifice, as shares of the shaft's length."""
BUMPS = 6
"""Bumps of a foil in a drawing."""
LETTER, LINE = 6.5, 16.0
"""Width [px] of a letter of a part's name, and height [px] of a line of names."""
NARROW_PAPER = 560.0
"""Least width [px] that the names of parts are kept apart on."""


@dataclass(frozen=True)
class Shape:
    """A part seen from the side: its path in the machine file, its kind, its corners [mm]."""

    part: str
    kind: str
    corners: Polygon


@dataclass(frozen=True)
class Mark:
    """A part that has no size in the drawing: its path in the machine file, its kind, its place [mm]."""

    part: str
    kind: str
    z: float
    y: float


@dataclass(frozen=True)
class SideView:
    """The machine from the side, in mm: shapes from back to front, marks, dimensions.

    `rows` are the places of each row of dimensions by its name, `diameters` the ends of each section and its diameters
    as a text, `names` the place and name of each part; the shaft with all discs reaches from `start` to `end`, and no
    part is above `top`.
    """

    shapes: tuple[Shape, ...]
    marks: tuple[Mark, ...]
    rows: dict[str, list[float]]
    diameters: tuple[tuple[float, float, str], ...]
    names: tuple[tuple[float, str], ...]
    start: float
    end: float
    top: float


def side_view(machine: Machine) -> SideView:
    """Shapes, marks and dimensions of a machine."""
    discs_at = [one.position for one in machine.discs]
    start, end = (1e3 * f([z, *discs_at]) for f, z in ((min, machine.shaft.start), (max, machine.shaft.end)))
    least, thick = FLAT * (end - start), SLEEVE * (end - start)
    shapes = [Shape(f"discs.{k}", "arm", _corners(_arm(d, least))) for k, d in enumerate(machine.discs) if d.arm]
    shapes += [Shape(f"discs.{k}", "disc", _corners(_solid(d, least))) for k, d in enumerate(machine.discs)]
    shapes += [Shape(f"shaft.sections.{k}", "shaft", one) for k, one in enumerate(_sections(machine, 1e3))]
    shapes += [Shape(f"shaft.layers.{k // 2}", "layer", one) for k, one in enumerate(_layers(machine, 1e3))]
    shapes += [Shape(f"shaft.sections.{k}", "bore", one) for k, one in _bores(machine)]
    for k, film in zip(machine.film_bearings, machine.films, strict=True):
        mouths = sorted({n.z * 1e3 for n in nozzles(machine) if n.bearing == k})
        for kind, box in _film_parts(film, thick, mouths, MOUTH * (end - start)):
            shapes += [Shape(f"bearings.{k}", kind, one) for one in (box, _below(box))]
    for k, one in enumerate(machine.thrust_bearings):
        shapes.append(Shape(f"thrust_bearings.{k}", "collar", _corners(_collar(one, least))))
    plates = list(_plates(machine, 1e3, least))
    shapes += [Shape(f"thrust_bearings.{k // 2}", "bearing", _corners(one)) for k, one in enumerate(plates)]
    top = max(y for one in shapes if one.kind != "arm" for _, y in one.corners)
    planes = sorted({round(probe_plane(machine).begin, 6)}
                    | {round(p.position, 6) for p in machine.probes if p.position is not None})  # fmt: skip
    marks = [
        Mark(f"bearings.{k}", "spring", b.position * 1e3, -_at(machine, b.position, 1e3))
        for k, b in enumerate(machine.bearings) if b.coefficients is not None
    ]  # fmt: skip
    marks += [Mark(f"point_masses.{k}", "mass", m.position * 1e3, 0.0) for k, m in enumerate(machine.point_masses)]
    marks += [Mark(_probe_at(machine, z), "probe", z * 1e3, 1.12 * top) for z in planes]
    rows = _dimension_rows(machine, planes)
    return SideView(tuple(shapes), tuple(marks), rows, tuple(_pieces(machine)), tuple(_named(machine)), start, end, top)


def _probe_at(machine: Machine, z: float) -> str:
    """Path of the probe at z [m]; `probe` for the measuring plane."""
    found = (k for k, p in enumerate(machine.probes) if p.position is not None and round(p.position, 6) == z)
    number = next(found, None)
    return "probe" if number is None else f"probes.{number}"


def _corners(box: Box) -> Polygon:
    left, right, low, high = box
    return [(left, low), (right, low), (right, high), (left, high)]


LOOKS = {
    "arm": ("arm", DISC, 1.0), "disc": ("disc", DISC, 1.0), "shaft": ("shaft", SHAFT, 1.0),
    "layer": ("layer", LAYER, 1.0), "bore": ("bore", "#ffffff", 1.0), "collar": ("thrust collar", SHAFT, 1.0),
    "bearing": ("bearing", BEARING, 0.7), "foil": ("foil", FOIL, 0.6), "mouth": ("orifice or injector", NOZZLE, 1.0),
}  # fmt: skip
"""Name, colour and opacity of a kind of shape in a drawing, from back to front."""


def machine_drawing(machine: Machine) -> go.Figure:
    """The machine from the side, to scale in both directions, with a row of dimensions for each kind of part."""
    figure, view = go.Figure(), side_view(machine)
    start, length, top = view.start, view.end - view.start, view.top
    for kind, (name, colour, opacity) in LOOKS.items():
        _polygons(figure, name, [one.corners for one in view.shapes if one.kind == kind], colour, opacity, INK)
    edge = {"color": INK, "width": 1}
    for kind, name, look in (
        ("spring", "bearing", {"symbol": "triangle-up", "size": 14, "color": BEARING, "line": edge}),
        ("mass", "point mass", {"size": 9, "color": INK}),
        ("probe", "probe", {"symbol": "diamond-tall", "size": 13, "color": PROBE}),
    ):  # fmt: skip
        own = [mark for mark in view.marks if mark.kind == kind]
        figure.add_scatter(x=[one.z for one in own], y=[one.y for one in own], mode="markers", name=name,
                           hoverinfo="name+x", marker=look)  # fmt: skip
    room = MARGIN * length
    left, right = (f(z for one in view.shapes for z, _ in one.corners) for f in (min, max))
    pixel = (right - left + 2.4 * room) / PAPER
    _diameters(figure, view)
    low, named = _dimensions(figure, view, pixel), _part_names(figure, view, left - room, right + room)
    figure.add_shape(type="line", x0=start - room / 2, x1=start + length + room / 2, y0=0, y1=0,
                     line={"color": INK, "width": 0.8, "dash": "dashdot"})  # fmt: skip
    style(figure, int(min((1.25 * top - low) / pixel, 2 * TALL) + 60 + named), hovermode="closest", dragmode=False)
    figure.update_xaxes(title_text="position along the shaft [mm]", showgrid=False,
                        range=[left - 1.6 * room, right + 0.8 * room])  # fmt: skip
    figure.update_yaxes(title_text="radius [mm]", visible=False, scaleanchor="x", scaleratio=1, constrain="domain",
                        range=[low, 1.25 * top])  # fmt: skip
    figure.update_layout(margin={"l": 12, "r": 12, "t": 6 + named, "b": 42}, showlegend=False)
    return figure


def _bores(machine: Machine) -> Iterator[tuple[int, Polygon]]:
    """Numbers of the sections that have a bore, and the bores in mm."""
    for k, (z, one) in enumerate(machine.shaft.placed):
        if max(one.inner) > 0:
            left, right = (diameter * 500 for diameter in one.inner)
            a, b = z * 1e3, (z + one.length) * 1e3
            yield k, [(a, -left), (b, -right), (b, right), (a, left)]


def _pieces(machine: Machine) -> Iterator[tuple[float, float, str]]:
    """Ends [mm] of the sections of the shaft, and their outer and inner diameters in the page's unit as a text."""
    for z, one in machine.shaft.placed:
        outer, inner = (
            " to ".join(number(d * 1e3, "mm", ".4g") for d in dict.fromkeys(ends)) for ends in (one.outer, one.inner)
        )
        text = f"\N{DIAMETER SIGN}{outer}" + (f" / {inner}" if max(one.inner) > 0 else "")
        yield z * 1e3, (z + one.length) * 1e3, text


def _solid(disc: Disc, least: float) -> Box:
    """A disc in mm, at least so wide."""
    half, radius = max(_width(disc) * 1e3, least) / 2, _radius(disc) * 1e3
    return disc.position * 1e3 - half, disc.position * 1e3 + half, -radius, radius


def _film_parts(film: GasFilm, thick: float, mouths: Sequence[float], least: float) -> Iterator[tuple[str, Polygon]]:
    """Kind and shape, in mm, of a sleeve, its foil and its orifices at `mouths` as they are seen above the shaft."""
    left, right = (1e3 * z for z in film.ends)
    inner = film.diameter / 2 * 1e3
    yield "bearing", _corners((left, right, inner, inner + thick))
    if film.foil is not None:
        steps = np.linspace(left, right, 2 * BUMPS + 1)
        heights = inner + thick * np.where(np.arange(len(steps)) % 2, 0.45, 0.15)
        yield "foil", [(left, inner), *zip(steps.tolist(), heights.tolist(), strict=True), (right, inner)]
    for z in mouths:
        yield "mouth", _corners((z - least / 2, z + least / 2, inner, inner + thick))


def _below(corners: Polygon) -> Polygon:
    """The mirror image below the axis."""
    return [(z, -y) for z, y in corners]


def _collar(thrust: ThrustBearing, width: float) -> Box:
    """The face on which a thrust bearing pushes, in mm."""
    z, radius = thrust.position * 1e3, thrust.outer_diameter * 500
    return *sorted((z - thrust.sign * width / 2, z + thrust.sign * width)), -radius, radius


def _named(machine: Machine) -> Iterator[tuple[float, str]]:
    """Place [mm] and name of every disc, bearing, thrust bearing and layer with a name, films with their sizes."""
    for disc, name in zip(machine.discs, machine.disc_names, strict=True):
        yield disc.position * 1e3, name
    for one, name in zip(machine.bearings, machine.bearing_names, strict=True):
        size = "" if not isinstance(one, GasFilm) else (
            f" \N{DIAMETER SIGN}{number(one.diameter * 1e3, 'mm', '.4g')} \N{MULTIPLICATION SIGN} "
            f"{number(one.length * 1e3, 'mm', '.4g')}, c {quantity(one.clearance * TO_UM, 'µm')}"
        )  # fmt: skip
        yield one.position * 1e3, name + size
    for thrust, name in zip(machine.thrust_bearings, machine.thrust_names, strict=True):
        yield thrust.position * 1e3, f"{name} \N{DIAMETER SIGN}{number(thrust.outer_diameter * 1e3, 'mm', '.4g')}"
    for layer in machine.shaft.layers:
        if layer.name:
            yield 500 * (layer.position + layer.end), layer.name


def _part_names(figure: go.Figure, view: SideView, low: float, high: float) -> float:
    """Names of the parts above them, in as many lines as keep them apart between two ends [mm]; their height [px]."""
    letter, ends = LETTER * (high - low) / NARROW_PAPER, list[float]()
    for z, text in sorted(view.names):
        half = min(0.5 * letter * len(text), 0.5 * (high - low))
        z = min(max(z, low + half), high - half)
        line = next((k for k, end in enumerate(ends) if end < z - half), len(ends))
        ends[line : line + 1] = [z + half + letter]
        figure.add_annotation(x=z, y=1.25 * view.top, yanchor="bottom", yshift=line * LINE, text=text, showarrow=False)
    return len(ends) * LINE


def _dimension_rows(machine: Machine, planes: Sequence[float]) -> dict[str, list[float]]:
    """Places [mm] of every row of dimensions that has more than one; `planes` [m] are those of the probes."""
    start, end = machine.shaft.start * 1e3, machine.shaft.end * 1e3
    rows = {
        "sections": [start, *(right for _, right, _ in _pieces(machine))],
        "bearings": [start, *(b.position * 1e3 for b in machine.bearings), end],
        "discs": [start, *(d.position * 1e3 for d in machine.discs), end] if machine.discs else [],
        "layers": [1e3 * z for one in machine.shaft.layers for z in (machine.shaft.start, one.position, one.end)],
        "thrust": [1e3 * z for one in machine.thrust_bearings for z in (machine.shaft.start, one.position)],
        "probes": [start, *(z * 1e3 for z in planes), end],
        "overall": [start, end],
    }  # fmt: skip
    if len(machine.shaft.sections) == 1:
        del rows["sections"]
    ordered = {name: np.unique(np.round(places, 6)).tolist() for name, places in rows.items()}
    return {name: places for name, places in ordered.items() if len(places) > 1}


def _diameters(figure: go.Figure, view: SideView) -> None:
    """Diameters of the sections that are long enough for the number, as seen between the discs and sleeves."""
    for left, right, text in view.diameters:
        if right - left > 2 * WRITTEN * (view.end - view.start):
            figure.add_annotation(
                x=0.5 * (left + right), y=0.0, text=text, showarrow=False, bgcolor="rgba(255,255,255,0.75)"
            )


def _dimensions(figure: go.Figure, view: SideView, pixel: float) -> float:
    """Rows of dimensions below the machine; the lowest place [mm] that they take."""
    y = -1.1 * view.top
    for name, places in view.rows.items():
        y -= ROW * pixel
        _dimension_row(figure, name, places, y, pixel)
    return y - ROW * pixel


def _dimension_row(figure: go.Figure, name: str, places: Sequence[float], y: float, pixel: float) -> None:
    """A line with a tick at every place, and the distances between that have room for a number."""
    x: list[float | None] = [places[0], places[-1], None]
    heights: list[float | None] = [y, y, None]
    for z in places:
        x += [z, z, None]
        heights += [y - 5 * pixel, y + 5 * pixel, None]
    figure.add_scatter(x=x, y=heights, mode="lines", line={"color": INK, "width": 1}, hoverinfo="x", name=name)
    length = places[-1] - places[0]
    for left, right in pairwise(places):
        if right - left > WRITTEN * length:
            figure.add_annotation(
                x=0.5 * (left + right), y=y, yanchor="bottom", text=number(right - left, "mm", ".5g"), showarrow=False
            )
    figure.add_annotation(x=places[0], y=y, text=name, showarrow=False, xanchor="right", xshift=-10)
