r"""A linear film at many complex frequencies at once: factors, determinant, dynamic stiffness.

The film with its journals is one matrix of which the film's rows are eliminated, in an order of least fill without
pivots, as its diagonal is large:

.. math:: \begin{pmatrix} A(s) & J_X + s S_X \\ F_y & 0 \end{pmatrix}, \qquad A(s) = J + s S

The pivots make the determinant of A, what is left of the last rows is -Z(s), and the factors solve with A and its
adjoint. Every place of the matrix holds its values at all frequencies side by side: one walk through the pattern serves
them all.

Source: Duff, Erisman & Reid (2017): symbolic and numeric elimination with pivots on the diagonal.

Cites: duff_2017.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from reynolds.jit import inlined, kernel
from reynolds.perturbation import LinearFilm

TOGETHER, LANES = 16, 4
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


@inlined
def _over(x, pivot):
    """x / pivot, NaN for a pivot of 0: a frequency at a cell's own decay has no factors."""
    return x / pivot if pivot != 0.0 else complex(np.nan, np.nan)


def _substitute(starts, columns, diagonal, re, im, pivots, adjoint, x):
    """A^-1 x in place of x (count, k), with `adjoint` A^-H x, by the factors that `_eliminate` leaves."""
    count, width = x.shape
    if adjoint:
        for i in range(count):
            for b in range(width):
                x[i, b] = _over(x[i, b], pivots[i, b].conjugate())
            for f in range(diagonal[i] + 1, starts[i + 1]):
                j = columns[f]
                if j >= count:
                    break
                for b in range(width):
                    x[j, b] -= complex(re[f, b], -im[f, b]) * x[i, b]
        for i in range(count - 1, -1, -1):
            for e in range(starts[i], diagonal[i]):
                for b in range(width):
                    x[columns[e], b] -= complex(re[e, b], -im[e, b]) * x[i, b]
    else:
        for i in range(count):
            for e in range(starts[i], diagonal[i]):
                for b in range(width):
                    x[i, b] -= complex(re[e, b], im[e, b]) * x[columns[e], b]
        for i in range(count - 1, -1, -1):
            for f in range(diagonal[i] + 1, starts[i + 1]):
                j = columns[f]
                if j >= count:
                    break
                for b in range(width):
                    x[i, b] -= complex(re[f, b], im[f, b]) * x[j, b]
            for b in range(width):
                x[i, b] = _over(x[i, b], pivots[i, b])


@cache
def _compiled() -> tuple[Any, Any]:
    return kernel(_eliminate), kernel(_substitute)


@dataclass(frozen=True, eq=False)
class Pattern:
    """Filled pattern by rows of a film in an order (n,), and of its journals behind it.

    `diagonal` (n,), `terms`, `right` and `below` are the places of the diagonal, of the film's own terms and of the
    journals' `edge`, whose rows and columns in the film's order it has; `last` (q, q) those of the last rows.
    """

    order: np.ndarray
    starts: np.ndarray
    columns: np.ndarray
    diagonal: np.ndarray
    terms: np.ndarray
    edge: tuple[np.ndarray, np.ndarray]
    right: np.ndarray
    below: np.ndarray
    last: np.ndarray


