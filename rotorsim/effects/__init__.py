"""Physical effects in families, one file each; importing this package registers the shipped ones."""

from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import walk_packages

from rotorsim.effects.base import FILM_PORTS, PORTS, REGISTRY, Effect, numeric_fields, param, register

for _module in walk_packages(__path__, f"{__name__}."):
    import_module(_module.name)
# effects of installed packages: whoever installs one chose to run it; nothing that is named in a data file is imported
for _point in entry_points(group="rotorsim.effects"):
    _point.load()

__all__ = ["FILM_PORTS", "PORTS", "REGISTRY", "Effect", "numeric_fields", "param", "register"]
