r"""Film thickness, film forces and friction torque.

.. math:: h = c - X\cos\theta - Y\sin\theta, \qquad
          F_X = -\int (p - p_a)\cos\theta \,\mathrm dA, \quad F_Y = -\int (p - p_a)\sin\theta\,\mathrm dA

with theta on the bearing from x towards y, (X, Y) the journal's displacement, F the force ON the journal. The
thickness is kept above `h_min` by a parabola that joins h = 2 h_min smoothly, so that a touch leaves the equations
regular; the contact force is an effect of its own. A foil (`reynolds.sleeve.Foil`) adds its deflection.

.. math:: M = \int R \left(\frac{\mu U}{h} + \frac{h}{2}\,\partial_y p\right) \mathrm dA

is the friction torque against the rotation: Couette drag plus the pressure-driven part. Source: Hamrock (2004), section
8.5.

Cites: hamrock_2004.
"""

from __future__ import annotations

from reynolds.jit import inlined, view
from reynolds.lanes import two_dots


@inlined
def bend_foil(w, F, L, iadt):
    """Deflection of the foil [m] under the present pressure at the end of a stage; iadt = 0 is at rest."""
    past = F.bend_time * iadt
    inverse = 1.0 / (1.0 + past)
    for k in range(L.length):
        w[L.bend + k] = (w[L.soft + k] * (w[L.p + k] - F.pa) + past * w[L.bend_rhs + k]) * inverse


@inlined
def thickness(w, F, L):
    """Fill h (ghosts and edges too) from the journal position."""
    x, y = w[L.journal], w[L.journal + 1]
    low = F.h_min
    inverse = 0.25 / low
    for k in range(L.length):
        gap = w[L.clearance + k] - x * w[L.cos + k] - y * w[L.sin + k]
        if L.foil == 1:
            gap = gap + w[L.bend + k]
        near = gap if gap > 0.0 else 0.0
        near = near if near < 2.0 * low else 2.0 * low
        # the parabola lies above the gap and touches it at 2 h_min, where `near` ends
        kept = low + near * near * inverse
        w[L.h + k] = kept if kept > gap else gap


@inlined
def thickness_slope(w, F, L):
    """Fill the slope dh/d(nominal gap), ghosts and edges too."""
    x, y = w[L.journal], w[L.journal + 1]
    low = F.h_min
    inverse = 0.5 / low
    for k in range(L.length):
        gap = w[L.clearance + k] - x * w[L.cos + k] - y * w[L.sin + k]
        if L.foil == 1:
            gap = gap + w[L.bend + k]
        w[L.slope + k] = min(max(gap, 0.0), 2.0 * low) * inverse


@view
def stored(w, L, k):
    """Mass p h of cell k (times R_g T); grooves and steps hold gas too, by their mean depth."""
    return w[L.p + k] * w[L.h + k] if L.textured == 0 else w[L.p + k] * (w[L.h + k] + w[L.deep + k])


@inlined
def wrap(w, L, array):
    """Copy the ring's ends into the ghost lines."""
    start = array + L.first
    end = start + L.n_theta * L.stride
    for j in range(L.n_rows):
        w[start - L.stride + j] = w[end - L.stride + j]
        w[end + j] = w[start + j]


@inlined
def force(w, L):
    """Film force on the journal [N] into w[force]; the constant ambient pressure adds nothing over a full turn."""
    fx, fy = two_dots(w, L.p + L.first, L.force_x + L.first, L.force_y + L.first, L.span)
    w[L.force], w[L.force + 1] = fx, fy


@inlined
def friction_torque(w, F, L, speed):
    """Friction torque [N m] at shaft speed `speed` [rad/s]; positive brakes a positive speed."""
    drag = w[L.mu] * speed * F.radius
    inside = 0.0
    edges = 0.0
    for i in range(L.n_theta):
        line = L.first + i * L.stride
        for j in range(L.n_rows):
            k = line + j
            slope = (w[L.p + k + L.stride] - w[L.p + k - L.stride]) / (2.0 * F.dy)
            inside += w[L.weight + k] * (drag / w[L.h + k] + 0.5 * w[L.h + k] * slope)
        # the edges carry half a cell of Couette drag on either side
        upper = w[L.h + line + L.n_rows]
        lower = upper if L.half == 1 else w[L.h + line - 1]
        edges += 0.5 * drag * (1.0 / upper + 1.0 / lower)
    return F.radius * F.dy * F.dz * (inside * (1.0 + L.half) + edges)
