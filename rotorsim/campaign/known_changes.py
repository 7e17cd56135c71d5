"""Table [changes] of a plan: what is changed on purpose on the rig for its records, written as in a mapping.

::

    [changes]
    trial_weight = { me = "12 g*mm", phase = "30 deg" }    # or a list; with `position`, another plane than the disc's
    sensor_ring = { angle = "30 deg" }                     # of both probes, from x towards y
    "effects.gas_heating.rise" = "12 K"                    # a new value of the machine file

Each record states it in its attribute `changes`, so that `rotorsim diagnose` takes it into account.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from identification.records.mapping import stated_changes
from rotorsim.base.errors import RotorsimError
from rotorsim.base.input_files import parse_json
from rotorsim.campaign.axes import change
from rotorsim.campaign.errors import PlanError
from rotorsim.discrepancy.changes import RING, WEIGHT, known_changes, with_ring
from rotorsim.machine import Machine

PLACE = "changes"


def changes_text(table: Mapping[str, Any]) -> str:
    """The attribute `changes` of a record, JSON in SI; empty without changes; raises PlanError."""
    try:
        return stated_changes(dict(table)).get(PLACE, "")
    except RotorsimError as error:
        raise PlanError(str(error)) from error


def changed_paths(table: Mapping[str, Any]) -> set[str]:
    """Names in a table [changes], and the paths of the machine file whose values the sensor ring in it takes over."""
    ring = table.get(RING)
    return {*table, *(f"effects.{RING}.{key}" for key in (ring if isinstance(ring, Mapping) else ()))}


def with_changes(machine: Machine, text: str) -> Machine:
    """The machine as it is changed for a record; trial weights add to its unbalance as vectors; raises PlanError."""
    if not text:
        return machine
    table = parse_json(text)
    try:
        known_changes(machine, table, PLACE)
    except RotorsimError as error:
        raise PlanError(str(error).splitlines()[0]) from error
    weights, ring = table.pop(WEIGHT, []), table.pop(RING, None)
    for path, value in table.items():
        machine = change(machine, path, value, PLACE)
    if ring is not None:
        machine = with_ring(machine, ring["angle"])
    return _weighted(machine, weights)


def _weighted(machine: Machine, weights: list[dict[str, float]]) -> Machine:
    """The machine with trial weights in the planes of its unbalance."""
    sums = known_changes(machine, {WEIGHT: weights}, PLACE)
    values: dict[str, float] = {}
    for number, own in enumerate(machine.effects.get("unbalance", ())):
        key = f"unbalance.{number}.me~phase"
        weight = complex(sums.get(f"{key}.c", 0.0), sums.get(f"{key}.s", 0.0))
        if weight:
            whole = own.me * np.exp(1j * own.phase) + weight  # type: ignore[attr-defined]
            here = f"effects.unbalance.{number}"
            values |= {f"{here}.me": float(abs(whole)), f"{here}.phase": float(np.angle(whole))}
    return machine.with_(values)
