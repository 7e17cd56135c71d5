"""The theta-z grid of the film and the layout of its flat workspace.

Pressure nodes sit at theta_i = i dtheta (i = 0 .. n_theta - 1, periodic) and z_j = j dz; the outermost z nodes are the
bearing's edges, where p is ambient. A bearing that is symmetric about its midplane is solved on one half: row 0 is the
midplane with half a cell, and forces count twice.

Every film array is stored as theta lines of `stride` values between two ghost lines that repeat the other end: the
unknown rows, the upper edge and, on a full bearing, the lower edge of the NEXT line, which sits right before its
rows. So neighbours are at fixed distances (+-1 in z, +-stride in theta), every loop over the film is one flat loop,
and with sizes known at compile time it vectorises without alias checks.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rotorsim.base.errors import RotorsimError

CONVERGENCE = 16
"""Places for the memory of Newton's method, in w[convergence]."""
JUMP, KINK = 1e-12, 1e-9
"""Differences [m] of the gap and of its derivative between two stretches that are no rounding."""
FILM_ARRAYS = (
    "cos", "sin", "weight", "per_weight", "link", "form", "clearance", "p", "h", "flow_t", "flow_z", "r", "m_rhs",
    "h_frozen", "p_frozen", "diag", "west", "east", "down", "up", "dh", "slope", "two_p",
    "m_old", "rate", "m_mid", "dp", "force_x", "force_y", "p_1", "p_2", "p_3", "m_before", "scale",
)  # fmt: skip
FOIL_ARRAYS = ("soft", "bend", "bend_rhs", "bend_old", "bend_rate", "bend_mid")
STRIP_ARRAYS = ("strip_reads", "by_before", "by_own", "by_behind", "whole_x", "whole_y")
TEXTURE_ARRAYS = ("depth", "share", "cos_squared", "sin_cos", "deep", "broad", "ahead_x", "ahead_y", "patch",
                  "patch_south", "mixed", "south", "north", "face_west", "face_east", "south_west", "south_east",
                  "north_west", "north_east", "push_x", "push_y", "shifted_x", "shifted_y", "push_x_by",
                  "push_y_by")  # fmt: skip
"""Arrays of films with a foil, with strips under it or with grooves and steps; other films have no room for them."""
INJECTOR_ARRAYS = ("plenum", "plenum_rhs", "pin_conductance", "supply", "curtain", "capacity", "pin_flow", "film_flow",
                   "gain_q", "gain_h", "defect", "shift", "pull_q", "pull_h", "pin_p", "film_p", "film_q", "film_h",
                   "inj_cos", "inj_sin", "outward", "beta", "plenum_old", "plenum_rate", "plenum_mid", "plenum_1",
                   "plenum_2", "plenum_3", "local_p", "local_h", "reading")  # fmt: skip
NOZZLE_TERMS = 16
PLACE = 5
"""Numbers of a place where the gap is smallest, in w[places]: distance of the sleeve from its centre, reach of the
journal towards it, direction x and y, and the second derivative of the gap after the angle."""
STRETCH = 14
"""Numbers of a stretch of the sleeve that is smooth, in w[stretches]: line, first and last share of the step to the
next, middle of its arc [rad], depth [m]; at either end the direction x and y, distance from the centre [m] and its
derivative after the angle; whether the distance jumps where it begins."""
MEDIUM = 6
"""Numbers of a piece in w[media]: conductances [m3] along the circumference, between both axes and along the axis, drag
[m] along both, and what the surface adds to the pressure in its middle [Pa]."""
LAMINATE = 7
"""Numbers of a lane of pieces in w[laminate]: those of `reynolds.texture.medium`, with the inverse of the conductance
along the other axis, and what its pieces drag at their own pressures: [m2] per gradient of p^2 over p, and [Pa m]."""


class FilmError(RotorsimError, ValueError):
    """Raised for a film that cannot be computed, or its input; the message states where and why."""


