"""Linear analyses of the coupled machine: operating maps, onsets, mode shapes, calibration."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
