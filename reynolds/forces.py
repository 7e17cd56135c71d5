r"""Friction torque of the film on the journal.

.. math:: M = \int R \left(\frac{\mu U}{h} + \frac{h}{2}\,\partial_y p\right) \mathrm dA

against the rotation: Couette drag plus the pressure-driven part. Source: Hamrock (2004), section 8.5.

Cites: hamrock_2004.
"""

from __future__ import annotations

from reynolds.jit import inlined


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