class Layout(NamedTuple):
    """Sizes and offsets (in doubles) of the film's part of a workspace; all integers, literal in compiled steps."""

    n_theta: int
    n_rows: int
    stride: int
    half: int
    foil: int
    strips: int
    textured: int
    grooved: int
    n_steps: int
    pieces: int
    n_inj: int
    n_border: int
    length: int
    span: int
    first: int
    cos: int
    sin: int
    weight: int
    per_weight: int
    link: int
    form: int
    clearance: int
    p: int
    h: int
    flow_t: int
    flow_z: int
    r: int
    m_rhs: int
    h_frozen: int
    p_frozen: int
    diag: int
    west: int
    east: int
    down: int
    up: int
    dh: int
    slope: int
    two_p: int
    m_old: int
    rate: int
    m_mid: int
    dp: int
    force_x: int
    force_y: int
    p_1: int
    p_2: int
    p_3: int
    m_before: int
    scale: int
    soft: int
    bend: int
    bend_rhs: int
    bend_old: int
    bend_rate: int
    bend_mid: int
    strip_reads: int
    by_before: int
    by_own: int
    by_behind: int
    whole_x: int
    whole_y: int
    strip_push: int
    held: int
    depth: int
    share: int
    cos_squared: int
    sin_cos: int
    deep: int
    broad: int
    ahead_x: int
    ahead_y: int
    patch: int
    patch_south: int
    mixed: int
    south: int
    north: int
    face_west: int
    face_east: int
    south_west: int
    south_east: int
    north_west: int
    north_east: int
    push_x: int
    push_y: int
    shifted_x: int
    shifted_y: int
    push_x_by: int
    push_y_by: int
    line_piece: int
    line_lift: int
    line_middle: int
    line_turn: int
    line_cover: int
    row_piece: int
    row_slant: int
    row_cover: int
    step_depth: int
    groove: int
    media: int
    laminate: int
    push: int
    plenum: int
    plenum_rhs: int
    pin_conductance: int
    supply: int
    curtain: int
    capacity: int
    pin_flow: int
    film_flow: int
    gain_q: int
    gain_h: int
    defect: int
    shift: int
    pull_q: int
    pull_h: int
    pin_p: int
    film_p: int
    film_q: int
    film_h: int
    inj_cos: int
    inj_sin: int
    outward: int
    beta: int
    plenum_old: int
    plenum_rate: int
    plenum_mid: int
    plenum_1: int
    plenum_2: int
    plenum_3: int
    local_p: int
    local_h: int
    reading: int
    nozzle: int
    source_weight: int
    reader_weight: int
    plain_weight: int
    source_start: int
    source_cell: int
    reader_start: int
    reader_cell: int
    n_integers: int
    journal: int
    journal_a: int
    journal_b: int
    journal_rhs: int
    static_a: int
    static_rhs: int
    force: int
    inverse: int
    spike: int
    closure: int
    border: int
    border_force: int
    border_reader: int
    small: int
    small_matrix: int
    lanes: int
    convergence: int
    mu: int
    slip: int
    law: int
    outline: int
    places: int
    stretches: int
    added: int
    size: int


@dataclass(frozen=True)
class Texture:
    """Kinds of forms that the films of a workspace have, which decide how many pieces a cell is cut into.

    `steps` rows of pockets, grooves, lobes between which the gap jumps.
    """

    steps: int = 0
    grooved: bool = False
    jumps: bool = False

    @property
    def pieces(self) -> int:
        """Most pieces of a cell in one direction: with any of the rows of pockets, on either side of an edge."""
        return 2**self.steps * (2 if self.grooved or self.jumps else 1)


@dataclass(frozen=True)
class FilmGrid:
    """A theta-z grid over a bearing of radius `radius` and length `length` [m]."""

    radius: float
    length: float
    n_theta: int
    n_z: int
    half: bool = True

    def __post_init__(self) -> None:
        if self.n_theta < 8 or self.n_theta % 4:
            raise FilmError(f"n_theta = {self.n_theta}: must be a multiple of 4, at least 8")
        if self.n_z < 4 or self.n_z % 2:
            raise FilmError(f"n_z = {self.n_z}: must be even, at least 4 (intervals over the full length)")

    @property
    def dtheta(self) -> float:
        """Angle between lines [rad]."""
        return 2 * np.pi / self.n_theta

    @property
    def dy(self) -> float:
        """Circumferential step [m]."""
        return self.radius * self.dtheta

    @property
    def dz(self) -> float:
        """Axial step [m]."""
        return self.length / self.n_z

    @property
    def n_rows(self) -> int:
        """Unknown rows in z."""
        return self.n_z // 2 if self.half else self.n_z - 1

    @property
    def row_z(self) -> np.ndarray:
        """z of the unknown rows [m], from the bearing's centre."""
        rows = np.arange(self.n_rows)
        return rows * self.dz if self.half else (rows + 1) * self.dz - self.length / 2

    @property
    def theta(self) -> np.ndarray:
        """Angles of the lines [rad]."""
        return np.arange(self.n_theta) * self.dtheta

    @property
    def z(self) -> np.ndarray:
        """Centres of the n_z intervals [m]."""
        return (np.arange(self.n_z) + 0.5) * self.dz - self.length / 2


