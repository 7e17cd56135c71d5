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

from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from reynolds.jit import inlined, kernel
from reynolds.perturbation import LinearFilm
from reynolds.vectors import LANES, less_complex_products, less_complex_sum, wide_vectors
from reynolds.workspace import at_cache_line

STRIDE = 2 * LANES
"""Numbers from one place to the next: real parts, then imaginary ones, of as many frequencies as a vector has lanes.

At one frequency that many right-hand sides go through the pattern together.
"""
TOGETHER = 16
"""Pivots over their diagonal that are multiplied before their logarithm is taken."""


@inlined
def _times_inverse(w, y, factors, inverse):
    """Complex numbers at y over a pivot whose inverse is given among the factors."""
    for b in range(LANES):
        real, imag = w[y + b], w[y + LANES + b]
        w[y + b] = real * factors[inverse + b] - imag * factors[inverse + LANES + b]
        w[y + LANES + b] = real * factors[inverse + LANES + b] + imag * factors[inverse + b]


def _eliminate(starts, columns, diagonal, base, slope, place, count, s, w, shares):
    """Rows of base + s slope without their first `count` columns, by columns of the pattern, at s (STRIDE,), a place.

    `w` has room for the places, with the factors in the end, and behind them for the inverse pivots (count,); `place`
    is room for the places of a row. `shares` (k, 2, LANES) become products of `TOGETHER` pivots over their diagonal.
    """
    wide_vectors()
    inverse = STRIDE * len(columns)
    for i in range(len(starts) - 1):
        for e in range(starts[i], starts[i + 1]):
            place[columns[e]] = STRIDE * e
            for b in range(LANES):
                w[STRIDE * e + b] = base[e] + slope[e] * s[b]
                w[STRIDE * e + LANES + b] = slope[e] * s[LANES + b]
        for e in range(starts[i], starts[i + 1]):
            k = columns[e]
            if k >= i or k >= count:
                break
            _times_inverse(w, STRIDE * e, w, inverse + STRIDE * k)
            less_complex_products(w, STRIDE * e, place, columns, diagonal[k] + 1, starts[k + 1], w)
        if i < count:
            own, to = STRIDE * diagonal[i], inverse + STRIDE * i
            for b in range(LANES):
                x, y = w[own + b], w[own + LANES + b]
                size = x * x + y * y  # 0 / 0 for a pivot of 0: a frequency at a cell's own decay has no factors
                w[to + b] = x / size
                w[to + LANES + b] = -y / size
                real, imag = abs(base[diagonal[i]]) + slope[diagonal[i]] * s[b], slope[diagonal[i]] * s[LANES + b]
                size = real * real + imag * imag
                part, turn = (x * real + y * imag) / size, (y * real - x * imag) / size
                if i % TOGETHER > 0:
                    before, turned = shares[i // TOGETHER, 0, b], shares[i // TOGETHER, 1, b]
                    part, turn = part * before - turn * turned, part * turned + turn * before
                shares[i // TOGETHER, 0, b], shares[i // TOGETHER, 1, b] = part, turn


def _substitute(starts, columns, diagonal, order, factors, w, place, adjoint, x, begin):
    """A^-1 x for LANES columns of x (count, k) from one on, with `adjoint` A^-H x, by the factors of `_eliminate`.

    Those are not changed: w (STRIDE * count,) is room for the columns, `place` (count,) for their places.
    """
    wide_vectors()
    count, width = len(order), min(x.shape[1] - begin, LANES)
    inverse = STRIDE * len(columns)
    sign = -1.0 if adjoint else 1.0
    # A^-H x is the conjugate of A^-T conj(x): the factors are taken as they are
    for i in range(count):
        place[i] = STRIDE * i
        for b in range(LANES):
            value = x[order[i], begin + b] if b < width else 0j
            w[place[i] + b] = value.real
            w[place[i] + LANES + b] = sign * value.imag
    for n in range(2 * count):
        lower = (n < count) != adjoint
        i = n if n < count else 2 * count - 1 - n
        first, last = (starts[i], diagonal[i]) if lower else (diagonal[i] + 1, starts[i + 1])
        while last > first and columns[last - 1] >= count:
            last -= 1
        if adjoint:
            if not lower:
                _times_inverse(w, place[i], factors, inverse + STRIDE * i)
            less_complex_products(w, place[i], place, columns, first, last, factors)
        else:
            less_complex_sum(w, place[i], place, columns, first, last, factors)
            if not lower:
                _times_inverse(w, place[i], factors, inverse + STRIDE * i)
    for i in range(count):
        for b in range(width):
            x[order[i], begin + b] = complex(w[place[i] + b], sign * w[place[i] + LANES + b])


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


KEPT = 4_000_000
"""Numbers in rooms that are kept for the next factors: 32 MB."""
_given_back: deque[np.ndarray] = deque()
"""Rooms of factors that are no longer needed: the pages of new memory cost more time than what is put into them."""


def _room(size: int) -> np.ndarray:
    """Room for factors, with whatever was left in it."""
    with suppress(IndexError):
        w = _given_back.pop()
        if len(w) == size:
            return w
    return at_cache_line(size)


class _Groups(list[tuple[np.ndarray, np.ndarray]]):
    """Room of the kernels with the factors at some of the frequencies, and shares of the determinant there, of each.

    Whoever reads a room holds the list: with it the rooms are given back.
    """

    def __del__(self) -> None:
        """Give the rooms back."""
        for w, _ in self:
            if len(w) * (len(_given_back) + 1) <= KEPT:
                _given_back.append(w)


@dataclass(frozen=True, eq=False)
class FilmFactors:
    """Factors of A at frequencies s (k,) [rad/s], for any number of threads."""

    response: FilmResponse
    s: np.ndarray

    def __post_init__(self) -> None:
        if self.s.ndim != 1 or not len(self.s):
            raise ValueError(f"film: frequencies of shape {self.s.shape}; give (k,) with one or more")

    @cached_property
    def _groups(self) -> _Groups:
        """Factors at all frequencies; the last group is filled up."""
        pattern, base, slope = self.response._parts
        n, found = len(pattern.order), _Groups()
        place, fill = np.zeros(len(pattern.starts) - 1, np.int64), -len(self.s) % LANES
        for s in np.pad(self.s.astype(complex), (0, fill), "edge").reshape(-1, LANES):
            w, shares = _room(STRIDE * (len(base) + n)), np.empty((-(-n // TOGETHER), 2, LANES))
            parts = np.concatenate([s.real, s.imag])
            filled_in = pattern.starts, pattern.columns, pattern.diagonal, base, slope, place, n, parts, w, shares
            _compiled()[0](*filled_in)
            found.append((w, shares))
        return found

    @property
    def log(self) -> np.ndarray:
        """Logarithm (k,) of the determinant over the diagonal's.

        The diagonal counts with its values at s = 0 above 0, so that its roots are real and negative.
        """
        shares = np.concatenate([shares for _, shares in self._groups], axis=2)[..., : len(self.s)]
        return np.asarray(np.log(shares[:, 0] + 1j * shares[:, 1]).sum(axis=0))

    @cached_property
    def Z(self) -> np.ndarray:
        """Dynamic stiffness (k, q, q) [N/m]."""
        last, size = self.response._parts[0].last, STRIDE * len(self.response._parts[1])
        parts = [w[:size].reshape(-1, 2, LANES)[last] for w, _ in self._groups]
        found = np.concatenate([one[..., 0, :] + 1j * one[..., 1, :] for one in parts], axis=2)
        return -found.transpose(2, 0, 1)[: len(self.s)]

    def solve(self, b: np.ndarray, adjoint: bool = False) -> np.ndarray:
        """A^-1 b, or A^-H b, for b (n, k) of one column a frequency; with one frequency for any columns."""
        pattern, groups, x = self.response._parts[0], self._groups, np.array(b, complex, order="C")
        n, k = len(pattern.order), len(self.s)
        if x.ndim != 2 or len(x) != n or x.shape[1] != k > 1:
            raise ValueError(f"film: right-hand sides of shape {x.shape}; give ({n}, {k if k > 1 else 'any'})")
        w, place = at_cache_line(STRIDE * n), np.empty(n, np.int64)
        for begin in range(0, x.shape[1], LANES):
            factors, _ = groups[0 if k == 1 else begin // LANES]
            _compiled()[1](pattern.starts, pattern.columns, pattern.diagonal, pattern.order, factors, w, place, adjoint,
                           x, begin)  # fmt: skip
        return x
