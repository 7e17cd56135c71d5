"""Effects from the `[effects.NAME]` tables; units, limits and sentences are declared by the effects' fields."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from rotorsim.base.display import closest, did_you_mean, quote
from rotorsim.base.quantity import quantity_of
from rotorsim.effects import REGISTRY, Effect
from rotorsim.effects.installed import LEFT_OUT
from rotorsim.machine.part import PartError, unknown_field


def read_effects(tables: Any) -> dict[str, tuple[Effect, ...]]:
    """Effects by name in the file's order; every problem of every table is raised at once."""
    if not isinstance(tables, Mapping):
        raise ValueError(f"{quote(tables)} is not a set of tables; write e.g. [effects.unbalance]")
    problems: list[tuple[str, str]] = []
    effects = {str(name): _read_entries(str(name), value, problems) for name, value in tables.items()}
    if problems:
        raise PartError(*problems)
    return effects


def readable_effects(tables: Any) -> dict[str, tuple[Effect, ...]]:
    """The effects in which nothing is wrong."""
    found: dict[str, tuple[Effect, ...]] = {}
    for name, value in tables.items() if isinstance(tables, Mapping) else ():
        problems: list[tuple[str, str]] = []
        read = _read_entries(str(name), value, problems)
        found |= {} if problems else {str(name): read}
    return found


def unknown_effect(name: str) -> str:
    """Sentence about a name that is no effect's; one of earlier versions has a new name, a package may have failed."""
    renamed = next((effect.name for effect in REGISTRY.values() if name == effect.earlier_name), "")
    if renamed:
        return f"is called '{renamed}' now; rename it"
    if name in LEFT_OUT:
        return LEFT_OUT[name]
    if closest(name, REGISTRY):
        return f"unknown effect; {did_you_mean(name, REGISTRY)}"
    return "unknown effect; take one that 'rotorsim machine effects' lists, or install the package that has it"


def _read_entries(name: str, value: Any, problems: list[tuple[str, str]]) -> tuple[Effect, ...]:
    if name not in REGISTRY:
        problems.append((name, unknown_effect(name)))
        return ()
    if isinstance(value, (list, tuple)) and value:
        return tuple(_read_one(name, f"{name}.{i}", entry, problems) for i, entry in enumerate(value))
    return (_read_one(name, name, value, problems),)


def _read_one(name: str, path: str, table: Any, problems: list[tuple[str, str]]) -> Effect:
    effect = REGISTRY[name]
    if isinstance(table, effect):
        return table
    known = {f.name: f for f in fields(effect)}
    values: dict[str, Any] = {}
    if not isinstance(table, Mapping):
        problems.append((path, f"{quote(table)} is not a table; write [effects.{name}]"))
        table = {}
    for key, given in table.items():
        if key not in known:
            problems.append((f"{path}.{key}", unknown_field(str(key), tuple(known), effect.earlier_keys)))
            continue
        try:
            quantity = quantity_of(known[key])
            values[key] = float(quantity.parse(given)) if quantity else given
        except ValueError as error:
            problems.append((f"{path}.{key}", str(error)))
    for key, parameter in known.items():
        if key not in table and parameter.default is MISSING and parameter.default_factory is MISSING:
            problems.append((f"{path}.{key}", "missing; add it"))
    return effect() if problems else effect(**values)
