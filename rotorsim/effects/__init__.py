"""Physical effects in families: a file for each, with its name, is imported when the effect is asked for.

The first use of `REGISTRY` loads the effects of installed packages, which find this package complete.
"""

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
