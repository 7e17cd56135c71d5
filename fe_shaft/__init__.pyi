from .assembly import ReducedRotor as ReducedRotor, modal_reduction as modal_reduction
from .campbell import CampbellResult as CampbellResult
from .critical import (
    CriticalSpeedResult as CriticalSpeedResult,
    StabilityResult as StabilityResult,
    UcsResult as UcsResult,
)
from .modal import ModalResult as ModalResult
from .response import ForcedResult as ForcedResult, Receptance as Receptance, StaticResult as StaticResult
from .rotor import Rotor as Rotor
from .shaft import (
    BearingElement as BearingElement,
    DiskElement as DiskElement,
    Material as Material,
    PointMass as PointMass,
    ShaftElement as ShaftElement,
    ShaftError as ShaftError,
    steel as steel,
)
from .transient import TimeResult as TimeResult, Unbalance as Unbalance
