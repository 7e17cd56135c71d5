"""Change of values of a machine at dotted paths, in SI units and checked as those of a machine file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from typing import Any

from pydantic import ValidationError

from rotorsim.base.errors import MachineFileError
from rotorsim.base.quantity import quantity_of
from rotorsim.base.suggest import did_you_mean
from rotorsim.effects import Effect
from rotorsim.machine.messages import sentences
from rotorsim.machine.part import SI, Part


class Branch(dict[str, Any]):
    """Changes below one part of a machine, by field or number."""


def branches(values: Mapping[str, Any]) -> Branch:
    """Values by dotted path as a tree."""
    root = Branch()
    for path, value in values.items():
        *above, last = path.split(".")
        here = root
        for key in above:
            here = here.setdefault(key, Branch())
        here[last] = value
    return root


def changed(old: Any, change: Any, path: str = "") -> Any:
    """A part, list or effect of a machine with a tree of changes; raises MachineFileError with one line per problem."""
    if not isinstance(change, Branch):
        return change
    if isinstance(old, tuple):
        alone = len(old) == 1 and not all(key.isdecimal() for key in change)  # a single table without its number
        items = {"0": change} if alone else change
        _known(items, map(str, range(len(old))), path)
        numbered = ((str(i), item) for i, item in enumerate(old))
        return tuple(changed(item, items[i], _join(path, i)) if i in items else item for i, item in numbered)
    if isinstance(old, Effect):
        return _changed_effect(old, change, path)
    now = dict(old) if isinstance(old, (Mapping, Part)) else {}
    _known(change, now, path)
    new = now | {key: changed(now[key], value, _join(path, key)) for key, value in change.items()}
    return _checked_part(type(old), new, path) if isinstance(old, Part) else new


def _checked_part(kind: type[Part], values: Mapping[str, Any], path: str) -> Part:
    try:
        return kind.model_validate(values, context=SI)
    except ValidationError as error:
        raise MachineFileError("\n".join(_join(path, line) for line in sentences(error, kind))) from error


def _changed_effect(effect: Effect, change: Branch, path: str) -> Effect:
    known = {entry.name: quantity_of(entry) for entry in fields(effect)}
    _known(change, known, path)
    values = {}
    for name, value in change.items():
        declaration = known[name]
        try:
            values[name] = declaration.check(value) if declaration else value
        except ValueError as error:
            raise MachineFileError(f"{_join(path, name)}: {error}") from error
    return replace(effect, **values)


def _known(change: Iterable[str], names: Iterable[str], path: str) -> None:
    """Refuse a path that leads nowhere."""
    names = list(names)
    for key in change:
        if key not in names:
            raise MachineFileError(f"{_join(path, key)}: is not there; {did_you_mean(key, names) if names else path}")


def _join(path: str, key: str) -> str:
    return f"{path}.{key}" if path else key
