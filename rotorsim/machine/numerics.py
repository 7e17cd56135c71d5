"""Parts of a machine that concern its computation: film grid, step, sampling rate, limits of a run, range of validity.

A file may give the sampling rate. Where it does not, the highest speed decides: the lowest of 5, 10, 20, 50, 100, ...
kHz with 12 samples in a turn at that speed and 8 in a period of the rotor on its films. Without a highest speed it is
5 kHz.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, inf, pi, sqrt
from typing import Literal, Protocol

from pydantic import Field

from rotorsim.base.units import MPA, RIG_SAMPLE, show
from rotorsim.machine.gas_film import GasFilm
from rotorsim.machine.part import Part, count, quantity
from rotorsim.machine.rotor import Drive

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
    corrections: int | None = count(
        "Most corrections of a time step, a factorisation counted as ten; as many as the tolerance takes when not "
        "given. From 20 on: new factors, and ten more for two stages.", None, low=20, high=1000, example=50,
    )  # fmt: skip
    modes_per_plane: int = count("Rotor modes kept in each plane.", 6, low=1, high=40)
    minimum_film: float = quantity(
        "m", "Floor of the film thickness in the Reynolds equation.", 2.5e-7, above=0, high=1e-4
    )


HOT = 423.15
"""Temperature [K] from which on quenched bearing steel loses hardness and piezo stacks end, 150 degC."""


class Limits(Part):
    """Limits at which a run ends.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.Limits(tip_speed="200 m/s").tip_speed
    200.0
    """

    tip_speed: float = quantity(
        "m/s", "Speed of the rim of the rotor's widest part; a solid disc of steel bears 810 MPa at 500 m/s.",
        500.0, above=0, high=2000)  # fmt: skip
    temperature: float | None = quantity(
        "K", "Temperature of gas, journal or sleeve; 150 degC when not given, none where the gas is fed warmer.",
        None, above=0, high=5000, example=HOT)  # fmt: skip
    choked_feeds: float | None = quantity(
        "1", "Share of a film's injectors and orifices that may be choked where they enter it; any when not given.",
        None, low=0, high=1, example=0.5)  # fmt: skip


class Checked(Part):
    """Operating points at which the machine's model was compared with measurements; no run depends on it.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.load_machine("dtu_gas_bearing").checked.highest_pressure
    700000.0
    """

    highest_speed: float = quantity("rad/s", "Highest speed.", low=0, high=1e6, example=628.3185307179587)
    lowest_pressure: float = quantity("Pa", "Lowest gauge pressure of the supply.", 0.0, low=0, high=1e8, example=3e5)
    highest_pressure: float | None = quantity(
        "Pa", "Highest gauge pressure of the supply; any when not given.", None, low=0, high=1e8, example=7e5
    )
    against: str = Field("measurements", description="What it was compared with.")

    def problems(self) -> Iterator[tuple[str, str]]:
        """The pressures are a range."""
        if self.highest_pressure is not None and self.highest_pressure < self.lowest_pressure:
            low, high = show(self.lowest_pressure, "Pa"), show(self.highest_pressure, "Pa")
            yield "lowest_pressure", f"'{low}' is above highest_pressure '{high}'; make it smaller"

    def holds(self, speed: float, pressure: float) -> bool:
        """Whether an operating point [rad/s], [Pa] lies within, to 0.1 %."""
        highest = inf if self.highest_pressure is None else 1.001 * self.highest_pressure
        return abs(speed) <= 1.001 * self.highest_speed and 0.999 * self.lowest_pressure <= pressure <= highest

    @property
    def pressures(self) -> str:
        """The pressures as a text."""
        if self.highest_pressure is None:
            return f"from {self.lowest_pressure / MPA:g} MPa on"
        return f"{self.lowest_pressure / MPA:g} to {self.highest_pressure / MPA:g} MPa"


PER_TURN = 12
"""Samples in a turn at the highest speed that a derived rate has."""
PER_PERIOD = 8
"""Samples in a period of the rotor on its films that a derived rate has."""
FEWEST = 4
"""Samples in a turn below which a run is refused: with fewer the line at twice the speed is not resolved."""

RATES = (5e3, 10e3, 20e3, 50e3, 100e3, 200e3, 500e3, 1e6)
"""Rates [Hz] that are derived."""


class Sampled(Protocol):
    """Tables of a machine that decide its sampling, and what follows from them."""

    @property
    def solver(self) -> Solver:
        """Step and rate of the file."""

    @property
    def drive(self) -> Drive:
        """The drive, which has the highest speed."""

    @property
    def films(self) -> tuple[GasFilm, ...]:
        """The gas films."""

    @property
    def mass(self) -> float:
        """Mass of the rotor [kg]."""

    @property
    def sampling_time(self) -> float:
        """Time between two samples [s]."""

    @property
    def time_step(self) -> float:
        """Step of the solver [s]."""


def rate_for(wanted: float) -> float:
    """The lowest derived rate [Hz] that is not below another, or the highest."""
    return next((rate for rate in RATES if rate >= wanted * (1 - 1e-9)), RATES[-1])


def derived_rate(machine: Sampled) -> float:
    """Sampling rate [Hz] of a machine whose file gives none."""
    highest = machine.drive.highest_speed
    if highest is None:
        return 1 / RIG_SAMPLE
    films = sum(film.nominal_stiffness for film in machine.films)
    bounce = sqrt(films / machine.mass) / (2 * pi)
    wanted = max(PER_TURN * highest / (2 * pi), PER_PERIOD * bounce)
    return rate_for(wanted)


def sampling_time(machine: Sampled) -> float:
    """Time [s] between two samples of a machine."""
    rate = machine.solver.sampling_rate
    return 1 / (derived_rate(machine) if rate is None else rate)


def time_step(machine: Sampled) -> float:
    """Step [s] of the solver: the file's, or where it gives none 0.1 ms or what next divides the sampling time."""
    step, Ts = machine.solver.time_step, machine.sampling_time
    return Ts / ceil(Ts / STEP * (1 - 1e-9)) if step == STEP else step


def check_step(machine: Sampled) -> Iterator[tuple[str, str]]:
    """The step divides the sampling time."""
    step, Ts = machine.time_step, machine.sampling_time
    if not _divides(step, Ts):
        fewest = max(ceil(Ts / step), 2)
        short = (float(f"{Ts / n:.9g}") for n in range(fewest, 10 * fewest))
        fitting = show(next((one for one in short if _divides(one, Ts)), Ts / fewest), "s")
        own = show(float(f"{Ts:.9g}"), "s")
        yield "solver.time_step", f"'{show(step, 's')}' does not divide the sampling time {own}; write e.g. '{fitting}'"


def _divides(step: float, Ts: float) -> bool:
    steps = Ts / step
    return steps >= 0.5 and abs(steps - round(steps)) <= 1e-9 * steps


def highest_sampled(machine: Sampled) -> float:
    """Highest speed [rad/s] at which a turn has enough samples."""
    return 2 * pi / (machine.sampling_time * FEWEST)
