"""Run-up: prescribed ramp of the speed, upwards or downwards."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_RPM
from rotorsim.experiments.experiment import BEGINNINGS, LONGEST, Experiment, begin, param, register

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.machine import Machine
    from rotorsim.plant.plant import Plant, Signal


@register
@dataclass(frozen=True)
class Runup(Experiment):
    """Run-up: a linear ramp of the speed at constant supply pressure.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Runup(start=50.0, stop=60.0, rate=50.0, pressure=0.5e6).samples
    1000
    """

    name: ClassVar[str] = "runup"
    swept: ClassVar[bool] = True
    example: ClassVar[str] = "--stop '7000 rpm' --rate '100 rpm/s' --pressure '0.5 MPa'"
    figures: ClassVar[tuple[str, ...]] = ("bode", "waterfall", "full_spectrum", "orbits", "against_time")
    page: ClassVar[str] = "report.html"
    start: float = param("rad/s", "Speed at the beginning.", 0.0, low=0, attribute="start_speed")
    stop: float = param(
        "rad/s", "Speed at the end; below the start it is a coast-down.", 200 * np.pi, low=0, attribute="stop_speed"
    )
    rate: float = param("rad/s^2", "Acceleration of the shaft, positive.", 200 * np.pi / 60)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)
    begin: str = begin()

    def check(self) -> None:
        """Refuse a ramp that never arrives."""
        ramp_time(self.start, self.stop, self.rate)

    @property
    def samples(self) -> int:
        """Length in samples."""
        return max(round(ramp_time(self.start, self.stop, self.rate) / self.Ts), 1)

    def initial(self) -> tuple[float, float]:
        """Speed [rad/s] and gauge pressure [Pa] of the equilibrium it starts from."""
        return self.start, self.pressure

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        rows = np.zeros((count, 6))
        rows[:, 0] = self.start + (self.stop - self.start) * (first + 1 + np.arange(count)) / self.samples
        rows[:, 1] = self.pressure
        return rows


def runup(
    plant: Plant | Machine | str | Path,
    start: float = 0.0,
    stop: float = 2 * np.pi * 100,
    rate: float = 2 * np.pi * 100 / 60,
    pressure: Signal = 0.3e6,
    seed: int = 0,
    progress: bool = False,
    begin: str = BEGINNINGS[0],
) -> xr.Dataset:
    """Run up and return the record; it ends at a limit of the machine, with the sentence in its attribute `ended`.

    Parameters
    ----------
    plant : Plant, machine or name
        The machine.
    start, stop : float
        Speeds [rad/s] at the beginning and at the end.
    rate : float
        Magnitude of the acceleration [rad/s^2].
    pressure : float, callable or array
        Gauge pressure [Pa]; a function of time or an array over the samples as `Plant.simulate` takes it.
    seed : int
        Of the plant's noise.
    progress : bool
        Show a bar on a terminal.
    begin : str
        "orbit", the synchronous orbit, or "rest", the static equilibrium.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.runup(plant, start=50.0, stop=60.0, rate=100.0, pressure=0.5e6).sizes["time"]
    500
    """
    from rotorsim.experiments.running import begun, cut, run
    from rotorsim.plant.plant import as_plant

    if not callable(pressure) and np.ndim(pressure) == 0:
        ramp = Runup(start, stop, rate, float(pressure), begin)  # type: ignore[arg-type]
        return run(plant, ramp, seed, progress)
    plant = as_plant(plant)
    ramp = Runup(start, stop, rate, begin=begin, Ts=plant.machine.sampling_time)
    speed = np.append(start, ramp.rows(0, ramp.samples)[:, 0])
    _, point = plant.inputs(ramp.samples * ramp.Ts, speed, pressure)
    initial = begun(plant, ramp, point, seed)
    made = plant.simulate(ramp.samples * ramp.Ts, speed, pressure, seed=seed, initial=initial, progress=progress)
    attrs = {name: value for name, value in ramp.attrs().items() if name != "pressure"}
    return cut(made.assign_attrs(attrs), plant.assembly)


def ramp_time(start: float, stop: float, rate: float) -> float:
    """Duration [s] of a ramp; raises DataError for a rate or range that makes none."""
    if not rate > 0:
        raise DataError(f"rate = {rate * TO_RPM:g} rpm/s: must be positive, also downwards; give e.g. 100 rpm/s")
    if start == stop:
        raise DataError("start and stop are the same speed; give a range to run through")
    duration = abs(stop - start) / rate
    if duration > LONGEST:
        raise DataError(f"rate = {rate * TO_RPM:g} rpm/s: the run would last {duration / 86400:.3g} days; raise it")
    return duration
