"""Controller designs, one file per method: identified model in, law out; imported when they are first used.

The stub lists them; what it lists is a command, a name of `rs.control` and an entry of the catalogue.
"""

from rotorsim.base.public import lazy

__getattr__, __dir__, __all__ = lazy(__name__, __file__)
IN_ORDER = ("p", "lead", "placement", "lqr", "hinf", "lpv", "h2_scheduled", "youla")
"""Designs with a law file, from the simplest to those over a range of speeds."""
IN_PYTHON = ("mpc",)
"""Designs without a law file: they are used from Python alone."""
