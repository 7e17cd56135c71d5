r"""Labyrinth seal: damping against gas that turns with a share of the shaft's speed, and cross-coupled stiffness.

.. math:: F = -\begin{bmatrix} K & k \\ -k & K \end{bmatrix} \begin{bmatrix} x \\ y \end{bmatrix}
          - C \begin{bmatrix} \dot x \\ \dot y \end{bmatrix}, \qquad
          k = k_0\,\mathrm{sgn}\,\Omega + \lambda\,\Omega\,C

lambda is the mean swirl of the gas over the speed of the shaft, k_0 what swirl at the inlet adds, which the shaft
turns with it (a shaft at rest counts as turning from x to y).

A seal drives forward whirl where k > omega (C + c_e), for a whirl at omega and the other damping c_e of its plane, so
that without k_0 the threshold is Omega = (omega / lambda)(1 + c_e / C).

With lambda = 1 it is internal damping at one plane; of a rotor in one mode records tell the two apart by the damping
alone.

The shaft keeps the gas turning, as through a gear of the ratio lambda: the torque -lambda e_z (q x F_C) of the
damping force F_C against the gas brakes it.

So what the whirl takes up comes from the spin, and nothing is lost but C |v - lambda Omega e_z x q|^2. What k_0 feeds
comes from the flow through the seal.

Source: Childs (1993), Turbomachinery Rotordynamics, chapter 5. Assumes: small motion about the centre, no added mass,
no cross damping.
"""

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, Effect, param, register


@inlined
def labyrinth_seal(t, angle, speed, x, y, vx, vy, p):
    """Force (fx, fy) [N] of the gas on the shaft."""
    inlet = p.cross_stiffness if speed >= 0.0 else -p.cross_stiffness
    cross = inlet + p.swirl * speed * p.damping
    return (
        -p.stiffness * x - cross * y - p.damping * vx,
        -p.stiffness * y + cross * x - p.damping * vy,
    )


@inlined
def labyrinth_seal_torque(t, angle, speed, x, y, vx, vy, p):
    """Torque [N m] on the turning shaft of the gas that it keeps turning."""
    swirl = p.swirl * speed
    return -p.swirl * p.damping * (swirl * (x * x + y * y) - (x * vy - y * vx))


@register
class LabyrinthSeal(Effect):
    """Labyrinth seal, at the disc or at `position`."""

    port = "motion"
    kernel = labyrinth_seal
    braking = labyrinth_seal_torque
    steady = True
    cites = ("childs_1993",)
    forms = (
        CandidateForm(
            "damping", 5.0, options=(("swirl", (0.5,)),), refine=(("swirl", 0.1),), signed=False,
            alone_of="circulatory", same_as=("internal_damping.time", "swirl", 1.0, 1.0),
        ),
        CandidateForm("cross_stiffness", 1e3, alone_of="circulatory"),
    )  # fmt: skip
    damping: float = param("N*s/m", bounds=(0.0, 1e6), doc="Direct damping C.")
    swirl: float = param("1", default=0.5, bounds=(-2.0, 2.0), doc="Mean swirl of the gas over the shaft's speed.")
    cross_stiffness: float = param("N/m", bounds=(-1e9, 1e9), doc="Part of k that does not grow with the speed.")
    stiffness: float = param("N/m", bounds=(-1e9, 1e9), doc="Direct stiffness K.")
    position: float | None = param(
        "m", default=None, bounds=(-100.0, 100.0), doc="Plane along the shaft; the first disc when not given."
    )
