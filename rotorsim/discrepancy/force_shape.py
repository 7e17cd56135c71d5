r"""Shape of a force that no law explains: a Gaussian process over the motion at a place, seen through the receptances.

The force along each axis is an unknown smooth function of displacement and velocity there, speed and shaft angle,

.. math:: f(s) = \sum_j w_j\,\phi_j(s), \quad \phi(s) = k(s, Z)\,L^{-T}, \quad LL' = k(Z, Z), \quad w \sim N(0, 1)

.. math:: k(s, s') = a^2 \exp\Big(-\tfrac12 \sum_d (s_d - s'_d)^2 / l_d^2\Big)

with inducing points Z; the angle of the shaft enters by its cosine and sine. A feature adds
:math:`H_{sp}\,\mathcal F\{\phi_j\}` to the data, as a term of a law does, next to the calibration's columns. The
evidence chooses the place, the size a, the lengths l, and the quantities that matter.

Assumes: the force along an axis depends on the motion along it, and has no memory. Source: Rasmussen & Williams (2006),
sections 5.4.1 and 8.3.

Cites: rasmussen_2006.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import minimize

from rotorsim.base.errors import NoAnswerError
from rotorsim.base.rounding import answer
from rotorsim.discrepancy.comparison import excess, table
from rotorsim.discrepancy.fit import ParameterFit, prior_rows
from rotorsim.discrepancy.law_terms import ObservedPlaces, PlaceMotion, force_curve, law_places, lines_of_series

POINTS = 40
"""Number of inducing points."""
SAMPLED = 100
"""Moments of a record among which inducing points are chosen."""
QUANTITIES = ("displacement", "velocity", "speed", "shaft angle")
"""Quantities on which a force may depend."""
SIZES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""First standard deviations of a force, as multiples of that which moves the probes as much as the residual."""
LENGTH = 3.0
"""First lengths, in standard deviations of a quantity over the records."""
REACH = (0.3, 1e3)
"""Smallest and largest length, in standard deviations of a quantity."""
SIZE_REACH = (1e-3, 1e3)
"""Smallest and largest multiple of the size."""
MOST_TRIES = 80
"""Most evaluations of the evidence at a place."""
CLEARLY = 10.0
"""Logarithm of the evidence over none, or by a quantity, from which on it counts."""
RIDGE = 1e-6
"""Variance that is added to the kernel's own at inducing points, as a share of it."""


@dataclass(frozen=True, eq=False)
class ForceProcess:
    """A Gaussian process at a place: size a [N], lengths (5,) and points (k, 5) of `states`, weights (2 k,).

    evidence : its logarithm over that of none; covariance : that of the weights; left (n,) : whitened residual
    """

    place: str
    size: float
    lengths: np.ndarray
    points: np.ndarray
    evidence: float
    weights: np.ndarray
    covariance: np.ndarray
    left: np.ndarray

    def along(self, m: PlaceMotion) -> tuple[np.ndarray, np.ndarray]:
        """Force on the shaft (2, n) [N] along a motion, and its standard deviation."""
        force, spread = np.zeros(m.displacement.shape), np.zeros(m.displacement.shape)
        for axis in (0, 1):
            own = slice(axis * len(self.points), (axis + 1) * len(self.points))
            phi = features(self.points, self.size, self.lengths, states(m, axis))
            force[axis] = phi @ self.weights[own]
            spread[axis] = np.sqrt(np.einsum("ij,jk,ik->i", phi, self.covariance[own, own], phi))
        return force, spread


