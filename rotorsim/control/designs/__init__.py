"""Controller designs, one file per method: identified model in, law out; imported when they are first used."""

import lazy_loader

METHODS = ["h2_scheduled", "hinf", "lead", "lpv", "lqr", "p", "placement", "youla"]
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, METHODS)
