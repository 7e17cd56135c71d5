from .bearing import (
    Coefficients as Coefficients,
    GasBearing as GasBearing,
    March as March,
    SteadyFilm as SteadyFilm,
)
from .grid import FilmError as FilmError
from .injector import Injector as Injector
from .sleeve import RingFeed as RingFeed, SpiralGrooves as SpiralGrooves
from .thrust import GasThrustBearing as GasThrustBearing, SteadyThrust as SteadyThrust
