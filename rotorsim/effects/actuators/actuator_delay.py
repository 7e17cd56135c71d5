r"""Delay of the references: converters, buses and amplifiers pass a reference on late.

.. math:: r_k(t) \;\to\; r_k(t - T)

with the reference linear between samples; before the run it is at rest. Source: definition; Åström & Wittenmark (1997)
for the delay of sampled loops.
"""

from __future__ import annotations

from typing import Any

from reynolds.jit import inlined
from rotorsim.base.units import show
from rotorsim.effects.actuators.actuator_gain import no_such_pin
from rotorsim.effects.base import CandidateForm, SampledEffect, param, register

LENGTH = 64
"""Samples kept of each reference."""


@inlined
def actuator_delay(w, state, number, sample, x, y, p):
    """References [V] of pin `number`; states: a ring of samples of each reference, for each pin."""
    now, ring = int(sample) % LENGTH, state + 2 * LENGTH * (int(number) - 1)
    w[ring + now] = x
    w[ring + LENGTH + now] = y
    if p.delay == 0.0 or (p.injector != 0.0 and p.injector != number):
        return x, y
    back = p.delay / p.interval
    whole = int(back)
    part = back - whole
    near, far = ring + (now - whole) % LENGTH, ring + (now - whole - 1) % LENGTH
    return w[near] + part * (w[far] - w[near]), w[near + LENGTH] + part * (w[far + LENGTH] - w[near + LENGTH])


@register
class ActuatorDelay(SampledEffect):
    """Delay of the reference of one pin, or of all."""

    port = "reference"
    kernel = actuator_delay
    cites = ("astrom_1997",)
    states = 2 * LENGTH
    memory = "short"
    forms = (CandidateForm("delay", 5e-5, signed=False, pinned=True),)
    injector: float = param("1", bounds=(0.0, 64.0), whole=True, doc="Number of the injector, from 1; 0 for all.")
    delay: float = param("s", bounds=(0.0, 0.012), doc="Delay of the reference.")

    def problems(self, machine: Any) -> dict[str, str]:
        """The pin exists, and the delay is no longer than the samples that are kept."""
        longest = (LENGTH - 2) * machine.sampling_time
        if self.delay <= longest * (1 + 1e-9):
            return no_such_pin(self.injector, machine)
        given, most = show(self.delay, "s"), show(float(f"{longest:.6g}"), "s")
        return {"delay": f"'{given}' is longer than {LENGTH - 2} samples at the sampling rate; write at most '{most}'"}
