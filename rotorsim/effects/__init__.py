"""Physical effects, one file each; importing this package registers the shipped ones."""

from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules

from rotorsim.effects.base import FILM_PORTS, PORTS, REGISTRY, Effect, numeric_fields, param, register

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
# effects of installed packages: whoever installs one chose to run it; nothing that is named in a data file is imported
for _point in entry_points(group="rotorsim.effects"):
    _point.load()

__all__ = ["FILM_PORTS", "PORTS", "REGISTRY", "Effect", "numeric_fields", "param", "register"]
