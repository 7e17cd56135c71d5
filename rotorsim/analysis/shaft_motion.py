"""Motion of the whole shaft: mode shapes, complex at every node, and some revolutions of the nonlinear plant."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.analysis.campbell import highest_speed
from rotorsim.analysis.supply import felt
from rotorsim.analysis.whirl_onset import LeastDamped
from rotorsim.base.errors import DataError
from rotorsim.base.units import RIG_SAMPLE
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
    over = ("mode", "node", "axis")
    return xr.Dataset(
        {
            "shape_re": (over, shape.real, {"units": "1", "long_name": "mode shape, real part"}),
            "shape_im": (over, shape.imag, {"units": "1", "long_name": "mode shape, imaginary part"}),
            "wn": ("mode", model.wn, {"units": "rad/s", "long_name": "natural frequency"}),
            "zeta": ("mode", model.zeta, {"units": "1", "long_name": "damping ratio"}),
            "whirl": ("mode", list(model.whirl), {"long_name": "sense of whirl at the disc"}),
        }
        | outline(plant),
        axes(plant),
        plant.provenance() | {
            "kind": "modes", "speed": float(speed), "pressure": pressure, "zeta_least": damping,
            "not_listed": np.abs(every[~known]),
        },
    )  # fmt: skip


def outline(plant: Plant) -> dict[str, Any]:
    """Radius [m] of the element to the right of each node, at the last one left; node and radius of the discs."""
    mesh, discs = plant.assembly.mesh, [d for d in plant.machine.discs if d.mass > 0]
    radii = [0.5 * e.odl for e in mesh.rotor.shaft_elements]
    return {
        "radius": ("node", np.array([*radii, radii[-1]]), {"units": "m", "long_name": "radius of the shaft"}),
        "disc_node": ("disc", [mesh.node(d.position) for d in discs], {"long_name": "node of the disc"}),
        "disc_radius": ("disc", [(2 * d.polar_inertia / d.mass) ** 0.5 for d in discs], {"units": "m"}),
    }


def axes(plant: Plant) -> dict[str, Any]:
    """Coordinates of the nodes along the shaft and of the two directions."""
    z = ("node", plant.assembly.mesh.nodes, {"units": "m", "long_name": "position along the shaft"})
    return {"z": z, "axis": ["x", "y"]}


def shaft_motion(
    plant: Plant, speed: float, pressure: float = 0.0, settle: float = 0.5, revolutions: float = 1.0, frames: int = 72
) -> xr.Dataset:
    """Displacement of every node, and film pressure, over revolutions at constant speed after `settle`.

    Parameters
    ----------
    plant : Plant
    speed, pressure : float
        Operating point [rad/s], [Pa, gauge]; the shaft must turn.
    settle : float
        Time [s] from the equilibrium until the first frame.
    revolutions : float
        Length, in turns.
    frames : int
        Instants, at most one a sample of 0.2 ms.

    Returns
    -------
    Dataset
        displacement (time, node, axis) [m] from the undeflected line, z and radius (node) [m]; with a gas film
        film_pressure (time, theta, film_z) [Pa, absolute] and `film_radius`, `film_position` [m] as attributes.

    Raises
    ------
    DataError
        If the shaft stands or a length is not above 0.

    Examples
    --------
    >>> import rotorsim as rs
    >>> motion = rs.analysis.shaft_motion(rs.Plant("dtu_gas_bearing"), 500.0, 0.5e6, settle=0.1, frames=12)
    >>> motion["displacement"].dims
    ('time', 'node', 'axis')
    """
    import xarray as xr

    if not speed or settle < 0 or not revolutions > 0 or frames < 1:
        raise DataError(
            f"shaft motion: speed = {speed:g} rad/s, settle = {settle:g} s, {revolutions:g} turns, {frames} frames; "
            "give a turning shaft, lengths above 0 and a frame or more"
        )
    samples = max(round(2 * pi * revolutions / abs(speed) / RIG_SAMPLE), 1)
    at = np.unique(np.linspace(0, samples, frames, endpoint=False).astype(int))
    simulation = plant.start(speed, pressure)
    row = np.array([speed, pressure, 0.0, 0.0, 0.0, 0.0])
    if before := round(settle / RIG_SAMPLE):
        simulation.advance(np.tile(row, (before, 1)))
    a, film, over = plant.assembly, plant.machine.film, ("time", "node", "axis")
    motions, films = [], []
    for steps in np.diff(at, prepend=0):
        if steps:
            simulation.advance(np.tile(row, (steps, 1)))
        q = simulation.w[a.rotor.q :][: a.mesh.reduced.Phi.shape[1]]
        motions.append(np.column_stack([a.mesh.shaft_modes[axis::4] @ q for axis in range(2)])[: len(a.mesh.nodes)])
        if a.film_model is not None:
            films.append(simulation.film_pressure())
    values: dict[str, Any] = {
        "displacement": (over, np.array(motions), {"units": "m", "long_name": "displacement of the shaft"}),
    } | outline(plant)
    coords: dict[str, Any] = {"time": ("time", at * RIG_SAMPLE, {"units": "s"})} | axes(plant)
    attrs = plant.provenance() | {"kind": "motion", "speed": float(speed), "pressure": float(pressure)}
    if films and film is not None and a.film_model is not None:
        grid = a.film_model.grid
        where = ("time", "theta", "film_z")
        values["film_pressure"] = (where, np.array(films), {"units": "Pa", "long_name": "film pressure, absolute"})
        coords |= {"theta": ("theta", grid.theta, {"units": "rad"}), "film_z": ("film_z", grid.z, {"units": "m"})}
        attrs |= {"film_radius": grid.radius, "film_position": film.position}
    return xr.Dataset(values, coords, attrs)
