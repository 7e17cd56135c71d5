r"""Determinant and dynamic stiffness of a linear film at many complex frequencies at once.

The film with its journals is one matrix of which the film's rows are eliminated, in an order of least fill without
pivots, as its diagonal is large:

.. math:: \begin{pmatrix} A(s) & J_X + s S_X \\ F_y & 0 \end{pmatrix}, \qquad A(s) = J + s S

The pivots make the determinant of A, and what is left of the last rows is -Z(s). Every place of the matrix holds its
values at all frequencies side by side: one walk through the pattern serves them all.

Source: Duff, Erisman & Reid (2017): symbolic and numeric elimination with pivots on the diagonal.

Cites: duff_2017.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import Any

import numpy as np
from scipy import sparse

from reynolds.jit import kernel
from reynolds.perturbation import LinearFilm

TOGETHER, LANES = 8, 4
"""Most frequencies that go through the pattern together, and the number whose multiples the processor takes at once."""


def _eliminate(starts, columns, diagonal, base, slope, place, count, s, re, im, pivots):
    """Rows of base + s slope without their first `count` columns, by columns of the pattern, at s (k,).

    `pivots` (count, k) are the diagonal after elimination; `re`, `im` (places, k) have the factors,
    `place` is room for the places of a row.
    """
    for i in range(len(starts) - 1):
        for e in range(starts[i], starts[i + 1]):
            place[columns[e]] = e
            for b in range(len(s)):
                re[e, b] = base[e] + slope[e] * s[b].real
                im[e, b] = slope[e] * s[b].imag
        for e in range(starts[i], starts[i + 1]):
            k = columns[e]
            if k >= i or k >= count:
                break
            for b in range(len(s)):
                p = pivots[k, b]
                size = p.real * p.real + p.imag * p.imag
                x, y = re[e, b], im[e, b]
                re[e, b] = (x * p.real + y * p.imag) / size
                im[e, b] = (y * p.real - x * p.imag) / size
            for f in range(diagonal[k] + 1, starts[k + 1]):
                t = place[columns[f]]
                for b in range(len(s)):
                    re[t, b] -= re[e, b] * re[f, b] - im[e, b] * im[f, b]
                    im[t, b] -= re[e, b] * im[f, b] + im[e, b] * re[f, b]
        if i < count:
            for b in range(len(s)):
                pivots[i, b] = complex(re[diagonal[i], b], im[diagonal[i], b])


@cache
def _compiled() -> Any:
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
def filled(indptr: bytes, indices: bytes, count: int) -> Pattern:
    """Pattern of a symmetric one by rows, with what the elimination of its first `count` rows fills."""
    starts, columns = np.frombuffer(indptr, np.int32), np.frombuffer(indices, np.int32)
    size = len(starts) - 1
    behind = [{j for j in columns[starts[k] : starts[k + 1]].tolist() if j > k} for k in range(size)]
    for k in range(count):
        first = min(behind[k], default=size)
        if first < count:
            behind[first] |= behind[k] - {first}
    upper = [np.array([k, *sorted(behind[k])]) for k in range(size)]
    rows = np.repeat(np.arange(size), [len(one) for one in upper])
    U = sparse.coo_matrix((np.ones(len(rows)), (rows, np.concatenate(upper))), (size, size))
    whole = (U + U.T).tocsr()
    whole.sort_indices()
    return Pattern(whole.indptr.astype(np.int64), whole.indices.astype(np.int64))


@dataclass(frozen=True, eq=False)
class FilmDeterminant:
    """A film whose states are eliminated in an `order` (n,)."""

    film: LinearFilm
    order: np.ndarray

    @cached_property
    def _parts(self) -> tuple[Pattern, np.ndarray, np.ndarray, np.ndarray]:
        """Pattern, the values at s = 0 and their slopes over s by place, and the places of the diagonal."""
        film, n, q = self.film, len(self.order), len(self.film.F_y)
        J = film.J.tocsr()[self.order][:, self.order]
        J.sum_duplicates()
        J.eliminate_zeros()  # a zero has no place in the pattern
        J = J.tocoo()
        moved, pulled, felt = film.J_X[self.order], film.S_X[self.order], film.F_y[:, self.order]
        edge = sparse.csr_matrix((moved != 0) | (pulled != 0) | (felt.T != 0))
        shape = sparse.bmat([[abs(J) + abs(J).T + sparse.identity(n), edge], [edge.T, np.ones((q, q))]]).tocsr()
        shape.sort_indices()
        pattern = filled(*(x.astype(np.int32).tobytes() for x in (shape.indptr, shape.indices)), n)
        base, slope, diagonal = *np.zeros((2, len(pattern.columns))), pattern.places(np.arange(n), np.arange(n))
        row, column = edge.nonzero()
        right, below = pattern.places(row, n + column), pattern.places(n + column, row)
        base[pattern.places(J.row.astype(np.int64), J.col)] = J.data
        base[right], base[below] = moved[row, column], felt[column, row]
        slope[diagonal], slope[right] = film.S[self.order], pulled[row, column]
        return pattern, base, slope, diagonal

    def at(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Logarithm (k,) of the determinant over the diagonal's, and Z (k, m, m) [N/m], at s (k,).

        The diagonal counts with its values at s = 0 above 0, so that its roots are real and negative.
        """
        pattern, base, slope, diagonal = self._parts
        n, q, size = len(self.order), len(self.film.F_y), len(pattern.columns)
        room, at_rest, rate = np.zeros(n + q, np.int64), np.abs(base[diagonal, None]), slope[diagonal, None]
        last = pattern.places((n + np.arange(q))[:, None], n + np.arange(q))
        padded, logs, Z = np.resize(s, -(-len(s) // LANES) * LANES).astype(complex), [], []
        for k in range(0, len(padded), TOGETHER):
            group = padded[k : k + TOGETHER]
            re, im, pivots = *np.empty((2, size, len(group))), np.empty((n, len(group)), complex)
            _compiled()(pattern.starts, pattern.columns, diagonal, base, slope, room, n, group, re, im, pivots)
            logs.append(np.log(pivots / (at_rest + rate * group)).sum(axis=0))
            Z.append(-(re[last] + 1j * im[last]).transpose(2, 0, 1))
        return np.concatenate(logs)[: len(s)], np.concatenate(Z)[: len(s)]