@dataclass(frozen=True, eq=False)
class ForceShape:
    """Force at a place whose law is not known: the quantities on which it depends, and its curve.

    position : coordinate along the shaft [m]; evidence : its logarithm over that of no force
    gone : share of the misfit beyond the floor that it takes
    depends : fall of that by each quantity that counts; near : by how much it is less at other places
    curve : moments of the records: displacement and velocity (n, 2) there, force (n, 2) measured and of the process,
        and the standard deviation of the latter
    """

    place: str
    position: float
    evidence: float
    gone: float
    depends: dict[str, float]
    near: dict[str, float]
    curve: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def places(self) -> tuple[str, ...]:
        """The place, and those that are as likely."""
        return self.place, *(place for place, less in self.near.items() if less < CLEARLY)

    @property
    def sentence(self) -> str:
        """The place, and what the force there depends on."""
        of = " and ".join(self.depends) or "no single one of displacement, velocity, speed and shaft angle"
        return (
            f"Where its shape is free, a force at {' or '.join(self.places)} that depends on {of} explains the records "
            f"best: it takes {100 * self.gone:.0f} % of the misfit."
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and text, for JSON."""
        return {
            "place": self.place, "position": self.position, "log_evidence": self.evidence, "gone": self.gone,
            "depends": dict(self.depends), "less_at": dict(self.near), "sentence": self.sentence,
        }  # fmt: skip


def shape_of(seen: ObservedPlaces, base: ParameterFit) -> ForceShape | None:
    """The force of free shape that explains the records best; None where no place has clear evidence of one."""
    found = dict[str, ForceProcess]()
    for place in seen.motions:
        with suppress(NoAnswerError):
            found[place] = _best(seen, base, place)
    if not found:
        return None
    best = max(found.values(), key=lambda one: one.evidence)
    if best.evidence < CLEARLY:
        return None
    without = {name: best.evidence - _without(seen, base, best, k) for k, name in enumerate(QUANTITIES)}
    shape = ForceShape(
        best.place,
        law_places(seen.comparison.twin.machine)[best.place],
        best.evidence,
        1 - excess(table(seen.comparison, best.left)) / max(excess(table(seen.comparison, seen.residual)), 1e-300),
        {name: fall for name, fall in without.items() if fall > CLEARLY},
        {place: best.evidence - one.evidence for place, one in found.items() if place != best.place},
    )
    return replace(shape, curve=force_curve(seen, best.place, best.left * seen.comparison.sigma, best.along))


def _best(seen: ObservedPlaces, base: ParameterFit, place: str) -> ForceProcess:
    """The process of most evidence at a place, by the size first, and then by size and lengths."""
    every = np.concatenate([states(m, axis) for m in seen.motions[place] for axis in (0, 1)])
    scale = np.maximum(every.std(axis=0), 1e-12)
    points = _spread_out(np.concatenate([states(m, axis)[:: max(m.displacement.shape[1] // SAMPLED, 1)]
                                         for m in seen.motions[place] for axis in (0, 1)]), scale)  # fmt: skip

    def lengths(x: np.ndarray) -> np.ndarray:
        return np.exp(x[[1, 2, 3, 4, 4]]) * scale  # cosine and sine of the angle have one length

    moved = np.linalg.norm(responses(seen, place, 1.0, LENGTH * scale, points))
    if not moved:
        raise NoAnswerError(f"no probe sees a force at {place}")
    unit = float(np.linalg.norm(seen.residual) / moved)

    def at(x: np.ndarray) -> ForceProcess:
        return process_at(seen, base, place, unit * float(np.exp(x[0])), lengths(x), points)

    starts = [np.log([size, *4 * [LENGTH]]) for size in SIZES]
    first = max(starts, key=lambda x: at(x).evidence)
    bounds = [tuple(np.log(SIZE_REACH)), *4 * [tuple(np.log(REACH))]]
    simplex = np.vstack([first, *(first + unit for unit in np.eye(5))])
    options = {"maxfev": MOST_TRIES, "fatol": 0.3, "xatol": 0.05, "initial_simplex": simplex}
    return at(minimize(lambda x: -at(x).evidence, first, method="Nelder-Mead", bounds=bounds, options=options).x)


def _without(seen: ObservedPlaces, base: ParameterFit, best: ForceProcess, quantity: int) -> float:
    """Logarithm of the evidence where the force does not depend on a quantity, with size and other lengths as found."""
    lengths = best.lengths.copy()
    lengths[quantity : quantity + 1 + (quantity == len(QUANTITIES) - 1)] = np.inf
    return process_at(seen, base, best.place, best.size, lengths, best.points).evidence


def states(m: PlaceMotion, axis: int) -> np.ndarray:
    """Displacement [m], velocity [m/s], speed [rad/s], cosine and sine of the shaft angle (n, 5) along an axis."""
    u = m.displacement[axis]
    return np.column_stack([u, m.velocity[axis], np.full(len(u), m.speed), np.cos(m.angle), np.sin(m.angle)])


def features(points: np.ndarray, size: float, lengths: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Features (n, k) [N] of states (n, 5) whose weights are independent with a standard deviation of one."""

    def kernel(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        a, b = a / lengths, b / lengths
        square = np.sum(a**2, axis=1)[:, None] + np.sum(b**2, axis=1) - 2 * a @ b.T
        return np.asarray(np.exp(-0.5 * np.maximum(square, 0.0)))

    L = answer(np.linalg.cholesky, kernel(points, points) + RIDGE * np.eye(len(points)))
    return np.asarray(size * solve_triangular(L, kernel(points, at), lower=True).T)


def _spread_out(every: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """States (k, 5) among (n, 5) that are far from each other, the first one nearest to the mean."""
    own = every / scale
    found = [int(np.argmin(np.sum((own - own.mean(axis=0)) ** 2, axis=1)))]
    distance = np.full(len(own), np.inf)
    while len(found) < min(POINTS, len(own)):
        distance = np.minimum(distance, np.sum((own - own[found[-1]]) ** 2, axis=1))
        found.append(int(np.argmax(distance)))
    return every[found]


def process_at(
    seen: ObservedPlaces, base: ParameterFit, place: str, size: float, lengths: np.ndarray, points: np.ndarray
) -> ForceProcess:  # fmt: skip
    """Gaussian process at a place with given size [N], lengths (5,) and points (k, 5), next to the calibration."""
    S, p = responses(seen, place, size, lengths, points), prior_rows(base.parameters)
    A, k = np.column_stack([seen.J, S]), len(p)
    H = A.T @ A + np.diag([*p**2, *np.ones(S.shape[1])])
    g = A.T @ seen.residual - np.concatenate([p**2 * base.vector, np.zeros(S.shape[1])])
    _, _, before = _posterior(H[:k, :k], g[:k])
    x, V, after = _posterior(H, g)
    return ForceProcess(place, size, lengths, points, after - before, x[k:], V[k:, k:], seen.residual - A @ x)


def _posterior(H: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Mean H^-1 g (k,) and covariance H^-1 of weights, and the logarithm of their evidence without the prior's own."""
    scale = np.sqrt(np.maximum(np.diag(H), 1e-300))
    L = answer(np.linalg.cholesky, H / scale[:, None] / scale + 1e-12 * np.eye(len(H)))
    half = solve_triangular(L, np.diag(1 / scale), lower=True)
    return half.T @ (half @ g), half.T @ half, float(np.sum((half @ g) ** 2) / 2 - np.log(np.diag(L) * scale).sum())


def responses(seen: ObservedPlaces, place: str, size: float, lengths: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whitened responses (n, 2 k) to the features of the force along x, then along y."""

    def moved(m: PlaceMotion, axis: int) -> np.ndarray:
        lines = lines_of_series(features(points, size, lengths, states(m, axis)).T, len(m.H))
        return np.einsum("lc,kl->kcl", m.H[:, :, axis], lines)

    return seen.joined(place, lambda m: [*moved(m, 0), *moved(m, 1)])
