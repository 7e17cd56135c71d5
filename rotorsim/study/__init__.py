"""Studies of identification against physics: a campaign, models of its records, the linearised plant."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
