r"""Ball bearing with radial clearance, softer than in the machine file or stiffer by a thrust load.

.. math:: F = k\,x - s\,k\,\frac{(e - g)_+}{e}\,x, \qquad e = |x|, \qquad
          s = (1 - \sigma)\,(T / T_k)^{1/3}

added to the linear bearing's -k x: the two together are a spring s k behind a radial clearance g.

k is the mean of the bearing's k_xx and k_yy, T the thrust load and T_k the one at which k holds: balls in Hertz'
contact are pressed by delta^(3/2), so that the stiffness against small motion grows as the cube root of the load.

The few modes kept of the rotor are those of the stiff bearing and hardly move there: x is their displacement and R F,
with R the static compliance of the modes left out (MacNeal 1971).

Source: Harris (2001), Rolling Bearing Analysis, chapter 7.
"""

import math
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import CalibrationParameter, CandidateForm, Effect, param, register


@inlined
def ball_bearing(t, angle, speed, x, y, vx, vy, p):
    """Force (fx, fy) [N] besides the linear bearing's."""
    if p.softening == 0.0 and p.clearance == 0.0 and p.stiffening == 1.0:
        return 0.0, 0.0
    k = p.stiffness
    held = (1.0 - p.softening) * p.stiffening * k
    e = math.sqrt(x * x + y * y)
    # the displacement with what the force adds through the modes left out: e' = e + R F(e')
    whole = e / (1.0 - k * p.residual)
    if whole > p.clearance:
        whole = (e + p.residual * held * p.clearance) / (1.0 - (k - held) * p.residual)
    missing = (k * whole - held * max(whole - p.clearance, 0.0)) / e if e > 0.0 else 0.0
    return missing * x, missing * y


@register
class BallBearing(Effect):
    """Compliance, clearance and thrust load of a ball bearing."""

    port = "motion"
    kernel = ball_bearing
    cites = ("harris_2001",)
    place = "bearing"
    steady = True
    extra = ("stiffness", "stiffening", "residual")
    forms = (CandidateForm("clearance", 5e-7, signed=False),)
    calibration = (CalibrationParameter("softening", 0.05, 0.3, -0.9, 0.9),)
    softening: float = param("1", bounds=(-1.0, 0.98), doc="Share of the bearing's stiffness that is missing.")
    clearance: float = param("m", bounds=(0.0, 1e-4), doc="Radial clearance.")

    thrust: float = param("N", bounds=(0.0, 1e7), doc="Thrust load; 0 is that at which the stiffness holds.")
    rated_thrust: float = param("N", bounds=(0.0, 1e7), doc="Thrust load at which the bearing's stiffness holds.")
    bearing: float | None = param(
        "1", default=None, bounds=(0.0, 63.0), whole=True,
        doc="Index among the bearings, from 0, or name of the linear bearing; the first one when not given.",
    )  # fmt: skip

    def derived(self, machine: Any) -> dict[str, float]:
        """Mean stiffness of the linear bearing [N/m], and its growth by the thrust load."""
        grown = (self.thrust / self.rated_thrust) ** (1 / 3) if self.thrust and self.rated_thrust else 1.0
        number = machine.spring_number(self)
        if number is None:
            return {"stiffness": 0.0, "stiffening": 1.0}
        return {"stiffness": 0.5 * float(machine.bearings[number].K.trace()), "stiffening": grown}

    def problems(self, machine: Any) -> dict[str, str]:
        """There is a bearing with a constant stiffness, and a load with which to compare."""
        number = machine.spring_number(self)
        if number is None:
            return {"": "there is no bearing with kind = 'linear' to soften; add one or remove this"}
        if self.thrust and not self.rated_thrust:
            return {"rated_thrust": "missing: the stiffness grows with the ratio of both loads; add it"}
        return {}
