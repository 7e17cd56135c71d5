r"""Unbalance that is there from an instant on, as where a blade or a balance weight is lost.

.. math:: f = 0 \quad (t \le t_0), \qquad
          f_x + i f_y = me\,(\Omega^2 - i \dot\Omega)\,e^{i(\varphi + \beta)} \quad (t > t_0)

`phase` is where the heavy side is from then on, opposite to the mass that is lost; the mass of the rotor stays as it
is. The force jumps at the start of a sample, and the step has the acceleration after the jump, so that its order holds.

Source: as `unbalance`; the answer of a rotor in one mode is in Genta (2005), section 3.
"""

from __future__ import annotations

from typing import Any

from reynolds.jit import inlined
from rotorsim.base.quantity import whole_samples
from rotorsim.effects.base import TURN, SampledEffect, param, register
from rotorsim.effects.rotor.unbalance import unbalance

SAME = 1e-3
"""Share of a sample by which the clock may be off."""


@inlined
def sudden_unbalance(t, angle, speed, acceleration, p):
    """Force (fx, fy) [N] at shaft angle `angle` [rad] after the instant."""
    if t - p.time <= SAME * p.interval:
        return 0.0, 0.0
    return unbalance(t, angle, speed, acceleration, p)


@inlined
def sudden_onset(t, angle, speed, acceleration, p):
    """Force (fx, fy) [N] that begins at t, which is the start of a sample."""
    if abs(t - p.time) > SAME * p.interval:
        return 0.0, 0.0
    return unbalance(t, angle, speed, acceleration, p)


@register
class SuddenUnbalance(SampledEffect):
    """Unbalance that appears during a run: loss of a blade or of a balance weight."""

    port = "force"
    kernel = sudden_unbalance
    onset = sudden_onset
    cites = ("friswell_2010", "genta_2005")
    role = "known"
    me: float = param("kg*m", bounds=(0.0, 1.0), doc="Unbalance that appears, lost mass times its radius.")
    phase: float = param("rad", bounds=(-TURN, TURN), doc="Heavy side on the shaft from then on, from x towards y.")
    time: float = param("s", default=1.0, bounds=(0.0, 1e6), doc="Instant from the start of the run.")
    position: float | None = param(
        "m", default=None, bounds=(-100.0, 100.0), doc="Plane along the shaft; the first disc when not given."
    )

    def problems(self, machine: Any) -> dict[str, str]:
        """The force jumps at the start of a sample."""
        try:
            whole_samples(self.time, machine.sampling_time)
        except ValueError as error:
            return {"time": str(error)}
        return {}
