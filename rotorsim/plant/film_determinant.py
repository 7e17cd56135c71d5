r"""Determinant and dynamic stiffness of a linear film at many complex frequencies at once.

The film with its journals is one matrix of which the film's rows are eliminated, in an order of least fill without
pivots, as its diagonal is large:

.. math:: \begin{pmatrix} A(s) & J_X + s S_X \\ F_y & 0 \end{pmatrix}, \qquad A(s) = J + s S

The pivots make the determinant of A, and what is left of the last rows is -Z(s). Every place of the matrix holds its
values at all frequencies side by side: one walk through the pattern serves them all.

Source: Duff et al. (2017), chapters 5 and 12 (symbolic and numeric elimination with diagonal pivots).

Cites: saad_2011.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import Any

import numpy as np
from scipy import sparse

from reynolds.perturbation import LinearFilm

TOGETHER = 8
"""Frequencies that go through the pattern together."""


def _eliminate(starts, columns, diagonal, base, slope, place, count, s, re, im, pivots):  # type: ignore[no-untyped-def]
    """Rows of base + s slope without their first `count` columns, by columns of the pattern, at TOGETHER frequencies.

    `pivots` (count,) are the diagonal after elimination; `re`, `im` (places, TOGETHER) have the factors, `place` is room
    for the places of a row.
    """
    for i in range(len(starts) - 1):
        for e in range(starts[i], starts[i + 1]):
            place[columns[e]] = e
            for b in range(TOGETHER):
                re[e, b] = base[e] + slope[e] * s[b].real
                im[e, b] = slope[e] * s[b].imag
        for e in range(starts[i], starts[i + 1]):
            k = columns[e]
            if k >= i or k >= count:
                break
            for b in range(TOGETHER):
                p = pivots[k, b]
                size = p.real * p.real + p.imag * p.imag
                x, y = re[e, b], im[e, b]
                re[e, b] = (x * p.real + y * p.imag) / size
                im[e, b] = (y * p.real - x * p.imag) / size
            for f in range(diagonal[k] + 1, starts[k + 1]):
                t = place[columns[f]]
                for b in range(TOGETHER):
                    re[t, b] -= re[e, b] * re[f, b] - im[e, b] * im[f, b]
                    im[t, b] -= re[e, b] * im[f, b] + im[e, b] * re[f, b]
        if i < count:
            for b in range(TOGETHER):
                pivots[i, b] = complex(re[diagonal[i], b], im[diagonal[i], b])


@cache
def _compiled() -> Any:
    from reynolds.jit import kernel  # brings numba

    return kernel(_eliminate)


@dataclass(frozen=True, eq=False)
class Pattern:
    """Filled pattern by rows of a film in an order, and of its journals behind it."""

    starts: np.ndarray
    columns: np.ndarray

    @cached_property
    def keys(self) -> np.ndarray:
        """Ascending number of each place: its row times the size, and its column."""
        size = len(self.starts) - 1
        return np.repeat(np.arange(size), np.diff(self.starts)) * size + self.columns

    def places(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Places of the terms of rows and columns."""
        return np.searchsorted(self.keys, rows * (len(self.starts) - 1) + columns)


@lru_cache(maxsize=16)
def filled(indptr: bytes, indices: bytes, journals: int) -> Pattern:
    """Pattern of a symmetric one by rows, with what its elimination fills and `journals` full rows and columns."""
    starts, columns = np.frombuffer(indptr, np.int32), np.frombuffer(indices, np.int32)
    n = len(starts) - 1
    behind = [{j for j in columns[starts[k] : starts[k + 1]].tolist() if j > k} for k in range(n)]
    for k in range(n):
        if behind[k]:
            first = min(behind[k])
            behind[first] |= behind[k] - {first}
    upper = [np.array([k, *sorted(behind[k])]) for k in range(n)]
    rows = np.repeat(np.arange(n), [len(one) for one in upper])
    U = sparse.coo_matrix((np.ones(len(rows)), (rows, np.concatenate(upper))), (n, n))
    full = sparse.csr_matrix(np.ones((n, journals)))
    whole = sparse.bmat([[U + U.T, full], [full.T, np.ones((journals, journals))]]).tocsr()
    whole.sort_indices()
    return Pattern(whole.indptr.astype(np.int64), whole.indices.astype(np.int64))


@dataclass(frozen=True, eq=False)
class FilmDeterminant:
    """A film whose states are eliminated in an `order` (n,); the first `alone` of them have real negative roots."""

    film: LinearFilm
    order: np.ndarray
    alone: int

    @cached_property
    def _parts(self) -> tuple[Pattern, np.ndarray, np.ndarray, np.ndarray]:
        """Pattern, the values at s = 0 and their slopes over s by place, and the places of the diagonal."""
        film, n, q = self.film, len(self.order), len(self.film.F_y)
        J = sparse.csr_matrix(film.J)[self.order][:, self.order]
        shape = (J + J.T + sparse.identity(n)).tocsr()
        shape.sort_indices()
        pattern = filled(*(x.astype(np.int32).tobytes() for x in (shape.indptr, shape.indices)), q)
        base, slope = np.zeros((2, len(pattern.columns)))
        J = J.tocoo()
        own, behind = np.arange(n), n + np.arange(q)
        diagonal = pattern.places(own, own)
        edge = pattern.places(own[:, None], behind), pattern.places(behind[:, None], own)
        base[pattern.places(J.row.astype(np.int64), J.col)] = J.data
        base[edge[0]], base[edge[1]] = film.J_X[self.order], film.F_y[:, self.order]
        slope[diagonal], slope[edge[0]] = film.S[self.order], film.S_X[self.order]
        return pattern, base, slope, diagonal

    def at(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Logarithm of the determinant (k,) up to multiples of 2 pi i, and Z (k, journals, journals), at s (k,)."""
        pattern, base, slope, diagonal = self._parts
        n, q, size = len(self.order), len(self.film.F_y), len(pattern.columns)
        re, im = np.empty((2, size, TOGETHER))
        pivots, room = np.empty((n, TOGETHER), complex), np.zeros(n + q, np.int64)
        groups = np.resize(s, (-(-len(s) // TOGETHER), TOGETHER)).astype(complex)
        last = pattern.places((n + np.arange(q))[:, None], n + np.arange(q))
        logs, Z = np.empty(groups.shape, complex), np.empty((*groups.shape, q, q), complex)
        for k, group in enumerate(groups):
            _compiled()(pattern.starts, pattern.columns, diagonal, base, slope, room, n, group, re, im, pivots)
            logs[k] = np.log(pivots[self.alone :]).sum(axis=0)
            Z[k] = -(re[last] + 1j * im[last]).transpose(2, 0, 1)
        return logs.ravel()[: len(s)], Z.reshape(-1, q, q)[: len(s)]
