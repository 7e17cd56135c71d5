r"""Eigenvalues of a pencil in a region of the complex plane, all of them: their number is proven.

The pencil :math:`J x = \lambda S x` is real, the region the sector :math:`r < |\lambda| < R,\ \zeta < \zeta_{max}` and
its mirror image below the real axis. With the known eigenvalues divided out of the determinant,

.. math:: N = \frac{1}{2\pi i} \oint \frac{g'}{g}\,ds, \qquad g(s) = \frac{\det(J - s S)}{\prod_k (s - \lambda_k)}

counts those in the region that are not known: 0 proves that none is missing. The known ones span one invariant
subspace, refined by inverse iteration from both sides with a Rayleigh-Ritz step: a double eigenvalue has two vectors,
and a single one that was met twice has one.

Source: Saad (2011), chapters 4 and 7; Delves and Lyness (1967), the argument principle.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

Vector = NDArray[np.complex128]

OSCILLATES = 1e-6
"""Imaginary part over modulus above which an eigenvalue oscillates."""
SETTLED = 1e-11
"""Relative change of an eigenvalue after which its refinement ends."""
NEAR = 1e-3
"""Relative distance of eigenvalues within which two vectors may be one mode that was met twice."""
ALIKE = 1e-3
"""Part of a vector outside the span of the vectors nearby below which it adds no mode."""
LOOSE = 1e10
"""Condition of left against right vectors above which they span no common subspace."""
SMALL = 130
"""Size up to which all eigenvalues are computed at once."""
DEPTH, WIDTH = 14, 2
"""Steps of a block Krylov space and vectors of its block."""


class Factor(Protocol):
    """Factors of J - s S."""

    def solve(self, b: Vector) -> Vector:
        """(J - s S)^-1 b for b (n,)."""

    def adjoint(self, b: Vector) -> Vector:
        """(J - s S)^-H b for b (n,)."""


class Pencil(Protocol):
    """Real pencil J - s S."""

    @property
    def size(self) -> int:
        """Number of states n."""

    def times_J(self, x: Vector) -> Vector:
        """J x for x (n, k)."""

    def times_S(self, x: Vector, transposed: bool = False) -> Vector:
        """S x or S' x for x (n, k)."""

    def factor(self, s: complex) -> Factor:
        """Factors at s [rad/s]."""

    def log_det(self, s: complex) -> complex:
        """Logarithm of det(J - s S) up to a constant, the imaginary part modulo 2 pi."""


@dataclass(frozen=True)
class Region:
    """Sector floor < |s| < reach [rad/s] of damping ratios below `zeta`, growing modes included."""

    reach: float
    floor: float
    zeta: float = 0.5

    def holds(self, s: Any) -> Any:
        """Whether eigenvalues [rad/s] oscillate in the region."""
        size = np.abs(s)
        inside = (size > self.floor) & (size < self.reach) & (-np.real(s) < self.zeta * size)
        return inside & (np.imag(s) > OSCILLATES * size)

    @property
    def wider(self) -> Region:
        """The region with a rim, in which modes are followed beyond the border."""
        return Region(1.3 * self.reach, 0.5 * self.floor, min(self.zeta + 0.15, 0.5 * (1 + self.zeta)))

    def border(self, s: complex) -> str:
        """The border beyond which an eigenvalue [rad/s] lies; empty inside."""
        if abs(s) >= self.reach:
            return "reach"
        if abs(s) <= self.floor:
            return "floor"
        if -s.real >= self.zeta * abs(s):
            return "damping"
        return "" if self.holds(s) else "no oscillation"


@dataclass(frozen=True, eq=False)
class Modes:
    """Eigenvalues (k,) [rad/s] with vectors (n, k), left^H S right = I, ascending in modulus.

    `missing` is the number of eigenvalues of the region that are not among them, NaN where it could not be counted.
    """

    values: Vector
    right: Vector
    left: Vector
    missing: float = float("nan")

    @property
    def proven(self) -> bool:
        """Whether it is proven that none is missing."""
        return self.missing == 0

    def take(self, which: Any) -> Modes:
        """Those of the indices or flags `which`."""
        return replace(self, values=self.values[which], right=self.right[:, which], left=self.left[:, which])


def nothing(size: int) -> Modes:
    """No modes of a pencil of a size."""
    return Modes(np.zeros(0, complex), np.zeros((size, 0), complex), np.zeros((size, 0), complex))


