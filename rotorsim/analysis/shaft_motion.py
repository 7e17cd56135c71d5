"""Motion of the whole shaft and the film's pressure over some revolutions of the nonlinear plant."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.analysis.mode_shapes import radii
from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.base.errors import DataError
from rotorsim.plant import Plant

if TYPE_CHECKING:
    import xarray as xr


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
    a, motions, films = plant.assembly, [], []
    for steps in np.diff(at, prepend=0):
        if steps:
            simulation.advance(np.tile(row, (steps, 1)))
        q = simulation.w[a.rotor.q :][: a.mesh.reduced.Phi.shape[1]]
        motions.append(np.column_stack([a.mesh.shaft_modes[axis::4] @ q for axis in range(2)])[: len(a.mesh.nodes)])
        if a.film_model is not None:
            films.append(simulation.film_pressure())
    return _dataset(plant, at * RIG_SAMPLE, np.array(motions), films, speed, pressure)


def _dataset(
    plant: Plant, time: np.ndarray, motions: np.ndarray, films: list[np.ndarray], speed: float, pressure: float
) -> xr.Dataset:
    import xarray as xr

    a, film = plant.assembly, plant.machine.film
    discs = [d for d in plant.machine.discs if d.mass > 0]
    values: dict[str, Any] = {
        "displacement": (("time", "node", "axis"), motions, {"units": "m", "long_name": "displacement of the shaft"}),
        "radius": ("node", radii(plant), {"units": "m", "long_name": "radius of the shaft"}),
        "disc_node": ("disc", [a.mesh.node(d.position) for d in discs], {"long_name": "node of the disc"}),
        "disc_radius": ("disc", [(2 * d.polar_inertia / d.mass) ** 0.5 for d in discs], {"units": "m"}),
    }
    coords: dict[str, Any] = {
        "time": ("time", time, {"units": "s"}), "axis": ["x", "y"],
        "z": ("node", a.mesh.nodes, {"units": "m", "long_name": "position along the shaft"}),
    }  # fmt: skip
    attrs = plant.provenance() | {"kind": "motion", "speed": float(speed), "pressure": float(pressure)}
    if films and film is not None and a.film_model is not None:
        grid = a.film_model.grid
        over = ("time", "theta", "film_z")
        values["film_pressure"] = (over, np.array(films), {"units": "Pa", "long_name": "film pressure, absolute"})
        coords |= {"theta": ("theta", grid.theta, {"units": "rad"}), "film_z": ("film_z", grid.z, {"units": "m"})}
        attrs |= {"film_radius": grid.radius, "film_position": film.position}
    return xr.Dataset(values, coords, attrs)
