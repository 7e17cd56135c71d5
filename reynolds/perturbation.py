r"""Linear perturbation of the steady film: sparse descriptor matrices, K(omega) and C(omega).

With y = (q of every node, plenum pressures) and the journal's displacement X,

.. math:: S\,\dot y + S_X\,\dot X + J\,y + J_X\,X + J_u u = 0, \qquad \delta F = F_y\,y, \qquad
          K + i\omega C = F_y\,(J + i\omega S)^{-1}(J_X + i\omega S_X),

u = (conductance of every pin, supply pressure). J and J_X are the Jacobians of the residual itself, so that the
coefficients are those of the non-linear film and not of a second discretisation.

Cites: hamrock_2004, thesis.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import block_diag
from scipy.sparse.linalg import splu

from reynolds.grid import FilmError, Layout, cells
from reynolds.newton import gap_terms, linear_terms
from reynolds.workspace import FilmModel

CORNERS = (("south_west", 1, 1), ("south_east", -1, 1), ("north_west", 1, -1), ("north_east", -1, -1))
"""Corners of the nine-point Jacobian of a textured film, and where the neighbour is, in lines and rows."""


@dataclass(frozen=True)
class LinearFilm:
    """Matrices of the perturbed film: S (n,), J (n, n) sparse, S_X, J_X (n, 2), J_u (n, n_inj + 1), F_y (2, n).

    Of several films side by side: two columns of S_X and J_X and two rows of F_y for each, one supply pressure.
    """

    S: np.ndarray
    J: Any
    S_X: np.ndarray
    J_X: np.ndarray
    J_u: np.ndarray
    F_y: np.ndarray


def dynamic_stiffness(film: LinearFilm, omega: float) -> np.ndarray:
    """K + i omega C (2, 2) [N/m] at the whirl frequency omega [rad/s]."""
    matrix = film.J + 1j * omega * sparse.diags(film.S)
    return np.asarray(film.F_y @ splu(matrix.tocsc()).solve(film.J_X + 1j * omega * film.S_X))


@dataclass(frozen=True)
class Kernels:
    """`linear_terms` and `gap_terms` for a layout: the functions for all layouts, or those compiled for this one."""

    terms: Callable[..., None]
    gap: Callable[..., None]


def common_kernels(layout: Layout) -> Kernels:
    """Kernels that take the sizes of the film as an argument."""
    return Kernels(lambda w, ix, F, U: linear_terms(w, ix, F, layout, U), lambda w, F, U: gap_terms(w, F, layout, U))


def linear_film(
    model: FilmModel, layout: Layout, w: np.ndarray, ix: np.ndarray, F: Any, speed: float, kernels: Kernels,
    arms: np.ndarray | float = 1.0,
) -> LinearFilm:  # fmt: skip
    """Matrices at the steady state held in the workspace w (left as it is) for shaft speed `speed` [rad/s].

    The force on the journal of every node counts with its `arms` (n,).
    """
    w = w.copy()
    kernels.terms(w, ix, F, speed * model.grid.radius)
    index = cells(layout)
    n, ni = index.size, layout.n_inj

    def film(offset: int) -> np.ndarray:
        return np.asarray(w[offset + index]).ravel()

    J = _injector_rows(layout, w, ix, F, index, _ring_matrix(layout, w))
    capacity = w[layout.capacity : layout.capacity + ni]
    area, held = film(layout.weight), film(layout.weight) * film(layout.h)
    opens = np.stack([film(layout.cos), film(layout.sin)], axis=1)
    if layout.textured:
        ahead = np.stack([film(layout.ahead_x), film(layout.ahead_y)], axis=1)
        opens = film(layout.broad)[:, None] * opens + ahead
        area, held = area * film(layout.broad), held * film(layout.broad) + film(layout.weight) * film(layout.deep)
        held -= film(layout.weight) * (ahead @ w[layout.journal : layout.journal + 2])
    S = np.concatenate([0.5 * held / film(layout.p), capacity])
    rate = film(layout.weight) * film(layout.p) * film(layout.slope)
    S_X = np.vstack([-rate[:, None] * opens, np.zeros((ni, 2))])
    local = np.stack([w[layout.inj_cos : layout.inj_cos + ni], w[layout.inj_sin : layout.inj_sin + ni]], axis=1)
    J_X = np.vstack(
        [
            np.stack([film(layout.border + axis * layout.length) for axis in range(2)], axis=1),
            -w[layout.film_h : layout.film_h + ni][:, None] * local,
        ]
    )
    read = 0.5 / film(layout.p)
    F_q = np.stack([read * film(layout.force_x), read * film(layout.force_y)])
    if layout.textured:
        F_q += np.stack([film(layout.push_x_by), film(layout.push_y_by)])
    F_y = np.hstack([arms * F_q, np.zeros((2, ni))])
    linear = LinearFilm(S, J, S_X, J_X, _inputs(layout, w, n), F_y)
    opening = area * film(layout.p) * film(layout.slope)
    if layout.foil:
        fed = _fed_through_gap(layout, w, ix, F, index)
        linear = _on_foil(linear, opening, fed, layout, w, F, speed * model.grid.radius, kernels)
    return _pushed(linear, w[layout.push + 2 : layout.push + 6].reshape(2, 2).T) if layout.textured else linear


def _pushed(film: LinearFilm, push: np.ndarray) -> LinearFilm:
    """The film whose journal its own displacement pushes too, by `push` (2, 2) [N/m].

    Pressures that push as much, T X with F_y T = `push`, are added to the unknown: y + T X is the state.
    """
    T = film.F_y.T @ np.linalg.solve(film.F_y @ film.F_y.T, push)
    return replace(film, J_X=film.J_X - film.J @ T, S_X=film.S_X - film.S[:, None] * T)


def _on_foil(
    film: LinearFilm, opening: np.ndarray, fed: Any, layout: Layout, w: np.ndarray, F: Any, U: float, kernels: Kernels
) -> LinearFilm:
    """The film with the foil's deflection, one more state a node where the foil has losses.

    Without storage J has the foil at rest under the pressure. With J_w the derivative after the gap, a film whose foil
    moves has S q' + M w' + (J - J_w R) q + J_w w = 0 and tau w' + w = R q, with R = dw/dq at rest and M, `opening`,
    what a gap that opens takes; w' is put in from the second, so that S stays diagonal. `fed` is the injectors' part
    of J_w, which J lacks.
    """
    if layout.strips:
        return _on_strips(film, opening, fed, layout, w, float(F["bend_time"])) if F["strip"] > 0 else film
    n, at = film.F_y.shape[1] - layout.n_inj, cells(layout)
    softness = (w[layout.soft + at] * 0.5 / w[layout.p + at]).ravel()
    R = sparse.hstack([sparse.diags(softness), sparse.csc_matrix((n, layout.n_inj))])
    if layout.n_inj:
        film = replace(film, J=(film.J + fed @ R).tocsc())
    if not F["bend_time"] > 0:
        S = film.S.copy()
        S[:n] += opening * softness
        return replace(film, S=S)
    kernels.gap(w, F, U)
    ring = _ring_matrix(layout, w)
    J_w = ring[:, :n] - sparse.vstack([sparse.diags(opening), sparse.csc_matrix((layout.n_inj, n))]) / F["bend_time"]
    if layout.n_inj:
        J_w += fed
    J = sparse.bmat([[film.J - J_w @ R, J_w], [-R, sparse.identity(n)]], format="csc")

    def below(rows: np.ndarray) -> np.ndarray:
        return np.vstack([rows, np.zeros((n, rows.shape[1]))])

    S = np.concatenate([film.S, np.full(n, F["bend_time"])])
    F_w = np.zeros((2, n))
    if layout.textured:
        F_w += np.stack([w[by + at].ravel() for by in (layout.push_x_by, layout.push_y_by)])
    F_y = np.hstack([film.F_y - F_w @ R, F_w])
    return LinearFilm(S, J, below(film.S_X), below(film.J_X), below(film.J_u), F_y)


def _on_strips(
    film: LinearFilm, opening: np.ndarray, fed: Any, layout: Layout, w: np.ndarray, time: float
) -> LinearFilm:
    """The film with the deflection w of every strip, a state of its own where the foil has losses.

    S q' + M w' + J q + J_w w = 0 and tau w' + w = R q, with M what a strip that moves takes, is written for
    u = q + S^-1 M w, so that S stays diagonal.
    """
    n, at, lines = layout.n_theta * layout.n_rows, cells(layout), layout.n_theta
    number = np.arange(n).reshape(at.shape)
    strip = np.repeat(np.arange(lines), layout.n_rows).reshape(at.shape)
    R = sparse.csc_matrix((w[layout.strip_reads + at].ravel(), (strip.ravel(), number.ravel())), (lines, len(film.S)))
    J_w = sparse.csc_matrix((len(film.S), lines))
    for array, aside in ((layout.by_own, 0), (layout.by_before, -1), (layout.by_behind, 1)):
        columns = (strip + aside) % lines
        J_w += sparse.csc_matrix((w[array + at].ravel(), (number.ravel(), columns.ravel())), J_w.shape)
    if layout.n_inj:
        J_w += fed @ sparse.csc_matrix((np.ones(n), (number.ravel(), strip.ravel())), (n, lines))
    G = sparse.csc_matrix((opening / film.S[:n], (number.ravel(), strip.ravel())), J_w.shape)
    J_w, whole, F_w = J_w - film.J @ G, 1 + (R @ G).diagonal(), -film.F_y @ G
    if layout.textured:
        F_w = F_w + w[layout.strip_push : layout.strip_push + 2 * lines].reshape(lines, 2).T
    if time == 0:
        bent = sparse.diags(1 / whole) @ R
        return replace(film, J=(film.J + J_w @ bent).tocsc(), F_y=film.F_y + F_w @ bent)
    J = sparse.bmat([[film.J, J_w], [-R, sparse.diags(whole)]], format="csc")

    def below(rows: np.ndarray) -> np.ndarray:
        return np.vstack([rows, np.zeros((lines, rows.shape[1]))])

    S = np.concatenate([film.S, np.full(lines, time)])
    return LinearFilm(S, J, below(film.S_X), below(film.J_X), below(film.J_u), np.hstack([film.F_y, F_w]))


def _fed_through_gap(layout: Layout, w: np.ndarray, ix: np.ndarray, F: Any, index: np.ndarray) -> Any:
    """Derivative (n + n_inj, n) of the balances after the gap at every node, of the injectors' flows alone."""
    position = {int(cell): k for k, cell in enumerate(index.ravel())}
    found = sparse.lil_matrix((index.size + layout.n_inj, index.size))
    for k in range(layout.n_inj):
        sources = range(ix[layout.source_start + k], ix[layout.source_start + k + 1])
        places = [position[int(ix[layout.source_cell + s])] for s in sources]
        weights = w[layout.source_weight + np.array(sources)]
        flow = w[layout.film_h + k] * (1 + layout.half) * weights
        found[index.size + k, places] = flow
        for place, share in zip(places, weights, strict=True):
            found[place, places] = -float(F["source"]) * share * flow
    return found.tocsc()


