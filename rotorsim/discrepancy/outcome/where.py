"""Places on the machine of the effects that a diagnosis found, of their rivals and of the equivalent force."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields, replace

from rotorsim.discrepancy.outcome.findings import Found
from rotorsim.discrepancy.outcome.result import Diagnosis
from rotorsim.effects import REGISTRY, Effect
from rotorsim.machine import Machine
from rotorsim.plant.locations import Place, acting_places, force_plane

FORCE = "equivalent force"
"""Label of the force that would make what no effect explains."""


@dataclass(frozen=True)
class Located:
    """An effect with the places where it acts; `role` is 'found', 'rival' or 'force'."""

    label: str
    role: str
    places: tuple[Place, ...]

    @property
    def sentence(self) -> str:
        """As text, with the bearing and the injector once."""
        return f"{self.label.partition(' of ')[0]}: {' and '.join(place.name for place in self.places)}"


def located(diagnosis: Diagnosis) -> tuple[Located, ...]:
    """Found effects, what is indistinguishable from them, and the equivalent force of what nothing explains."""
    machine, effects = diagnosis.machine, diagnosis.effects
    out = [Located(f.form, "found", acting_places(machine, effect_of(f))) for f in effects]
    keys = [key for found in effects for key in found.tie_class] + [key for tie in diagnosis.ties for key in tie]
    others = [key for key in dict.fromkeys(keys) if key not in {found.form for found in effects}]
    rivals = [(key, effect) for key in others if (effect := effect_of_key(machine, key)) is not None]
    out += [Located(key, "rival", acting_places(machine, effect)) for key, effect in rivals]
    if diagnosis.unknown.get("lines"):
        out.append(Located(FORCE, "force", (force_plane(machine),)))
    return tuple(one for one in out if one.places)


def effect_of(found: Found) -> Effect:
    """The effect with the parameters that were found."""
    kind = REGISTRY[found.effect]
    return kind(**{f.name: found.parameters[f.name] for f in fields(kind) if f.name in found.parameters})


def effect_of_key(machine: Machine, key: str) -> Effect | None:
    """A neutral effect at the place that a candidate's key names; None for an effect that is not known.

    A key is 'weak_injector.blocked of injector 3 of front', see `rotorsim.discrepancy.search.candidates`.
    """
    kind = REGISTRY.get(key.partition(".")[0])
    if kind is None:
        return None
    known, values = {f.name for f in fields(kind)}, {}
    if "injector" in known and (number := re.search(r" of injector (\d+)", key)):
        values["injector"] = float(number[1])
    named = [i for i, name in enumerate(machine.bearing_names) if key.endswith(f" of {name}")]
    if "bearing" in known and named:
        values["bearing"] = float(named[0])
    return replace(kind.neutral(machine, 0), **values)


__all__ = ["FORCE", "Located", "effect_of", "effect_of_key", "located"]
