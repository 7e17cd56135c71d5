r"""Matrices of one Timoshenko shaft element and of one rigid disc.

The frame: z along the shaft, x horizontal, y vertical.  A node carries x, y [m] and alpha, beta [rad], the
right-handed rotations about the x and the y axis.  The spin and whirl are positive from x to y, that is
right-handed about z.  Small angles of an unsheared shaft (d/dz written '):

.. math:: x' = \beta, \qquad y' = -\alpha

so that with (theta_x, theta_y) = (beta, -alpha) both planes share one set of shape functions.  These solve
the static beam exactly, hence static answers are exact at the nodes (xi = z/L,
Phi = 12 E I / (kappa G A L^2)):

.. math:: N = \frac{1}{1+\Phi}\begin{bmatrix} 1 - 3\xi^2 + 2\xi^3 + \Phi(1-\xi) \\
          L(\xi - 2\xi^2 + \xi^3 + \tfrac{\Phi}{2}(\xi - \xi^2)) \\ 3\xi^2 - 2\xi^3 + \Phi\xi \\
          L(\xi^3 - \xi^2 - \tfrac{\Phi}{2}(\xi - \xi^2)) \end{bmatrix}, \quad
          \psi = \frac{1}{1+\Phi}\begin{bmatrix} 6(\xi^2 - \xi)/L \\ 1 - 4\xi + 3\xi^2 + \Phi(1-\xi) \\
          6(\xi - \xi^2)/L \\ 3\xi^2 - 2\xi + \Phi\xi \end{bmatrix}

The gyroscopic moment on a slice of polar inertia dI_p is that of the disc,
M_x = -Omega dI_p d(beta)/dt, M_y = +Omega dI_p d(alpha)/dt.

Source: Nelson & McVaugh, J. Eng. Ind. 98 (1976) 593; Nelson, J. Mech. Design 102 (1980) 793; Friswell et
al. (2010), chapter 5; shear coefficient after Cowper, J. Appl. Mech. 33 (1966) 335.
Assumes: small deflections, no torsion or axial force, no internal damping.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fe_shaft.shaft import DiskElement, ShaftElement

Matrix = NDArray[np.float64]

# Places among the element's x1, y1, alpha1, beta1, x2, y2, alpha2, beta2.
X_PLANE = np.array([0, 3, 4, 7])  # x1, beta1, x2, beta2
Y_PLANE = np.array([1, 2, 5, 6])  # y1, alpha1, y2, alpha2
_FLIP = np.array([1.0, -1.0, 1.0, -1.0])  # theta_y = -alpha

# Four points are exact to degree 7; the highest integrand, N^2, has degree 6.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_XI = (_POINTS + 1) / 2
_ROOT_WEIGHT = np.sqrt(_WEIGHTS / 2)[:, None]


def shear_coefficient(Poisson: float, diameter_ratio: float = 0.0) -> float:
    """Cowper's kappa [1] of a circular section; `diameter_ratio` is inner over outer diameter [1].

    A solid section gives 6 (1 + nu) / (7 + 6 nu).
    """
    r = diameter_ratio**2
    hollow = (1 + r) ** 2
    return 6 * (1 + Poisson) * hollow / ((7 + 6 * Poisson) * hollow + (20 + 12 * Poisson) * r)


def shear_parameter(element: ShaftElement) -> float:
    """Phi = 12 E I / (kappa G A L^2) [1]; 0 when the element has no shear effects."""
    if not element.shear_effects:
        return 0.0
    material = element.material
    kappa = shear_coefficient(material.Poisson, element.idl / element.odl)
    return 12 * material.E * element.second_moment / (kappa * material.G_s * element.area * element.L**2)


def stiffness_matrix(element: ShaftElement) -> Matrix:
    """Stiffness (8, 8) [N/m, N, N m] of bending and shear."""
    L, Phi = element.L, shear_parameter(element)
    a, b, c = 6 * L, (4 + Phi) * L**2, (2 - Phi) * L**2
    plane = np.array([[12, a, -12, a], [a, b, -a, c], [-12, -a, 12, -a], [a, c, -a, b]])
    return _both_planes(element.material.E * element.second_moment / ((1 + Phi) * L**3) * plane)


def mass_matrix(element: ShaftElement) -> Matrix:
    """Consistent mass (8, 8) [kg, kg m, kg m2]: translation, and rotary inertia if the element has it."""
    plane = element.mass * _gram(_deflection_shapes(element))
    if element.rotary_inertia:
        plane = plane + _rotary_matrix(element)
    return _both_planes(plane)


def gyroscopic_matrix(element: ShaftElement) -> Matrix:
    """Gyroscopic matrix (8, 8) [kg, kg m, kg m2], skew-symmetric, to be multiplied by the speed [rad/s]."""
    G = np.zeros((8, 8))
    if element.gyroscopic:
        # The polar moment of a round section is twice the diametral.
        coupling = 2 * _rotary_matrix(element) * _FLIP
        G[np.ix_(X_PLANE, Y_PLANE)] = coupling
        G[np.ix_(Y_PLANE, X_PLANE)] = -coupling.T
    return G


def disk_mass_matrix(disk: DiskElement) -> Matrix:
    """Mass (4, 4) [kg, kg m2] of a rigid disc."""
    return np.diag([disk.m, disk.m, disk.Id, disk.Id]).astype(float)


def disk_gyroscopic_matrix(disk: DiskElement) -> Matrix:
    """Gyroscopic matrix (4, 4) [kg m2] of a rigid disc, to be multiplied by the speed [rad/s]."""
    G = np.zeros((4, 4))
    G[2, 3], G[3, 2] = disk.Ip, -disk.Ip
    return G


def _both_planes(plane: Matrix) -> Matrix:
    full = np.zeros((8, 8))
    full[np.ix_(X_PLANE, X_PLANE)] = plane
    full[np.ix_(Y_PLANE, Y_PLANE)] = plane * np.outer(_FLIP, _FLIP)
    return full


def _rotary_matrix(element: ShaftElement) -> Matrix:
    inertia = element.material.rho * element.second_moment * element.L
    return inertia * _gram(_rotation_shapes(element))


def _gram(shapes: Matrix) -> Matrix:
    """Mean over the element of shapes_i * shapes_j; A.T @ A keeps it symmetric to the last bit."""
    root = _ROOT_WEIGHT * shapes
    return root.T @ root


def _deflection_shapes(element: ShaftElement) -> Matrix:
    """N at the quadrature points, (4, 4): point, shape."""
    L, Phi, x = element.L, shear_parameter(element), _XI
    left = 1 - 3 * x**2 + 2 * x**3 + Phi * (1 - x)
    left_tilt = L * (x - 2 * x**2 + x**3 + Phi / 2 * (x - x**2))
    right = 3 * x**2 - 2 * x**3 + Phi * x
    right_tilt = L * (x**3 - x**2 - Phi / 2 * (x - x**2))
    return np.column_stack([left, left_tilt, right, right_tilt]) / (1 + Phi)


def _rotation_shapes(element: ShaftElement) -> Matrix:
    """Psi at the quadrature points, (4, 4): point, shape."""
    L, Phi, x = element.L, shear_parameter(element), _XI
    bow = 6 * (x**2 - x) / L
    left_tilt = 1 - 4 * x + 3 * x**2 + Phi * (1 - x)
    right_tilt = 3 * x**2 - 2 * x + Phi * x
    return np.column_stack([bow, left_tilt, -bow, right_tilt]) / (1 + Phi)