def make_layout(
    grid: FilmGrid, source_sizes: list[int], reader_sizes: list[int],
    foil: bool = False, texture: Texture | None = None, edges: int = 0, strips: bool = False,
) -> Layout:  # fmt: skip
    """Lay the film's arrays out; sizes are the footprint cells of each injector, `edges` those of lobes and pockets.

    A film whose gap is not smooth has a `texture`. mu and slip stand in the workspace because effects change them, and
    the injectors' law so that both share their machine code.
    """
    rows, stride, n_inj = grid.n_rows, grid.n_rows + (1 if grid.half else 2), len(source_sizes)
    first = _round(8 + stride)
    length = _round(first + (grid.n_theta + 1) * stride + 8)
    span = _round(grid.n_theta * stride)
    borders, blocks = n_inj + 2, grid.n_theta * rows * rows
    sizes = {name: length for name in FILM_ARRAYS}
    textured, form = texture is not None, texture or Texture()
    further = {name: length * foil for name in FOIL_ARRAYS} | {name: length * textured for name in TEXTURE_ARRAYS}
    further |= {name: length * strips for name in STRIP_ARRAYS} | {"strip_push": 2 * grid.n_theta * strips, "held": 1}
    lines, patches = (textured * count * form.pieces for count in (grid.n_theta, rows + 1))
    further |= {
        "line_piece": lines, "line_lift": lines, "line_middle": lines, "line_turn": 4 * lines,
        "line_cover": lines * form.steps,
        "row_piece": patches, "row_slant": patches, "row_cover": patches * form.steps,
        "step_depth": form.steps, "groove": 4 * textured, "media": MEDIUM * form.pieces**2 * textured,
        "laminate": LAMINATE * form.pieces * textured, "push": 6 * textured,
    }  # fmt: skip
    sizes |= {name: n_inj for name in INJECTOR_ARRAYS}
    # columns of spikes and borders solved together, then borders at the cuts closed together
    lanes = max((2 * rows + max(borders, 6)) * _round(rows), (borders + 1) * _round(2 * rows))
    sizes |= {
        "nozzle": NOZZLE_TERMS + 4, "source_weight": sum(source_sizes), "reader_weight": sum(reader_sizes),
        "plain_weight": sum(reader_sizes),
        "journal": 2, "journal_a": 4, "journal_b": 4, "journal_rhs": 2, "static_a": 4, "static_rhs": 2, "force": 2,
        "inverse": blocks, "spike": 2 * rows * length, "border": borders * length, "closure": 4 * rows * rows,
        "border_force": 2 * borders, "border_reader": max(n_inj, 1) * borders, "small": 2 * borders,
        "small_matrix": borders * borders, "lanes": lanes, "convergence": CONVERGENCE,
        "mu": 1, "slip": 1, "law": 1,
        "outline": grid.n_theta + 3, "places": PLACE * grid.n_theta,
        "stretches": STRETCH * (grid.n_theta + edges), "added": foil * textured * (grid.n_theta + edges),
    } | further  # fmt: skip
    offsets, at = {}, 0
    for name, size in sizes.items():
        offsets[name], at = at, _round(at + max(size, 1))
    starts = n_inj + 1
    integers = {
        "source_start": 0, "source_cell": starts, "reader_start": starts + sum(source_sizes),
        "reader_cell": 2 * starts + sum(source_sizes),
        "n_integers": 2 * starts + sum(source_sizes) + sum(reader_sizes) + 1,
    }  # fmt: skip
    return Layout(
        n_theta=grid.n_theta, n_rows=rows, stride=stride, half=int(grid.half), foil=int(foil),
        strips=int(strips), textured=int(textured), grooved=int(form.grooved), n_steps=form.steps,
        pieces=form.pieces, n_inj=n_inj, n_border=borders, length=length, span=span,
        first=first, size=at, **offsets, **integers,
    )  # fmt: skip


def _round(size: int) -> int:
    return (size + 7) // 8 * 8


def cells(layout: Layout) -> np.ndarray:
    """Indices (n_theta, n_rows) of the unknown pressures inside a film array."""
    lines = layout.first + np.arange(layout.n_theta) * layout.stride
    return lines[:, None] + np.arange(layout.n_rows)


def fill(w: np.ndarray, offset: int, layout: Layout, values: np.ndarray, edge: float | np.ndarray) -> None:
    """Write (n_theta, n_rows) `values` into the film array at `offset`: ghosts repeat the other end.

    `edge` is the value of both edges, one number or one per line.
    """
    rows = layout.n_rows
    edges = np.broadcast_to(np.asarray(edge, float), layout.n_theta)
    lines = np.empty((layout.n_theta + 2, layout.stride))
    lines[1:-1, :rows] = values
    lines[1:-1, rows] = edges
    lines[1:-1, rows + 1 :] = np.roll(edges, -1)[:, None]
    lines[0], lines[-1] = lines[-2], lines[1]
    w[offset : offset + layout.length] = edges[0]
    start = offset + layout.first - layout.stride
    w[start : start + lines.size] = lines.ravel()
