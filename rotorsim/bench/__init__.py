"""Benchmarks: speed, accuracy and the shipped rig against its references, measured on this computer."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
