"""Edits of values in a machine file that keep comments and order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from numbers import Integral, Real
from typing import Any

import tomlkit
from tomlkit.items import InlineTable

from rotorsim.base.errors import MachineFileError
from rotorsim.base.sentences import quote

ANY = "*"
"""Key of a path that stands for every entry of a list."""


def with_value(text: str, path: str, value: Any) -> str:
    """TOML `text` with `value` at the dotted `path`; list items by index, `*` for each; absent tables are made.

    Raises
    ------
    MachineFileError
        If the path does not lead to a value.
    """
    return with_values(text, {path: value})


def with_values(text: str, values: Mapping[str, Any]) -> str:
    """Likewise with several values, by path; the text is parsed once."""
    document = tomlkit.parse(text)
    for path, value in values.items():
        for one in _every(document, path):
            _set(document, one, value)
    return tomlkit.dumps(document)


def expanded(text: str, path: str) -> tuple[str, ...]:
    """The paths that a path with stars stands for: one for each entry of a list that has the value."""
    return _every(tomlkit.parse(text), path)


def _every(document: Any, path: str) -> tuple[str, ...]:
    if ANY not in (keys := path.split(".")):
        return (path,)
    found = tuple(".".join(one) for one in _matches(document, keys))
    if not found:
        raise MachineFileError(f"{path}: no entry of the list has such a value; name one by its number from 0")
    return found


def _matches(here: Any, keys: list[str]) -> Iterator[list[str]]:
    """Key lists of the values below `here` that a path with stars means."""
    if not keys:
        yield []
        return
    key, *rest = keys
    if isinstance(here, list):
        names = map(str, range(len(here))) if key == ANY else [key] if key.isdecimal() and int(key) < len(here) else []
        below = {name: here[int(name)] for name in names}
    else:
        below = {key: here[key]} if isinstance(here, MutableMapping) and key in here else {}
    for name, value in below.items():
        yield from ([name, *after] for after in _matches(value, rest))


def remarked(text: str, paths: Iterable[str], remark: str) -> str:
    """TOML `text` with `remark` as the comment behind the values at `paths`, instead of the one that is there."""
    document = tomlkit.parse(text)
    for path in paths:
        *above, last = path.split(".")
        comment(_descend(document, above, path), last, remark)
    return tomlkit.dumps(document)


def comment(table: Any, key: str, remark: str) -> None:
    """Put `remark` behind a value of a table of tomlkit; an inline table has no room for comments and stays."""
    if not inline(table):
        table[key].comment(remark)


def inline(table: Any) -> bool:
    """Whether a table of tomlkit stands on one line, in braces."""
    return isinstance(table, InlineTable)


def _set(document: Any, path: str, value: Any) -> None:
    keys = path.split(".")
    if not all(keys):
        raise MachineFileError(f"{path!r} is not a path; write e.g. 'effects.unbalance.me'")
    table = _descend(document, keys[:-1], path)
    if isinstance(table, list):
        _item(table, keys[-1], ".".join(keys[:-1]))
    held = table if isinstance(table, list) else table.get(keys[-1])
    if isinstance(held, (MutableMapping, list)):
        below = _first(held[int(keys[-1])] if isinstance(table, list) else held)
        hint = f", e.g. '{path}.{below}'" if below else ""
        raise MachineFileError(f"{path}: holds several values; name the one to change{hint}")
    try:
        table[keys[-1]] = _plain(value)
    except ValueError as error:  # tomlkit's answer to what TOML cannot express
        raise MachineFileError(f"{path}: {quote(value)} is not a valid value; write text with a unit") from error


def _first(held: Any) -> str:
    """Path of the first value below a table or list; empty where there is none."""
    if not isinstance(held, (MutableMapping, list)):
        return ""
    for key, value in held.items() if isinstance(held, MutableMapping) else enumerate(held):
        nested = isinstance(value, (MutableMapping, list))
        if not nested or _first(value):
            return f"{key}.{_first(value)}" if nested else str(key)
    return ""


def _descend(table: Any, keys: list[str], path: str) -> Any:
    """The table that holds the last key of `path`."""
    for depth, key in enumerate(keys):
        if isinstance(table, list):
            table = _item(table, key, ".".join(keys[:depth]))
        elif key == "0" and "0" not in table:  # a single table is its own first item
            continue
        else:
            if key not in table:
                table[key] = tomlkit.table(is_super_table=depth < len(keys) - 1)
            table = table[key]
        if not isinstance(table, (MutableMapping, list)):
            raise MachineFileError(f"{path}: '{'.'.join(keys[: depth + 1])}' is a value, not a table; check the path")
    return table


def _item(items: list[Any], key: str, where: str) -> Any:
    if key.isdecimal() and int(key) < len(items):
        return items[int(key)]
    raise MachineFileError(f"{where}: has {len(items)} entries, counted from 0; '{key}' is none of them")


def _plain(value: Any) -> Any:
    """Numbers of numpy and the like as TOML knows them."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return value
    return int(value) if isinstance(value, Integral) else float(value)
