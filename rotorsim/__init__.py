"""First-principles simulation of rotors on active gas bearings.

    import rotorsim as rs
    plant = rs.Plant(rs.load_machine("dtu_gas_bearing"))
    record = rs.experiments.runup(plant, 0.0, 628.3, 10.5, 0.3e6)

Names are imported when they are first used, so that ``import rotorsim`` is quick and silent.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotorsim import experiments
    from rotorsim.control import load_law
    from rotorsim.machine import Machine, load_machine
    from rotorsim.plant import Plant

__all__ = ["Machine", "Plant", "experiments", "load_law", "load_machine"]

_HOMES = {
    "load_law": "rotorsim.control",
    "load_machine": "rotorsim.machine",
    "Machine": "rotorsim.machine",
    "Plant": "rotorsim.plant",
}


def __getattr__(name: str) -> Any:
    if name == "experiments":
        return import_module("rotorsim.experiments")
    if name not in _HOMES:
        raise AttributeError(f"module 'rotorsim' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
