r"""Delay of the displacement sensors.

.. math:: s(t) = x(t - T)

with the displacement linear between samples; before the run it stood where it stands at its start.
Source: definition; the delay of converters and anti-alias filters.
"""

from typing import Any

from reynolds.jit import inlined
from rotorsim.base.units import show
from rotorsim.effects.base import CandidateForm, SampledEffect, param, register

LENGTH = 64
"""Samples kept of each axis."""


@inlined
def sensor_delay(w, reading, state, seed, sample, p):
    """Change the displacements read; states: a ring of samples of each axis, and whether it is filled."""
    now = int(sample) % LENGTH
    back = p.delay / p.interval
    whole = int(back)
    part = back - whole
    first = w[state + 2 * LENGTH] == 0.0
    w[state + 2 * LENGTH] = 1.0
    for axis in range(2):
        ring = state + axis * LENGTH
        if first:
            for n in range(LENGTH):
                w[ring + n] = w[reading + axis]
        w[ring + now] = w[reading + axis]
        if back > 0.0:
            near = w[ring + (now - whole) % LENGTH]
            far = w[ring + (now - whole - 1) % LENGTH]
            w[reading + axis] = near + part * (far - near)


def late(parameter: str) -> CandidateForm:
    """Form of a sensor whose readings come late by a time, whether a delay or a lag."""
    signature, resembles = "time that the sensors lag", "a lag of the amplifiers or the actuators"
    return CandidateForm(parameter, 5e-5, signed=False, signature=signature, resembles=resembles)


@register
class SensorDelay(SampledEffect):
    """Delay of the displacement sensors."""

    port = "sensor"
    kernel = sensor_delay
    cites = ("astrom_1997",)
    states = 2 * LENGTH + 1
    memory = "short"
    forms = (late("delay"),)
    delay: float = param("s", bounds=(0.0, 0.012), doc="Delay of both sensors.")

    def problems(self, machine: Any) -> dict[str, str]:
        """No longer than the samples that are kept."""
        longest = (LENGTH - 2) * machine.sampling_time
        if self.delay <= longest * (1 + 1e-9):
            return {}
        given, most = show(self.delay, "s"), show(float(f"{longest:.6g}"), "s")
        return {"delay": f"'{given}' is longer than {LENGTH - 2} samples at the sampling rate; write at most '{most}'"}
