"""Controller designs, one file each (``design(model, Spec()) -> Law``), and the scheduled discrete law they return."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
