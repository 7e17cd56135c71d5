"""Physical effects in families, one file each; importing this package registers the shipped ones.

The first use of `REGISTRY` loads the effects of installed packages, which find this package complete.
"""

from importlib import import_module
from pkgutil import walk_packages
from typing import TYPE_CHECKING, Any

from rotorsim.base.public import refuse
from rotorsim.effects.base import (
    FILM_PORTS,
    PORTS,
    Effect,
    FilmEffect,
    SampledEffect,
    numeric_fields,
    param,
    register,
    registry,
)

for _module in walk_packages(__path__, f"{__name__}."):
    import_module(_module.name)

if TYPE_CHECKING:
    from rotorsim.effects.base import REGISTRY
else:

    def __getattr__(name: str) -> Any:
        if name == "REGISTRY":
            return registry()
        refuse(__name__, name, __all__)

    def __dir__() -> list[str]:
        return sorted(__all__)


__all__ = [
    "FILM_PORTS",
    "PORTS",
    "REGISTRY",
    "Effect",
    "FilmEffect",
    "SampledEffect",
    "numeric_fields",
    "param",
    "register",
]
