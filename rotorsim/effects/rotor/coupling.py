r"""Forces of a misaligned coupling at two and three times the shaft speed.

.. math:: f_x = \sum_n F_n \cos(n\varphi+\psi_n), \qquad f_y = \kappa \sum_n F_n \sin(n\varphi+\psi_n), \quad n=2, 3

with constant amplitudes F_n, as a coupling with a fixed offset gives. kappa = 1 is a force turning forward, 0 one of
fixed direction, -1 one turning backward.

The torque of these forces on the shaft is left out: over a turn of a steady orbit it has the mean power that they put
into the whirl.

Source: harmonics of a misaligned coupling, Gibbons (1976) and Sekhar & Prabhu (1995); the thesis (E.5.2) sees their
resonances at one half and one third of the critical speeds.
"""

import math

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CandidateForm, Effect, param, register


@inlined
def coupling(t, angle, speed, acceleration, p):
    """Force (fx, fy) [N] at shaft angle `angle` [rad]."""
    two = 2.0 * angle + p.phase_2x
    three = 3.0 * angle + p.phase_3x
    fx = p.force_2x * math.cos(two) + p.force_3x * math.cos(three)
    fy = p.ellipticity * (p.force_2x * math.sin(two) + p.force_3x * math.sin(three))
    return fx, fy


@register
class Coupling(Effect):
    """Misaligned coupling: forces at 2X and 3X."""

    port = "force"
    kernel = coupling
    cites = ("gibbons_1976", "sekhar_1995", "thesis")
    place = "start"
    forms = (
        # a shaft of unequal stiffness that the weight bends makes a force at 2X that turns forward, too
        CandidateForm(
            "force_2x", 1.0, "phase_2x", options=(("ellipticity", (1.0, 0.0, -1.0)),),
            with_weight="forward 2X", from_value=("ellipticity", 0.5),
        ),
        CandidateForm("force_3x", 1.0, "phase_3x", options=(("ellipticity", (1.0, 0.0, -1.0)),)),
    )  # fmt: skip
    force_2x: float = param("N", bounds=(0.0, 1e4), doc="Amplitude of the force at 2X, 0-pk.")
    force_3x: float = param("N", bounds=(0.0, 1e4), doc="Amplitude of the force at 3X, 0-pk.")
    phase_2x: float = param("rad", bounds=(-TURN, TURN), doc="Phase of the 2X force.")
    phase_3x: float = param("rad", bounds=(-TURN, TURN), doc="Phase of the 3X force.")
    ellipticity: float = param(
        "1", default=1.0, bounds=(-1.0, 1.0), doc="1 turns forward, 0 has a fixed direction, -1 turns backward."
    )
    position: float | None = param(
        "m", default=None, bounds=(-100.0, 100.0), doc="Where it acts; the left end of the shaft when not given."
    )
