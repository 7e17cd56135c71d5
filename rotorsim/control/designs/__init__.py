"""Controller designs, one file per method: identified model in, law out; imported when they are first used."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