def tilted_film(
    model: FilmModel, layout: Layout, w: np.ndarray, ix: np.ndarray, F: Any, speed: float, kernels: Kernels
) -> LinearFilm:
    """Film whose J_X, S_X are those of a journal that tilts by (dX/dz, dY/dz), and F_y y its moment.

    A gap that changes by z times as much changes a balance z times as much, but for what the fluxes between nodes of
    different z make of it. Of a half film the states are those of pressures that are odd in z: in the midplane, of
    injectors there and of strips nothing changes.
    """
    if model.sleeve.steps or model.sleeve.jumps:
        raise FilmError("tilt: takes a film without pockets and jumps; give it another sleeve", argument="sleeve")
    at, half, whole = cells(layout), model.grid.length / 2, not model.grid.half
    film = linear_film(model, layout if whole else layout._replace(n_inj=0), w, ix, F, speed, kernels)
    n = at.size
    z = np.broadcast_to(model.grid.dz * (whole + np.arange(layout.n_rows)) - whole * half, at.shape)
    beyond = z * whole  # of what changes a balance besides the nodes: edges and injectors
    beyond[:, -1] = half
    if whole:
        beyond[:, 0] = -half
    w = w.copy()
    kernels.terms(w, ix, F, speed * model.grid.radius)
    if not whole and not (layout.foil and not layout.strips):
        film = replace(film, J=_ring_matrix(layout, w)[:n, :n], S=film.S[:n], F_y=film.F_y[:, :n])
    kernels.gap(w, F, speed * model.grid.radius)
    ring = _ring_matrix(layout, w)[:n, :n]
    closes = -np.stack([w[layout.cos + at].ravel(), w[layout.sin + at].ravel()], axis=1)
    size = len(film.S)
    J_X, arms, push = np.zeros((size, 2)), np.zeros((size, 1)), np.zeros(size)
    injectors = [one.offset for one in model.injectors if whole]
    arms[:n, 0], arms[n : n + len(injectors), 0] = z.ravel(), injectors
    push[:n] = z.ravel()
    if layout.foil and not layout.strips:
        last = n + layout.n_inj * whole
        push[last:] = np.resize(z, size - last)
    J_X[n:] = arms[n:] * film.J_X[n:size]
    J_X[:n] = ring @ (z.reshape(-1, 1) * closes) + beyond.reshape(-1, 1) * (film.J_X[:n] - ring @ closes)
    F_y = film.F_y * push
    if whole and layout.strips and layout.n_inj:  # a strip moves nodes of every z, unevenly about orifices
        F_y = linear_film(model, layout, w, ix, F, speed, kernels, z.ravel()).F_y
    tilted = LinearFilm(film.S, film.J, arms * film.S_X[:size], J_X, np.zeros((size, 1)), F_y)
    return tilted if whole else _odd(tilted, layout.n_rows)


