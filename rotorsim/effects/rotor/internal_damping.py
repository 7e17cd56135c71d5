r"""Rotating (internal) damping of the shaft: material, shrink fits, splines.

.. math:: F = -\beta\,K_s\,(\dot q - \Omega\,e_z \times q)

with the shaft's own stiffness K_s: it damps a shaft at rest and drives forward whirl above a threshold, which for
isotropic supports with external damping c_e is Omega = omega (1 + c_e / c_i).

omega is the whirl's frequency, c_e and c_i its modal dampings. The torque that drives the whirl is not taken from the
turning shaft.

Source: Kimball (1924); Genta (2005), Dynamics of Rotating Systems, chapter 3.
"""

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, Effect, param, register


@inlined
def internal_damping(p):
    """Ratio [s] of damping to stiffness."""
    return p.time


@register
class InternalDamping(Effect):
    """Internal damping of the turning shaft."""

    port = "rotating"
    kernel = internal_damping
    cites = ("genta_2005", "kimball_1924")
    single = True
    forms = (CandidateForm("time", 1e-5, signed=False, alone_of="circulatory"),)
    time: float = param("s", bounds=(0.0, 1e-2), doc="Ratio of damping to stiffness.")
