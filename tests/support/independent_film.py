"""Gas film by biquadratic finite elements whose lines stand on all edges; shares no code with `reynolds`.

Galerkin's method for the pressure p with Newton's method, and its linearisation at a frequency; narrow grooves by the
fluxes of Vohr & Chow (1965), slip by Burgdorfer (1959), friction from the two gradients of a groove and its ridge.
"""

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

GAUSS = np.array([-np.sqrt(0.6), 0.0, np.sqrt(0.6)]), np.array([5.0, 8.0, 5.0]) / 18
TINY = 1e-30


def lines(low, high, count, edges, periodic=False):
    """Element ends between low and high: about `count` equal ones, and all edges."""
    edges = np.unique(np.round([low + (e - low) % (high - low) if periodic else e for e in edges], 12))
    edges = edges[(edges > low + 1e-9 * (high - low)) & (edges < high - 1e-9 * (high - low))]
    marks = np.concatenate([[low], edges, [high]])
    pieces = [
        np.linspace(a, b, max(1, int(np.ceil((b - a) * count / (high - low) - 1e-9))) + 1)[:-1]
        for a, b in pairwise(marks)
    ]
    return np.concatenate([*pieces, [high]])


def quadratic(x):
    """Three shape functions and their derivatives at x in -1..1."""
    return (np.array([0.5 * x * (x - 1), 1 - x * x, 0.5 * x * (x + 1)]), np.array([x - 0.5, -2 * x, x + 0.5]))


