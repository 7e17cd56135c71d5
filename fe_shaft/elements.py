r"""Matrices of one Timoshenko shaft element and of the masses on a node.

The frame: z along the shaft, x horizontal, y vertical.  A node carries x, y [m] and alpha, beta [rad], the
right-handed rotations about the x and the y axis.  The spin and whirl are positive from x to y, that is
right-handed about z.  Small angles of an unsheared shaft (d/dz written '):

.. math:: x' = \beta, \qquad y' = -\alpha

so that with (theta_x, theta_y) = (beta, -alpha) both planes share one set of shape functions.

.. math:: M_{ij} = \int \rho A v_i v_j + \rho I \theta_i \theta_j, \quad
          K_{ij} = \int E I \theta_i' \theta_j' + \kappa G A \gamma_i \gamma_j + F v_i' v_j'

The gyroscopic moment on a slice of polar inertia dI_p is that of the disc,
M_x = -Omega dI_p d(beta)/dt, M_y = +Omega dI_p d(alpha)/dt.

A torque T, whose direction stays that of z, adds the moment T (x', y') to the bending moment; with w = x + i y this
is the term -i T integral of w_j' times conj(w_i''). It couples the planes and is not symmetric.

Damping in the turning frame acts on the velocity relative to it, dq/dt - Omega e_z x q: with loss eta of the
stiffness K the force -eta K dq/dt is joined by the circulatory one -Omega eta N q, N = -K (e_z x). A hysteretic
material of loss factor eta_h loses the same in a cycle of any frequency: where w = x + i y whirls as exp(i omega t), it
is strained at omega - Omega, and its stiffness is

.. math:: K\,(1 + i\,\eta_h\,\mathrm{sgn}(\omega - \Omega))

Whirl that overtakes the shaft is damped, whirl that the shaft overtakes is driven, and synchronous whirl, a constant
strain, is neither. For the two whirls +omega and -omega of a motion together, with s the two signs, this is a damping
eta_h K (s_+ - s_-) / (2 omega) and a circulatory stiffness -eta_h N (s_+ + s_-) / 2: all damping below Omega = omega,
all circulatory above. It has no law in time.

The shape functions in one plane, of a cylinder or a cone, are exact for static end loads. With bending moment M = E I
\theta', shear force V = \kappa G A (v' - \theta), a load p and a moment m per length,

.. math:: V = V_0 - p z, \qquad M = M_0 - V_0 z - m z + p z^2/2, \qquad
          \theta = \theta_0 + \int \frac{M}{EI}, \qquad v = v_0 + \int \theta + \frac{V}{\kappa G A}

The four static shapes have p = m = 0 and unit displacement of one end; V_0 and M_0 follow from the ends. The two
internal shapes are the answers of the element with held ends to a uniform load and to a uniform moment, which are the
leading inertia forces: with them the frequency error is of fourth order in L instead of second. They are orthogonal to
the static shapes in the stiffness, so that static condensation would throw away all they bring; they stay as the four
coordinates of an internal node.

Source: Timoshenko, Vibration Problems in Engineering (1937); Nelson & McVaugh, J. Eng. Ind. 98 (1976) 593; Nelson, J.
Mech. Design 102 (1980) 793; Zorzi & Nelson, J. Eng. Power 99 (1977) 71 (viscous internal damping) and J. Mech. Design
102 (1980) 158 (torque); Genta, J. Vib. Acoust. 126 (2004) 459 (hysteretic damping); Friswell et al. (2010), chapter 5;
Cowper, J. Appl. Mech. 33 (1966) 335 (shear coefficient); the rest of the shapes is beam theory.
Assumes: small deflections, no torsion.

Cites: cowper_1966, friswell_2010, genta_2004, nelson_1976, nelson_1980, timoshenko_1937, zorzi_1977, zorzi_1980.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fe_shaft.shaft import DiskElement, ShaftElement

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


# Places among x, y, alpha, beta of the left, the right and the internal node.
X_PLANE = np.array([0, 3, 4, 7, 8, 11])
Y_PLANE = np.array([1, 2, 5, 6, 9, 10])
_FLIP = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # theta_y = -alpha


@lru_cache(maxsize=4096)
def _parts(element: ShaftElement) -> tuple[GaussSection, Shapes]:
    cut = section(element)
    return cut, shapes(element, cut)


def size(element: ShaftElement) -> int:
    """Number of the element's degrees of freedom: 8, with internal ones 12."""
    return 12 if element.internal else 8


@lru_cache(maxsize=4096)
def stiffness_matrix(element: ShaftElement) -> Matrix:
    """Stiffness (8, 8) or (12, 12) [N/m, N, N m] of bending, shear and tension; not to be written into."""
    plane = _elastic(element)
    if element.axial_force:
        _, shape = _parts(element)
        plane = plane + element.axial_force * element.L * _gram(shape.theta + shape.shear, np.ones(len(WEIGHT)))
    return _both_planes(plane)


def elastic_matrix(element: ShaftElement) -> Matrix:
    """The part of the stiffness (8, 8) or (12, 12) [N/m, N, N m] that the material's damping is a share of."""
    return _both_planes(_elastic(element))


