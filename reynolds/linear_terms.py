"""Derivatives of the steady film for its linear model."""

from __future__ import annotations

from reynolds.differences import gap_jacobian
from reynolds.film import thickness_slope
from reynolds.jit import kernel
from reynolds.newton import cell_jacobian, journal_derivative
from reynolds.residual import residual


@kernel
def linear_terms(w, ix, F, L, U):
    """Jacobian without storage at the present state, and thickness derivatives after X and Y in borders 0 and 1."""
    residual(w, ix, F, L, U, 0.0)
    thickness_slope(w, F, L)
    cell_jacobian(w, F, L, U, 0.0)
    for axis in range(2):
        journal_derivative(w, ix, F, L, U, 0.0, axis, L.film_h, L.border + axis * L.length)
    residual(w, ix, F, L, U, 0.0)


@kernel
def gap_terms(w, F, L, U):
    """Derivatives of the cells' residual without storage after the gap at every node, where `linear_terms` has those
    after q."""
    gap_jacobian(w, F, L, U, 0.0)
