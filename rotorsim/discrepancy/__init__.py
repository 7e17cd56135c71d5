"""Diagnosis of model errors: compare simulation and measurement, find the missing effect, add it, show the gap.

`diagnose` is the whole of it; `hide` makes records in which an effect is hidden, to try it on.
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