def _odd(film: LinearFilm, rows: int) -> LinearFilm:
    """A half film without the states of the midplane, the first of every `rows`."""
    kept = np.flatnonzero(np.arange(len(film.S)) % rows)
    J = film.J.tocsr()[kept][:, kept].tocsc()
    return LinearFilm(film.S[kept], J, film.S_X[kept], film.J_X[kept], film.J_u[kept], film.F_y[:, kept])


def with_tilt(film: LinearFilm, tilted: LinearFilm) -> LinearFilm:
    """A whole film that both moves and tilts: displacements and forces before tilts and moments."""
    S_X, J_X = np.hstack([film.S_X, tilted.S_X]), np.hstack([film.J_X, tilted.J_X])
    return replace(film, S_X=S_X, J_X=J_X, F_y=np.vstack([film.F_y, tilted.F_y]))


def side_by_side(films: Sequence[LinearFilm]) -> LinearFilm:
    """Several films as one, which only the supply pressure has in common."""
    if len(films) == 1:
        return films[0]
    parts = [(film.S_X, film.J_X, film.F_y.T, film.J_u[:, :-1]) for film in films]
    widths = [part.shape[1] for one in parts for part in one]
    columns = np.split(block_diag(*map(np.hstack, parts)), np.cumsum(widths)[:-1], axis=1)
    S_X, J_X, F_y, J_u = (np.hstack(columns[k::4]) for k in range(4))
    supply = np.concatenate([film.J_u[:, -1:] for film in films])
    before = np.cumsum([0, *(len(film.S) for film in films)])
    every = [(film.J.data, film.J.indices + row) for film, row in zip(films, before, strict=False)]
    data, rows = (np.concatenate(one) for one in zip(*every, strict=True))
    starts = np.append(0, np.cumsum(np.concatenate([np.diff(film.J.indptr) for film in films])))
    return LinearFilm(
        np.concatenate([film.S for film in films]),
        sparse.csc_matrix((data, rows, starts), (before[-1], before[-1])),
        S_X,
        J_X,
        np.hstack([J_u, supply]),
        F_y.T,
    )


