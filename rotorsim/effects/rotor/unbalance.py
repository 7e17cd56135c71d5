r"""Residual unbalance in one plane.

.. math:: f_x = me\,(\Omega^2 \cos(\varphi+\beta) + \dot\Omega \sin(\varphi+\beta)), \quad
          f_y = me\,(\Omega^2 \sin(\varphi+\beta) - \dot\Omega \cos(\varphi+\beta)).

A mass m at radius e turns with the shaft angle phi; beta is its angular position. The phase is continuous whatever the
speed does, because the force depends on the shaft angle and not on Omega t.

The torque of the unbalance on the turning shaft, of second order in the motion, is left out.

Source: thesis eq. (1.1); the tangential term of a run-up is in Friswell et al. (2010), section 6.2.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import TURN, CalibrationParameter, CandidateForm, Effect, param, register


@inlined
def unbalance(t, angle, speed, acceleration, p):
    """Force (fx, fy) [N] of the unbalance at shaft angle `angle` [rad]."""
    c = math.cos(angle + p.phase)
    s = math.sin(angle + p.phase)
    normal = p.me * speed * speed
    tangential = p.me * acceleration
    return normal * c + tangential * s, normal * s - tangential * c


@register
class RotorUnbalance(Effect):
    """Unbalance of one plane; give a list of tables for several planes."""

    port = "force"
    kernel = unbalance
    cites = ("friswell_2010", "thesis")
    forms = (CandidateForm("me", 1e-6, "phase", resembles="a skew of the disc"),)
    places = 2
    me: float = param("kg*m", bounds=(0.0, 1e-2), doc="Unbalance, mass times eccentricity.")
    phase: float = param("rad", bounds=(-TURN, TURN), doc="Angular position on the shaft, from x towards y.")
    position: float | None = param(
        "m", default=None, bounds=(-100.0, 100.0), doc="Plane along the shaft; the first disc when not given."
    )

    @classmethod
    def neutral(cls, machine: Any, place: int) -> RotorUnbalance:
        """A neutral one at the disc first, then in the plane of the film or of the second disc."""
        if place == 0 or (machine.film is None and len(machine.discs) < 2):
            return cls()
        return cls(position=machine.discs[1].position if machine.film is None else machine.film.position)

    @classmethod
    def candidate_forms(cls, machine: Any) -> tuple[CandidateForm, ...]:
        """The plane of the film: that of the disc is calibrated."""
        return cls.forms if machine.film is not None else ()

    @classmethod
    def calibration_of(cls, machine: Any) -> tuple[CalibrationParameter, ...]:
        """Residual unbalance of the disc, and of a second one on linear bearings, in proportion to the mass [kg]."""
        size = 2e-7 * machine.mass / 3.5
        one = CalibrationParameter("me", 4 * size, 40 * size, phase="phase", film_only=False)
        return (one, replace(one, place=1)) if machine.film is None and len(machine.discs) > 1 else (one,)
