from rotorsim.base.errors import FilmError as FilmError

from .bearing import (
    Coefficients as Coefficients,
    GasBearing as GasBearing,
    March as March,
    SteadyFilm as SteadyFilm,
)
from .injector import Injector as Injector
