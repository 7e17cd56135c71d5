r"""Pin sensors: position sensors of the injectors' pins, which the loops of the pins and the records read.

.. math:: T\,\dot s + s = (1 + g)\,y, \qquad y_m = s + \sigma\,n_i

A record has the reading y_m of every pin in `pin_measured`, next to the true position y in `pin`. The position loop
of a pin acts on s, so that behind a slow sensor the pin is ahead of its reading.

The lag is exact for a pin that is straight over a substep. The noise is a recorder's, which the loop does not read;
n_i depends on (seed of the run, pin, number of the sample) alone.

A lag is refused that takes more than 45 deg, or more than half of the phase margin, at the crossover of the pin's
loop.

Source: thesis C.2 and eq. (C.23), whose laws and models have measured positions; Åström & Wittenmark (1997) for the
lag.
"""

from __future__ import annotations

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.base.units import show
from rotorsim.effects.base import Effect, param, register
from rotorsim.effects.sensors import normal

CHANNELS = 8.0
"""Channel of random numbers below that of the first pin."""
ROUNDED = 1.005
"""Factor by which a lag may exceed its limit, which sentences state with three digits."""


@inlined
def pin_sensor(number, h, before, start, end, seen, p):
    """Signal [m] of the sensor of pin `number` after h [s] in which the pin went straight from `start` to `end`."""
    if p.injector != 0.0 and p.injector != number:
        return seen
    if p.lag == 0.0:
        return seen + p.gain * end
    if h == 0.0:
        return before
    keep = math.exp(-h / p.lag)
    mean = (1.0 - keep) * p.lag / h
    return keep * before + (1.0 + p.gain) * ((mean - keep) * start + (1.0 - mean) * end)


@inlined
def pin_noise(number, seed, sample, p):
    """Noise [m] of the reading of pin `number`."""
    if p.sigma == 0.0 or (p.injector != 0.0 and p.injector != number):
        return 0.0
    return p.sigma * normal(seed, CHANNELS + number, sample)


@register
class PinSensor(Effect):
    """Position sensors of the pins, all alike or a table for each."""

    port = "pin_sensor"
    kernel = pin_sensor
    reading_noise = pin_noise
    cites = ("astrom_1997", "thesis")
    role = "known"
    random_part = "sigma"
    injector: float = param("1", bounds=(0.0, 64.0), whole=True, doc="Number of the injector, from 1; 0 for all.")
    lag: float = param("s", bounds=(0.0, 1.0), doc="Time constant.")
    gain: float = param("1", bounds=(-0.5, 1.0), doc="Relative gain error.")
    sigma: float = param("m", bounds=(0.0, 1e-4), doc="Standard deviation of a recorded reading.")

    def problems(self, machine: Any) -> dict[str, str]:
        """The pins exist, each has one sensor, and none is slower than the pin's loop allows."""
        count = len(machine.injectors)
        if not count:
            return {"": "reads the pins of injectors, but there are none; add [[injectors]] or remove it"}
        if self.injector > count:
            return {"injector": f"{self.injector:g} is none of the pins; write 1 to {count}, or 0 for all"}
        if self._doubles(machine.effects.get(self.name, ())):
            return {"injector": "its pin has a sensor in a table above; write one table for all pins, or one for each"}
        return self._slower(machine) if self.lag > 0.0 else {}

    def _doubles(self, tables: tuple[PinSensor, ...]) -> bool:
        """Whether a table above is about the same pin; one at neutral values is about none."""
        above = tables[: next((i for i, one in enumerate(tables) if one is self), 0)]
        others = [one.injector for one in above if not one._is_neutral]
        return not self._is_neutral and any(0.0 in (self.injector, one) or one == self.injector for one in others)

    @property
    def _is_neutral(self) -> bool:
        return (self.lag, self.gain, self.sigma) == (0.0, 0.0, 0.0)

    def _slower(self, machine: Any) -> dict[str, str]:
        """A sentence for a lag that the position loop of a pin does not allow."""
        if machine.actuators is None:
            return {}
        limits = {
            number: machine.actuators.slowest_sensor(injector, self.gain)
            for number, injector in enumerate(machine.injectors, 1)
            if self.injector in (0.0, number)
        }
        number = min(limits, key=lambda n: limits[n])
        if self.lag <= ROUNDED * limits[number]:
            return {}
        given, most = show(self.lag, "s"), show(float(f"{limits[number]:.3g}"), "s")
        return {"lag": f"'{given}' is slower than the position loop of pin {number} allows; write at most '{most}', or "
                       f"make that loop slower (injectors.{number - 1}.pd_gain)"}  # fmt: skip
