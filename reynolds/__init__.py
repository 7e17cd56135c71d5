"""Gas film of a journal bearing: modified Reynolds equation with injection, in SI floats.

from reynolds import GasBearing, Injector
film = GasBearing(0.02, 0.04, 25e-6).steady(journal=(10e-6, 0), speed=628.3)
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
