"""Numerics of a machine: film grid, tolerances, time step, and the rate of its probes, encoder and laws.

A file may give the sampling rate. Where it does not, the highest speed decides: the lowest of 5, 10, 20, 50, 100, ...
kHz with 12 samples in a turn at that speed and 8 in a period of the rotor on its films. Without a highest speed it is
5 kHz.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, pi, sqrt
from typing import TYPE_CHECKING, Literal

from pydantic import Field

from rotorsim.base.constants import RIG_SAMPLE, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.base.units import show
from rotorsim.machine.part import Part, count, quantity

if TYPE_CHECKING:
    from rotorsim.machine.schema import Machine

STEP = 1e-4
"""Longest time step [s] that is taken where a file gives none."""


class Grid(Part):
    """Grid of the gas film.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Grid(n_theta=48, n_z=16).n_theta
    48
    """

    n_theta: int = count("Intervals round the circumference.", 32, low=8, high=512, multiple=4)
    n_z: int = count("Intervals along the full length of the film.", 16, low=4, high=256, multiple=2)
    symmetry: Literal["auto", "none"] = Field(
        "auto", description="'auto' solves half a film that is symmetric about its middle, 'none' always all of it."
    )


class Solver(Part):
    """Step, sampling and tolerances of the coupled solution.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Solver(time_step="50 us").time_step
    5e-05
    """

    time_step: float = quantity(
        "s", "Time step; the sampling time is a whole multiple of it. 0.1 ms is shortened until it is.", STEP,
        low=1e-7, high=1e-3,
    )  # fmt: skip
    sampling_rate: float | None = quantity(
        "Hz", "Rate of probes, encoder and laws; from drive.highest_speed when not given, and 5 kHz without that.",
        None, low=100, high=1e6, example=20e3,
    )  # fmt: skip
    tolerance: float = quantity(
        "1", "Tolerance of the film pressure, relative to ambient pressure.", 5e-6, above=0, high=1e-3
    )
    modes_per_plane: int = count("Rotor modes kept in each plane.", 6, low=1, high=40)
    minimum_film: float = quantity(
        "m", "Floor of the film thickness in the Reynolds equation.", 2.5e-7, above=0, high=1e-4
    )


PER_TURN = 12
"""Samples in a turn at the highest speed that a derived rate has."""
PER_PERIOD = 8
"""Samples in a period of the rotor on its films that a derived rate has."""
FEWEST = 4
"""Samples in a turn below which a run is refused: with fewer the line at twice the speed is not resolved."""

RATES = (5e3, 10e3, 20e3, 50e3, 100e3, 200e3, 500e3, 1e6)
"""Rates [Hz] that are derived."""


def rate_for(wanted: float) -> float:
    """The lowest derived rate [Hz] that is not below another, or the highest."""
    return next((rate for rate in RATES if rate >= wanted * (1 - 1e-9)), RATES[-1])


def derived_rate(machine: Machine) -> float:
    """Sampling rate [Hz] of a machine whose file gives none."""
    highest = machine.drive.highest_speed
    if highest is None:
        return 1 / RIG_SAMPLE
    films = sum(film.nominal_stiffness for film in machine.films)
    bounce = sqrt(films / machine.mass) / (2 * pi)
    wanted = max(PER_TURN * highest / (2 * pi), PER_PERIOD * bounce)
    return rate_for(wanted)


def sampling_time(machine: Machine) -> float:
    """Time [s] between two samples of a machine."""
    rate = machine.solver.sampling_rate
    return 1 / (derived_rate(machine) if rate is None else rate)


def time_step(machine: Machine) -> float:
    """Step [s] of the solver: the file's, or where it gives none 0.1 ms or what next divides the sampling time."""
    step, Ts = machine.solver.time_step, machine.sampling_time
    return Ts / ceil(Ts / STEP * (1 - 1e-9)) if step == STEP else step


def check_step(machine: Machine) -> Iterator[tuple[str, str]]:
    """The step divides the sampling time."""
    step, Ts = machine.time_step, machine.sampling_time
    steps = Ts / step
    if steps < 0.5 or abs(steps - round(steps)) > 1e-9 * steps:
        fitting = show(float(f"{Ts / max(ceil(steps), 2):.9g}"), "s")
        own = show(float(f"{Ts:.9g}"), "s")
        yield "solver.time_step", f"'{show(step, 's')}' does not divide the sampling time {own}; write e.g. '{fitting}'"


def highest_sampled(machine: Machine) -> float:
    """Highest speed [rad/s] at which a turn has enough samples."""
    return 2 * pi / (machine.sampling_time * FEWEST)


def check_speed(machine: Machine, speed: float) -> None:
    """Raise DataError for a speed [rad/s] at which a turn has too few samples, with the rate that it needs."""
    if abs(speed) <= highest_sampled(machine) * (1 + 1e-9):
        return
    needed = rate_for(PER_TURN * abs(speed) / (2 * pi))
    own = 2 * pi / (abs(speed) * machine.sampling_time)
    raise DataError(
        f"speed = {abs(speed) * TO_RPM:.6g} rpm: a turn has {own:.2g} samples at "
        f"{show(float(f'{1 / machine.sampling_time:.9g}'), 'Hz')} and needs {FEWEST}; give the machine "
        f"solver.sampling_rate = '{show(needed, 'Hz')}'"
    )