def modes_in(pencil: Pencil, region: Region, hints: Sequence[float] = (), seed: Modes | None = None) -> Modes:
    """All modes of a pencil in the region, their number proven.

    Parameters
    ----------
    pencil : Pencil
    region : Region
    hints : sequence of float
        Frequencies [rad/s] around which modes are expected.
    seed : Modes, optional
        Those of a neighbouring pencil, from which these are refined before others are looked for.

    Returns
    -------
    Modes
        Those of the region and some around it that were met; `missing` is 0 where the count proves it complete.
    """
    if pencil.size <= SMALL:
        known = everything(pencil)
    else:
        known = nothing(pencil.size) if seed is None else refined(pencil, seed)
    known = replace(known, missing=missing_in(pencil, region, known.values))
    rounds = [] if pencil.size <= SMALL else _shifts(region, hints)
    while not known.proven and rounds:
        for shift in rounds.pop(0):
            known = joined(pencil, known, settled(pencil, unknown(known, around(pencil, shift), region)))
        known = replace(known, missing=missing_in(pencil, region, known.values))
    return known.take(np.argsort(np.abs(known.values), kind="stable"))


def _shifts(region: Region, hints: Sequence[float]) -> list[list[complex]]:
    """Rounds of shifts [rad/s]: around the hints and evenly over the reach, then between, then towards the edge."""
    near = [h for h in hints if region.floor < h < region.reach]
    even = [region.reach * (k + 0.5) / 3 for k in range(3)]
    first = [f for f in even if all(abs(f - h) > 0.1 * region.reach for h in near)]
    rounds = [[1j * f for f in [*near, *first]]]
    for count in (6, 12):
        step = region.reach / count
        rounds.append([step * (k + 0.5) * np.exp(1j * np.deg2rad(a)) for k in range(count) for a in (80, 112)])
    ladder = np.geomspace(region.floor, region.reach, 12)
    return [*rounds, [r * np.exp(1j * np.deg2rad(a)) for r in ladder for a in (60, 100, 119)]]


def everything(pencil: Pencil) -> Modes:
    """All modes of a small pencil that are not below the real axis."""
    eye = np.eye(pencil.size, dtype=complex)
    S, J = pencil.times_S(eye).real, pencil.times_J(eye).real
    values, left, right = eig(np.linalg.solve(S, J), left=True)
    keep = values.imag >= 0
    return joined(
        pencil, nothing(pencil.size), Modes(values[keep], right[:, keep], np.linalg.solve(S.T, left[:, keep]))
    )


def around(pencil: Pencil, shift: complex) -> Modes:
    """Modes nearest to a shift [rad/s] in a block Krylov space of (J - shift S)^-1 S, with random left vectors."""
    factor, rng = pencil.factor(shift), np.random.default_rng(0)

    def inverse(block: Any) -> Any:
        return np.column_stack([factor.solve(b) for b in pencil.times_S(block).T])

    basis = np.linalg.qr(inverse(rng.standard_normal((pencil.size, WIDTH)) + 0j))[0]
    k = DEPTH * WIDTH
    H = np.zeros((k + WIDTH, k), complex)
    for j in range(0, k, WIDTH):
        new = inverse(basis[:, j:])
        for _ in range(2):  # twice is enough
            part = basis.conj().T @ new
            new = new - basis @ part
            H[: len(part), j : j + WIDTH] += part
        q, H[j + WIDTH : j + 2 * WIDTH, j : j + WIDTH] = np.linalg.qr(new)
        basis = np.hstack([basis, q])
    theta, y = np.linalg.eig(H[:k])
    values, open_ends = shift + 1 / theta, np.linalg.norm(H[k:] @ y, axis=0) / np.abs(theta)
    good = (open_ends < 1e-5) & (values.imag > -1e-9 * np.abs(values))
    right = basis[:, :k] @ y[:, good]
    left = rng.standard_normal(right.shape) + 1j * rng.standard_normal(right.shape)
    return Modes(values[good], right, left)


def unknown(known: Modes, new: Modes, region: Region) -> Modes:
    """The new modes in the region or near it that are not among the known ones."""
    grows = (np.abs(new.values.imag) <= OSCILLATES * np.abs(new.values)) & (new.values.real > 0)
    inside = np.flatnonzero(region.wider.holds(new.values) | grows)
    vectors = list(known.right.T)
    return new.take([k for k in inside if not _met(known.values, vectors, complex(new.values[k]), new.right[:, k])])


