r"""Modal reduction of the rotor to a few modes per plane, for time simulation with a gas film.

The modes are those of the undamped rotor at rest, held at the gas bearings by extra isotropic springs of about
the films' stiffness k, so that the few kept modes already bend as the supported shaft does; the springs are
then taken out again:

.. math:: (K_p + k\, e e')\,\phi_i = \omega_i^2 M_p \phi_i, \quad
          \phi_i' M_p \phi_j = \delta_{ij}, \quad q = \Phi \eta

.. math:: \ddot\eta + \left(\Phi' C \Phi + \mathrm{diag}(2\zeta\omega_i) + \Omega\,\Phi' G \Phi\right)\dot\eta
          + \Phi' K \Phi\, \eta = \Phi' f

with K_p, M_p the blocks of plane p, (x, beta) or (y, alpha). Pedestals (point masses that carry a bearing) are part of
the rotor and of its modes.  What couples the planes (gyroscopics,
cross-coupled bearings) stays in the reduced matrices.

Source: modes with a loaded interface after Benfield & Hruda, AIAA J. 9 (1971) 1255.
Assumes: modal damping zeta of the shaft; modes at rest span the whirl at speed.

Cites: benfield_1971.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from fe_shaft.assembly import AssembledRotor, rigid_motions
from fe_shaft.shaft import ShaftError

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
        Rows Phi' M 1_x and Phi' M 1_y [kg^1/2] of shaft and discs, without pedestals.
    modal_damping : ndarray (2n, 2n)
        What the shaft's damping ratio has in C [1/s].
    """

    Phi: Matrix
    K: Matrix
    C: Matrix
    G: Matrix
    frequencies: Matrix
    participation: Matrix
    modal_damping: Matrix

    def shape(self, position_node: int) -> Matrix:
        """Modes at a node (2, 2n) [kg^-1/2]: (x, y) = shape @ eta, and shape.T @ force is the modal force."""
        if not 0 <= 4 * position_node < len(self.Phi):
            raise ShaftError(f"reduced rotor: node {position_node} is not among 0 to {len(self.Phi) // 4 - 1}.")
        return self.Phi[4 * position_node : 4 * position_node + 2]

    def body(self) -> Matrix:
        """Participation of the modes in x and y (2, 2n) [kg^1/2]; gravity g along -y acts as -g * row 1."""
        return self.participation


def modal_reduction(
    rotor: AssembledRotor, springs: Mapping[int, float], n_modes: int, damping_ratio: float
) -> ReducedRotor:
    """Reduce `rotor` to `n_modes` modes of each plane.

    Parameters
    ----------
    rotor : AssembledRotor
        Its linear bearings and pedestals stay part of it.
    springs : mapping of int to float
        Nominal stiffness [N/m] of every gas bearing by its node; empty for a rotor on its linear bearings alone. Where
        the rotor has a bearing on a pedestal at that node, it acts between the two.
    n_modes : int
        Modes kept in each plane.
    damping_ratio : float
        Modal damping of the shaft [1].

    Raises
    ------
    ShaftError
        If a node is not on the shaft, the planes have not `n_modes` modes, or the shaft has damping in the turning
        frame, which the reduced matrices at rest do not show.

    Examples
    --------
    >>> import fe_shaft
    >>> fe_shaft.modal_reduction(rotor, {6: 4e6}, n_modes=4, damping_ratio=0.01).K.shape
    (8, 8)
    """
    _check(rotor, springs, n_modes)
    M, K, C, G = rotor.M(), rotor.K(), rotor.C(), rotor.G()
    held = add_springs(K, rotor, springs)
    planes = [_plane_modes(M, held, rotor.layout.axes, dofs, n_modes) for dofs in ((0, 3), (1, 2))]
    omega, Phi = (np.concatenate(parts, axis=-1) for parts in zip(*planes, strict=True))
    modal_damping = np.diag(2 * damping_ratio * omega)
    if rotor.layout.pedestals and damping_ratio:
        modal_damping = _shaft_damping(rotor, springs, n_modes, damping_ratio, M, Phi)
    shifts = rigid_motions(rotor)[:, :2].T
    C, G = Phi.T @ C @ Phi + modal_damping, Phi.T @ G @ Phi
    return ReducedRotor(Phi, Phi.T @ K @ Phi, C, G, omega, shifts @ M @ Phi, modal_damping)


def _shaft_damping(
    rotor: AssembledRotor, springs: Mapping[int, float], n_modes: int, damping_ratio: float, M: Matrix, Phi: Matrix
) -> Matrix:
    """Modal damping of the shaft on pedestals at rest, in the modes Phi: pedestals have dampers of their own."""
    n = 4 * rotor.n_nodes
    held = [replace(b, n_link=None) for b in rotor.bearing_elements if b.n < rotor.n_nodes]
    masses = [m for m in rotor.point_mass_elements if m.n < rotor.n_nodes]
    shaft = replace(rotor, bearing_elements=held, point_mass_elements=masses)
    own = modal_reduction(shaft, springs, min(n_modes, 2 * rotor.n_nodes), damping_ratio)
    P = own.Phi[:n].T @ M[:n, :n] @ Phi[:n]
    return P.T @ own.modal_damping @ P


def add_springs(K: Matrix, rotor: AssembledRotor, springs: Mapping[int, float]) -> Matrix:
    """A stiffness matrix (ndof, ndof) of `rotor` with isotropic springs [N/m] at nodes, against their pedestals."""
    total = K.copy()
    links = {b.n: b.n_link for b in rotor.bearing_elements}
    for node, stiffness in springs.items():
        own, link = 4 * node, links.get(node)
        block = stiffness * np.eye(2)
        total[own : own + 2, own : own + 2] += block
        if link is not None:
            other = rotor.layout.place(link)
            total[other : other + 2, other : other + 2] += block
            total[own : own + 2, other : other + 2] -= block
            total[other : other + 2, own : own + 2] -= block
    return total


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


def _check(rotor: AssembledRotor, nodes: Iterable[int], n_modes: int) -> None:
    turning = next((name for name in ("eta_v", "eta_h") if any(getattr(e, name) for e in rotor.shaft_elements)), None)
    if turning:
        raise ShaftError(
            f"reduction: the shaft has {turning}, turning damping, which reduced matrices lack; leave it out."
        )
    for node in nodes:
        if not 0 <= node < rotor.n_nodes:
            last = rotor.n_nodes - 1
            raise ShaftError(f"reduction: node {node}, but the shaft has nodes 0 to {last}; choose another.")
    most = 2 * rotor.n_nodes + len(rotor.layout.pedestals)
    if not 1 <= n_modes <= most:
        raise ShaftError(
            f"reduction: {n_modes} modes a plane, but {rotor.n_nodes} nodes have 1 to {most}; "
            "keep fewer or use more elements."
        )
