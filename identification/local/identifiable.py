r"""Parameters that data cannot show apart: the null space of the scaled Fisher matrix.

.. math:: F = S^{-1} J^T J S^{-1}, \quad S = \mathrm{diag}(\|J_i\|); \qquad F v = 0

With sensitivities J of unit length, what nuisance parameters such as the initial state explain taken out, a singular
value near zero is a direction v = S dtheta that leaves the response as it is. Directions of several independent
ambiguities mix in v; the projection onto all of them does not, and its blocks are the groups of parameters.

Cites: ljung_1999.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

SINGULAR = 1e-6
"""Singular value, of sensitivities of unit length, below which a direction leaves the response as it is."""
NEGLIGIBLE = 1e-9
"""A parameter whose size moves the response by less than this share of what the strongest does has no effect."""
LINKED = 1e-3
"""Elements of the projection above this link two parameters."""


def without_nuisance(J: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Sensitivities (samples, q) of J (n, p, q + k) to parameters beyond what the k others explain.

    sizes (q,) are those of the parameters, 0 where one is not known. Columns are of the length that they have relative
    to their full one, which is 1, or 0 without any effect.
    """
    flat, q = J.reshape(-1, J.shape[2]), len(sizes)
    own, others = flat[:, :q], flat[:, q:]
    length = np.linalg.norm(own, axis=0)
    effect = length * sizes
    none = (length == 0) | ((sizes > 0) & (effect < NEGLIGIBLE * effect.max(initial=0.0)))
    own = np.where(none, 0.0, own / np.where(none, 1.0, length))
    if not others.shape[1]:
        return own
    Q = np.linalg.qr(others / np.maximum(np.linalg.norm(others, axis=0), 1e-300))[0]
    return np.asarray(own - Q @ (Q.T @ own))


def indistinguishable(J: np.ndarray, names: Sequence[str]) -> list[str]:
    """A text for each group of parameters that sensitivities J (samples, q), of unit length, do not show apart."""
    if not len(names):
        return []
    length = np.linalg.norm(J, axis=0)
    dead = length < SINGULAR
    scaled = np.where(dead, 0.0, J / np.where(dead, 1.0, length))
    values, vectors = np.linalg.svd(np.linalg.qr(scaled, mode="r"))[1:]
    null = vectors[values < SINGULAR]
    return [_text([names[i] for i in group]) for group in _groups(null.T @ null)]


def _groups(P: np.ndarray) -> list[list[int]]:
    """Indices that the projection (q, q) links, group by group."""
    left, found = [i for i in range(len(P)) if P[i, i] > LINKED**2], []
    while left:
        group, ahead = [], [left[0]]
        while ahead:
            group.append(i := ahead.pop())
            left.remove(i)
            ahead += [j for j in left if abs(P[i, j]) > LINKED and j not in ahead]
        found.append(sorted(group))
    return found


def _text(group: list[str]) -> str:
    if len(group) == 1:
        return f"{group[0]} does not change the response"
    return f"{', '.join(group[:-1])} and {group[-1]} change it only together, in one combination"
