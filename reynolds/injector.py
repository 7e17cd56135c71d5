r"""Injectors: pin seat -> plenum -> curtain -> footprint.

The plenum pressure P_k is a state,

.. math:: \frac{V}{\kappa R_g T}\,\dot P_k = \dot m_\mathrm{pin} - \dot m_\mathrm{film}

(kappa = 1: isothermal). Two laws feed it:

orifice       \dot m_pin = Cd1 \pi d_p (g_0 - y)_+ \Phi(P_s, P_k), y the pin's extension: a longer pin closes the seat;
loss factor   \dot m_pin = l_f(y) (P_s^2 - P_k^2), laminar (Pierart & Santos 2015);

and \dot m_film = Cd2 \pi d_o h_loc \Phi(P_k, p_loc) leaves through the curtain round the orifice. \Phi is the
isentropic nozzle function, choked below the critical pressure ratio, odd for backflow and linear for r > 0.995 where
its root is singular. It is evaluated as sqrt(1 - r) times a polynomial fitted to round-off, so that no power function
is called and every platform computes the same bits.

The source is spread over the orifice's disc by area weights. On a coarse grid the disc's mean pressure is not the mean
of the node pressures, because p^2 is logarithmic round a source; `footprint` returns reading weights that put the
missing part back (a multiple of the discrete Laplacian; Peaceman's well correction, here with the disc's own mean).

Cites: hamrock_2004, morosi_2011, pierart_2015, thesis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from reynolds.grid import NOZZLE_TERMS, FilmError, FilmGrid
from reynolds.jit import inlined

LINEAR_ABOVE = 0.995
LAWS = ("orifice", "loss_factor")


@dataclass(frozen=True)
class Injector:
    """One injector: SI units; `angle` [rad] from x towards y, `offset` [m] from the bearing's centre.

    `law` is "orifice" or "loss_factor"; `pin` is the extension [m] taken when none is given in a call. An `open_area`
    [m^2], discharge coefficient times area, stands for a hole that is always open in place of seat and pin.

    Examples
    --------
    >>> import reynolds
    >>> injectors = tuple(reynolds.Injector(angle) for angle in (0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi))
    >>> reynolds.GasBearing(0.02, 0.04, 25e-6, injectors=injectors).injectors[1].law
    'orifice'
    """

    angle: float
    offset: float = 0.0
    law: str = "orifice"
    pin: float = 22.5e-6
    seat_gap: float = 40.2e-6
    minimum_gap: float = 0.5e-6
    pin_diameter: float = 2e-3
    pin_discharge: float = 0.1244
    orifice_diameter: float = 2e-3
    curtain_discharge: float = 0.9
    plenum_volume: float = 1e-9
    polytropic_exponent: float = 1.0
    loss_factor: float = 0.0
    loss_exponent: float = 1.0
    open_area: float = 0.0

    def __post_init__(self) -> None:
        if self.law not in LAWS:
            raise FilmError(f"injector: law {self.law!r} is not known; choose one of {', '.join(LAWS)}")

    def conductance(self, pin: float) -> float:
        """Pin conductance: Cd1 pi d_p g [m^2] (orifice) or l_f [kg/(s Pa^2)] at pin extension `pin` [m]."""
        if self.open_area > 0:
            return self.open_area
        gap = max(self.seat_gap - pin, self.minimum_gap)
        if self.law == "loss_factor":
            return self.loss_factor * (gap / self.seat_gap) ** self.loss_exponent
        return self.pin_discharge * math.pi * self.pin_diameter * gap


def nozzle_flux(ratio: np.ndarray, kappa: float, gas_constant: float, temperature: float) -> np.ndarray:
    """Isentropic mass flux per area and upstream pressure [s/m] at pressure ratio `ratio` (not linearised)."""
    r = np.maximum(ratio, critical_ratio(kappa))
    factor = 2 * kappa / ((kappa - 1) * gas_constant * temperature)
    return np.sqrt(factor * (r ** (2 / kappa) - r ** ((kappa + 1) / kappa)))


def critical_ratio(kappa: float) -> float:
    """Pressure ratio below which the flow is choked."""
    return float((2 / (kappa + 1)) ** (kappa / (kappa - 1)))


def nozzle_coefficients(kappa: float, gas_constant: float, temperature: float) -> np.ndarray:
    """Constants of `nozzle`: polynomial in (1 - r), critical ratio, choked flux, slope and limit of the linear part."""
    fluxes, critical = unit_coefficients(kappa)
    scaled = fluxes / math.sqrt(gas_constant * temperature)
    return np.concatenate([scaled[:-2], [critical], scaled[-2:], [1 - LINEAR_ABOVE]])


@lru_cache
def unit_coefficients(kappa: float) -> tuple[np.ndarray, float]:
    """Fluxes of `nozzle_coefficients` for R T = 1 m^2/s^2, of which all are multiples, and the critical ratio."""
    critical = critical_ratio(kappa)
    top = 1 - critical
    nodes = top * (0.5 + 0.5 * np.cos(np.pi * (np.arange(64) + 0.5) / 64))
    values = nozzle_flux(1 - nodes, kappa, 1.0, 1.0) / np.sqrt(nodes)
    poly = np.polynomial.Chebyshev.fit(nodes, values, NOZZLE_TERMS - 1, domain=[0, top])
    coefficients = poly.convert(kind=np.polynomial.Polynomial).coef
    limit = 1 - LINEAR_ABOVE
    at_limit = math.sqrt(limit) * np.polynomial.polynomial.polyval(limit, coefficients)
    at_critical = math.sqrt(top) * np.polynomial.polynomial.polyval(top, coefficients)
    return np.concatenate([coefficients, [at_critical, at_limit / limit]]), critical


@inlined
def nozzle_table(w, c):
    """`nozzle_coefficients`, from offset `c` of w on, as values that a loop over injectors keeps."""
    return (
        (w[c], w[c + 2], w[c + 4], w[c + 6], w[c + 8], w[c + 10], w[c + 12], w[c + 14]),
        (w[c + 1], w[c + 3], w[c + 5], w[c + 7], w[c + 9], w[c + 11], w[c + 13], w[c + 15]),
        (w[c + 16], w[c + 17], w[c + 18], w[c + 19]),
    )


@inlined
def horner(c, s):
    """Value and derivative of the polynomial in s with eight coefficients, by Horner's rule."""
    a, b = c[7], c[6]
    value, slope = a * s + b, a
    slope, value = slope * s + value, value * s + c[5]
    slope, value = slope * s + value, value * s + c[4]
    slope, value = slope * s + value, value * s + c[3]
    slope, value = slope * s + value, value * s + c[2]
    slope, value = slope * s + value, value * s + c[1]
    slope, value = slope * s + value, value * s + c[0]
    return value, slope


