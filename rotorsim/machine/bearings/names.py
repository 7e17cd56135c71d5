"""Names of bearings in a machine file: what names a bearing is given its index before the tables are read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from rotorsim.base.sentences import did_you_mean, quote

KEYS = ("bearing", "place")
"""Keys under which an effect names its bearing."""


@dataclass
class Names:
    """Indices of bearings by name, and a sentence for each name that is none."""

    known: dict[str, int]
    problems: list[str] = field(default_factory=list)

    def index(self, path: str, value: Any) -> Any:
        """The index of a name, None for one that is not known; other values are left as they are."""
        if not isinstance(value, str) or value in self.known:
            return self.known[value] if isinstance(value, str) else value
        remedy = did_you_mean(value, self.known) if self.known else "give the bearings names, or write an index from 0"
        self.problems.append(f"{path}: {quote(value)} is not the name of a bearing; {remedy}")
        return None


def by_index(tables: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """The tables of a machine file with indices for names of bearings, and a sentence for each name that is none."""
    bearings = tables.get("bearings")
    named = [b.get("name") if isinstance(b, Mapping) else None for b in bearings] if isinstance(bearings, list) else []
    names = Names({name: i for i, name in enumerate(named) if isinstance(name, str)})
    found = dict(tables)
    if isinstance(tables.get("injection"), Mapping):
        found |= _fed(tables, names)
    if isinstance(tables.get("probes"), list):
        found["probes"] = [_effect(f"probes.{i}", one, names) for i, one in enumerate(tables["probes"])]
    if isinstance(tables.get("effects"), Mapping):
        found["effects"] = {name: _effect(f"effects.{name}", one, names) for name, one in tables["effects"].items()}
    return found, names.problems


def _fed(tables: Mapping[str, Any], names: Names) -> dict[str, Any]:
    """Injection and injectors: the bearing that injectors name is that of `[injection]`, as pins feed one film."""
    common, injectors = dict(tables["injection"]), tables.get("injectors")
    given = injectors if isinstance(injectors, list) else []
    for i, one in enumerate(given):
        own = one.get("bearing") if isinstance(one, Mapping) else None
        if own is not None and common.setdefault("bearing", own) != own:
            sentence = f"{quote(own)} is not that of the others; all pins feed one film"
            names.problems.append(f"injectors.{i}.bearing: {sentence}")
    if "bearing" in common:
        common["bearing"] = names.index("injection.bearing", common["bearing"])
    if not given:
        return {"injection": common}
    kept = [{k: v for k, v in one.items() if k != "bearing"} if isinstance(one, Mapping) else one for one in given]
    return {"injection": common, "injectors": kept}


def _effect(path: str, entry: Any, names: Names) -> Any:
    """One effect or several; a `place` that names a bearing is written as `bearing`."""
    if isinstance(entry, list):
        return [_effect(f"{path}.{i}", one, names) for i, one in enumerate(entry)]
    if not isinstance(entry, Mapping):
        return entry
    return {"bearing" if k in KEYS else k: names.index(f"{path}.{k}", v) if k in KEYS else v for k, v in entry.items()}
