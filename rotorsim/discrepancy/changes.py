"""Known changes: what was changed on purpose for one record, such as a trial weight.

A record states them in its attribute `changes`, a JSON text as the mapping's table `[changes]` gives it:
`trial_weight`, one or several {me, phase, position} in SI, added to the unbalance that is there; `sensor_ring`, the
{angle} [rad] at which the ring of both probes stands; and new values by a path of the machine file
('effects.gas_heating.rise'). They hold for that record alone; what the records share is
calibrated as before, and better: a known change of the force shows the response by itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.input_files import parse_json
from rotorsim.effects import REGISTRY
from rotorsim.effects.base import TURN
from rotorsim.machine import Machine

WEIGHT, RING = "trial_weight", "sensor_ring"
RING_KEY = f"{RING}.0.angle"
"""Key of the ring's angle among the sums."""
PLANE, MAIN = "plane", -math.inf
"""Key of the plane [m] of the probes that a trial shows, and what stands for the machine file's, which none states."""
NEAR = 1e-6
"""Distance [m] within which two planes are the same."""


def known_changes(machine: Machine, stated: object, name: str) -> dict[str, float]:
    """Changes by key of `calibration` that a record's attribute states; raises DataError with one sentence."""
    table = _table(stated, name)
    weights, ring = table.pop(WEIGHT, []), table.pop(RING, None)
    sums = _of_paths(machine, table, name)
    if ring is not None:
        if sums.get(RING_KEY):
            raise DataError(
                f"{name}: the angle of the sensor ring is stated twice; leave one of them out", argument="sensor_ring"
            )
        sums[RING_KEY] = _angle(ring, name) - ring_angle(machine)
    for weight in weights if isinstance(weights, list) else [weights]:
        for key, value in _of_weight(machine, weight, name).items():
            sums[key] = sums.get(key, 0.0) + value
    return {key: value for key, value in sums.items() if value}


def _table(stated: object, name: str) -> dict[str, Any]:
    if stated is None or stated == "":
        return {}
    try:
        table = parse_json(stated) if isinstance(stated, (str, bytes)) else stated
    except ValueError as error:
        raise DataError(f"{name}: the attribute 'changes' is not JSON; give it as [changes] of a mapping") from error
    if not isinstance(table, Mapping):
        raise DataError(f"{name}: the attribute 'changes' is not a table; give it as [changes] of a mapping")
    return dict(table)


def _of_weight(machine: Machine, weight: Any, name: str) -> dict[str, float]:
    """Changes that a trial weight makes: cosine and sine of the unbalance [kg m] of its plane."""
    try:
        me, phase = float(weight["me"]), float(weight.get("phase", 0.0))
        position = None if weight.get("position") is None else float(weight["position"])
    except (TypeError, KeyError, ValueError, AttributeError) as error:
        raise DataError(f"{name}: {WEIGHT} {weight!r}; give me, phase and, for another plane, position") from error
    if not (math.isfinite(me) and math.isfinite(phase)):
        raise DataError(f"{name}: {WEIGHT} {weight!r}; give numbers")
    planes = [e.position for e in machine.effects.get("unbalance", ())]  # type: ignore[attr-defined]
    disc = machine.discs[0].position if machine.discs else None
    where = position if position is not None else disc
    for number, plane in enumerate(planes):
        own = disc if plane is None else plane
        if own is not None and where is not None and abs(own - where) < NEAR:
            key = f"unbalance.{number}.me~phase"
            return {f"{key}.c": me * math.cos(phase), f"{key}.s": me * math.sin(phase)}
    shown = "of the first disc" if position is None else f"at {1e3 * position:.6g} mm"
    raise DataError(
        f"{name}: a trial weight in the plane {shown}, where the machine file has no [[effects.unbalance]]; "
        "add one with that position and me = '0 kg*m'"
    )


def _angle(ring: Any, name: str) -> float:
    """Angle [rad] of a stated sensor ring."""
    angle = ring.get("angle") if isinstance(ring, Mapping) else None
    if isinstance(angle, bool) or not isinstance(angle, (int, float)) or not abs(angle) <= TURN:  # nor a number
        raise DataError(
            f"{name}: {RING} {ring!r}; give its angle in rad, a turn at most", argument="sensor_ring", value=ring
        )
    return float(angle)


def ring_angle(machine: Machine) -> float:
    """Angle [rad] at which the machine file has the sensor ring."""
    own = machine.effects.get(RING, ())
    return float(own[0].angle) if own else 0.0  # type: ignore[attr-defined]


def ring_axes(angle: float) -> np.ndarray:
    """Direction cosines (2, 2) of the probes to x and y with their ring at an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])


def with_ring(machine: Machine, angle: float) -> Machine:
    """The machine with the sensor ring at an angle [rad]."""
    return machine.with_({"effects": {**machine.effects, RING: (REGISTRY[RING](angle=angle),)}})


def _of_paths(machine: Machine, table: Mapping[str, Any], name: str) -> dict[str, float]:
    """Changes by new values of an effect's parameters."""
    other = machine
    for path, value in table.items():
        try:
            other = other.replace(path, value)
        except MachineFileError as error:
            raise DataError(f"{name}: known change: {str(error).splitlines()[0]}") from error
    fixed = [name for name, own in machine.effects.items() if own[0].role == "scatter"]
    same = set(other.effects) == set(machine.effects) and all(other.effects[e] == machine.effects[e] for e in fixed)
    if not same or other.with_({"effects": dict(machine.effects)}) != machine:
        raise DataError(
            f"{name}: known change of {', '.join(table)}: only a trial weight, the sensor ring and parameters of "
            "effects in the machine file may differ from record to record"
        )
    sums: dict[str, float] = {}
    for effect, tables in machine.effects.items():
        for number, (old, new) in enumerate(zip(tables, other.effects[effect], strict=True)):
            sums |= _difference(f"{effect}.{number}", old, new)
    return sums


def _difference(where: str, old: Any, new: Any) -> dict[str, float]:
    if where.startswith("unbalance."):
        step = complex(new.me * np.exp(1j * new.phase) - old.me * np.exp(1j * old.phase))
        return {f"{where}.me~phase.c": step.real, f"{where}.me~phase.s": step.imag}
    names = [f.name for f in fields(old) if isinstance(getattr(old, f.name), (int, float))]
    return {f"{where}.{n}": float(getattr(new, n)) - float(getattr(old, n)) for n in names}


def notes_on_changes(changes: Mapping[str, Mapping[str, float]]) -> list[str]:
    """A sentence on the records with known changes, by record."""
    plain = {name: sorted({key.partition("~")[0] for key in own}) for name, own in changes.items() if own}
    found = [f"{name} ({', '.join(keys)})" for name, keys in plain.items()]
    return [f"changed on purpose, as stated: {'; '.join(found)}"] if found else []
