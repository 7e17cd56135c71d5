"""Unbalance from measured 1X vectors: influence coefficients, a physical model, and correction weights."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
