"""Changes that a plan may make from record to record, and those that a machine can do."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError

if TYPE_CHECKING:
    from rotorsim.machine import Machine

ALLOWED = {
    "speed": "shaft speed, within the machine's range",
    "pressure": "injection pressure",
    "amplitude": "amplitude of the excitation",
    "axis": "excitation of one axis alone; of vectors of one probe, its angle",
    "bias": "constant part of the reference, which biases the pins",
    "step": "steps of the reference, held so that slow effects show",
    "trial-weight": "a known unbalance mounted in a balancing plane",
    "sensor-ring": "the ring of the displacement probes, turned by a stated angle",
    "slow-roll": "slow revolutions, in which the probes read runout",
    "coast-down": "vectors of 1X, 2X, 3X while the shaft slows down at a stated rate",
}
"""Changes that a plan may make from record to record, with their meaning."""
OF_VECTORS = ("speed", "axis", "trial-weight", "sensor-ring", "slow-roll", "coast-down")
"""Changes that a plan can make where all records are vectors of run-ups."""


def check_allowed(names: Iterable[str]) -> tuple[str, ...]:
    """The names, each once, all of them for none; raises DataError for one that is unknown."""
    asked = tuple(name for name in dict.fromkeys(names) if name != "all")
    for unknown in (name for name in asked if name not in ALLOWED):
        raise DataError(f"--allow: '{unknown}' cannot be changed by a plan; {did_you_mean(unknown, ALLOWED)}")
    return asked or tuple(ALLOWED)


def obstacles(machine: Machine, vectors: bool = False, one_probe: bool = False) -> dict[str, str]:
    """Reasons why a machine cannot change something, by name.

    `vectors` where all records are vectors of run-ups, `one_probe` where a record has a single displacement probe.
    """
    found: dict[str, str] = {}
    if not machine.injectors or machine.actuators is None:
        found |= dict.fromkeys(("bias", "step"), f"{machine.name} has no injectors with moving pins")
    if not machine.fed:
        found["pressure"] = f"{machine.name} has no injection pressure"
    if not machine.effects.get("unbalance"):
        found["trial-weight"] = f"{machine.name} has no [effects.unbalance] to add a weight to"
    if one_probe:
        found["sensor-ring"] = "the records are of one probe" + (", which 'axis' turns" if vectors else "")
    if vectors:
        others = (name for name in ALLOWED if name not in OF_VECTORS)
        found |= dict.fromkeys(others, "the records are vectors of run-ups, which show no excitation")
    return found


def allowed_here(
    machine: Machine, names: Iterable[str], vectors: bool = False, one_probe: bool = False
) -> tuple[str, ...]:
    """Allowed changes that the machine can make; raises DataError for a named one that it cannot."""
    asked, against = check_allowed(names), obstacles(machine, vectors, one_probe)
    can = tuple(name for name in ALLOWED if name not in against)
    if set(asked) == set(ALLOWED):
        return can
    for name in asked:
        if name in against:
            raise DataError(f"--allow: '{name}' cannot be changed, {against[name]}; allow {', '.join(can)}")
    return asked
