"""Open-loop eigenvalues of the plant at the present operating point and effect settings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_shaft.modes.spectrum import modes_in
from rotorsim.analysis.modes_over_speed import least_damped
from rotorsim.analysis.whirl_onset import region_up_to
from rotorsim.base.errors import RotorsimError
from rotorsim.base.processes import one_thread
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.equilibrium import settle
from rotorsim.plant.linearise import linearise


@dataclass(frozen=True)
class Modes:
    """Frequency [Hz] and damping ratio of the lowest mode of each axis at a speed [rad/s] and gauge pressure [Pa], or
    the reason why there is none; `least` are frequency and damping ratio of the least damped of all modes."""

    frequency: tuple[float, ...] = ()
    zeta: tuple[float, ...] = ()
    why: str = ""
    least: tuple[float, float] = (float("nan"), float("inf"))
    speed: float = 0.0
    pressure: float = 0.0


def modes_at(a: Assembly, speed: float, pressure: float) -> Modes:
    """Modes at a speed [rad/s] and gauge pressure [Pa], without controller."""
    try:
        plant = linearise(a, settle(a, speed, pressure), speed)
    except RotorsimError as error:
        return Modes(why=str(error))
    except np.linalg.LinAlgError:
        return Modes(why="cannot be computed here")
    first = [plant.mode_of_axis(axis) for axis in range(2)]
    frequency, zeta = (plant.wn[first] / (2 * np.pi)).tolist(), plant.zeta[first].tolist()
    hints = a.mesh.reduced.frequencies
    region = region_up_to(hints, abs(speed))
    with one_thread():
        damping, omega = least_damped(modes_in(plant, region, np.unique(hints.round(3)).tolist()), region)
    return Modes(tuple(frequency), tuple(zeta), "", (omega / (2 * np.pi), damping), speed, pressure)


def own_copy(a: Assembly) -> Assembly:
    """Private copy of an assembly's parameter record and workspace."""
    return replace(a, record=a.record.copy(), w=a.w.copy())
