r"""Supply droop: the regulator pressure falls with the flow, behind a line with a filling time.

.. math:: T\,\dot P_l = P - R\,\dot m - P_l

P is the regulator's pressure, R its droop per flow, T the filling time of the line. Within a sample the line moves
linearly; T = 0 follows at once. At rest P_l = P - R m. Source: Blackburn, Reethof
& Shearer (1960), Fluid Power Control, chapter 8.
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, Effect, param, register


@inlined
def supply_droop(w, state, h, supply, flow, p):
    """Pressure [Pa] behind the line at start and end of a sample."""
    goal = supply - p.droop * flow
    if p.filling_time == 0.0:
        return goal, goal
    if w[state + 1] == 0.0:
        w[state], w[state + 1] = goal, 1.0
    start = w[state]
    w[state] = goal + (start - goal) * math.exp(-h / p.filling_time)
    return start, w[state]


@register
class SupplyDroop(Effect):
    """Droop of the regulator and filling of the line."""

    port = "supply"
    kernel = supply_droop
    cites = ("blackburn_1960",)
    states = 2
    single = True
    memory = "short"
    forms = (CandidateForm("droop", 2e8, signed=False),)
    droop: float = param("Pa*s/kg", bounds=(0.0, 5e9), doc="Pressure lost per mass flow.")
    filling_time: float = param("s", bounds=(0.0, 60.0), doc="Time constant of the line; 0 follows at once.")
