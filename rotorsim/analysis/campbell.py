"""Campbell diagram from 0 Hz: the lowest modes of the coupled machine over speed, followed from speed to speed.

Modes of film and rotor are looked for around every natural frequency of the rotor on its nominal bearings; those with a
damping ratio above one half, most of them motions of the gas, are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linear_sum_assignment

from fe_shaft import BearingElement
from rotorsim.analysis.axes import checked
from rotorsim.base.errors import DataError, NoLiftOffError
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant
from rotorsim.plant.validity import linear_warnings

if TYPE_CHECKING:
    import xarray as xr

DAMPED = 0.5
"""Damping ratio above which a mode is left out."""
SAME = 1e-6
"""Relative distance of eigenvalues that are one mode, found from two shifts."""
SENSE = 0.3
"""Weight of the sense of whirl, against the relative change of the eigenvalue, in following a mode."""


def campbell(plant: Plant, speeds: Sequence[float] | np.ndarray, pressure: float = 0.0, modes: int = 8) -> xr.Dataset:
    """The lowest modes over the speeds (n,) [rad/s], at a gauge supply pressure [Pa] for machines with a film.

    Parameters
    ----------
    plant : Plant
    speeds : array (n,)
        Ascending [rad/s].
    pressure : float
        Supply pressure [Pa, gauge].
    modes : int
        How many, the lowest first at each speed.

    Returns
    -------
    Dataset
        wn [rad/s], zeta, log_dec, whirl_ratio and whirl by branch and speed, NaN where the film does not carry or there
        are fewer; critical_speed [rad/s] by order (1, 2, 3) and branch, interpolated.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.campbell(rs.Plant("plain_rotor"), [0.0, 100.0, 200.0], modes=4)
    >>> found["wn"].shape
    (4, 3)
    """
    import xarray as xr

    speeds = checked("campbell: speeds [rad/s]", speeds)
    if modes < 1:
        raise DataError(f"campbell: {modes} modes; give 1 or more")
    values, senses = np.full((modes, len(speeds)), np.nan, complex), np.full((modes, len(speeds)), np.nan)
    for k, speed in enumerate(speeds.tolist()):
        try:
            model = plant.linearise(speed, pressure)
        except NoLiftOffError:
            continue
        s, sense = lowest_modes(plant, model, modes)
        order = _follow(values[:, k - 1], senses[:, k - 1], s, sense) if k else np.arange(len(s))
        values[order, k], senses[order, k] = s, sense
    wn, zeta = np.abs(values), -values.real / np.abs(values)
    over = ("branch", "speed")
    whirl = np.where(np.isnan(senses), "", np.where(np.abs(senses) < 0.02, "mixed",
                     np.where(senses > 0, "forward", "backward")))  # fmt: skip
    critical = np.array([[_crossing(speeds, row, order) for row in wn] for order in (1, 2, 3)])
    return xr.Dataset(
        {
            "wn": (over, wn, {"units": "rad/s", "long_name": "natural frequency"}),
            "zeta": (over, zeta, {"units": "1", "long_name": "damping ratio"}),
            "log_dec": (over, 2 * np.pi * zeta / np.sqrt(1 - zeta**2), {"units": "1", "long_name": "log. decrement"}),
            "whirl_ratio": (over, senses, {"units": "1", "long_name": "roundness of the orbit, 1 forward"}),
            "whirl": (over, whirl, {"long_name": "sense of whirl"}),
            "critical_speed": (("order", "branch"), critical, {"units": "rad/s", "long_name": "critical speed"}),
        },
        {
            "speed": ("speed", speeds, {"units": "rad/s", "long_name": "speed of the shaft"}),
            "branch": np.arange(1, modes + 1),
            "order": ("order", [1, 2, 3], {"units": "1", "long_name": "order of the speed"}),
        },
        plant.provenance() | linear_warnings(plant, speeds, _least(zeta), pressure)
        | {"kind": "campbell", "pressure": float(pressure)},
    )  # fmt: skip


def _least(zeta: np.ndarray) -> np.ndarray:
    """Least damping ratio (speeds,) of the branches (branches, speeds); NaN where none is known."""
    return np.where(np.isnan(zeta).all(axis=0), np.nan, np.nanmin(np.nan_to_num(zeta, nan=np.inf), axis=0))


def lowest_modes(plant: Plant, model: LinearPlant, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Eigenvalues [rad/s] of the `count` lowest modes and the roundness of their orbits at the measuring plane."""
    near = np.unique(plant.assembly.mesh.reduced.frequencies.round(3))
    found: list[tuple[complex, float]] = []
    for shift in near[:1] if model.film is None else near:
        one = replace(model, near=float(shift))
        known = [s for s, _ in found]  # of the shifts before: a double eigenvalue is found twice from one
        for s, sense in zip(one.eigenvalues, one.whirl_ratio, strict=True):
            same = next((k for k, other in enumerate(known) if abs(s - other) <= SAME * abs(s)), None)
            if same is not None:
                known.pop(same)
            elif -s.real < DAMPED * abs(s):
                found.append((complex(s), float(sense)))
    found = sorted(found, key=lambda entry: abs(entry[0]))[:count]
    return np.array([s for s, _ in found], complex), np.array([sense for _, sense in found])


def _follow(before: np.ndarray, senses: np.ndarray, s: np.ndarray, sense: np.ndarray) -> np.ndarray:
    """Branch of each eigenvalue, so that eigenvalues and senses change least in all."""
    change = np.abs(s[:, None] - before[None, :]) / np.abs(s[:, None])
    change = change + SENSE * np.abs(sense[:, None] - senses[None, :])
    return np.asarray(linear_sum_assignment(np.nan_to_num(change, nan=10.0))[1])


def _crossing(speeds: np.ndarray, wn: np.ndarray, order: int) -> float:
    """First speed at which `order` times the speed is the natural frequency, interpolated; NaN where there is none."""
    gap = wn - order * speeds
    change = np.flatnonzero((gap[:-1] > 0) & (gap[1:] <= 0))
    if not change.size:
        return float("nan")
    k = int(change[0])
    return float(speeds[k] + (speeds[k + 1] - speeds[k]) * gap[k] / (gap[k] - gap[k + 1]))


def critical_speed_map(
    plant: Plant, stiffness: tuple[float, float] = (1e5, 1e9), points: int = 60, modes: int = 4
) -> xr.Dataset:
    """Undamped critical speeds wn (mode, stiffness) [rad/s] of the rotor over the stiffness [N/m] of every bearing.

    Parameters
    ----------
    plant : Plant
    stiffness : (float, float)
        Range [N/m], from above 0.
    points, modes : int
        Values of the stiffness, evenly in its logarithm, and critical speeds.

    Raises
    ------
    ShaftError
        For a range that does not ascend, or a rotor with bearings at one node alone.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.analysis.critical_speed_map(rs.Plant("plain_rotor"), points=5).sizes["stiffness"]
    5
    """
    mesh = plant.assembly.mesh
    held = [BearingElement(mesh.node(b.position), 1.0, 0.0) for b in plant.machine.bearings]
    found = (
        replace(mesh.constant, bearing_elements=held, point_mass_elements=())
        .run_ucs(stiffness, points, modes)
        .dataset()
    )
    return found.assign_attrs(plant.provenance() | {"kind": "critical_speed_map"})
