"""Reading of tables: effects by what their fields declare, and every problem of a machine file in one pass.

pydantic checks values one by one and looks at what is between them once all are right. `every_problem` makes the parts
of what can be read, without the values that cannot; a check that meets a missing one ends without a word.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import MISSING, fields
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError

from rotorsim.base.display import closest, did_you_mean, quote
from rotorsim.base.quantity import quantity_of
from rotorsim.effects import REGISTRY, Effect
from rotorsim.effects.base import LEFT_OUT
from rotorsim.machine.checks import decisive, further
from rotorsim.machine.part import Part, PartError, choices, sentences, unknown_field
from rotorsim.machine.plausibility import questions


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
