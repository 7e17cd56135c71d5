"""The table [changes] of a mapping: what was changed on purpose before a record was made.

::

    [changes]
    trial_weight = { me = "300 g*mm", phase = "45 deg", position = "160 mm" }   # or a list; else the first disc
    "effects.gas_heating.rise" = "12 K"                                         # a new value of the machine file

It becomes the attribute `changes` of the record, a JSON text with the weights in SI; `rotorsim diagnose` reads it.
"""

from __future__ import annotations

import json
from typing import Any

from identification.errors import ReadError
from identification.records.units import quantity_at
from rotorsim.base.sentences import quote

WEIGHT = "trial_weight"
_PARTS = {"me": "kg*m", "phase": "rad", "position": "m"}


def stated_changes(table: dict[str, Any]) -> dict[str, str]:
    """The attribute; raises ReadError with one sentence."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        if name == WEIGHT:
            weights = value if isinstance(value, list) else [value]
            found[name] = [_weight(f"changes.{WEIGHT}", w) for w in weights]
        elif isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise ReadError(f"changes.{quote(name)}: {quote(value)}; quote the path and give one value with its unit")
        else:
            found[name] = value
    return {"changes": json.dumps(found)} if found else {}


def _weight(path: str, weight: Any) -> dict[str, float]:
    if not isinstance(weight, dict) or "me" not in weight:
        raise ReadError(f"{path}: {quote(weight)}; write {{ me = '300 g*mm', phase = '45 deg' }}")
    for name in weight:
        if name not in _PARTS:
            raise ReadError(f"{path}.{name}: is not known; give {', '.join(_PARTS)}")
    return {name: quantity_at(f"{path}.{name}", value, _PARTS[name]) for name, value in weight.items()}
