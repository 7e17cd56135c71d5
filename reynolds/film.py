r"""Film thickness and film forces.

.. math:: h = c - X\cos\theta - Y\sin\theta, \qquad
          F_X = -\int (p - p_a)\cos\theta \,\mathrm dA, \quad F_Y = -\int (p - p_a)\sin\theta\,\mathrm dA

with theta on the bearing from x towards y, (X, Y) the journal's displacement, F the force ON the journal. The
thickness is kept above `h_min` by a parabola that joins h = 2 h_min smoothly, so that a touch leaves the equations
regular; the contact force is an effect of its own.
"""

from __future__ import annotations

from reynolds.jit import inlined
from reynolds.lanes import dot


@inlined
def thickness(w, F, L):
    """Fill h (ghosts and edges too) and its slope dh/d(nominal gap) from the journal position."""
    x, y = w[L.journal], w[L.journal + 1]
    low = F.h_min
    inverse = 0.25 / low
    for k in range(L.length):
        gap = w[L.clearance + k] - x * w[L.cos + k] - y * w[L.sin + k]
        near = min(max(gap, 0.0), 2.0 * low)
        w[L.h + k] = max(gap - 2.0 * low, 0.0) + low + near * near * inverse
        w[L.slope + k] = near * 2.0 * inverse


@inlined
def force(w, L):
    """Film force on the journal [N] into w[force]; the constant ambient pressure adds nothing over a full turn."""
    w[L.force] = dot(w, L.p + L.first, L.force_x + L.first, L.span)
    w[L.force + 1] = dot(w, L.p + L.first, L.force_y + L.first, L.span)
