r"""Creep of the piezo stacks: the stroke keeps growing for minutes after a step.

.. math:: y = d + \sum_{j=1}^{3} z_j, \qquad T_j\,\dot z_j = \gamma\,d - z_j, \quad T_j = T\,\{0.1, 1, 10\}

three Kelvin-Voigt elements in series, nearly a creep with the logarithm of time. Each is stepped by implicit Euler: its
time constant is thousands of substeps. Source: Kuhnen & Janocha (1998); thesis C.8 ("a few percent over minutes").
"""

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, Effect, param, register


@inlined
def creep(w, old, new, h, volt, stroke, p):
    """Stroke [m] with the creep's part."""
    rate = 10.0 * h / p.time
    total = 0.0
    for j in range(3):
        z = (w[old + j] + rate * p.gain * stroke) / (1.0 + rate)
        w[new + j] = z
        total += z
        rate *= 0.1
    return stroke + total


@register
class Creep(Effect):
    """Creep of the piezo stacks."""

    port = "actuator"
    kernel = creep
    cites = ("kuhnen_1998", "thesis")
    states = 3
    single = True
    memory = "mean"
    forms = (CandidateForm("gain", 6e-3),)
    gain: float = param("1", bounds=(0.0, 0.3), doc="Share of the stroke that each of three elements adds in the end.")
    time: float = param("s", default=3.0, bounds=(0.1, 300.0), doc="Time constant of the middle element.")
