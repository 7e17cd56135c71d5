"""Diagnosis of model errors: compare simulation and measurement, find the missing effect, add it, show the gap.

`diagnose` is the whole of it; `hide` makes records in which an effect is hidden, to try it on.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
