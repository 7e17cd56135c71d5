r"""Ball bearing with radial clearance, softer than in the machine file.

.. math:: F = k\,x - (1 - \sigma)\,k\,\frac{(e - g)_+}{e}\,x, \qquad e = |x|

added to the linear bearing's -k x: the two together are a spring (1 - sigma) k behind a radial clearance g. k is the
mean of the bearing's k_xx and k_yy. The few modes kept of the rotor are those of the stiff bearing and hardly move
there: x is their displacement and R F, with R the static compliance of the modes left out (MacNeal 1971). Source:
Harris (2001), Rolling Bearing Analysis, chapter 7, linearised.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import Effect, param, register
from rotorsim.effects.diagnosis import CalibrationParameter, CandidateForm


@inlined
def ball_bearing(t, angle, speed, x, y, vx, vy, p):
    """Force (fx, fy) [N] besides the linear bearing's."""
    if p.softening == 0.0 and p.clearance == 0.0:
        return 0.0, 0.0
    k = p.stiffness
    held = (1.0 - p.softening) * k
    e = math.sqrt(x * x + y * y)
    # the displacement with what the force adds through the modes left out: e' = e + R F(e')
    whole = e / (1.0 - k * p.residual)
    if whole > p.clearance:
        whole = (e + p.residual * held * p.clearance) / (1.0 - (k - held) * p.residual)
    missing = (k * whole - held * max(whole - p.clearance, 0.0)) / e if e > 0.0 else 0.0
    return missing * x, missing * y


@register
class BallBearing(Effect):
    """Compliance and clearance of a ball bearing."""

    port = "motion"
    kernel = ball_bearing
    cites = ("harris_2001",)
    place = "bearing"
    steady = True
    single = True
    extra = ("stiffness", "residual")
    forms = (CandidateForm("clearance", 5e-7, signed=False),)
    calibration = (CalibrationParameter("softening", 0.05, 0.3, -0.9, 0.9),)
    softening: float = param("1", bounds=(-1.0, 0.98), doc="Share of the bearing's stiffness that is missing.")
    clearance: float = param("m", bounds=(0.0, 1e-4), doc="Radial clearance.")

    def derived(self, machine: Any) -> dict[str, float]:
        """Mean stiffness of the first linear bearing [N/m]."""
        bearing = next((b for b in machine.bearings if hasattr(b, "kxx")), None)
        if bearing is None:
            return {"stiffness": 0.0}
        kyy = bearing.kxx if bearing.kyy is None else bearing.kyy
        return {"stiffness": 0.5 * (bearing.kxx + kyy)}

    def problems(self, machine: Any) -> dict[str, str]:
        """There is a bearing to soften."""
        has_one = any(hasattr(b, "kxx") for b in machine.bearings)
        return {} if has_one else {"": "there is no bearing with kind = 'linear' to soften; add one or remove this"}
