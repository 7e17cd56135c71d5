r"""Shape functions of a Timoshenko element in one plane, exact for static end loads; cylinder or cone.

With bending moment M = E I \theta', shear force V = \kappa G A (v' - \theta), a load p and a moment m per length,

.. math:: V = V_0 - p z, \qquad M = M_0 - V_0 z - m z + p z^2/2, \qquad
          \theta = \theta_0 + \int \frac{M}{EI}, \qquad v = v_0 + \int \theta + \frac{V}{\kappa G A}

The four static shapes have p = m = 0 and unit displacement of one end; V_0 and M_0 follow from the ends. The two
internal shapes are the answers of the element with held ends to a uniform load and to a uniform moment, which are the
leading inertia forces: with them the frequency error is of fourth order in L instead of second. They are orthogonal to
the static shapes in the stiffness, so that static condensation would throw away all they bring; they stay as the four
coordinates of an internal node.

Source: Friswell et al. (2010), chapter 5, for the cylinder; the rest is beam theory. Shear coefficient after Cowper,
J. Appl. Mech. 33 (1966) 335.

Cites: cowper_1966, friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fe_shaft.shaft import ShaftElement

Matrix = NDArray[np.float64]

POINTS = 12
"""Gauss points: exact to degree 23; a cone that doubles its diameter is right to 1e-9."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(POINTS)
XI = (_NODES + 1) / 2
WEIGHT = _WEIGHTS / 2


def _running_integral() -> Matrix:
    """Q (n + 1, n): integral from 0 to each point, and to 1, of the polynomial through values at the points."""
    powers = np.arange(POINTS)
    vander = np.polynomial.legendre.legvander(_NODES, POINTS - 1)
    ends = np.append(_NODES, 1.0)
    basis = [np.polynomial.legendre.Legendre.basis(int(k)).integ(lbnd=-1) for k in powers]
    integrals = np.column_stack([b(ends) for b in basis]) / 2
    return np.asarray(integrals @ np.linalg.inv(vander))


RUNNING = _running_integral()


@dataclass(frozen=True, eq=False)
class GaussSection:
    """Stiffness and inertia at the Gauss points (n,): E I [N m2], 1/(kappa G A) [1/N], rho A [kg/m], rho I [kg m]."""

    EI: Matrix
    shear_flexibility: Matrix
    mass: Matrix
    inertia: Matrix


@dataclass(frozen=True, eq=False)
class Shapes:
    """Deflection v, rotation theta, curvature theta' and shear strain at the points, each (n, 4) or (n, 6)."""

    v: Matrix
    theta: Matrix
    curvature: Matrix
    shear: Matrix


def shear_coefficient(Poisson: float, diameter_ratio: float | Matrix = 0.0) -> float | Matrix:
    """Cowper's kappa [1] of a circular section; `diameter_ratio` is inner over outer diameter [1].

    A solid section gives 6 (1 + nu) / (7 + 6 nu).
    """
    r = diameter_ratio**2
    hollow = (1 + r) ** 2
    return 6 * (1 + Poisson) * hollow / ((7 + 6 * Poisson) * hollow + (20 + 12 * Poisson) * r)


def section(element: ShaftElement) -> GaussSection:
    """Section of an element at its Gauss points."""
    material = element.material
    inner = element.idl + XI * (element.idr - element.idl)
    outer = element.odl + XI * (element.odr - element.odl)
    area, second = np.pi / 4 * (outer**2 - inner**2), np.pi / 64 * (outer**4 - inner**4)
    kappa = shear_coefficient(material.Poisson, inner / outer)
    flexibility = 1 / (kappa * material.G_s * area) if element.shear_effects else np.zeros_like(area)
    return GaussSection(material.E * second, flexibility, material.rho * area, material.rho * second)


def shapes(element: ShaftElement, cut: GaussSection) -> Shapes:
    """The static shapes of an element, and its internal ones where it has them."""
    L = element.L
    z = L * XI
    # columns: answers to M_0 = 1, V_0 = 1 and to the two loads, with the left end held
    moment = [np.ones(POINTS), -z]
    shear = [np.zeros(POINTS), np.ones(POINTS)]
    if element.internal:
        # loads of a size that gives the internal shapes the sizes of the static ones
        p, m = 384 * cut.EI.mean() / L**4, 12 * cut.EI.mean() / L**2
        moment += [p * L * z**2 / (2 * L), -m * z]
        shear += [-p * z, np.zeros(POINTS)]
    curvature = np.column_stack(moment) / cut.EI[:, None]
    strain = np.column_stack(shear) * cut.shear_flexibility[:, None]
    theta = L * RUNNING @ curvature
    v = L * RUNNING @ (theta[:-1] + strain)
    amplitudes = _end_forces(L, v[-1], theta[-1])
    rigid_v = np.column_stack([np.ones(POINTS), z, *[np.zeros(POINTS)] * (amplitudes.shape[1] - 2)])
    rigid_theta = np.column_stack([np.zeros(POINTS), np.ones(POINTS), *[np.zeros(POINTS)] * (amplitudes.shape[1] - 2)])
    return Shapes(
        v[:-1] @ amplitudes + rigid_v,
        theta[:-1] @ amplitudes + rigid_theta,
        curvature @ amplitudes,
        strain @ amplitudes,
    )


def _end_forces(L: float, v: Matrix, theta: Matrix) -> Matrix:
    """Amplitudes (2 or 4, 4 or 6) of the columns of `shapes` in each shape."""
    ends = np.stack([v, theta])
    static = np.array([[-1.0, -L, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]])
    basic = np.linalg.solve(ends[:, :2], static)
    if ends.shape[1] == 2:
        return np.asarray(basic)
    held = -np.linalg.solve(ends[:, :2], ends[:, 2:])
    return np.block([[basic, held], [np.zeros((2, 4)), np.eye(2)]])
