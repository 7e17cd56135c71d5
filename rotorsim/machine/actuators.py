"""Machine-file parts: piezo actuators of the injector pins, and the drive of the shaft."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field

from rotorsim.base.units import show
from rotorsim.machine.part import Part, quantity


class Actuators(Part):
    """Common data of the piezo actuators of all pins."""

    earlier_keys: ClassVar[dict[str, str]] = {
        "limit": "reference_limit", "pole": "pd_pole", "transducer": "sensor_sensitivity",
    }  # fmt: skip

    mode: Literal["ideal", "voltage", "reference"] = Field(
        description="'ideal' (pins follow at once, effects of the actuators idle), 'voltage' (the reference is the "
        "amplifier's) or 'reference' (PD loop)."
    )
    sensitivity: float = quantity("m/V", "Stroke of a stack per volt, without hysteresis.", 4.5e-6, above=0, high=1e-3)
    sensor_sensitivity: float = quantity(
        "m/V", "Travel per volt of the pins' position sensors.", 4.5e-6, above=0, high=1e-3
    )
    lowest: float = quantity("V", "Lowest voltage of the amplifiers.", 0.0, low=-1e4, high=1e4)
    highest: float = quantity("V", "Highest voltage of the amplifiers.", 10.0, low=-1e4, high=1e4)
    reference_limit: float = quantity(
        "V", "Largest reference that a controller or an experiment may give.", 5.0, above=0, high=1e4
    )
    pd_pole: float = quantity("1/s", "Pole of the PD law.", 101.0, above=0, high=1e6)
    amplifier_lag: float = quantity("s", "Time constant of the amplifiers.", 4.2e-4, low=0, high=10)
    stack_lag: float = quantity("s", "Time constant of the stacks.", 1e-4, low=0, high=10)

    def problems(self) -> Iterator[tuple[str, str]]:
        """The amplifiers have a range."""
        if self.lowest >= self.highest:
            low, high = show(self.lowest, "V"), show(self.highest, "V")
            yield "lowest", f"'{low}' is not below highest '{high}'; make it smaller"


class Drive(Part):
    """Drive of the shaft, and the drag besides the film's once the drive is off."""

    earlier_keys: ClassVar[dict[str, str]] = {"time": "speed_recovery_time"}

    inertia: float | None = quantity(
        "kg*m^2",
        "Moment of inertia about the axis; that of shaft and discs when not given.",
        None,
        above=0,
        high=1e6,
        example=0.004,
    )
    dry_drag: float = quantity("N*m", "Constant torque against the rotation.", 0.0, low=0, high=1e6, example=16e-3)
    viscous_drag: float = quantity("N*m*s", "Torque per speed against the rotation.", 0.0, low=0, high=1e6)
    highest_speed: float | None = quantity(
        "rad/s", "Highest speed the machine is made for; the sampling rate follows from it.",
        None, above=0, high=1e6, example=6283.185307179586,
    )  # fmt: skip
    speed_recovery_time: float = quantity(
        "s", "Time in which the drive takes deviations of the speed back.", 0.5, above=1e-3, high=1e3
    )