def _met(values: Any, vectors: Sequence[Vector], value: complex, vector: Vector) -> bool:
    """Whether a vector lies in the span of those with nearly the same eigenvalue."""
    near = [k for k, other in enumerate(values) if abs(value - other) < NEAR * abs(value)]
    if not near:
        return False
    span = np.column_stack([vectors[k] / np.linalg.norm(vectors[k]) for k in near])
    rest = vector - span @ np.linalg.lstsq(span, vector, rcond=None)[0]
    return bool(np.linalg.norm(rest) < ALIKE * np.linalg.norm(vector))


def predicted(pencil: Pencil, modes: Modes) -> Modes:
    """Two-sided Ritz values and vectors of a pencil in the subspaces of a neighbour's modes."""
    if not len(modes.values):
        return modes
    J, S = modes.left.conj().T @ pencil.times_J(modes.right), modes.left.conj().T @ pencil.times_S(modes.right)
    values, turn = np.linalg.eig(np.linalg.solve(S, J))
    return Modes(values, modes.right @ turn, modes.left @ np.linalg.inv(S @ turn).conj().T)


def refined(pencil: Pencil, seed: Modes) -> Modes:
    """Modes of a pencil that grow out of those of a neighbour."""
    return settled(pencil, predicted(pencil, seed))


def settled(pencil: Pencil, guess: Modes) -> Modes:
    """Eigenpairs by inverse iteration from guesses, near ones together; what does not settle is left out."""
    known, left_over = nothing(pencil.size), list(range(len(guess.values)))
    while left_over:
        first = guess.values[left_over[0]]
        group = [k for k in left_over if abs(guess.values[k] - first) < NEAR * abs(first)]
        left_over = [k for k in left_over if k not in group]
        found = iterated(pencil, guess.take(group))
        alone = [group] if found is not None or len(group) == 1 else [[k] for k in group]
        for one in alone if found is None else []:
            single = iterated(pencil, guess.take(one))
            known = known if single is None else joined(pencil, known, single)
        known = known if found is None else joined(pencil, known, found)
    return known


def iterated(pencil: Pencil, guess: Modes) -> Modes | None:
    """Eigenpairs of an invariant subspace by inverse iteration with a Ritz step from both sides; None if it stays open.

    The shift is moved onto the mean of the eigenvalues where that is slow.
    """
    values = guess.values
    right, left = np.linalg.qr(guess.right)[0], np.linalg.qr(guess.left)[0]
    for _ in range(6):
        shift = complex(values.mean()) * (1 + 1e-9)
        factor, before = pencil.factor(shift), values
        for turn in range(6):
            pushed = pencil.times_S(right)
            new = np.column_stack([factor.solve(b) for b in pushed.T])
            left = np.column_stack([factor.adjoint(b) for b in pencil.times_S(left, True).T])
            left = np.linalg.qr(left)[0]
            apart = np.linalg.norm(new - right @ (right.conj().T @ new)) / np.linalg.norm(new)
            inner = left.conj().T @ pushed
            if not np.isfinite(apart) or np.linalg.cond(inner) > LOOSE:
                return None
            theta, mix = np.linalg.eig(np.linalg.solve(inner, left.conj().T @ pencil.times_S(new)))
            order = np.argsort(-np.abs(theta), kind="stable")
            values, vectors = shift + 1 / theta[order], new @ mix[:, order]
            right = np.linalg.qr(vectors)[0]
            change = np.abs(np.sort_complex(values) - np.sort_complex(before)).max()
            if turn and change < SETTLED * np.abs(values).min() and apart < 1e-6:
                return _paired(pencil, values, vectors / np.linalg.norm(vectors, axis=0), left)
            if turn and apart > 0.03:
                break
            before = values
    return None


def _paired(pencil: Pencil, values: Vector, right: Vector, left: Vector) -> Modes | None:
    """The modes with left vectors out of a left subspace that make left^H S right = I."""
    overlap = left.conj().T @ pencil.times_S(right)
    if np.linalg.cond(overlap) > LOOSE:
        return None
    return Modes(values, right, left @ np.linalg.inv(overlap).conj().T)