def deflection(layers: Sequence[ShaftElement], z: float) -> Matrix:
    """Rows (2, 8) that give x, y [m] at z [m] from the left end from the ends' x, y [m], alpha, beta [rad].

    By the static shapes, in which the span of one or more layers itself moves: a node put there and condensed out
    again.
    """
    K = np.zeros((12, 12))
    for element in layers:
        outer = element.odl + (element.odr - element.odl) * z / element.L
        inner = element.idl + (element.idr - element.idl) * z / element.L
        left = replace(element, L=z, odr=outer, idr=inner, internal=False, axial_force=0.0)
        right = replace(element, L=element.L - z, odl=outer, idl=inner, internal=False, axial_force=0.0)
        K[:8, :8] += stiffness_matrix(left)
        K[4:, 4:] += stiffness_matrix(right)
    ends = [0, 1, 2, 3, 8, 9, 10, 11]
    return np.asarray(-np.linalg.solve(K[4:8, 4:8], K[4:8][:, ends])[:2])


def torque_matrix(element: ShaftElement) -> Matrix:
    """Stiffness (8, 8) or (12, 12) [N, N m] per torque [N m]; not symmetric."""
    _, shape = _parts(element)
    coupling = element.L * (shape.curvature * WEIGHT[:, None]).T @ shape.theta * _FLIP[: shape.theta.shape[1]]
    K = np.zeros((size(element), size(element)))
    x, y = _planes(element)
    K[np.ix_(x, y)] = coupling
    K[np.ix_(y, x)] = -coupling * np.outer(_FLIP, _FLIP)[: len(x), : len(x)]
    return K


@lru_cache(maxsize=4096)
def mass_matrix(element: ShaftElement) -> Matrix:
    """Consistent mass (8, 8) or (12, 12) [kg, kg m, kg m2]: translation, and rotary inertia if the element has it.

    Not to be written into.
    """
    cut, shape = _parts(element)
    plane = element.L * _gram(shape.v, cut.mass)
    if element.rotary_inertia:
        plane = plane + element.L * _gram(shape.theta, cut.inertia)
    return _both_planes(plane)


@lru_cache(maxsize=4096)
def gyroscopic_matrix(element: ShaftElement) -> Matrix:
    """Gyroscopic matrix, skew-symmetric, [kg, kg m, kg m2], by the speed [rad/s]; not to be written into."""
    G = np.zeros((size(element), size(element)))
    if element.gyroscopic:
        cut, shape = _parts(element)
        x, y = _planes(element)
        # The polar moment of a round section is twice the diametral.
        coupling = 2 * element.L * _gram(shape.theta, cut.inertia) * _FLIP[: len(x)]
        G[np.ix_(x, y)] = coupling
        G[np.ix_(y, x)] = -coupling.T
    return _fixed(G)


def circulatory_matrix(element: ShaftElement) -> Matrix:
    """N (8, 8) or (12, 12) [N/m, N, N m], skew-symmetric: -K times the turn by 90 degrees from x to y."""
    quarter = np.kron(np.eye(size(element) // 2), [[0.0, -1.0], [1.0, 0.0]])
    return -elastic_matrix(element) @ quarter


def disk_mass_matrix(disk: DiskElement) -> Matrix:
    """Mass (4, 4) [kg, kg m, kg m2] of a rigid disc, whose centre of gravity moves by x + a beta, y - a alpha."""
    M = np.diag([disk.m, disk.m, disk.Id, disk.Id]).astype(float)
    if disk.offset:
        first = disk.m * disk.offset
        M[[2, 3], [2, 3]] += first * disk.offset
        M[0, 3] = M[3, 0] = first
        M[1, 2] = M[2, 1] = -first
    return M


def disk_gyroscopic_matrix(disk: DiskElement) -> Matrix:
    """Gyroscopic matrix (4, 4) [kg m2] of a rigid disc, to be multiplied by the speed [rad/s]."""
    G = np.zeros((4, 4))
    G[2, 3], G[3, 2] = disk.Ip, -disk.Ip
    return G


def _elastic(element: ShaftElement) -> Matrix:
    cut, shape = _parts(element)
    if not element.stiff:
        return np.zeros((size(element) // 2, size(element) // 2))
    stiff = np.zeros_like(cut.EI)
    np.divide(1.0, cut.shear_flexibility, out=stiff, where=cut.shear_flexibility > 0)
    return element.L * (_gram(shape.curvature, cut.EI) + _gram(shape.shear, stiff))


def _planes(element: ShaftElement) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    n = size(element) // 2
    return X_PLANE[:n], Y_PLANE[:n]


def _both_planes(plane: Matrix) -> Matrix:
    n = len(plane)
    full = np.zeros((2 * n, 2 * n))
    full[np.ix_(X_PLANE[:n], X_PLANE[:n])] = plane
    full[np.ix_(Y_PLANE[:n], Y_PLANE[:n])] = plane * np.outer(_FLIP[:n], _FLIP[:n])
    return _fixed(full)


def _fixed(matrix: Matrix) -> Matrix:
    matrix.flags.writeable = False
    return matrix


def _gram(values: Matrix, weight: Matrix) -> Matrix:
    """Mean over the element of weight * values_i * values_j; A.T @ A keeps it symmetric to the last bit."""
    root = np.sqrt(WEIGHT * weight)[:, None] * values
    return root.T @ root
