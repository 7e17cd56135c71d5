"""Verification of a law on the nonlinear plant against declared criteria: pass or fail."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