@dataclass
class Film:
    """A film of any form; pockets are tuples (count, depth, arc, length, first angle), grooves a dictionary."""

    radius: float
    length: float
    clearance: float
    lobes: tuple | None = None  # count, preload, offset, first angle
    pockets: tuple = ()
    grooves: dict | None = None
    foil: tuple | None = None  # stiffness, relaxation time
    mean_free_path: float = 0.0
    mu: float = 1.85e-5
    pa: float = 101325.0
    n_theta: int = 32
    n_z: int = 12
    half: bool = True
    extra: object = None  # further gap (theta, z) -> m
    solved: dict = field(default_factory=dict)

    @cached_property
    def mesh(self):
        """Coordinates, shape functions, weights at the points and node numbers of all elements."""
        turns = []
        for count, _, arc, _, first in self.pockets:
            middles = first + 2 * np.pi / count * np.arange(count)
            turns += [*(middles - arc / 2), *(middles + arc / 2)]
        if self.lobes is not None:
            count, _, offset, first = self.lobes
            turns += list(first + 2 * np.pi / count * (np.arange(count) - offset))
        ends = [length / 2 for *_, length, _ in self.pockets if length is not None]
        if self.grooves is not None:
            ends.append(self.grooves.get("land", 0.0) / 2)
        low = 0.0 if self.half else -self.length / 2
        t = lines(0.0, 2 * np.pi, self.n_theta, turns, periodic=True)
        z = lines(low, self.length / 2, self.n_z, [*ends, *(-e for e in ends)])
        nt, nz = t.size - 1, z.size - 1
        rows = 2 * nz + 1
        i, j = np.meshgrid(np.arange(nt), np.arange(nz), indexing="ij")
        a, b = np.meshgrid(np.arange(3), np.arange(3), indexing="ij")
        number = ((2 * i[..., None, None] + a) % (2 * nt)) * rows + 2 * j[..., None, None] + b
        number = number.reshape(nt * nz, 9)
        g, weight = GAUSS
        N, dN = quadratic(g)  # (3 functions, 3 points)
        shape = np.einsum("ap,bq->pqab", N, N).reshape(9, 9)
        by_t = np.einsum("ap,bq->pqab", dN, N).reshape(9, 9)
        by_z = np.einsum("ap,bq->pqab", N, dN).reshape(9, 9)
        wide, high = np.diff(t)[i].ravel(), np.diff(z)[j].ravel()
        u, v = (x.ravel() for x in np.meshgrid(g, g, indexing="ij"))
        theta = (t[i].ravel() + wide / 2)[:, None] + wide[:, None] / 2 * u
        axial = (z[j].ravel() + high / 2)[:, None] + high[:, None] / 2 * v
        middle = (t[i].ravel() + wide / 2)[:, None], (z[j].ravel() + high / 2)[:, None]
        area = np.outer(self.radius * wide * high, np.outer(weight, weight).ravel())
        dy = by_t[None] * (2 / (self.radius * wide))[:, None, None]
        dz = by_z[None] * (2 / high)[:, None, None]
        on_edge = np.arange(2 * nt)[:, None] * rows + np.array([rows - 1] if self.half else [0, rows - 1])
        free = np.setdiff1d(np.arange(2 * nt * rows), on_edge)
        return theta, axial, middle, shape, dy, dz, area, number, free, 2 * nt * rows

    @cached_property
    def texture(self):
        """Depth, share, angle and sense at the elements (n, 1)."""
        _, _, (t, z), *_ = self.mesh
        depth, share, angle, sense = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t), np.ones_like(t)
        if self.grooves is not None:
            g = self.grooves
            spiral = g.get("pattern") == "spiral"
            there = np.ones_like(z, bool) if spiral else np.abs(z) > g.get("land", 0.0) / 2
            turn = -1.0 if g.get("on") == "journal" else 1.0
            depth[there], share[there], sense[there] = g["depth"], g["share"], turn
            slant = np.ones_like(z) if spiral else -np.sign(z)
            angle[there] = (turn * slant * g["angle"])[there]
        for count, deep, arc, length, first in self.pockets:
            pitch = 2 * np.pi / count
            phase = (t - first + pitch / 2) % pitch - pitch / 2
            inside = (np.abs(phase) < arc / 2) & (np.abs(z) < (length or self.length) / 2)
            depth[inside], share[inside], angle[inside], sense[inside] = deep, 1.0, 0.0, 1.0
        return depth, share, angle, sense

    def rigid(self, journal, points=None):
        """Gap at the points (theta, z) of all elements without a foil; Gauss's points if none are given."""
        theta, z, (middle, _), *_ = self.mesh
        theta, z = (theta, z) if points is None else points
        h = self.clearance - journal[0] * np.cos(theta) - journal[1] * np.sin(theta)
        if self.lobes is not None:
            count, preload, offset, first = self.lobes
            arc = 2 * np.pi / count
            number = np.floor((middle - first) / arc + offset)
            about = theta - first - arc * number
            h = h + self.clearance / (1 - preload) * (1 - preload * np.cos(about)) - self.clearance
        return h if self.extra is None else h + self.extra(theta, z)

    def flux(self, U, h, p, py, pz):
        """Mass fluxes (times R_g T) along y and z; analytic in h and p."""
        depth, share, beta, sense = self.texture
        s, c = np.sin(beta), np.cos(beta)
        slip = 6 * self.mean_free_path * self.pa / p
        G = lambda x: x**3 + slip * x**2  # noqa: E731
        g = h + depth
        along = share * G(g) + (1 - share) * G(h)
        across = 1 / (share / G(g) + (1 - share) / G(h))
        S = share * g + (1 - share) * h
        T = across * (share * g / G(g) + (1 - share) * h / G(h))
        ps, pn = c * py + s * pz, c * pz - s * py
        Ug = sense * U
        qs = Ug / 2 * p * S * c - along * p * ps / (12 * self.mu)
        qn = -Ug / 2 * p * T * s - across * p * pn / (12 * self.mu)
        return c * qs - s * qn + (U - Ug) / 2 * p * S, s * qs + c * qn

    def stored(self, h):
        depth, share, *_ = self.texture
        return h + depth * share

    def gap(self, journal, p):
        return self.rigid(journal) + (0 if self.foil is None else (p - self.pa) / self.foil[0])

    def fields(self, nodal):
        """Values and gradients at the points of a nodal field."""
        _, _, _, shape, dy, dz, _, number, *_ = self.mesh
        local = nodal[number]
        return local @ shape.T, np.einsum("epa,ea->ep", dy, local), np.einsum("epa,ea->ep", dz, local)

    def tangent(self, journal, U, nodal):
        """Fluxes at the points and their derivatives after p (at the foil's rest), its gradient, and h."""
        p, py, pz = self.fields(nodal)
        h = self.gap(journal, p)
        at = lambda *x: self.flux(U, *x)  # noqa: E731
        q = at(h, p, py, pz)
        by_p, by_h, by_y, by_z = (
            [f.imag / e for f in at(h + 1j * eh, p + 1j * ep, py + 1j * ey, pz + 1j * ez)]
            for e, eh, ep, ey, ez in (
                (TINY, 0, TINY, 0, 0), (TINY, TINY, 0, 0, 0), (TINY, 0, 0, TINY, 0), (TINY, 0, 0, 0, TINY)
            )
        )  # fmt: skip
        return p, h, q, by_p, by_h, by_y, by_z

    def matrix(self, by_p, by_y, by_z, storage):
        """Sparse derivative of the weak form."""
        _, _, _, shape, dy, dz, area, number, free, size = self.mesh
        flux_y = by_p[0][..., None] * shape + by_y[0][..., None] * dy + by_z[0][..., None] * dz
        flux_z = by_p[1][..., None] * shape + by_y[1][..., None] * dy + by_z[1][..., None] * dz
        local = -np.einsum("ep,epa,epb->eab", area, dy, flux_y) - np.einsum("ep,epa,epb->eab", area, dz, flux_z)
        local = local + np.einsum("ep,pa,pb->eab", area * storage, shape, shape)
        rows = np.repeat(number, 9, axis=1).ravel()
        cols = np.tile(number, (1, 9)).ravel()
        return coo_matrix((local.ravel(), (rows, cols)), (size, size)).tocsc()[free][:, free]

    def vector(self, q, storage=0.0):
        """The weak form itself at the free nodes."""
        _, _, _, shape, dy, dz, area, number, free, size = self.mesh
        local = -np.einsum("ep,epa->ea", area * q[0], dy) - np.einsum("ep,epa->ea", area * q[1], dz)
        local = local + (area * storage) @ shape
        out = np.zeros(size, local.dtype)
        np.add.at(out, number, local)
        return out[free]

    def pressure(self, journal, speed):
        """Nodal pressure [Pa]."""
        key = (*journal, speed)
        if key not in self.solved:
            _, _, _, _, _, _, _, _, free, size = self.mesh
            nodal = np.full(size, self.pa)
            for share in (0.1, 0.3, 0.6, 1.0):
                U = share * speed * self.radius
                for _ in range(40):
                    _, _, q, by_p, by_h, by_y, by_z = self.tangent(journal, U, nodal)
                    if self.foil is not None:
                        by_p = [a + b / self.foil[0] for a, b in zip(by_p, by_h, strict=True)]
                    step = -splu(self.matrix(by_p, by_y, by_z, np.zeros_like(q[0]))).solve(self.vector(q))
                    nodal[free] += step * min(1.0, 0.5 * self.pa / max(np.abs(step).max(), 1e-9))
                    if np.abs(step).max() < 1e-9 * self.pa:
                        break
                else:
                    raise RuntimeError("independent film: no convergence")
            self.solved[key] = nodal
        return self.solved[key]

    @property
    def sum(self):
        return 2.0 if self.half else 1.0

    def force(self, journal, speed):
        """Force (2,) [N] on the journal."""
        theta, _, _, _, _, _, area, *_ = self.mesh
        p, _, _ = self.fields(self.pressure(journal, speed))
        return -self.sum * np.array([(area * (p - self.pa) * f(theta)).sum() for f in (np.cos, np.sin)])

    def dynamic_stiffness(self, journal, speed, omega):
        """K + i omega C (2, 2) [N/m]."""
        theta, _, _, _, _, _, area, _, free, size = self.mesh
        p, h, _, by_p, by_h, by_y, by_z = self.tangent(journal, speed * self.radius, self.pressure(journal, speed))
        soft = 0.0 if self.foil is None else 1 / (self.foil[0] * (1 + 1j * omega * self.foil[1]))
        by_q = [a + b * soft for a, b in zip(by_p, by_h, strict=True)]
        solver = splu(self.matrix(by_q, by_y, by_z, 1j * omega * (self.stored(h) + p * soft)).astype(complex))
        Z = np.zeros((2, 2), complex)
        for axis, f in enumerate((np.cos, np.sin)):
            dh = -f(theta)
            rhs = self.vector([b * dh for b in by_h], 1j * omega * p * dh)
            change = np.zeros(size, complex)
            change[free] = solver.solve(-rhs.astype(complex))
            dp, _, _ = self.fields(change)
            Z[:, axis] = self.sum * np.array([(area * dp * g(theta)).sum() for g in (np.cos, np.sin)])
        return Z

    def friction(self, journal, speed):
        """Torque [N m] that brakes the journal."""
        *_, area, _, _, _ = self.mesh
        p, py, pz = self.fields(self.pressure(journal, speed))
        h, U = self.gap(journal, p), speed * self.radius
        depth, share, beta, sense = self.texture
        s, c = np.sin(beta), np.cos(beta)
        path = self.mean_free_path * self.pa / p
        ps, pn = c * py + s * pz, c * pz - s * py
        # across the grooves: the volume flow a h - b h^3 G is the same in groove and ridge, and the mean of G is pn
        gaps = [h + depth, h]
        passing = [x**2 * (x + 6 * path) / (12 * self.mu) for x in gaps]
        moved = [-sense * U * s / 2 * x for x in gaps]
        weights = [share, 1 - share]
        flow = (sum(w * m / k for w, m, k in zip(weights, moved, passing, strict=True)) - pn) / sum(
            w / k for w, k in zip(weights, passing, strict=True)
        )
        stress = 0.0
        mean = c * ps - s * pn
        for w, x, m, k in zip(weights, gaps, moved, passing, strict=True):
            gradient = c * ps - s * (m - flow) / k
            shear = self.mu * U / (x + 2 * path)
            on_journal = shear + x / 2 * gradient
            on_sleeve = shear - x / 2 * gradient  # and h dp/dy of the mean goes to the journal
            stress = stress + w * np.where(sense > 0, on_journal, on_sleeve + h * mean)
        return self.sum * self.radius * (area * stress).sum()

    def smallest_gap(self, journal, speed):
        """Smallest thickness [m] over ridges, lands and pockets, at fine points of every element, its ends included."""
        theta, axial, (t, z), *_, number, _, _ = self.mesh
        u, v = (x.ravel() for x in np.meshgrid(np.linspace(-1, 1, 65), np.linspace(-1, 1, 9), indexing="ij"))
        wide, high = (np.ptp(x, axis=1, keepdims=True) / np.sqrt(0.6) / 2 for x in (theta, axial))
        gap = self.rigid(journal, (t + wide * u, z + high * v))
        if self.foil is not None:
            shape = np.einsum("ap,bp->pab", quadratic(u)[0], quadratic(v)[0]).reshape(u.size, 9)
            gap = gap + (self.pressure(journal, speed)[number] @ shape.T - self.pa) / self.foil[0]
        depth, share, *_ = self.texture
        return (gap + np.where(share == 1, depth, 0.0)).min()
