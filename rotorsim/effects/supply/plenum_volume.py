r"""Plenum volume different from the machine file.

.. math:: V_k \;\to\; V_k\,(1 + \delta)

Above some 5 mm3 the rig's film and plena hammer: the damping of the first mode turns negative. Source: plenum balance,
injector.py; Licht & Elrod (1960) for pneumatic hammer.
"""

from __future__ import annotations

from typing import Any

from reynolds.jit import inlined
from rotorsim.effects.base import CalibrationParameter, CandidateForm, FilmEffect, param, register
from rotorsim.effects.supply.weak_injector import no_such_injector


@inlined
def plenum_volume(k, p):
    """Factor on the volume of plenum k."""
    return 1.0 + p.change if p.injector == 0.0 or p.injector == k + 1.0 else 1.0


@register
class PlenumVolume(FilmEffect):
    """Other volume of the plena, or of one."""

    port = "plenum"
    kernel = plenum_volume
    cites = ("licht_1960",)
    forms = (CandidateForm("change", 0.3),)
    calibration = (CalibrationParameter("change", 0.05, 0.20, -0.7, 3.0, trend=(0.05, 0.05)),)
    places = 2
    change: float = param("1", bounds=(-0.95, 50.0), doc="Relative change of the volume.")
    injector: float = param("1", bounds=(0.0, 64.0), whole=True, doc="Number of the injector, from 1; 0 for all.")

    @classmethod
    def neutral(cls, machine: Any, place: int) -> PlenumVolume:
        """A neutral one of all plena first, then of the first plenum alone."""
        return cls() if place == 0 else cls(injector=1.0)

    def problems(self, machine: Any) -> dict[str, str]:
        """The injector exists, or all are meant."""
        return {} if self.injector == 0.0 else no_such_injector(self, self.injector, machine)
