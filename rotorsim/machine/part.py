"""Parts of machine files: fields declared by a `Quantity`, and the sentences about values that do not fit.

A value is text with a unit (or a bare number where there is none) until `Part` has validated it, and an SI float
afterwards. Unknown fields are refused, instances are frozen. Errors of pydantic become sentences with the dotted path,
the value, the limit or the known names, and the way out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import MISSING, fields
from types import NoneType, UnionType, new_class
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self, Union, cast, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, field_validator, model_validator

from rotorsim.base.display import closest, did_you_mean, quote
from rotorsim.base.errors import MachineFileError
from rotorsim.base.quantity import Quantity, quantity_of
from rotorsim.base.units import quoted

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass
else:
    ModelMetaclass = type(BaseModel)

SI = {"values": "SI"}
"""Context of a validation whose values are SI floats already, not text with units."""


class PartError(ValueError):
    """Several problems of one part: pairs of a path below it and a sentence."""

    def __init__(self, *items: tuple[str, str]) -> None:
        super().__init__("; ".join(f"{path}: {sentence}" for path, sentence in items))
        self.items = items


def _field(default: Any, declaration: Quantity) -> Any:
    return Field(default, description=declaration.doc, json_schema_extra=cast(Any, {"quantity": declaration}))


def quantity(unit: str, doc: str, default: Any = ..., *, example: float | None = None, **limits: float) -> Any:
    """A field with an SI unit ('1' for a plain number), a sentence, an SI default, SI limits and an SI example."""
    own = example if example is not None or default in (..., None, 0) else default
    return _field(default, Quantity(unit, doc, example=own, **limits))  # type: ignore[arg-type]


def count(
    doc: str, default: int | None, *, low: int, high: int, multiple: int = 1, example: int | None = None
) -> Any:  # fmt: skip
    """A field that is a whole number."""
    own = default if example is None else example
    return _field(default, Quantity("1", doc, low=low, high=high, multiple=multiple, example=own))


class Construction(ModelMetaclass):
    """Metaclass of the parts: a part that is built in Python with values that do not fit is a MachineFileError."""

    def __call__(self, *values: Any, **named: Any) -> Any:
        try:
            return super().__call__(*values, **named)
        except ValidationError as error:
            lines = [f"{self.__name__}.{line}" for line in sentences(error, cast(type[BaseModel], self))]
        raise MachineFileError("\n".join(lines), argument=lines[0].partition(":")[0])


class Part(BaseModel, metaclass=Construction):
    """A part of a machine: frozen, known fields only, SI values."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    tag: ClassVar[str] = "kind"
    """Field that distinguishes it from the other parts of a union."""

    def problems(self) -> Iterator[tuple[str, str]]:
        """Conflicts between its values: paths below it and sentences."""
        return iter(())

    def __setattr__(self, name: str, value: Any) -> None:
        if name in type(self).model_fields:
            raise MachineFileError(
                f"{type(self).__name__}.{name}: does not change; make another machine with replace or with_",
                argument=name,
                value=value,
            )
        super().__setattr__(name, value)

    @model_validator(mode="after")
    def _fits(self) -> Self:
        problems = tuple(self.problems())
        if problems:
            raise PartError(*problems)
        return self

    @field_validator("*", mode="before")
    @classmethod
    def _to_si(cls, value: Any, info: ValidationInfo) -> Any:
        field = cls.model_fields[cast(str, info.field_name)]
        known = quantity_of(field)
        if known is None or (value is None and field.default is None and info.context is SI):
            return value
        return known.check(value) if info.context is SI else known.parse(value)


def part_of(declared: Any, module: str) -> Any:
    """Part of a machine file that a dataclass with declared fields is: its instances are instances of both.

    Parameters
    ----------
    declared : class
        A frozen dataclass whose fields carry a `Quantity`, or under 'doc' a sentence and under 'stated' whether a file
        must give a value that has a default in Python. Its method `problems` is that of the part.
    module : str
        Module that has the part under the name of the dataclass.
    """
    hints = get_type_hints(declared)
    body: dict[str, Any] = {"__module__": module, "__doc__": declared.__doc__, "__annotations__": {}}
    body["problems"] = declared.problems
    for entry in fields(declared):
        known, stated = quantity_of(entry), entry.default is MISSING or entry.metadata.get("stated", False)
        default = ... if stated else entry.default
        body["__annotations__"][entry.name] = hints[entry.name]
        body[entry.name] = _field(default, known) if known else Field(default, description=entry.metadata["doc"])
    return new_class(declared.__name__, (Part, declared), exec_body=lambda space: space.update(body))


SHAPES = ("union_tag", "model_type", "model_attributes_type", "tuple_type", "too_short")
"""Beginnings of pydantic's names of what decides which fields there are."""


