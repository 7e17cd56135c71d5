r"""Amplifiers that are slower or faster than the machine file has them.

.. math:: \tau_a \;\to\; (1 + \delta)\,\tau_a

tau_a is the amplifier's time constant in the law of the actuators, plant/kernels/injectors.py; the piezo is its load,
so that a stack of more capacity is a longer lag. Source: thesis C.23.
"""

from __future__ import annotations

from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.actuators.actuator_gain import no_such_pin
from rotorsim.effects.base import CandidateForm, Effect, param, register


@inlined
def amplifier_lag(number, p):
    """Factor on the time constant of the amplifier of pin `number`."""
    return 1.0 + p.change if p.injector == 0.0 or p.injector == number else 1.0


@register
class AmplifierLag(Effect):
    """Other time constant of one amplifier, or of all."""

    port = "amplifier"
    kernel = amplifier_lag
    cites = ("thesis",)
    forms = (CandidateForm("change", 0.1, pinned=True),)
    injector: float = param("1", bounds=(0.0, 64.0), whole=True, doc="Number of the injector, from 1; 0 for all.")
    change: float = param("1", bounds=(-0.95, 9.0), doc="Relative change of the time constant.")

    def problems(self, machine: Any) -> dict[str, str]:
        """The pin exists and an amplifier drives it."""
        if self.change and machine.actuators is not None and machine.actuators.mode == "ideal":
            return {"": "changes nothing, as ideal pins have no amplifier; set actuators.mode = 'voltage' or remove it"}
        return no_such_pin(self.injector, machine)