def _ring_matrix(layout: Layout, w: np.ndarray) -> Any:
    """The five-point Jacobian as a sparse matrix, padded with empty plenum rows and columns."""
    places, pattern = _ring_pattern(layout)
    matrix = copy(pattern)
    matrix.data = w[places]
    return matrix


@lru_cache(maxsize=16)
def _ring_pattern(layout: Layout) -> tuple[np.ndarray, Any]:
    """Places in the workspace of the terms of that Jacobian by columns, and a matrix of its pattern."""
    nt, nr = layout.n_theta, layout.n_rows
    number = np.arange(nt * nr).reshape(nt, nr)
    at = cells(layout)
    entries = [
        (number, number, layout.diag + at),
        (number, np.roll(number, 1, axis=0), layout.west + at),
        (number, np.roll(number, -1, axis=0), layout.east + at),
        (number[:, 1:], number[:, :-1], (layout.down + at)[:, 1:]),
        (number[:, :-1], number[:, 1:], (layout.up + at)[:, :-1]),
    ]
    if layout.textured:
        for name, di, dj in CORNERS:
            own = slice(1, None) if dj > 0 else slice(None, -1)
            other = slice(None, -1) if dj > 0 else slice(1, None)
            column = np.roll(number, di, axis=0)[:, other]
            entries.append((number[:, own], column, (getattr(layout, name) + at)[:, own]))
    rows, columns, places = (np.concatenate([np.ravel(e[part]) for e in entries]) for part in range(3))
    order = np.lexsort((rows, columns))
    starts = np.append(0, np.cumsum(np.bincount(columns, minlength=nt * nr + layout.n_inj)))
    size = len(starts) - 1
    pattern = sparse.csc_matrix((np.zeros(len(order)), rows[order], starts), (size, size))
    pattern.sort_indices()
    for one in (pattern.indices, pattern.indptr):
        one.flags.writeable = False  # every film's matrix has these
    return places[order], pattern


