from .bearing import (
    Coefficients as Coefficients,
    FilmError as FilmError,
    GasBearing as GasBearing,
    March as March,
    SteadyFilm as SteadyFilm,
)
from .injector import Injector as Injector
