r"""Answers of the rotor to constant and to rotating forces.

.. math:: K q = -g M 1_y, \qquad
          \left(K(\Omega) + i\Omega (C(\Omega) + \Omega G) - \Omega^2 M\right) \hat q = \hat f, \qquad
          \hat f_x = m e\, \Omega^2 e^{i\varphi}, \quad \hat f_y = -i \hat f_x

with q = Re(q_hat exp(i Omega t)), so that the unbalance m e turns forward, from x to y, with the
shaft.
Source: Friswell et al. (2010), chapter 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from fe_shaft.rotor import Rotor

GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s2], along -y."""


@dataclass(frozen=True, eq=False)
class StaticResult:
    """Rest position under gravity.

    Attributes
    ----------
    displacement : ndarray (ndof,)
        x, y [m], alpha, beta [rad] of each node.
    bearing_forces : ndarray (n_bearings, 2)
        Force (x, y) of each bearing ON the shaft [N], in the order of rotor.bearing_elements.
    """

    displacement: NDArray[np.float64]
    bearing_forces: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class UnbalanceResult:
    """Steady whirl forced by unbalance.

    Attributes
    ----------
    frequency : ndarray (n_freq,)
        Speed of the shaft [rad/s].
    response : ndarray (ndof, n_freq) complex
        Amplitudes [m, rad]; the motion is Re(response exp(i frequency t)).
    """

    frequency: NDArray[np.float64]
    response: NDArray[np.complex128]


def run_static(rotor: Rotor, gravity: float = GRAVITY) -> StaticResult:
    """Sag of `rotor` at rest under `gravity` [m/s2] along -y.

    Raises
    ------
    ValueError
        If the bearings leave the rotor free to move as a rigid body.
    """
    _check_supported(rotor)
    down = np.zeros(rotor.ndof)
    down[1 :: rotor.number_dof] = -gravity
    q = np.linalg.solve(rotor.K(), rotor.M() @ down)
    forces = [-bearing.stiffness @ q[4 * bearing.n : 4 * bearing.n + 2] for bearing in rotor.bearing_elements]
    return StaticResult(np.asarray(q, dtype=np.float64), np.array(forces))


def run_unbalance_response(
    rotor: Rotor, node: int | Sequence[int], magnitude: ArrayLike, phase: ArrayLike, frequency: ArrayLike
) -> UnbalanceResult:
    """Whirl of `rotor` with unbalance at one node or at several.

    Parameters
    ----------
    rotor : Rotor
    node : int or sequence of int (n_u,)
    magnitude : float or array (n_u,)
        Mass times eccentricity [kg m].
    phase : float or array (n_u,)
        Angle of the unbalance from x towards y at t = 0 [rad].
    frequency : float or array (n_freq,)
        Speed of the shaft [rad/s].

    Raises
    ------
    ValueError
        If a node is not on the shaft.
    """
    frequency = np.atleast_1d(np.asarray(frequency, dtype=float))
    unbalance = _unbalance_vector(rotor, node, magnitude, phase)
    M, G = rotor.M(), rotor.G()
    response = np.empty((rotor.ndof, len(frequency)), dtype=complex)
    for i, w in enumerate(frequency):
        Z = rotor.K(w) - w**2 * M + 1j * w * (rotor.C(w) + w * G)
        response[:, i] = np.linalg.solve(Z, w**2 * unbalance)
    return UnbalanceResult(frequency, response)


def _unbalance_vector(
    rotor: Rotor, node: int | Sequence[int], magnitude: ArrayLike, phase: ArrayLike
) -> NDArray[np.complex128]:
    """Complex m e of every degree of freedom (ndof,) [kg m]."""
    vector = np.zeros(rotor.ndof, dtype=complex)
    for n, me, angle in np.broadcast(np.atleast_1d(node), magnitude, phase):
        if not 0 <= n < rotor.n_nodes:
            raise ValueError(f"unbalance at node {n}, but the shaft has nodes 0 to {rotor.n_nodes - 1}; move it.")
        vector[4 * n : 4 * n + 2] += me * np.exp(1j * angle) * np.array([1, -1j])
    return vector


def _check_supported(rotor: Rotor) -> None:
    """The bearings alone must resist the four rigid-body motions: two shifts and two tilts."""
    stiffness = np.zeros((4, 4))
    for bearing in rotor.bearing_elements:
        lever = rotor.nodes_pos[bearing.n] / rotor.nodes_pos[-1]
        motion = np.hstack([np.eye(2), lever * np.eye(2)])
        stiffness += motion.T @ bearing.stiffness @ motion
    if np.linalg.matrix_rank(stiffness) < 4:
        raise ValueError(
            f"static: {len(rotor.bearing_elements)} bearing(s) leave the shaft free to fall or tilt; "
            "support x and y at two nodes at least."
        )