@lru_cache(maxsize=16)
def pattern_of(indptr: bytes, indices: bytes, touched: bytes, journals: int) -> Pattern:
    """The pattern of a film by columns and of its journals: one for a machine at every speed.

    `touched` are flags (n, journals) of the states that move with a journal or push it.
    """
    starts, rows = np.frombuffer(indptr, np.int32), np.frombuffer(indices, np.int32)
    n = len(starts) - 1
    columns, edge = np.repeat(np.arange(n), np.diff(starts)), np.frombuffer(touched, bool).reshape(n, journals)
    film = sparse.csc_matrix((np.ones(len(rows)), rows, starts), (n, n))
    dominant = (film + sparse.diags(np.full(n, float(n)))).tocsc()
    options: dict[str, Any] = {"diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    order = np.argsort(splu(dominant, permc_spec="MMD_AT_PLUS_A", **options).perm_c)
    turned = sparse.csr_matrix(edge[order])
    inner = dominant[order][:, order]
    whole = filled(sparse.bmat([[inner + inner.T, turned], [turned.T, np.ones((journals, journals))]]).tocsr(), n)
    size, place = n + journals, np.argsort(order)
    keys = np.repeat(np.arange(size), np.diff(whole.indptr)) * size + whole.indices

    def places(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        return np.searchsorted(keys, i * size + j)

    row, column = edge.nonzero()
    behind, last = n + column, n + np.arange(journals)
    return Pattern(
        order, whole.indptr.astype(np.int64), whole.indices.astype(np.int64), places(np.arange(n), np.arange(n)),
        places(place[rows], place[columns]), (row, column), places(place[row], behind), places(behind, place[row]),
        places(last[:, None], last),
    )  # fmt: skip


def filled(pattern: Any, count: int) -> Any:
    """A symmetric pattern by rows with what the elimination of its first `count` rows fills."""
    size, starts, columns = pattern.shape[0], pattern.indptr, pattern.indices
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
    return whole


@dataclass(frozen=True, eq=False)
class FilmResponse:
    """Answers of a linear film over complex frequencies."""

    film: LinearFilm

    @cached_property
    def _parts(self) -> tuple[Pattern, np.ndarray, np.ndarray]:
        """Pattern, and the values at s = 0 and their slopes over s by place."""
        film = self.film
        J = sparse.csc_matrix(film.J, copy=True)
        J.sum_duplicates()
        J.eliminate_zeros()  # a zero has no place in the pattern
        touched = (film.J_X != 0) | (film.S_X != 0) | (film.F_y.T != 0)
        pattern = pattern_of(*(x.astype(np.int32).tobytes() for x in (J.indptr, J.indices)), touched.tobytes(),
                             touched.shape[1])  # fmt: skip
        base, slope = np.zeros((2, len(pattern.columns)))
        row, column = pattern.edge
        base[pattern.terms], base[pattern.right], base[pattern.below] = (
            J.data,
            film.J_X[row, column],
            film.F_y[column, row],
        )
        slope[pattern.diagonal], slope[pattern.right] = film.S[pattern.order], film.S_X[row, column]
        return pattern, base, slope

    def factors(self, s: np.ndarray) -> FilmFactors:
        """The film at frequencies s (k,) [rad/s]."""
        return FilmFactors(self, s)

    @cached_property
    def _kept(self) -> dict[float, tuple[np.ndarray, np.ndarray]]:
        return {}

    def coefficients(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """K [N/m] and C [N s/m] (q, q) at the whirl frequency omega [rad/s]; C at 0 is the limit."""
        if omega not in self._kept:
            film, held = self.film, self.factors(np.array([1j * omega if omega else 0.0]))
            rest = np.zeros(0) if omega else held.solve(film.S_X - film.S[:, None] * held.solve(film.J_X))
            self._kept[omega] = held.Z[0].real, held.Z[0].imag / omega if omega else (film.F_y @ rest).real
        K, C = self._kept[omega]
        return K.copy(), C.copy()


@dataclass(frozen=True, eq=False)
class FilmFactors:
    """Factors of A at frequencies s (k,) [rad/s]."""

    response: FilmResponse
    s: np.ndarray

    @cached_property
    def _groups(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Values by place, real and imaginary, and pivots at some of the frequencies; the last one fills a group up."""
        pattern, base, slope = self.response._parts
        n, found = len(pattern.order), []
        room = np.zeros(len(pattern.starts) - 1, np.int64)
        width = len(self.s) if len(self.s) == 1 else -(-len(self.s) // LANES) * LANES
        padded = np.pad(self.s.astype(complex), (0, width - len(self.s)), "edge")
        for k in range(0, width, TOGETHER):
            s = padded[k : k + TOGETHER]
            re, im, pivots = *np.empty((2, len(base), len(s))), np.empty((n, len(s)), complex)
            _compiled()[0](pattern.starts, pattern.columns, pattern.diagonal, base, slope, room, n, s, re, im, pivots)
            found.append((re, im, pivots))
        return found

    @property
    def log(self) -> np.ndarray:
        """Logarithm (k,) of the determinant over the diagonal's.

        The diagonal counts with its values at s = 0 above 0, so that its roots are real and negative.
        """
        pattern, base, slope = self.response._parts
        own = np.abs(base[pattern.diagonal, None]) + slope[pattern.diagonal, None] * self.s
        pivots = np.hstack([one[2] for one in self._groups])[:, : len(self.s)]
        return np.asarray(np.log(pivots / own).sum(axis=0))

    @cached_property
    def Z(self) -> np.ndarray:
        """Dynamic stiffness (k, q, q) [N/m]."""
        last = self.response._parts[0].last
        found = np.concatenate([-(re[last] + 1j * im[last]) for re, im, _ in self._groups], axis=2)
        return found.transpose(2, 0, 1)[: len(self.s)]

    def solve(self, b: np.ndarray, adjoint: bool = False) -> np.ndarray:
        """A^-1 b, or A^-H b, for b (n, k) of one column a frequency; with one frequency for any columns."""
        pattern = self.response._parts[0]
        x = np.empty(b.shape, complex)
        for columns, factors in self._columns(b.shape[1]):
            width = factors[0].shape[1]
            part = np.zeros((len(b), width), complex)
            own = b[pattern.order, columns]
            part[:, : own.shape[1]] = own
            _compiled()[1](pattern.starts, pattern.columns, pattern.diagonal, *factors, adjoint, part)
            x[pattern.order, columns] = part[:, : own.shape[1]]
        return x

    def _columns(self, count: int) -> Iterator[tuple[slice, tuple[np.ndarray, np.ndarray, np.ndarray]]]:
        """Columns of b with the factors that they need."""
        if len(self.s) == 1:
            for k in range(count):
                yield slice(k, k + 1), self._groups[0]
        else:
            for k, factors in enumerate(self._groups):
                yield slice(k * TOGETHER, (k + 1) * TOGETHER), factors
