"""The gas film alone: modified Reynolds equation with injection, in SI floats.

from reynolds import GasBearing, Injector
film = GasBearing(0.02, 0.04, 25e-6).steady(journal=(10e-6, 0), speed=628.3)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reynolds.bearing import Coefficients, FilmError, GasBearing, March, SteadyFilm
    from reynolds.injector import Injector

_HOMES = {"Injector": "injector"}
__all__ = ["Coefficients", "FilmError", "GasBearing", "Injector", "March", "SteadyFilm"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'reynolds' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(f"reynolds.{_HOMES.get(name, 'bearing')}"), name)
