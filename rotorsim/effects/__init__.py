"""Physical effects in families, one file each; importing this package registers the shipped ones."""

from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import walk_packages

from rotorsim.effects.base import FILM_PORTS, PORTS, REGISTRY, Effect, numeric_fields, param, register
from rotorsim.effects.installed import load_installed

for _module in walk_packages(__path__, f"{__name__}."):
    import_module(_module.name)
for _point in entry_points(group="rotorsim.effects"):
    load_installed(_point)

__all__ = ["FILM_PORTS", "PORTS", "REGISTRY", "Effect", "numeric_fields", "param", "register"]