def sentences(error: ValidationError, model: type[BaseModel]) -> list[str]:
    """Sentences of a validation, one for each problem, wrong shapes and unknown names first.

    A field that is missing because its name is misspelt is one problem.
    """
    items = error.errors()
    meant = {
        (*item["loc"][:-1], closest(str(item["loc"][-1]), _walk(model, item["loc"])[1].model_fields))
        for item in items
        if item["type"] == "extra_forbidden"
    }
    items = [item for item in items if not (item["type"] == "missing" and item["loc"] in meant)]
    below = {item["loc"][:depth] for item in items for depth in range(len(item["loc"]))}
    counted = [
        i for i in items if not (i["type"] == "too_short" and i["loc"] in below)
    ]  # its items are there, but wrong
    counted.sort(
        key=lambda item: 0 if item["type"].startswith(SHAPES) else 1 if item["type"] == "extra_forbidden" else 2
    )
    return [line for item in counted for line in _lines(item, model)]


def unknown_field(key: str, known: Iterable[str]) -> str:
    """Sentence about a key that is none of `known`."""
    return f"unknown field; {did_you_mean(key, sorted(known))}"


def _lines(item: Any, model: type[BaseModel]) -> list[str]:
    path, owner, union = _walk(model, item["loc"])
    cause = item.get("ctx", {}).get("error")
    if isinstance(cause, PartError):
        return [f"{'.'.join(filter(None, (path, below)))}: {sentence}" for below, sentence in cause.items]
    if item["type"].startswith("union_tag"):
        return [_tag(path, item, choices(union))]
    known = _SENTENCES.get(item["type"])
    sentence = known(item, owner) if known else str(item["msg"]).removeprefix("Value error, ")
    return [f"{path}: {sentence}".removeprefix(": ")]


def _walk(model: type[BaseModel], loc: tuple[Any, ...]) -> tuple[str, type[BaseModel], Any]:
    """Dotted path of a pydantic location, without union tags, the part that owns its last key, and the type there."""
    here: Any = model
    owner, path = model, []
    for key in loc:
        kinds = choices(here)
        if len(kinds) > 1:
            here = next((c for c in kinds if key in get_args(c.model_fields[c.tag].annotation)), None)
            continue
        here = kinds[0]
        path.append(str(key))
        if get_origin(here) is tuple:
            here = get_args(here)[0]
        elif isinstance(here, type) and issubclass(here, BaseModel):
            owner = here
            here = here.model_fields[key].annotation if key in here.model_fields else None
    return ".".join(path), owner, here


def choices(kind: Any) -> tuple[Any, ...]:
    """Types of a field other than None; more than one choice is a union distinguished by its tag."""
    if get_origin(kind) is Annotated:
        return choices(get_args(kind)[0])
    if get_origin(kind) in (Union, UnionType):
        return tuple(c for k in get_args(kind) if k is not NoneType for c in choices(k))
    return (kind,)


def _missing(item: Any, owner: type[BaseModel]) -> str:
    info = owner.model_fields[item["loc"][-1]]
    known = quantity_of(info)
    meaning = (info.description or "").rstrip(".")
    if known is None:
        return f"missing ({meaning}); add it"
    return f"missing ({meaning}); write e.g. {quoted(known.suggestion(), known.unit)}"


def _tag(path: str, item: Any, kinds: tuple[Any, ...]) -> str:
    given, tag = item["input"], kinds[0].tag
    if not isinstance(given, dict):
        return f"{path}: {_table(item)}"
    problem = f"{quote(given[tag])} is not known" if tag in given else "missing"
    *known, last = (repr(word) for kind in kinds for word in get_args(kind.model_fields[tag].annotation))
    return f"{path}.{tag}: {problem}; write {', '.join(known)} or {last}"


def _table(item: Any, *_: Any) -> str:
    return f"{quote(item['input'])} is not a table; write its fields below a [header]"


_SENTENCES: dict[str, Callable[[Any, type[BaseModel]], str]] = {
    "missing": _missing,
    "extra_forbidden": lambda item, owner: unknown_field(str(item["loc"][-1]), owner.model_fields),
    "literal_error": lambda item, _: f"{quote(item['input'])} is not known; write {item['ctx']['expected']}",
    "model_type": _table,
    "model_attributes_type": _table,
    "tuple_type": lambda item, _: f"{quote(item['input'])} is not a list of tables; write a [[header]] for each",
    "string_type": lambda item, _: f"{quote(item['input'])} is not text; write it in quotes",
    "too_short": lambda *_: "empty; give at least one",
}
"""Sentence about a value, from pydantic's problem and the part that owns the field, by pydantic's name of it."""
