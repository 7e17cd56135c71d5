"""Collection of every problem of a machine file in one pass, also where some values cannot be read.

pydantic checks values one by one and looks at what is between them once all are right. Here the parts are made of what
can be read, without the values that cannot; a check that meets a missing one ends without a word.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from rotorsim.base.quantity import quantity_of
from rotorsim.machine.checks import decisive, further
from rotorsim.machine.effect_tables import readable_effects
from rotorsim.machine.part import Part, choices, sentences
from rotorsim.machine.plausibility import questions


def every_problem(error: ValidationError, model: type[Part], tables: Mapping[str, Any]) -> list[str]:
    """Sentences of all problems of the tables of a file, those first that decide what the machine is."""
    machine: Any = readable(model, tables)
    filed = tables.get("effects", {})
    first = [_line(found) for check in decisive(machine) for found in _found(check)]
    if not isinstance(filed, Mapping) or len(machine.effects) < len(filed):
        machine.__dict__.pop("effects")  # one effect may need another that cannot be read
    between = [_line(found) for part in _parts(machine) for found in _found(*part)]
    with suppress(AttributeError):
        for check in further(machine):
            between += [_line(found) for found in _found(check)]
    return list(dict.fromkeys([*first, *sentences(error, model), *between, *questions(machine, whole=False)]))


def readable(model: type[Part], table: Any) -> Part:
    """A part with what can be read of its table; a value that cannot is an attribute that is missing."""
    table = table if isinstance(table, Mapping) else {}
    part = model.model_construct()
    for name in model.model_fields:
        if name in table:
            part.__dict__.pop(name, None)
            with suppress(ValueError):
                part.__dict__[name] = _read(model, name, table[name])
    return part


def _read(model: type[Part], name: str, value: Any) -> Any:
    """A value as its field has it; raises ValueError."""
    info = model.model_fields[name]
    known, kinds = quantity_of(info), choices(info.annotation)
    if known is not None:
        return known.parse(value)
    if get_origin(kinds[0]) is dict:
        return readable_effects(value)
    if get_origin(kinds[0]) is tuple:
        own = choices(get_args(kinds[0])[0])
        if not isinstance(value, (list, tuple)):
            raise ValueError(name)
        return tuple(value) if own == (str,) else tuple(readable(_kind(own, item), item) for item in value)
    if isinstance(kinds[0], type) and issubclass(kinds[0], BaseModel):
        return readable(_kind(kinds, value), value)
    words = get_args(kinds[0])
    if (words and value not in words) or not isinstance(value, str):
        raise ValueError(name)
    return value


def _kind(kinds: tuple[Any, ...], table: Any) -> type[Part]:
    """The part that a table is, by its tag where there are several; raises ValueError where it has none of them."""
    if len(kinds) == 1:
        return kinds[0]
    given = table.get(kinds[0].tag) if isinstance(table, Mapping) else None
    known = [k for k in kinds if given in get_args(k.model_fields[k.tag].annotation)]
    if not known:
        raise ValueError(given)
    return known[0]


def _parts(part: Any, path: str = "") -> Iterator[tuple[Iterable[tuple[str, str]], str]]:
    """Problems within every part below, and its path; the whole itself is checked apart."""
    for name in type(part).model_fields:
        value = part.__dict__.get(name)
        below = [(f"{path}{name}", value)] if isinstance(value, Part) else []
        if isinstance(value, tuple):
            below = [(f"{path}{name}.{i}", item) for i, item in enumerate(value) if isinstance(item, Part)]
        for here, one in below:
            yield one.problems(), here
            yield from _parts(one, f"{here}.")


def _found(problems: Iterable[tuple[str, str]], path: str = "") -> Iterator[tuple[str, str]]:
    """Problems up to where a value is missing."""
    with suppress(AttributeError):
        for below, sentence in problems:
            yield f"{path}.{below}".strip("."), sentence


def _line(found: tuple[str, str]) -> str:
    return f"{found[0]}: {found[1]}"
