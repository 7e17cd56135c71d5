r"""Bump foil under the film: an elastic foundation with a loss factor.

.. math:: \tau\,\dot w + w = \frac{p - p_a}{k}, \qquad h = c + w - X\cos\theta - Y\sin\theta, \qquad
          \tau = \frac{\eta}{\omega_\eta}

w [m] is the deflection of the foil at every node, k its stiffness per area [Pa/m] and eta the loss factor, which this
first-order foundation has at the frequency omega_eta. Bumps do not pull on each other. The deflection at the end of an
implicit stage follows from the pressure there, so that it is no unknown of its own: the film's Jacobian contains it.

Cites: heshmat_1983.
"""

from __future__ import annotations

from reynolds.jit import inlined


@inlined
def bend_foil(w, F, L, iadt):
    """Deflection of the foil [m] under the present pressure at the end of a stage; iadt = 0 is at rest."""
    past = F.bend_time * iadt
    inverse = 1.0 / (1.0 + past)
    for k in range(L.length):
        w[L.bend + k] = (w[L.soft + k] * (w[L.p + k] - F.pa) + past * w[L.bend_rhs + k]) * inverse


@inlined
def rest_foil(w, L):
    """Take the present deflection as one at rest."""
    for k in range(L.length):
        w[L.bend_old + k] = w[L.bend + k]
        w[L.bend_rate + k] = 0.0
