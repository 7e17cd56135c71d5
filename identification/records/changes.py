"""The table [changes] of a mapping: what was changed on purpose before a record was made.

::

    [changes]
    trial_weight = { me = "300 g*mm", phase = "45 deg", position = "160 mm" }   # or a list; else the first disc
    sensor_ring = { angle = "30 deg" }                                          # of both probes, from x towards y
    "effects.gas_heating.rise" = "12 K"                                         # a new value of the machine file

It becomes the attribute `changes` of the record, a JSON text with weights and ring in SI; `rotorsim diagnose` reads it.
"""

from __future__ import annotations

import json
from typing import Any

from identification.errors import ReadError
from identification.records.units import quantity_at
from rotorsim.base.sentences import quote

WEIGHT, RING = "trial_weight", "sensor_ring"
_PARTS = {WEIGHT: {"me": "kg*m", "phase": "rad", "position": "m"}, RING: {"angle": "rad"}}
_EXAMPLES = {WEIGHT: "{ me = '300 g*mm', phase = '45 deg' }", RING: "{ angle = '30 deg' }"}


def stated_changes(table: dict[str, Any]) -> dict[str, str]:
    """The attribute; raises ReadError with one sentence."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        if name == WEIGHT:
            weights = value if isinstance(value, list) else [value]
            found[name] = [_numbers(WEIGHT, w) for w in weights]
        elif name == RING:
            found[name] = _numbers(RING, value)
        elif isinstance(value, bool) or not isinstance(value, (str, int, float)):
            raise ReadError(f"changes.{quote(name)}: {quote(value)}; quote the path and give one value with its unit")
        else:
            found[name] = value
    return {"changes": json.dumps(found)} if found else {}


def _numbers(change: str, given: Any) -> dict[str, float]:
    """The numbers [SI] of a weight or ring, of which the first is needed."""
    path, units = f"changes.{change}", _PARTS[change]
    if not isinstance(given, dict) or next(iter(units)) not in given:
        raise ReadError(f"{path}: {quote(given)}; write {_EXAMPLES[change]}")
    for name in given:
        if name not in units:
            raise ReadError(f"{path}.{name}: is not known; give {', '.join(units)}")
    return {name: quantity_at(f"{path}.{name}", value, units[name]) for name, value in given.items()}
