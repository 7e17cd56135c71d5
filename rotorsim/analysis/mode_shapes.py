"""Mode shapes of the coupled machine along its shaft: complex displacements of every node."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rotorsim.analysis.campbell import highest_speed
from rotorsim.analysis.supply import felt
from rotorsim.analysis.whirl_onset import LeastDamped
from rotorsim.plant import Plant

if TYPE_CHECKING:
    import xarray as xr


SAME = 1e-6
"""Relative distance up to which two computed eigenvalues are one."""


def mode_shapes(plant: Plant, speed: float, pressure: float) -> xr.Dataset:
    """The modes next to the first critical speeds, at `speed` [rad/s] and gauge `pressure` [Pa].

    `shape_re`, `shape_im` (mode, node, axis): x = Re(X exp(st)), the largest displacement of a mode is 1; wn [rad/s],
    zeta, whirl by mode; radius [m] of the shaft next to each node; z [m] of the nodes;
    node and radius of the discs. The attributes hold what is known of all modes of the region in which onsets of whirl
    are looked for: `zeta_least`, NaN where none grows but one may be missing, and `not_listed` [rad/s], the frequencies
    of those that are not among the modes listed.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.analysis.mode_shapes(plant, 300.0, 0.5e6).sizes["axis"]
    2
    """
    import xarray as xr

    a = plant.assembly
    pressure = float(felt([plant.machine], [pressure])[0])
    model = plant.linearise(speed, pressure)
    reduced, nodes = a.mesh.reduced, a.mesh.nodes
    q = model.shapes[: reduced.Phi.shape[1]]
    shape = np.stack([reduced.Phi[axis::4] @ q for axis in range(2)], axis=-1).transpose(1, 0, 2)[:, : len(nodes)]
    size = np.abs(shape).reshape(len(shape), -1)
    shape = shape / (shape.reshape(len(shape), -1)[np.arange(len(shape)), size.argmax(axis=1)])[:, None, None]
    least = LeastDamped.up_to(plant, pressure, highest_speed(plant))
    damping, every = least.certain(model), least.known[-1].values
    every = every[least.region.holds(every)]
    known = (np.abs(every[:, None] - model.eigenvalues) < SAME * np.abs(every)[:, None]).any(axis=1)
    discs = [d for d in plant.machine.discs if d.mass > 0]
    over = ("mode", "node", "axis")
    return xr.Dataset(
        {
            "shape_re": (over, shape.real, {"units": "1", "long_name": "mode shape, real part"}),
            "shape_im": (over, shape.imag, {"units": "1", "long_name": "mode shape, imaginary part"}),
            "wn": ("mode", model.wn, {"units": "rad/s", "long_name": "natural frequency"}),
            "zeta": ("mode", model.zeta, {"units": "1", "long_name": "damping ratio"}),
            "whirl": ("mode", list(model.whirl), {"long_name": "sense of whirl at the disc"}),
            "radius": ("node", radii(plant), {"units": "m", "long_name": "radius of the shaft"}),
            "disc_node": ("disc", [a.mesh.node(d.position) for d in discs], {"long_name": "node of the disc"}),
            "disc_radius": ("disc", [(2 * d.polar_inertia / d.mass) ** 0.5 for d in discs], {"units": "m"}),
        },
        {"z": ("node", nodes, {"units": "m", "long_name": "position along the shaft"}), "axis": ["x", "y"]},
        plant.provenance() | {
            "kind": "modes", "speed": float(speed), "pressure": pressure, "zeta_least": damping,
            "not_listed": np.abs(every[~known]),
        },
    )  # fmt: skip


def radii(plant: Plant) -> np.ndarray:
    """Outer radius of the element to the right of each node (the last node: to the left)."""
    radii = [0.5 * e.odl for e in plant.assembly.mesh.rotor.shaft_elements]
    return np.array([*radii, radii[-1]])
