r"""Frequency response of the film at complex frequency s: dynamic stiffness, damping, actuation, from one LU.

With A(s) = J + s S of `reynolds.perturbation` and L(s) = A^-T F_y' (two adjoint solves),

.. math:: Z(s) = L'(J_X + s S_X), \qquad \delta F = -Z X - L' J_u u, \qquad
          K + i\omega C = Z(i\omega), \qquad C(0) = L'(S_X - S A^{-1} J_X)

Cites: hamrock_2004.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from reynolds.perturbation import LinearFilm

ORDERING = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
"""The pattern is symmetric and the diagonal large: half the fill of the default ordering."""


@dataclass(frozen=True, eq=False)
class FilmAnswer:
    """The film at one complex frequency: `factor` of A, adjoint L (n, 2), dynamic stiffness Z (2, 2) [N/m]."""

    factor: Any
    L: np.ndarray
    Z: np.ndarray

    @property
    def log_det(self) -> complex:
        """Logarithm of det A up to a multiple of i pi that is the same at every frequency."""
        return complex(np.log(self.factor.U.diagonal() + 0j).sum())


@dataclass(frozen=True, eq=False)
class FilmResponse:
    """Answers of a linear film; frequencies asked twice are factored once."""

    film: LinearFilm

    @cached_property
    def _pattern(self) -> tuple[Any, np.ndarray, dict[complex, FilmAnswer]]:
        """J by columns, the places of its diagonal in the data, and what is known already."""
        J = csc_matrix(self.film.J)
        J.sum_duplicates()
        columns = np.repeat(np.arange(J.shape[1]), np.diff(J.indptr))
        places = np.flatnonzero(J.indices == columns)
        assert len(places) == len(self.film.S)
        return J, places, {}

    def at(self, s: complex) -> FilmAnswer:
        """The film's answer at s [rad/s], kept; real arithmetic at s = 0."""
        known = self._pattern[2]
        if s not in known:
            known[s] = self.answer(s)
        return known[s]

    def answer(self, s: complex) -> FilmAnswer:
        """The film's answer at s [rad/s], not kept."""
        film, (J, places, _) = self.film, self._pattern
        real = s == 0
        data = J.data.copy() if real else J.data.astype(complex)
        if not real:
            data[places] += s * film.S
        factor = splu(csc_matrix((data, J.indices, J.indptr), J.shape), **ORDERING)
        L = factor.solve(np.ascontiguousarray(film.F_y.T, data.dtype), "T")
        moved = film.J_X if real else film.J_X + s * film.S_X
        return FilmAnswer(factor, L, L.T @ moved)

    def coefficients(self, omega: float) -> tuple[np.ndarray, np.ndarray]:
        """K [N/m] and C [N s/m] (2, 2) at the whirl frequency omega [rad/s]; C at 0 is the limit."""
        if omega:
            Z = self.at(1j * omega).Z
            return Z.real.copy(), Z.imag / omega
        answer, film = self.at(0), self.film
        return answer.Z, answer.L.T @ (film.S_X - film.S[:, None] * answer.factor.solve(film.J_X))
