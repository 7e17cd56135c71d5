"""Coupled plant: shaft, film, injectors and effects in one time step."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
