"""The gap workflow: find where simulation and measurement disagree, name the missing effect, add it, show the gap.

`diagnose` is the whole of it; `hide` makes records in which an effect is hidden, to try it on.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotorsim.discrepancy.hidden import hide
    from rotorsim.discrepancy.result import Diagnosis
    from rotorsim.discrepancy.workflow import Workshop, diagnose

__all__ = ["Diagnosis", "Workshop", "diagnose", "hide"]
_HOMES = {"hide": "hidden", "Diagnosis": "result", "diagnose": "workflow", "Workshop": "workflow"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'rotorsim.discrepancy' has no attribute {name!r}")
    value = getattr(import_module(f"rotorsim.discrepancy.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
