"""Errors and warnings that calls raise, each with a one-sentence message; `RotorsimError` is the base of almost all."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
