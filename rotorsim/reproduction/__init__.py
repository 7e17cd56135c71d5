"""Reproduction of the thesis: campaigns on the virtual rig, identification, control and verdicts on its claims."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
