r"""Flexible pedestal of the gas bearing: an isotropic resonance of the sleeve.

.. math:: m_p\,(\ddot x_p + 2\zeta\omega\,\dot x_p + \omega^2 x_p) = -F, \qquad h \text{ from } X - x_p, \qquad
          m_p = m_\mathrm{rotor}/r

F is the film's force on the journal. It enters as two modal coordinates x_p = (r / m_rotor)^(1/2) q_p of the rotor,
met implicitly like the others; r = 0 is a pedestal that does not move.

A film of stiffness K then has the static stiffness 1 / (1/K + 1/(m_p omega^2)). Records give the journal's
displacement against the sleeve.

Source: Childs (1993), section 3.6.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CandidateForm, FilmEffect, param, register


@inlined
def pedestal(p):
    """Natural frequency [rad/s], damping ratio and displacement per modal coordinate [kg^-1/2]."""
    return p.frequency, p.damping_ratio, math.sqrt(p.mass_ratio / p.rotor_mass)


@register
class Pedestal(FilmEffect):
    """Resonance of the gas bearing's pedestal."""

    port = "support"
    kernel = pedestal
    cites = ("childs_1993",)
    single = True
    extra = ("rotor_mass",)
    forms = (
        CandidateForm(
            "mass_ratio", 2e-3, options=(("frequency", tuple(TURN * f for f in (60, 90, 120, 160, 220))),),
            refine=(("frequency", TURN),), signed=False,
        ),
    )  # fmt: skip
    mass_ratio: float = param("1", bounds=(0.0, 100.0), doc="Mass of the rotor over that of the pedestal; 0 is rigid.")
    frequency: float = param(
        "rad/s", default=100 * TURN, bounds=(TURN, 1e4 * TURN), doc="Natural frequency of the pedestal alone."
    )
    damping_ratio: float = param("1", default=0.02, bounds=(0.0, 2.0), doc="Damping ratio of the pedestal alone.")

    def derived(self, machine: Any) -> dict[str, float]:
        """Mass of the rotor [kg]."""
        return {"rotor_mass": machine.mass}

    def problems(self, machine: Any) -> dict[str, str]:
        """A foundation that shakes the rotor would have to shake the pedestal as well."""
        shaken = any(e.x != 0.0 or e.y != 0.0 for e in machine.effects.get("base_vibration", ()))
        if self.mass_ratio == 0.0 or not shaken:
            return {}
        return {"": "does not feel [effects.base_vibration], which shakes its mass as well as the rotor's; keep one"}