def _injector_rows(layout: Layout, w: np.ndarray, ix: np.ndarray, F: Any, index: np.ndarray, ring: Any) -> Any:
    """Add the plena and the film's dependence on them."""
    if not layout.n_inj:
        return ring
    n = index.size
    position = {int(cell): k for k, cell in enumerate(index.ravel())}
    rows: list[int] = []
    cols: list[int] = []
    values: list[float] = []

    def add(row: int, col: int, value: float) -> None:
        rows.append(row)
        cols.append(col)
        values.append(float(value))

    for k in range(layout.n_inj):
        sources = range(ix[layout.source_start + k], ix[layout.source_start + k + 1])
        readers = range(ix[layout.reader_start + k], ix[layout.reader_start + k + 1])
        weight = layout.reader_weight if w[layout.outward + k] > 0 else layout.plain_weight
        film_p, film_q = w[layout.film_p + k], w[layout.film_q + k]
        add(n + k, n + k, film_p - w[layout.pin_p + k])
        for r in readers:
            add(n + k, position[int(ix[layout.reader_cell + r])], film_q * w[weight + r])
        for s in sources:
            row = position[int(ix[layout.source_cell + s])]
            share = float(F["source"]) * w[layout.source_weight + s]
            add(row, n + k, -share * film_p)
            for r in readers:
                col = position[int(ix[layout.reader_cell + r])]
                add(row, col, -share * film_q * w[weight + r])
    return ring + sparse.coo_matrix((values, (rows, cols)), shape=ring.shape).tocsc()


def _inputs(layout: Layout, w: np.ndarray, n: int) -> np.ndarray:
    """Derivative of the plenum rows after each pin's conductance and after the supply pressure."""
    ni = layout.n_inj
    J_u = np.zeros((n + ni, ni + 1))
    for k in range(ni):
        conductance, flow = w[layout.pin_conductance + k], w[layout.pin_flow + k]
        J_u[n + k, k] = -flow / conductance
        # Euler's theorem: the flow is homogeneous in both pressures, of degree 1 (orifice) or 2 (laminar)
        plenum, supply = w[layout.plenum + k], w[layout.supply + k]
        J_u[n + k, ni] = -((1 + w[layout.law]) * flow - plenum * w[layout.pin_p + k]) / supply
    return J_u