@inlined
def nozzle(up, down, table):
    """Nozzle function [kg/(s m^2)] and its derivatives after upstream and downstream pressure [Pa].

    `table` is that of `nozzle_table`. Backflow has the opposite sign. Written without branches, so that several nozzles
    are evaluated at once.
    """
    even_terms, odd_terms, (critical, choked, linear, limit) = table
    backward = down > up
    high, low = (down, up) if backward else (up, down)
    r = low / high
    t = 1.0 - r
    # the even and the odd powers of t side by side
    s = t * t
    even, d_even = horner(even_terms, s)
    odd, d_odd = horner(odd_terms, s)
    value = even + t * odd
    slope = odd + 2.0 * t * (d_even + t * d_odd)
    root = math.sqrt(max(t, limit))
    g = root * value
    dg = root * slope + 0.5 * value / root
    g = linear * t if t < limit else g
    dg = linear if t < limit else dg
    g = choked if r <= critical else g
    dg = 0.0 if r <= critical else dg
    flow = high * g
    d_high = g + dg * r
    return (
        -flow if backward else flow,
        dg if backward else d_high,
        -d_high if backward else -dg,
    )


@inlined
def pin_flow(pressure, supply, conductance, law, table):
    """Mass flow through the pin seat [kg/s] and its derivative after the plenum pressure."""
    if law == 1.0:
        return laminar_flow(pressure, supply, conductance)
    return orifice_flow(pressure, supply, conductance, table)


@inlined
def laminar_flow(pressure, supply, conductance):
    """Mass flow through the pin seat by the loss-factor form [kg/s], and its derivative."""
    return conductance * (supply * supply - pressure * pressure), -2.0 * conductance * pressure


@inlined
def orifice_flow(pressure, supply, conductance, table):
    """Mass flow through the pin seat by the orifice's law [kg/s], and its derivative."""
    flow, _, d_down = nozzle(supply, pressure, table)
    return conductance * flow, conductance * d_down


Entry = tuple[int, int, float]


PATCH = 24
"""Cells from the centre of the patch around an injector to its rim."""


@dataclass(frozen=True)
class Footprint:
    """An injector on the grid, as lists of (line, row, weight).

    `source` weights sum to 1 over the full bearing (a half-bearing list holds its own half); `reader` weights give the
    disc's mean of p^2 from the nodes' p^2 and sum to 1; `plain` are the same without the sub-grid correction `beta`.
    """

    source: list[Entry]
    reader: list[Entry]
    plain: list[Entry]
    beta: float


@lru_cache(maxsize=1024)
def footprint(grid: FilmGrid, injector: Injector) -> Footprint:
    """Cells that an injector feeds, and the weights by which the film's pressure at its disc is read."""
    spread = _area_weights(grid, injector)
    beta = subgrid_correction(grid, injector, spread)
    read, plain = dict(spread), dict(spread)
    squares = sum(share**2 for share in spread.values())
    for (i, j), share in spread.items():
        # a cell with the share v of the source has the share v of -Laplacian q: least squares for Q/T
        for (a, b), ratio in _neighbours(grid, i, j):
            read[i, j] += beta * ratio * share / squares
            read[a, b] = read.get((a, b), 0.0) - beta * ratio * share / squares
            plain.setdefault((a, b), 0.0)
    return Footprint(
        _fold(grid, spread, source=True), _fold(grid, read, source=False), _fold(grid, plain, source=False), beta
    )


