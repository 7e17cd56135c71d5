from .bearing import BearingElement as BearingElement
from .campbell import CampbellResult as CampbellResult
from .checks import ShaftError as ShaftError
from .critical import CriticalSpeedResult as CriticalSpeedResult, UcsResult as UcsResult
from .modal import ModalResult as ModalResult
from .reduction import ReducedRotor as ReducedRotor, modal_reduction as modal_reduction
from .response import ForcedResult as ForcedResult, Receptance as Receptance
from .rotor import Rotor as Rotor
from .shaft import (
    DiskElement as DiskElement,
    Material as Material,
    PointMass as PointMass,
    ShaftElement as ShaftElement,
    steel as steel,
)
from .stability import StabilityResult as StabilityResult
from .static import StaticResult as StaticResult
from .transient import TimeResult as TimeResult, Unbalance as Unbalance
