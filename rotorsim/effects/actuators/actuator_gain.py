r"""Gain error of the pins' drives: a pin travels more or less for a volt of its reference.

.. math:: r_k \;\to\; (1 + g)\,r_k

r_k is the deviation of the reference of pin k from its rest, where the pin keeps its bias. From g = -1 to 0 it is a pin
that sticks there by the share -g of its travel.

Source: thesis eq. (C.1); amplifier, stack and transducer of a closed position loop all enter it, a slow amplifier does
not.
"""

from __future__ import annotations

from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, Effect, param, register


@inlined
def actuator_gain(w, state, number, sample, x, y, p):
    """References [V] of pin `number`."""
    if p.injector != 0.0 and p.injector != number:
        return x, y
    return x * (1.0 + p.error), y * (1.0 + p.error)


@register
class ActuatorGain(Effect):
    """Gain error of the drive of one pin, or of all."""

    port = "reference"
    kernel = actuator_gain
    cites = ("thesis",)
    forms = (CandidateForm("error", 0.01, pinned=True, same_as=("weak_injector.stuck", "error", -1.0, 0.0)),)
    injector: float = param("1", bounds=(0.0, 64.0), whole=True, doc="Number of the injector, from 1; 0 for all.")
    error: float = param("1", bounds=(-11.0, 9.0), doc="Relative error of travel per volt; -2 reverses it.")

    def problems(self, machine: Any) -> dict[str, str]:
        """The pin exists."""
        return no_such_pin(self.injector, machine)


def no_such_pin(number: float, machine: Any) -> dict[str, str]:
    """A sentence for the number of a pin, 0 for all, that the machine has not."""
    count = len(machine.injectors)
    if number > count:
        return {"injector": f"{number:g} is none of the pins; write 1 to {count}, or 0 for all"}
    return {}
