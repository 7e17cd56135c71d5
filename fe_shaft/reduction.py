r"""Modal reduction of the rotor to a few modes per plane, for time simulation with a gas film.

The modes are those of the undamped rotor at rest, held at the gas bearings by extra isotropic springs of about
the films' stiffness k, so that the few kept modes already bend as the supported shaft does; the springs are
then taken out again:

.. math:: (K_p + k\, e e')\,\phi_i = \omega_i^2 M_p \phi_i, \quad
          \phi_i' M_p \phi_j = \delta_{ij}, \quad q = \Phi \eta

.. math:: \ddot\eta + \left(\Phi' C \Phi + \mathrm{diag}(2\zeta\omega_i) + \Omega\,\Phi' G \Phi\right)\dot\eta
          + \Phi' K \Phi\, \eta = \Phi' f

with K_p, M_p the blocks of plane p, (x, beta) or (y, alpha).  What couples the planes (gyroscopics,
cross-coupled bearings) stays in the reduced matrices.

Source: modes with a loaded interface after Benfield & Hruda, AIAA J. 9 (1971) 1255.
Assumes: modal damping zeta of the shaft; modes at rest span the whirl at speed.

Cites: benfield_1971.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from fe_shaft.checks import ShaftError
from fe_shaft.rotor import Rotor
from fe_shaft.static import rigid_motions

Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ReducedRotor:
    """Rotor in modal coordinates eta (2n,): n of the x plane, then n of the y plane; the mass matrix is I.

    Attributes
    ----------
    Phi : ndarray (ndof, 2n)
        Mass-normalised modes [kg^-1/2 and kg^-1/2/m].
    K : ndarray (2n, 2n)
        Stiffness without the nominal spring [1/s2].
    C : ndarray (2n, 2n)
        Damping of the bearings and of the modes [1/s].
    G : ndarray (2n, 2n)
        Gyroscopic matrix [1], to be multiplied by the speed [rad/s].
    frequencies : ndarray (2n,)
        Natural frequencies with the nominal spring [rad/s].
    participation : ndarray (2, 2n)
        Rows Phi' M 1_x and Phi' M 1_y [kg^1/2].
    """

    Phi: Matrix
    K: Matrix
    C: Matrix
    G: Matrix
    frequencies: Matrix
    participation: Matrix

    def shape(self, position_node: int) -> Matrix:
        """Modes at a node (2, 2n) [kg^-1/2]: (x, y) = shape @ eta, and shape.T @ force is the modal force."""
        if not 0 <= 4 * position_node < len(self.Phi):
            raise ShaftError(f"reduced rotor: node {position_node} is not among 0 to {len(self.Phi) // 4 - 1}.")
        return self.Phi[4 * position_node : 4 * position_node + 2]

    def body(self) -> Matrix:
        """Participation of the modes in x and y (2, 2n) [kg^1/2]; gravity g along -y acts as -g * row 1."""
        return self.participation


def modal_reduction(rotor: Rotor, springs: Mapping[int, float], n_modes: int, damping_ratio: float) -> ReducedRotor:
    """Reduce `rotor` to `n_modes` modes of each plane.

    Parameters
    ----------
    rotor : Rotor
        Its linear bearings stay part of it.
    springs : mapping of int to float
        Nominal stiffness [N/m] of every gas bearing by its node; empty for a rotor on its linear bearings alone.
    n_modes : int
        Modes kept in each plane.
    damping_ratio : float
        Modal damping of the shaft [1].

    Raises
    ------
    ShaftError
        If a node is not on the shaft or the planes have not `n_modes` modes.

    Examples
    --------
    >>> import fe_shaft
    >>> fe_shaft.modal_reduction(rotor, {6: 4e6}, n_modes=4, damping_ratio=0.01).K.shape
    (8, 8)
    """
    _check(rotor, springs, n_modes)
    M, K, C, G = rotor.M(), rotor.K(), rotor.C(), rotor.G()
    held = K.copy()
    for node, stiffness in springs.items():
        held[4 * node : 4 * node + 2, 4 * node : 4 * node + 2] += stiffness * np.eye(2)
    planes = [_plane_modes(M, held, rotor.layout.axes, dofs, n_modes) for dofs in ((0, 3), (1, 2))]
    omega, Phi = (np.concatenate(parts, axis=-1) for parts in zip(*planes, strict=True))
    modal_damping = np.diag(2 * damping_ratio * omega)
    shifts = rigid_motions(rotor)[:, :2].T
    return ReducedRotor(Phi, Phi.T @ K @ Phi, Phi.T @ C @ Phi + modal_damping, Phi.T @ G @ Phi, omega, shifts @ M @ Phi)


def _plane_modes(
    M: Matrix, K: Matrix, axes: NDArray[np.intp], dofs: tuple[int, int], n_modes: int
) -> tuple[Matrix, Matrix]:
    """Frequencies (n_modes,) [rad/s] and mass-normalised modes (ndof, n_modes) of one plane."""
    plane = np.flatnonzero(np.isin(axes, dofs))
    block = np.ix_(plane, plane)
    squares, vectors = eigh(K[block], M[block], subset_by_index=(0, n_modes - 1))
    Phi = np.zeros((len(M), n_modes))
    Phi[plane] = vectors
    return np.sqrt(np.clip(squares, 0, None)), Phi * _signs(Phi[axes == dofs[0]])


def _signs(deflection: Matrix) -> Matrix:
    """Make the first node that moves at least half as far as the farthest one move in the positive direction.

    The farthest node itself would not do: rounding chooses it in an antisymmetric mode.
    """
    size = np.abs(deflection)
    first = (size >= 0.5 * size.max(axis=0)).argmax(axis=0)
    return np.where(deflection[first, np.arange(deflection.shape[1])] < 0, -1.0, 1.0)


def _check(rotor: Rotor, nodes: Iterable[int], n_modes: int) -> None:
    for node in nodes:
        if not 0 <= node < rotor.n_nodes:
            last = rotor.n_nodes - 1
            raise ShaftError(f"reduction: node {node}, but the shaft has nodes 0 to {last}; choose another.")
    if not 1 <= n_modes <= 2 * rotor.n_nodes:
        raise ShaftError(
            f"reduction: {n_modes} modes a plane, but {rotor.n_nodes} nodes have 1 to {2 * rotor.n_nodes}; "
            "keep fewer or use more elements."
        )
