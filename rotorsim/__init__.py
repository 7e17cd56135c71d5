"""First-principles simulation of rotors on active gas bearings.

Names are imported when they are first used, so that ``import rotorsim`` is quick and silent.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotorsim.machine import load_machine

__all__ = ["load_machine"]

_HOMES = {"load_machine": "rotorsim.machine"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rotorsim' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
