"""Controller designs, one file each (``design(model, Spec()) -> Law``), and the scheduled discrete law they return."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
