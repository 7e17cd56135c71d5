r"""Safe speed: run-up until the disc leaves the safety circle (thesis Paper F, eq. F.1).

.. math:: (p_x - c_x)^2 + (p_y - c_y)^2 < r^2

The thesis' circle has r = 20 um about (10, -3) um in the coordinates of its sensors, whose signs it leaves open. Here
the circle lies about the disc's equilibrium at the start, moved by `centre`, zero by default.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rotorsim.base.constants import KRPM, TO_UM
from rotorsim.plant import Plant
from rotorsim.verify.other import AnyLaw, as_law
from rotorsim.verify.running import Run, run_rows
from rotorsim.verify.transients import changing

CONFIRM = 3
"""A circle is left when as many samples in a row lie outside."""


@dataclass(frozen=True, eq=False)
class SafeSpeed:
    """Speed [rad/s] at which the circle was left, or the last one reached; why the run ended; the run."""

    speed: float
    left: bool
    why: str
    run: Run


def safe_speed(
    plant: Plant, law: AnyLaw | Any | None, pressure: float = 0.3e6, start: float = 3 * KRPM, stop: float = 24 * KRPM,
    rate: float = 1 * KRPM, radius: float = 20e-6, centre: tuple[float, float] = (0.0, 0.0), seed: int = 0,
) -> SafeSpeed:  # fmt: skip
    """Run up from `start` to `stop` [rad/s] at `rate` [rad/s^2] and find the speed at which the circle is left.

    `law` is a Law or any controller that `closed_loop` takes, None for the open loop.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.verify.safe_speed(plant, law)
    """
    rows = changing((start, stop), (pressure, pressure), (stop - start) / rate, plant.machine.sampling_time)
    run = run_rows(plant, None if law is None else as_law(law), rows, seed)
    quiet = run.count(0.4)
    middle = run.disc[:quiet].mean(axis=0) + np.asarray(centre)
    outside = np.hypot(*(run.disc - middle).T) > radius
    long = np.flatnonzero(np.convolve(outside, np.ones(CONFIRM), mode="valid") == CONFIRM)
    speeds = run.column("speed")
    if long.size:
        at = int(long[0])
        return SafeSpeed(float(speeds[at]), True, f"left the circle of {radius * TO_UM:g} um", run)
    return SafeSpeed(float(speeds[-1]), bool(run.ended), run.ended or "reached the end of the ramp", run)
