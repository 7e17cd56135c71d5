"""Finite-element shafts: Timoshenko beams, rigid discs and linear bearings, their modes and responses.

Everything is in SI units and numpy arrays.  Frame: z along the shaft, x horizontal, y vertical; angles and
whirl are positive from x to y.

Examples
--------
>>> from fe_shaft import BearingElement, DiskElement, Rotor, ShaftElement, steel
>>> shaft = [ShaftElement(0.25, 0, 0.05) for _ in range(6)]
>>> disc = DiskElement.from_geometry(2, steel, width=0.07, i_d=0.05, o_d=0.28)
>>> rotor = Rotor(shaft, [disc], [BearingElement(0, 1e6, 0), BearingElement(6, 1e6, 0)])
>>> rotor.ndof
28
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
