r"""Hysteresis of the piezo stacks: Prandtl and Ishlinskii's superposition of play operators.

.. math:: d = s\,v + w \sum_{i=0}^{9} (p_i - r_i), \qquad
          p_i(t) = \max\{v - r_i, \min\{v + r_i, p_i(t^-)\}\}, \quad r_i = (i + \tfrac12)\,r

counted from the lower end of a full cycle that begins at 0 V; s is the sensitivity of the actuators, so w = 0 leaves
the straight line.

With s = 2.82 um/V, w = 0.336 um/V and r = 0.5 V a full cycle between 0 and 10 V runs from 0 to 45 um and opens by 8.4
um, as in the thesis' Fig. C.28.

Source: Kuhnen (2003), Modeling, identification and compensation of complex hysteretic nonlinearities.
"""

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, Effect, param, register

PLAYS = 10


@inlined
def hysteresis(w, old, new, h, volt, stroke, p):
    """Stroke [m] with the play operators' part."""
    total = 0.0
    for i in range(PLAYS):
        width = (i + 0.5) * p.width
        play = max(volt - width, min(volt + width, w[old + i]))
        w[new + i] = play
        total += play - width
    return stroke + p.weight * total


@register
class Hysteresis(Effect):
    """Hysteresis of the piezo stacks."""

    port = "actuator"
    kernel = hysteresis
    cites = ("kuhnen_2003",)
    states = PLAYS
    single = True
    memory = "short"
    forms = (CandidateForm("weight", 5e-8),)
    weight: float = param("m/V", bounds=(0.0, 1e-5), doc="Weight of each of ten play operators; 0 is a straight line.")
    width: float = param("V", default=0.5, bounds=(1e-3, 100.0), doc="Spacing of the plays' half widths.")
