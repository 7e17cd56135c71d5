r"""Static deflection under constant forces and weight: K q = f."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe_shaft.assembly import RIGID, AssembledRotor, rigid_motions
from fe_shaft.checks import ShaftError
from fe_shaft.labelled import dataset

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
    return np.asarray(rotor.parts.M @ down)


def _reaction(rotor: AssembledRotor, bearing, q: NDArray[np.float64]) -> NDArray[np.float64]:  # type: ignore[no-untyped-def]
    own = rotor.layout.place(bearing.n)
    relative = q[own : own + 2].copy()
    if bearing.n_link is not None:
        other = rotor.layout.place(bearing.n_link)
        relative -= q[other : other + 2]
    return np.asarray(-bearing.stiffness_at(0.0) @ relative)


def loose_motions(rotor: AssembledRotor) -> list[str]:
    """Names of the rigid-body motions, two shifts and two tilts, that the supports do not resist."""
    if rotor.clamped:
        return []
    motions = rigid_motions(rotor)
    resist = motions.T @ (rotor.K() - rotor.parts.K) @ motions
    for node in rotor.pinned:
        rows = motions[4 * node : 4 * node + 2]
        resist += np.abs(rotor.parts.K).max() * rows.T @ rows
    missing = 4 - int(np.linalg.matrix_rank(resist))
    values, vectors = np.linalg.eigh((resist + resist.T) / 2)
    size = np.abs(vectors) * np.array([1.0, 1.0, 1.001, 1.001])[:, None]  # to turn about a bearing at an end is a tilt
    loose = [list(RIGID)[int(size[:, i].argmax())] for i in np.argsort(np.abs(values))]
    return sorted(set(loose[:missing]))
