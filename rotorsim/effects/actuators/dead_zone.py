r"""Dead zone of the actuators: lost motion between stack and pin about the pin's bias.

.. math:: y = d - \mathrm{clip}(d - d_0, -b, b)

with d_0 the stroke at rest, the pins' bias, and b half the lost motion. It comes behind hysteresis and creep, which
belong to the stack. Source: Tao & Kokotovic (1996), Adaptive control of systems with actuator and sensor
nonlinearities.
"""

from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, Effect, param, register


@inlined
def dead_zone(w, old, new, h, volt, stroke, p):
    """Stroke [m] that reaches the pin."""
    return stroke - min(max(stroke - p.middle, -p.half_width), p.half_width)


@register
class DeadZone(Effect):
    """Lost motion between stack and pin."""

    port = "actuator"
    kernel = dead_zone
    cites = ("tao_1996",)
    single = True
    extra = ("middle",)
    ends_chain = True
    forms = (CandidateForm("half_width", 1e-7, signed=False),)
    half_width: float = param("m", bounds=(0.0, 1e-4), doc="Half the lost motion.")

    def derived(self, machine: Any) -> dict[str, float]:
        """The stroke about which it lies: the pins' bias."""
        return {"middle": machine.injection.pin_bias}

    def problems(self, machine: Any) -> dict[str, str]:
        """Lost motion comes after the stack."""
        order = list(machine.effects)
        behind = [n for n in order[order.index(self.name) + 1 :] if any(map(in_the_stack, machine.effects[n]))]
        if self.half_width == 0.0 or not behind:
            return {}
        return {"": f"is lost between stack and pin, but [effects.{behind[0]}] of the stack follows it; move it behind"}


def in_the_stack(effect: Effect) -> bool:
    """Whether an effect changes what the stack does: hysteresis or creep that is switched on."""
    return getattr(effect, {"hysteresis": "weight", "creep": "gain"}.get(effect.name, ""), 0.0) > 0.0
