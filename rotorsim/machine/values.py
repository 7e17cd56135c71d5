"""Values of a machine: effects of the tables of its file, and changes at dotted paths.

Units, limits and sentences of an effect are declared by its fields. A change has SI values, which are checked as those
of a machine file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import MISSING, Field, fields, replace
from typing import Any

from pydantic import ValidationError

from rotorsim.base.display import closest, did_you_mean, quote
from rotorsim.base.errors import MachineFileError
from rotorsim.base.quantity import quantity_of
from rotorsim.effects import REGISTRY, Effect
from rotorsim.effects.base import LEFT_OUT
from rotorsim.machine.part import SI, Part, PartError, sentences, unknown_field


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
    """Sentence about a name that is no effect's; the package that has it may have failed."""
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
            problems.append((f"{path}.{key}", unknown_field(str(key), known)))
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


class ChangeTree(dict[str, Any]):
    """Changes below one part of a machine, by field or number."""


def branches(values: Mapping[str, Any]) -> ChangeTree:
    """Values by dotted path as a tree; raises MachineFileError for a path that lies below another."""
    root = ChangeTree()
    for path, value in values.items():
        *above, last = keys = path.split(".")
        if not all(keys):
            raise MachineFileError(f"{path!r} is not a path; write e.g. 'effects.unbalance.me'")
        here = root
        for depth, key in enumerate(above, 1):
            whole = ".".join(above[:depth])
            if whole in values:
                raise MachineFileError(
                    f"{path}: lies below {whole}, which is given too; give one of them", argument=path
                )
            here = here.setdefault(key, ChangeTree())
        here[last] = value
    return root


def changed(old: Any, change: Any, path: str = "") -> Any:
    """A part, list or effect of a machine with a tree of changes; raises MachineFileError with one line per problem."""
    if change is None and isinstance(old, (Part, Effect, tuple, Mapping)):
        raise MachineFileError(f"{path}: may not be None; give the whole part")
    if not isinstance(change, ChangeTree):
        return change
    if isinstance(old, tuple):
        return _changed_items(old, change, path)
    if isinstance(old, Mapping):
        return _changed_effects(old, change, path)
    if isinstance(old, Effect):
        return _changed_effect(old, change, path)
    if isinstance(old, Part):
        return _changed_part(old, change, path)
    raise MachineFileError(f"{path}: is a value, not a table; check the path")


def _changed_items(old: tuple[Any, ...], change: ChangeTree, path: str) -> tuple[Any, ...]:
    if not old:
        raise MachineFileError(f"{path}: there are none in this machine; give the whole list")
    alone = len(old) == 1 and not all(key.isdecimal() for key in change)  # a single table without its number
    items = {"0": change} if alone else change
    _known(items, map(str, range(len(old))), path)
    single = len(old) == 1 and isinstance(old[0], Effect)
    numbered = ((str(i), item) for i, item in enumerate(old))
    where = {i: path if single else _join(path, i) for i in items}
    return tuple(changed(item, items[i], where[i]) if i in items else item for i, item in numbered)


def _changed_effects(old: Mapping[str, Any], change: ChangeTree, path: str) -> dict[str, Any]:
    """Effects by name; one that is absent can only be given as a whole."""
    for name in (key for key, value in change.items() if isinstance(value, ChangeTree) and key not in old):
        absent = "is not in this machine; give the whole effect, or use replace"
        raise MachineFileError(f"{_join(path, name)}: {absent if name in REGISTRY else unknown_effect(name)}")
    return {**old, **{name: changed(old.get(name), value, _join(path, name)) for name, value in change.items()}}


def _changed_part(old: Part, change: ChangeTree, path: str) -> Part:
    known = type(old).model_fields
    _known(change, known, path)
    new = dict(old)
    for key, value in change.items():
        optional = known[key].default is None
        if isinstance(value, ChangeTree) and new[key] is None and quantity_of(known[key]) is None:
            raise MachineFileError(f"{_join(path, key)}: is not in this machine; give the whole part")
        new[key] = None if optional and value is None else changed(new[key], value, _join(path, key))
    return _checked_part(type(old), new, path)


def _checked_part(kind: type[Part], values: Mapping[str, Any], path: str) -> Part:
    try:
        return kind.model_validate(values, context=SI)
    except ValidationError as error:
        raise MachineFileError("\n".join(_join(path, line) for line in sentences(error, kind))) from error


def _changed_effect(effect: Effect, change: ChangeTree, path: str) -> Effect:
    known = {entry.name: entry for entry in fields(effect)}
    _known(change, known, path)
    return replace(
        effect, **{name: _parameter(known[name], value, _join(path, name)) for name, value in change.items()}
    )


def _parameter(entry: Field[Any], change: Any, path: str) -> Any:
    """A value of an effect's parameter; a number is a float, as those of machine files."""
    declaration, value = quantity_of(entry), changed(None, change, path)
    if declaration is None or (value is None and entry.default is None):
        return value
    try:
        return float(declaration.check(value))
    except ValueError as error:
        raise MachineFileError(f"{path}: {error}") from error


def _known(change: Iterable[str], names: Iterable[str], path: str) -> None:
    """Refuse a path that leads nowhere."""
    names = list(names)
    for key in change:
        if key not in names:
            raise MachineFileError(f"{_join(path, key)}: is not there; {did_you_mean(key, names)}")


def _join(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key