def joined(pencil: Pencil, known: Modes, new: Modes) -> Modes:
    """Known modes, then new ones that are not among them; left and right vectors of near eigenvalues are paired."""
    values, right, left = list(known.values), list(known.right.T), list(known.left.T)
    for value, x, y in zip(new.values, new.right.T, new.left.T, strict=True):
        if _met(values, right, value, x):
            continue
        values.append(value)
        right.append(x)
        left.append(y)
    if not values:
        return known
    V, Y, s = np.column_stack(right), np.column_stack(left), np.array(values)
    overlap = Y.conj().T @ pencil.times_S(V)
    close = np.abs(s[:, None] - s) < NEAR * np.abs(s[:, None])
    return Modes(s, V, Y @ np.linalg.pinv(np.where(close, overlap, 0.0)).conj().T)


def missing_in(pencil: Pencil, region: Region, known: Vector) -> float:
    """Number of eigenvalues of the region that are not among the known ones (k,), NaN where it stays open.

    Half of the border, from the real axis to the real axis: the other half is its mirror image. A region of every
    damping ratio is the whole disc.
    """
    end = np.pi - np.arccos(region.zeta)
    tilt, depth = np.exp(1j * end), np.log(region.reach / region.floor)
    many = 1 + int(np.ceil(depth / 2))
    pieces = [
        (lambda t: region.reach * np.exp(1j * end * t), 1j * end, 2),
        (lambda t: region.reach * np.exp(-depth * t) * tilt, -depth, many),
        (lambda t: region.floor * np.exp(1j * end * (1 - t)), -1j * end, 1),
    ]
    if region.zeta >= 1:
        pieces = pieces[:1]
    g = _Quotient(pencil, known)

    def side(path: Callable[[float], complex], rate: complex, count: int) -> float:
        return _turned(lambda t: g.at(path(t), rate), count)

    turns = sum(side(*piece) for piece in pieces) / np.pi
    return float(round(turns)) if abs(turns - round(turns)) < 0.05 else float("nan")


@dataclass(frozen=True, eq=False)
class _Quotient:
    """The determinant over its known roots."""

    pencil: Pencil
    known: Vector

    def log(self, s: complex) -> complex:
        pairs = self.known[self.known.imag > OSCILLATES * np.abs(self.known)]
        real = self.known[self.known.imag <= OSCILLATES * np.abs(self.known)].real
        roots = np.log(s - pairs).sum() + np.log(s - pairs.conj()).sum() + np.log(s - real + 0j).sum()
        return complex(self.pencil.log_det(s) - roots)

    def at(self, s: complex, rate: complex) -> tuple[float, float]:
        """Phase at s and its derivative along a path with ds/dt = rate s."""
        here, there = self.log(s), self.log(s * (1 + SMALL_STEP))
        change = there - here
        slope = complex(change.real, _wrapped(change.imag)) / SMALL_STEP
        return here.imag, (slope * rate).imag


SMALL_STEP = 1e-6
"""Relative step of the derivative of the determinant."""
SPLITS = 400
"""Points after which the count along one side of the region is given up."""


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def _turned(phase: Callable[[float], tuple[float, float]], count: int) -> float:
    """Change of a phase over 0 <= t <= 1, intervals halved until values and derivatives agree, else NaN."""
    known: dict[float, tuple[float, float]] = {}

    def at(t: float) -> tuple[float, float]:
        if t not in known:
            known[t] = phase(t)
        return known[t]

    total, open_ones = 0.0, [(k / count, (k + 1) / count) for k in range(count)]
    while open_ones:
        a, b = open_ones.pop()
        m = 0.5 * (a + b)
        (pa, da), (pm, dm), (pb, db) = at(a), at(m), at(b)
        h = b - a
        first, second = h * (5 * da + 8 * dm - db) / 24, h * (-da + 8 * dm + 5 * db) / 24
        coarse = h * (da + dm) / 4, h * (dm + db) / 4
        off = _wrapped(pm - pa - first), _wrapped(pb - pm - second)
        if max(map(abs, off)) < 0.3 and abs(first - coarse[0]) < 1 and abs(second - coarse[1]) < 1:
            total += first + off[0] + second + off[1]
        elif len(known) > SPLITS or not np.isfinite(pm):
            return float("nan")
        else:
            open_ones += [(a, m), (m, b)]
    return total
