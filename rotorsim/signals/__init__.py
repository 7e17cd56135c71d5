"""Signal analysis of records: orders, spectra, frequency responses, ring-downs, runout, static gains; no plotting."""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
