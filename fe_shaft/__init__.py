"""Finite-element shafts: Timoshenko beams, rigid discs and linear bearings, their modes and responses.

Everything is in SI units and numpy arrays.  Frame: z along the shaft, x horizontal, y vertical; angles and
whirl are positive from x to y.

Examples
--------
>>> from fe_shaft import BearingElement, DiskElement, Rotor, ShaftElement, steel
>>> shaft = [ShaftElement(0.25, 0, 0.05) for _ in range(6)]
>>> disc = DiskElement.from_geometry(2, steel, width=0.07, i_d=0.05, o_d=0.28)
>>> rotor = Rotor(shaft, [disc], [BearingElement(0, 1e6, 0), BearingElement(6, 1e6, 0)])
>>> rotor.ndof
28
"""

from typing import TYPE_CHECKING

from fe_shaft.bearing import BearingElement
from fe_shaft.campbell import CampbellResult
from fe_shaft.checks import ShaftError
from fe_shaft.critical import CriticalSpeedResult
from fe_shaft.masses import DiskElement, PointMass
from fe_shaft.modal import ModalResult
from fe_shaft.reduction import ReducedRotor, modal_reduction
from fe_shaft.response import ForcedResult, FrequencyResponse
from fe_shaft.rotor import Rotor
from fe_shaft.shaft import Material, ShaftElement, steel
from fe_shaft.stability import StabilityResult
from fe_shaft.static import StaticResult
from fe_shaft.transient import TimeResult, Unbalance
from fe_shaft.ucs import UcsResult
from rotorsim.base.public import named

__all__ = [
    "BearingElement",
    "CampbellResult",
    "CriticalSpeedResult",
    "DiskElement",
    "ForcedResult",
    "FrequencyResponse",
    "Material",
    "ModalResult",
    "PointMass",
    "ReducedRotor",
    "Rotor",
    "ShaftElement",
    "ShaftError",
    "StabilityResult",
    "StaticResult",
    "TimeResult",
    "UcsResult",
    "Unbalance",
    "modal_reduction",
    "steel",
]


if not TYPE_CHECKING:
    __getattr__, __dir__ = named(__name__, __all__)
