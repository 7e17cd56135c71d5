"""Coast-down: deceleration by film friction and bearing drag with the drive off, or along a prescribed ramp."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.units import TO_RPM
from rotorsim.experiments.catalogue.runup import Runup, ramp_time
from rotorsim.experiments.experiment import Experiment, begin, param, register
from rotorsim.experiments.functions import as_function

if TYPE_CHECKING:
    import xarray as xr

OFF = np.nan
"""End speed of a row that leaves the shaft to itself."""


@register
@dataclass(frozen=True)
class Coastdown(Experiment):
    """The drive is switched off and friction slows the shaft down; or a declared ramp.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Coastdown(start=300.0, stop=280.0, rate=100.0, pressure=0.5e6).samples
    1000
    """

    name: ClassVar[str] = "coastdown"
    swept: ClassVar[bool] = True
    example: ClassVar[str] = "--start '6000 rpm' --stop '600 rpm' --longest '60 s'"
    figures: ClassVar[tuple[str, ...]] = (
        "deceleration_curve", "bode", "waterfall", "full_spectrum", "orbits", "against_time"
    )  # fmt: skip
    start: float = param(
        "rad/s", "Speed when the drive is switched off.", 200 * np.pi, above=0, attribute="start_speed"
    )
    stop: float = param("rad/s", "Speed at which the record ends.", 0.0, low=0, attribute="stop_speed")
    rate: float | None = param("rad/s^2", "Declared deceleration; friction decides when not given.", None)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)
    longest: float = param("s", "The record ends here at the latest.", 300.0, above=0, samples=True)
    begin: str = begin()

    def check(self) -> None:
        """Refuse a coast-down that goes up."""
        if self.stop >= self.start:
            raise DataError(
                f"stop = {self.stop * TO_RPM:g} rpm: is not below the start of {self.start * TO_RPM:g} rpm; "
                "give less or take runup"
            )
        if self.rate is not None:
            ramp_time(self.start, self.stop, self.rate)

    @property
    def ramp(self) -> Runup | None:
        """The declared ramp, if there is one."""
        return None if self.rate is None else Runup(self.start, self.stop, self.rate, self.pressure, Ts=self.Ts)

    @property
    def samples(self) -> int:
        """Length in samples; the longest one with the drive off."""
        return self.samples_in(self.longest) if self.ramp is None else self.ramp.samples

    def initial(self) -> tuple[float, float]:
        """Speed [rad/s] and gauge pressure [Pa] of the equilibrium it starts from."""
        return self.start, self.pressure

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        if self.ramp is not None:
            return self.ramp.rows(first, count)
        rows = np.zeros((count, 6))
        rows[:, 0], rows[:, 1] = OFF, self.pressure
        return rows

    def end(self, speed: np.ndarray) -> int | None:
        """The record ends with the first sample at or below `stop`; that of a ramp does where the shaft stands still.

        A drive that brakes with a delay would turn it back a little.
        """
        below = np.flatnonzero(speed <= self.stop)
        return int(below[0]) + 1 if below.size and (self.rate is None or self.stop == 0) else None

    @classmethod
    def findings(cls, record: xr.Dataset) -> dict[str, Any]:
        """Duration [s] and mean deceleration [rpm/s] from the first sample to the last."""
        from identification.records.sampling import nominal_rate

        speeds = np.asarray(record["speed"].isel(time=[0, -1]).values, float)
        time = (record.sizes["time"] - 1) / nominal_rate(record["time"].values)
        reached = bool(speeds[1] <= record.attrs["stop_speed"] + 1e-9)
        mean = float((speeds[0] - speeds[1]) / time * TO_RPM) if time else 0.0
        return {"deceleration": {"time_s": time, "mean_rpm_per_s": mean, "reached_stop": reached}}

    @classmethod
    def table(cls, summary: dict[str, Any]) -> list[tuple[str, str]]:
        """Row of the deceleration."""
        found = summary["deceleration"]
        end = "" if found["reached_stop"] else ", before the speed asked for"
        return [("Deceleration", f"{found['time_s']:.4g} s{end}, {found['mean_rpm_per_s']:.4g} rpm/s on average")]


coastdown = as_function(Coastdown)
