r"""Answers of a rotor to steady forces: rest under weight, whirl under unbalance, receptance.

.. math:: \left(K + i\omega (C + \Omega G) - \omega^2 M\right) \hat q = \hat f, \qquad
          \hat f_x = m e\, \Omega^2 e^{i\varphi}, \quad \hat f_y = -i \hat f_x

with q = Re(q_hat exp(i omega t)); an unbalance m e turns forward, from x to y, with the shaft (omega = Omega). At rest,
omega = 0, this is K q = f. The matrix is banded once its rows are put in the order of Cuthill and McKee, so that a
frequency costs microseconds.

Source: Friswell et al. (2010), chapter 6.

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lapack
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from fe_shaft.assembly import AssembledRotor, loose_motions
from fe_shaft.modal import dataset, half_axes
from fe_shaft.shaft import ShaftError, grid

if TYPE_CHECKING:
    import xarray as xr

GRAVITY = 9.80665
"""Standard acceleration of gravity [m/s2], along -y."""


@dataclass(frozen=True, eq=False)
class StaticResult:
    """Rest position.

    Attributes
    ----------
    displacement : ndarray (ndof,)
        x, y [m], alpha, beta [rad] of each node.
    bearing_forces : ndarray (n_bearings, 2)
        Force (x, y) of each bearing ON the shaft [N], in the order of rotor.bearing_elements.
    nodes_pos : ndarray (n_nodes,)
        Positions of the shaft's nodes [m].
    """

    displacement: NDArray[np.float64]
    bearing_forces: NDArray[np.float64]
    nodes_pos: NDArray[np.float64]

    def dataset(self) -> xr.Dataset:
        """Labelled data over node and bearing."""
        nodes = self.displacement[: 4 * len(self.nodes_pos)].reshape(-1, 4)
        names = {"x": ("m", "displacement in x"), "y": ("m", "displacement in y"),
                 "alpha": ("rad", "rotation about x"), "beta": ("rad", "rotation about y")}  # fmt: skip
        values = {name: (("node",), nodes[:, i], *names[name]) for i, name in enumerate(names)}
        force = (("bearing", "axis"), self.bearing_forces, "N", "force of the bearing on the shaft")
        z = (("node",), self.nodes_pos, "m", "position along the shaft")
        return dataset(values | {"bearing_force": force}, {"z": z})


def run_static(rotor: AssembledRotor, gravity: float = GRAVITY, force: ArrayLike | None = None) -> StaticResult:
    """Rest of `rotor` under `gravity` [m/s2] along -y and `force` (ndof,) [N, N m].

    Raises
    ------
    ShaftError
        If the supports leave the rotor free to move as a rigid body; the message names the motions.

    Examples
    --------
    >>> rotor.run_static().bearing_forces[:, 1].round(1).tolist()
    [112.8, 112.8]
    """
    block = np.ix_(rotor.free, rotor.free)
    K = rotor.K()
    if loose := loose_motions(rotor):
        raise ShaftError(
            f"static: {len(rotor.bearing_elements)} bearing(s) leave the shaft free to fall or tilt "
            f"({', '.join(loose)}); support x and y at two nodes at least."
        )
    load = weight(rotor, gravity) + (0.0 if force is None else np.asarray(force, dtype=float))
    q = np.zeros(rotor.ndof)
    q[rotor.free] = np.linalg.solve(K[block], load[rotor.free])
    return StaticResult(
        q, np.array([_reaction(rotor, bearing, q) for bearing in rotor.bearing_elements]), rotor.nodes_pos
    )


def weight(rotor: AssembledRotor, gravity: float = GRAVITY) -> NDArray[np.float64]:
    """Force (ndof,) [N, N m] of the weight of every mass, `gravity` [m/s2] along -y."""
    down = np.where(rotor.layout.axes == 1, -gravity, 0.0)
    down[4 * rotor.n_nodes : 4 * (rotor.n_nodes + len(rotor.layout.internal))] = 0.0
    return np.asarray((rotor.parts.M - rotor.parts.M_bearings) @ down)


def _reaction(rotor: AssembledRotor, bearing, q: NDArray[np.float64]) -> NDArray[np.float64]:  # type: ignore[no-untyped-def]
    own = rotor.layout.place(bearing.n)
    relative = q[own : own + 2].copy()
    if bearing.n_link is not None:
        other = rotor.layout.place(bearing.n_link)
        relative -= q[other : other + 2]
    return np.asarray(-bearing.stiffness_at(0.0) @ relative)


@dataclass(frozen=True, eq=False)
class ForcedResult:
    """Steady whirl forced by unbalance.

    Attributes
    ----------
    frequency : ndarray (n_freq,)
        Speed of the shaft [rad/s].
    response : ndarray (ndof, n_freq) complex
        Amplitudes [m, rad]; the motion is Re(response exp(i frequency t)).
    nodes_pos : ndarray (n_nodes,)
        Positions of the shaft's nodes [m].
    """

    frequency: NDArray[np.float64]
    response: NDArray[np.complex128]
    nodes_pos: NDArray[np.float64]

    def dataset(self) -> xr.Dataset:
        """Labelled data over node and frequency, with the half axes of the orbits."""
        nodes = 4 * len(self.nodes_pos)
        x, y = self.response[0:nodes:4], self.response[1:nodes:4]
        major, minor = half_axes(x, y)
        over = ("node", "frequency")
        return dataset(
            {
                "x": (over, x, "m", "amplitude in x"),
                "y": (over, y, "m", "amplitude in y"),
                "major": (over, major, "m", "major half axis of the orbit"),
                "minor": (over, minor, "m", "minor half axis of the orbit, negative in backward whirl"),
            },
            {
                "frequency": (("frequency",), self.frequency, "rad/s", "speed of the shaft"),
                "z": (("node",), self.nodes_pos, "m", "position along the shaft"),
            },
        )


@dataclass(frozen=True, eq=False)
class Receptance:
    """Receptance (n_out, n_in, n_freq) [m/N, rad/N, rad/(N m)] over `frequency` (n_freq,) [rad/s].

    `inputs` and `outputs` are the numbers of the degrees of freedom; `speed` [rad/s] is None where it is the frequency.
    """

    frequency: NDArray[np.float64]
    response: NDArray[np.complex128]
    inputs: NDArray[np.intp]
    outputs: NDArray[np.intp]
    speed: float | None

    def dataset(self) -> xr.Dataset:
        """Labelled data over output, input and frequency."""
        return dataset(
            {"receptance": (("output", "input", "frequency"), self.response, "m/N", "receptance")},
            {
                "output": (("output",), self.outputs, "1", "degree of freedom"),
                "input": (("input",), self.inputs, "1", "degree of freedom"),
                "frequency": (("frequency",), self.frequency, "rad/s", "frequency"),
            },
        )


def run_unbalance_response(
    rotor: AssembledRotor, node: int | Sequence[int], magnitude: ArrayLike, phase: ArrayLike, frequency: ArrayLike
) -> ForcedResult:
    """Whirl of `rotor` with unbalance at one node or at several.

    Parameters
    ----------
    rotor : AssembledRotor
    node : int or sequence of int (n_u,)
    magnitude : float or array (n_u,)
        Mass times eccentricity [kg m].
    phase : float or array (n_u,)
        Angle of the unbalance from x towards y at t = 0 [rad].
    frequency : float or array (n_freq,)
        Speed of the shaft [rad/s].

    Raises
    ------
    ShaftError
        If a node is not on the shaft, a frequency is not finite or a bearing's table does not cover it.

    Examples
    --------
    >>> rotor.run_unbalance_response(3, 1e-5, 0.0, [50.0, 100.0]).response.shape
    (28, 2)
    """
    frequency = grid("unbalance: frequency [rad/s]", frequency, increasing=False)
    unbalance = _unbalance_vector(rotor, node, magnitude, phase)[:, None]
    solved = _solve(rotor, frequency, None, lambda w: w**2 * unbalance)
    return ForcedResult(frequency, solved[:, 0], rotor.nodes_pos)


def run_freq_response(
    rotor: AssembledRotor,
    frequency: ArrayLike,
    speed: float | None = None,
    inputs: Sequence[int] | None = None,
    outputs: Sequence[int] | None = None,
) -> Receptance:
    """Receptance of `rotor` over `frequency` (n_freq,) [rad/s].

    `speed` [rad/s] is that of the shaft; without it the shaft turns at the frequency. `inputs` and `outputs` are
    numbers of degrees of freedom; all without them.

    Raises
    ------
    ShaftError
        If a degree of freedom does not exist or a frequency is not finite.

    Examples
    --------
    >>> rotor.run_freq_response([50.0, 100.0], speed=0.0, inputs=[12], outputs=[12, 13]).response.shape
    (2, 1, 2)
    """
    frequency = grid("frequency response: frequency [rad/s]", frequency, increasing=False)
    into, out = (_dofs(rotor, chosen) for chosen in (inputs, outputs))
    unit = np.eye(rotor.ndof)[:, into].astype(complex)
    solved = _solve(rotor, frequency, speed, lambda w: unit)
    return Receptance(frequency, solved[out], into, out, speed)


def _dofs(rotor: AssembledRotor, chosen: Sequence[int] | None) -> NDArray[np.intp]:
    dofs = np.arange(rotor.ndof) if chosen is None else np.atleast_1d(np.asarray(chosen, dtype=np.intp))
    if dofs.size and not (dofs.min() >= 0 and dofs.max() < rotor.ndof):
        raise ShaftError(
            f"frequency response: degree of freedom {dofs.max()}, but there are 0 to {rotor.ndof - 1}; "
            "4 times the node is its x."
        )
    return dofs


def _unbalance_vector(
    rotor: AssembledRotor, node: int | Sequence[int], magnitude: ArrayLike, phase: ArrayLike
) -> NDArray[np.complex128]:
    """Complex m e of every degree of freedom (ndof,) [kg m]."""
    vector = np.zeros(rotor.ndof, dtype=complex)
    for n, me, angle in np.broadcast(np.atleast_1d(node), magnitude, phase):
        if not 0 <= n < rotor.n_nodes:
            raise ShaftError(f"unbalance at node {n}, but the shaft has nodes 0 to {rotor.n_nodes - 1}; move it.")
        if not np.isfinite(me + angle):
            raise ShaftError(f"unbalance at node {n}: {me:g} kg m at {angle:g} rad; give finite numbers.")
        vector[4 * n : 4 * n + 2] += me * np.exp(1j * angle) * np.array([1, -1j])
    return vector


def _solve(
    rotor: AssembledRotor,
    frequency: NDArray[np.float64],
    speed: float | None,
    force: Callable[[float], NDArray[np.complex128]],
) -> NDArray[np.complex128]:
    """Displacements (ndof, n_in, n_freq) for forces (ndof, n_in) of each frequency."""
    constant = all(bearing.constant for bearing in rotor.bearing_elements) and not rotor.hysteretic
    start = float(frequency[0]) if speed is None else speed
    K0, C0 = (rotor.K(0.0), rotor.C(0.0)) if constant else (rotor.K(start, frequency[0]), rotor.C(start, frequency[0]))
    pattern = (rotor.parts.M != 0) | (K0 != 0) | (C0 != 0) | (rotor.parts.G != 0) | (rotor.parts.N != 0)
    pattern |= rotor.parts.N_h != 0
    order, width = _order(rotor, pattern | pattern.T)
    banded = [_band(matrix, order, width) for matrix in (rotor.parts.M, rotor.parts.G, rotor.parts.N, K0, C0)]
    M, G, N, K, C = banded
    answer: Any = None
    for i, w in enumerate(frequency):
        spin = float(w) if speed is None else speed
        if not constant:
            K = _band(rotor.K(spin, float(w)) - spin * rotor.parts.N, order, width)
            C = _band(rotor.C(spin, float(w)), order, width)
        Z = K + spin * N - w**2 * M + 1j * w * (C + spin * G)
        f = force(float(w))
        if answer is None:
            answer = np.zeros((rotor.ndof, f.shape[1], len(frequency)), dtype=complex)
        _, _, x, info = lapack.zgbsv(width, width, Z, f[order], overwrite_ab=True)
        if info:
            raise ShaftError(f"response: nothing resists the force at {w:g} rad/s; support the rotor or add damping.")
        answer[order, :, i] = x
    return np.asarray(answer)


def _order(rotor: AssembledRotor, pattern: NDArray[np.bool_]) -> tuple[NDArray[np.intp], int]:
    """Order of the free degrees of freedom with a small band, and its half width."""
    free = rotor.free
    inner = pattern[np.ix_(free, free)]
    place = np.asarray(reverse_cuthill_mckee(csr_matrix(inner), symmetric_mode=True))
    best = min((np.arange(len(free)), place), key=lambda p: _width(inner[np.ix_(p, p)]))
    return free[best], _width(inner[np.ix_(best, best)])


def _width(pattern: NDArray[np.bool_]) -> int:
    rows, columns = np.nonzero(pattern)
    return int(np.abs(rows - columns).max())


def _band(matrix: NDArray[np.float64], order: NDArray[np.intp], width: int) -> NDArray[np.float64]:
    """LAPACK's band storage (3 width + 1, n) with room for the factors."""
    part = matrix[np.ix_(order, order)]
    n = len(order)
    band = np.zeros((3 * width + 1, n), order="F")
    for offset in range(-width, width + 1):
        diagonal = np.diagonal(part, offset)
        columns = np.arange(max(0, offset), max(0, offset) + len(diagonal))
        band[2 * width - offset, columns] = diagonal
    return band
