r"""Closed-form rotordynamic solutions that verify the finite elements.

Pinned-pinned uniform shaft, k = n pi / L, forward circular whirl at w (backward: w < 0):

.. math:: (\kappa G A k^2 - \rho A w^2)(E I k^2 + \kappa G A - \rho I w^2 + 2\rho I \Omega w)
          = (\kappa G A k)^2

Massless cantilever with an overhung disc at its end (Stodola):

.. math:: \det\left(E I \begin{bmatrix} 12/L^3 & -6/L^2 \\ -6/L^2 & 4/L \end{bmatrix}
          + \begin{bmatrix} -m w^2 & 0 \\ 0 & I_p \Omega w - I_d w^2 \end{bmatrix}\right) = 0

Source: Friswell et al. (2010), chapters 3 and 5; Timoshenko, Vibration Problems in Engineering (1937).

Cites: friswell_2010, timoshenko_1937.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from fe_shaft.elements import shear_coefficient
from fe_shaft.shaft import Material, ShaftElement


@dataclass(frozen=True)
class WhirlPair:
    """Backward and forward natural frequencies of the same mode, both positive [rad/s]."""

    backward: float
    forward: float


def euler_pinned_frequency(L: float, diameter: float, material: Material, mode: int) -> float:
    """Frequency [rad/s] of mode 1, 2, .. of a solid pinned-pinned Euler shaft at rest; lengths in m."""
    section = ShaftElement(L, 0.0, diameter, material=material)
    k = mode * np.pi / L
    return float(k**2 * np.sqrt(material.E * section.second_moment / (material.rho * section.area)))


def timoshenko_pinned_frequencies(
    L: float, diameter: float, material: Material, mode: int, speed: float = 0.0
) -> WhirlPair:
    """Frequencies of bending mode 1, 2, .. of a solid pinned-pinned Timoshenko shaft at `speed` [rad/s]."""
    return layered_pinned_frequencies([ShaftElement(L, 0.0, diameter, material=material)], mode, speed)


def layered_pinned_frequencies(layers: Sequence[ShaftElement], mode: int, speed: float = 0.0) -> WhirlPair:
    """Frequencies of bending mode 1, 2, .. of a pinned-pinned shaft of bonded cylinders at `speed` [rad/s].

    Bending and shear stiffness, mass and rotary inertia of the section are sums over the layers.
    """
    k = mode * np.pi / layers[0].L
    stiff = [one for one in layers if one.stiff]
    shear = sum(shear_coefficient(e.material.Poisson, e.idl / e.odl) * e.material.G_s * e.area for e in stiff)
    inertia = sum(e.material.rho * e.second_moment for e in layers)
    deflection = Polynomial([shear * k**2, 0, -sum(e.material.rho * e.area for e in layers)])
    bending = sum(e.material.E * e.second_moment for e in stiff) * k**2
    rotation = Polynomial([bending + shear, 2 * inertia * speed, -inertia])
    return _lowest(deflection * rotation - (shear * k) ** 2)[0]


def overhung_disc_frequencies(
    L: float, diameter: float, E: float, m: float, Id: float, Ip: float, speed: float = 0.0, arm: float = 0.0
) -> tuple[WhirlPair, WhirlPair]:
    """Both modes of a disc (m [kg], Id, Ip [kg m2]) on a massless solid cantilever at `speed` [rad/s].

    Its centre of gravity stands on a rigid arm [m] beyond the end.
    """
    EI = E * np.pi * diameter**4 / 64
    deflection = Polynomial([12 * EI / L**3, 0, -m])
    rotation = Polynomial([4 * EI / L, Ip * speed, -(Id + m * arm**2)])
    both = Polynomial([-6 * EI / L**2, 0, -m * arm])
    first, second = _lowest(deflection * rotation - both**2)
    return first, second


def jeffcott_stiffness(L: float, diameter: float, E: float) -> float:
    """Stiffness 48 E I / L^3 [N/m] of a solid simply supported Euler shaft at its middle."""
    return float(48 * E * np.pi * diameter**4 / 64 / L**3)


def jeffcott_unbalance(k: float, m: float, c: float, unbalance: float, w: ArrayLike) -> NDArray[np.complex128]:
    """Whirl amplitude U w^2 / (k - m w^2 + i c w) [m].

    Stiffness `k` [N/m], mass `m` [kg], damping `c` [N s/m], `unbalance` U [kg m], speeds `w` (n,) [rad/s].
    """
    w = np.asarray(w, dtype=float)
    return np.asarray(unbalance * w**2 / (k - m * w**2 + 1j * c * w))


def pinned_sag(L: float, diameter: float, material: Material, gravity: float) -> float:
    """Sag [m] in the middle of a solid simply supported shaft under its weight w [N/m].

    5 w L^4 / (384 E I) of bending, and w L^2 / (8 kappa G A) of shear; `gravity` in m/s2.
    """
    section = ShaftElement(L, 0.0, diameter, material=material)
    load = material.rho * section.area * gravity
    shear = shear_coefficient(material.Poisson) * material.G_s * section.area
    return float(5 * load * L**4 / (384 * material.E * section.second_moment) + load * L**2 / (8 * shear))


def _lowest(determinant: Polynomial) -> tuple[WhirlPair, ...]:
    """The real roots by ascending size: negative ones whirl backward, positive ones forward."""
    roots = np.sort(determinant.roots().real)
    backward, forward = -roots[roots < 0][::-1], roots[roots > 0]
    return tuple(WhirlPair(float(b), float(f)) for b, f in zip(backward, forward, strict=True))
