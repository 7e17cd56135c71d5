r"""Eigenpairs of a pencil from Krylov spaces, refined as invariant subspaces: each mode once, a double one twice.

Inverse iteration runs from both sides, with a Rayleigh-Ritz step for eigenvalues near one another: they are one
subspace, whatever the distance. A mode that was met twice lies in the span of the vectors that are known already.

Source: Saad (2011), chapters 4 to 7 (subspace iteration, two-sided projection, block Krylov spaces).

Cites: saad_2011.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.linalg import eig

from fe_shaft.modes.pencil import OSCILLATES, Modes, Pencil, Region, Vector, nothing

SETTLED = 1e-11
"""Relative change of an eigenvalue after which its refinement ends."""
NEAR = 1e-3
"""Relative distance of eigenvalues that are refined as one subspace."""
ALIKE = 1e-3
"""Part of a vector outside the span of the vectors nearby below which it adds no mode."""
LOOSE = 1e10
"""Condition of left against right vectors above which they span no common subspace."""
SMALL = 130
"""Size up to which all eigenvalues are computed at once."""
DEPTH, WIDTH = 14, 2
"""Steps of a block Krylov space and vectors of its block."""


def everything(pencil: Pencil) -> Modes:
    """All modes of a small pencil that are not below the real axis: none is missing."""
    eye = np.eye(pencil.size)
    S, J = pencil.times_S(eye), pencil.times_J(eye)
    values, left, right = eig(np.linalg.solve(S, J), left=True, check_finite=False)
    keep = values.imag >= 0
    left = np.linalg.solve(S.T, left[:, keep])
    return Modes(values[keep], right[:, keep], _paired_nearby(pencil, values[keep], right[:, keep], left), 0.0)


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
    """Eigenpairs by inverse iteration from guesses, near ones together; what does not settle is left out.

    Where the iteration ends below the real axis, the partner above is the mode.
    """
    known, left_over = nothing(pencil.size), list(range(len(guess.values)))
    while left_over:
        first = guess.values[left_over[0]]
        group = [k for k in left_over if abs(guess.values[k] - first) < NEAR * abs(first)]
        left_over = [k for k in left_over if k not in group]
        found = iterated(pencil, guess.take(group))
        alone = [group] if found is not None or len(group) == 1 else [[k] for k in group]
        for one in alone if found is None else []:
            single = iterated(pencil, guess.take(one))
            known = known if single is None else joined(pencil, known, single.above)
        known = known if found is None else joined(pencil, known, found.above)
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
    return Modes(s, V, _paired_nearby(pencil, s, V, Y))


def _paired_nearby(pencil: Pencil, s: Vector, right: Vector, left: Vector) -> Vector:
    """Left vectors with left^H S right = I among near eigenvalues; those of distant ones are orthogonal as they are."""
    pushed = pencil.times_S(right)
    close = np.abs(s[:, None] - s) < NEAR * np.abs(s[:, None])
    if close.sum() == len(s):
        return left / np.sum(left.conj() * pushed, axis=0).conj()
    return left @ np.linalg.pinv(np.where(close, left.conj().T @ pushed, 0.0)).conj().T
