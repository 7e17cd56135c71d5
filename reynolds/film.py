r"""Film thickness, slip at the walls, film forces and friction torque.

.. math:: h = c - X\cos\theta - Y\sin\theta, \qquad
          F_X = -\int (p - p_a)\cos\theta \,\mathrm dA, \quad F_Y = -\int (p - p_a)\sin\theta\,\mathrm dA

with theta on the bearing from x towards y, (X, Y) the journal's displacement, F the force ON the journal. The
thickness is kept above `h_min` by a parabola that joins h = 2 h_min smoothly, so that a touch leaves the equations
regular; the contact force is an effect of its own. A foil (`reynolds.sleeve.Foil`) adds its deflection.

.. math:: M = \int R \left(\frac{\mu U}{h} + \frac{h}{2}\,\partial_y p\right) \mathrm dA

is the friction torque against the rotation: Couette drag plus the pressure-driven part. Source: Hamrock (2004), section
8.5.

A gas that slips at both walls (first order, Burgdorfer 1959) passes a gap h as if h^3 were h^2 (h + 6 lambda), and
drags as if h were h + 2 lambda, with the mean free path lambda = lambda_a p_a / p: at a wall its speed is that of the
wall and lambda times the slope of the profile. The pressure-driven part of the friction balances the pressures on a gap
and has no slip in it.

Cites: burgdorfer_1959, hamrock_2004.
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
def slip_length(w, L, p):
    """6 lambda [m] of the gas at pressure p [Pa], 0 for one that does not slip; w[slip] is 6 lambda p."""
    return w[L.slip] / p if L.rarefied == 1 else 0.0


@view
def shear_gap(h, slip):
    """Gap [m] whose drag is that of the gap h [m] with slip = 6 lambda [m]."""
    return h + slip * (1.0 / 3.0)


@inlined
def slip_flow(w, L, kt, kz):
    """Add the flow of a gas that slips at both walls, with w[slip] = 6 lambda p at once for all cells."""
    slip = 2.0 * w[L.slip]
    for k in range(L.first - L.stride, L.first + L.n_theta * L.stride):
        hf = 0.5 * (w[L.h + k] + w[L.h + k + L.stride])
        hz = 0.5 * (w[L.h + k] + w[L.h + k + 1])
        w[L.flow_t + k] -= kt * slip * (hf * hf) * (w[L.p + k + L.stride] - w[L.p + k])
        w[L.flow_z + k] += kz * slip * w[L.link + k] * (hz * hz) * (w[L.p + k] - w[L.p + k + 1])


@inlined
def slip_jacobian(w, L, k, face_t, face_z, kt, kz):
    """Derivative after q = p^2 at node k of the slip flow through a theta or z face with thickness face_t, face_z."""
    return w[L.slip] / w[L.p + k] * kt * face_t * face_t, w[L.slip] / w[L.p + k] * kz * face_z * face_z


@view
def mean_gap(w, L, k):
    """Mean thickness [m] in cell k, grooves and steps with it."""
    return w[L.h + k] if L.textured == 0 else w[L.h + k] + w[L.deep + k]


@view
def stored(w, L, k):
    """Mass p h of cell k (times R_g T); grooves and steps hold gas too."""
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
def smooth_torque(w, F, L, speed):
    """Friction torque [N m] of a film with a smooth gap at shaft speed `speed` [rad/s]; positive brakes a positive
    speed."""
    drag = w[L.mu] * speed * F.radius
    inside = 0.0
    edges = 0.0
    for i in range(L.n_theta):
        line = L.first + i * L.stride
        for j in range(L.n_rows):
            k = line + j
            slope = (w[L.p + k + L.stride] - w[L.p + k - L.stride]) / (2.0 * F.dy)
            gap = shear_gap(w[L.h + k], slip_length(w, L, w[L.p + k]))
            inside += w[L.weight + k] * (drag / gap + 0.5 * w[L.h + k] * slope)
        # the edges carry half a cell of Couette drag on either side
        slip = slip_length(w, L, F.pa)
        upper = shear_gap(w[L.h + line + L.n_rows], slip)
        lower = upper if L.half == 1 else shear_gap(w[L.h + line - 1], slip)
        edges += 0.5 * drag * (1.0 / upper + 1.0 / lower)
    return F.radius * F.dy * F.dz * (inside * (1.0 + L.half) + edges)