def _area_weights(grid: FilmGrid, injector: Injector, samples: int = 400) -> dict[tuple[int, int], float]:
    """Share of the orifice's disc in each cell; keys (line, axial node counted from the left edge)."""
    radius = injector.orifice_diameter / 2
    s = ((np.arange(samples) + 0.5) / samples * 2 - 1) * radius
    inside = s[:, None] ** 2 + s**2 <= radius**2
    line = np.rint((injector.angle * grid.radius + s) / grid.dy).astype(int) % grid.n_theta
    node = np.rint((injector.offset + grid.length / 2 + s) / grid.dz).astype(int)
    lines, nodes = (np.flatnonzero(np.diff(one, prepend=one[0] - 1)) for one in (line, node))
    counts = np.add.reduceat(np.add.reduceat(inside, nodes, axis=1, dtype=int), lines, axis=0)
    total = inside.sum()
    cells = sorted((int(line[i]), int(node[j]), float(n)) for i, row in zip(lines, counts, strict=True)
                   for j, n in zip(nodes, row, strict=True) if n)  # fmt: skip
    return {(i, j): n / total for i, j, n in cells}


def _neighbours(grid: FilmGrid, i: int, j: int) -> list[tuple[tuple[int, int], float]]:
    theta, axial = grid.dz / grid.dy, grid.dy / grid.dz
    return [
        (((i + 1) % grid.n_theta, j), theta),
        (((i - 1) % grid.n_theta, j), theta),
        ((i, j + 1), axial),
        ((i, j - 1), axial),
    ]


def subgrid_correction(grid: FilmGrid, injector: Injector, spread: dict[tuple[int, int], float]) -> float:
    """Mean of q over the disc minus the weighted mean of the node values, for a unit source Q/T.

    The discrete source is solved on a patch whose rim carries the exact logarithm; in the continuum the mean over a
    uniform disc source is 1/(8 pi) above the rim of the disc.
    """
    half = PATCH
    keys = np.array(list(spread))
    centre = (int(np.rint(injector.angle * grid.radius / grid.dy)), int(np.rint(injector.offset / grid.dz)))
    shift = (injector.angle * grid.radius - centre[0] * grid.dy, injector.offset - centre[1] * grid.dz)
    a, b = np.meshgrid(np.arange(-half, half + 1), np.arange(-half, half + 1), indexing="ij")
    distance = np.hypot(a * grid.dy - shift[0], b * grid.dz - shift[1])
    rim = (np.abs(a) == half) | (np.abs(b) == half)
    exact = -np.log(np.maximum(distance, 1e-12) / (injector.orifice_diameter / 2)) / (2 * np.pi)
    rhs = np.where(rim, exact, 0.0)
    line = (keys[:, 0] - centre[0] + grid.n_theta // 2) % grid.n_theta - grid.n_theta // 2 + half
    node = keys[:, 1] - centre[1] - grid.n_z // 2 + half
    weight = np.array(list(spread.values()))
    np.add.at(rhs, (line, node), weight)
    q = _patch(grid.dz / grid.dy, grid.dy / grid.dz).solve(rhs.ravel()).reshape(rhs.shape)
    return float(1 / (8 * np.pi) - weight @ q[line, node])


@lru_cache(maxsize=16)
def _patch(theta: float, axial: float) -> Any:
    """Factors of the discrete -Laplacian of a patch, which all injectors of a grid share; the identity on its rim."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import splu

    n = 2 * PATCH + 1
    index = np.arange(n * n).reshape(n, n)
    inner = index[1:-1, 1:-1].ravel()
    rim = np.setdiff1d(index, inner)
    entries = [(inner, inner, 2 * (theta + axial)), (rim, rim, 1.0)]
    entries += [(inner, index[2:, 1:-1].ravel(), -theta), (inner, index[:-2, 1:-1].ravel(), -theta)]
    entries += [(inner, index[1:-1, 2:].ravel(), -axial), (inner, index[1:-1, :-2].ravel(), -axial)]
    rows, columns = (np.concatenate([e[k] for e in entries]) for k in (0, 1))
    values = np.concatenate([np.full(e[0].size, e[2]) for e in entries])
    return splu(coo_matrix((values, (rows, columns))).tocsc())


def _fold(grid: FilmGrid, full: dict[tuple[int, int], float], source: bool) -> list[tuple[int, int, float]]:
    """Weights on the grid's unknown rows; on a half bearing sources keep their own half, readings add both."""
    middle = grid.n_z // 2
    folded: dict[tuple[int, int], float] = {}
    for (i, node), weight in full.items():
        if not grid.half:
            row, share = node - 1, weight
        else:
            row = abs(node - middle)
            share = weight / 2 if source else weight
        if not 0 <= row < grid.n_rows:
            raise FilmError(
                f"injectors: one is {grid.dz * (node - middle):.4g} m from the centre: its orifice leaves the film; "
                "move it inwards or refine the grid",
                argument="injectors",
            )
        folded[i, row] = folded.get((i, row), 0.0) + share
    return [(i, j, v) for (i, j), v in sorted(folded.items())]
