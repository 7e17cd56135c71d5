"""Change of values of a machine at dotted paths, in SI units and checked as those of a machine file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import Field, fields, replace
from typing import Any

from pydantic import ValidationError

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import MachineFileError
from rotorsim.base.quantity import quantity_of
from rotorsim.effects import REGISTRY, Effect
from rotorsim.machine.part import SI, Part, sentences
from rotorsim.machine.reading import unknown_effect


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
                raise MachineFileError(f"{path}: lies below {whole}, which is given too; give one of them")
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
