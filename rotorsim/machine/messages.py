"""pydantic's errors as sentences: dotted path, value, limit or known names, way out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from difflib import get_close_matches
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError

from rotorsim.machine.part import Problems, spec_of
from rotorsim.machine.units import dimension, quote


def sentences(error: ValidationError, model: type[BaseModel]) -> list[str]:
    """All problems of a validation, one line each."""
    return [line for item in error.errors() for line in _lines(item, model)]


def unknown_field(key: str, known: Iterable[str]) -> str:
    """Sentence about a key that is none of `known`."""
    names = sorted(known)
    close = get_close_matches(key, names, n=1, cutoff=0.6)
    return f"unknown field; did you mean '{close[0]}'?" if close else f"unknown field; known fields: {', '.join(names)}"


def _lines(item: Any, model: type[BaseModel]) -> list[str]:
    path, owner = _walk(model, item["loc"])
    cause = item.get("ctx", {}).get("error")
    if isinstance(cause, Problems):
        return [f"{'.'.join(filter(None, (path, below)))}: {sentence}" for below, sentence in cause.items]
    say = _SENTENCES.get(item["type"], lambda i, _: i["msg"].removeprefix("Value error, "))
    suffix = {"union_tag_not_found": ".kind", "union_tag_invalid": ".kind"}.get(item["type"], "")
    return [f"{path}{suffix}: {say(item, owner)}".removeprefix(": ")]


def _walk(model: type[BaseModel], loc: tuple[Any, ...]) -> tuple[str, type[BaseModel]]:
    """Dotted path of a pydantic location, without union tags, and the part that owns its last key."""
    here: Any = model
    owner, path = model, []
    for key in loc:
        if isinstance(here, dict):
            here = here.get(key, here)
            continue
        path.append(str(key))
        if isinstance(here, type) and issubclass(here, BaseModel):
            owner = here
            here = _content(here.model_fields[key].annotation) if key in here.model_fields else None
    return ".".join(path), owner


def _content(kind: Any) -> Any:
    """The part a field holds: itself, the item of its tuple, or parts by tag for a union of several."""
    if get_origin(kind) is tuple:
        return _Items(_content(get_args(kind)[0]))
    if get_origin(kind) in (Union, UnionType):
        parts = [k for k in get_args(kind) if isinstance(k, type) and issubclass(k, BaseModel)]
        return parts[0] if len(parts) == 1 else {_tag(k): k for k in parts}
    return _content(get_args(kind)[0]) if hasattr(kind, "__metadata__") else kind
