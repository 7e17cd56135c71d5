r"""Slip of the gas at the walls.

.. math:: h^3 p \;\to\; h^3 p + 6\,\lambda_a p_a\,h^2, \qquad
          \frac{\mu U}{h} \;\to\; \frac{\mu U}{h + 2 \lambda_a p_a / p}

in the pressure-driven flow and in the drag, of films with any form of sleeve (`reynolds.film`), lambda_a the mean free
path at ambient pressure: 68 nm in air, where the film's Knudsen number is a few thousandths. Source: Burgdorfer (1959),
first order; lifts an assumption of the Reynolds equation.
"""

from reynolds.jit import inlined
from rotorsim.effects.base import CandidateForm, FilmEffect, param, register


@inlined
def slip(t, speed, p):
    """Factor on the viscosity and mean free path [m]."""
    return 1.0, p.mean_free_path


@register
class Slip(FilmEffect):
    """Slip of the gas at the walls."""

    port = "gas"
    kernel = slip
    cites = ("burgdorfer_1959",)
    single = True
    forms = (CandidateForm("mean_free_path", 6.8e-8, signed=False, signature="properties of the gas"),)
    mean_free_path: float = param("m", bounds=(0.0, 5e-6), doc="Mean free path at ambient pressure; 0.068 um in air.")
