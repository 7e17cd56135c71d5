"""Dataclasses as plain data for JSON and arrays for npz, and back by the types that their fields declare.

Nothing of what is read is executed: the classes come from the caller, a file has values only.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

ARRAY, PAIRS = "$array", "$pairs"
"""Keys that stand for an array, by its name, and for a mapping whose keys are no text."""
Arrays = dict[str, np.ndarray]


def to_plain(value: Any, arrays: Arrays) -> Any:
    """A value as JSON takes it: dataclasses and mappings as objects, tuples as lists; arrays go into `arrays`.

    Raises TypeError for anything else than these, numbers, text, truth values and None.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: to_plain(getattr(value, field.name), arrays) for field in fields(value)}
    if isinstance(value, Mapping):
        if all(isinstance(key, str) and not key.startswith("$") for key in value):
            return {key: to_plain(one, arrays) for key, one in value.items()}
        return {PAIRS: [[to_plain(key, arrays), to_plain(one, arrays)] for key, one in value.items()]}
    if isinstance(value, (tuple, list)):
        return [to_plain(one, arrays) for one in value]
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
        name = f"array_{len(arrays)}"
        arrays[name] = value
        return {ARRAY: name}
    if isinstance(value, np.generic):
        return to_plain(value.item(), arrays)
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    raise TypeError(f"{type(value).__name__} cannot be stored as plain data")


def from_plain(kind: Any, value: Any, arrays: Mapping[str, np.ndarray], place: str = "") -> Any:
    """The value of type `kind` that `to_plain` made `value` of; raises ValueError with the place of what does not fit.

    Fields that are missing have their defaults, and fields that the class does not have are left out.
    """
    if kind is Any:
        return _untyped(value, arrays, place)
    if is_dataclass(kind) and isinstance(kind, type):
        return _object(kind, value, arrays, place)
    origin, args = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        return _one_of(args, value, arrays, place)
    if origin in (tuple, list):
        return _sequence(origin, args, value, arrays, place)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        pairs = _pairs(value, place)
        return {
            from_plain(args[0], key, arrays, place): from_plain(args[1], one, arrays, f"{place}.{key}")
            for key, one in pairs
        }
    if kind is np.ndarray or origin is np.ndarray:
        return _array(value, arrays, place)
    return _single(kind, value, place)


def _object(kind: type, value: Any, arrays: Mapping[str, np.ndarray], place: str) -> Any:
    if not isinstance(value, dict):
        raise ValueError(f"{place} is not an object")
    hints, given = get_type_hints(kind), {}
    for field in fields(kind):
        path = f"{place}.{field.name}".lstrip(".")
        if field.name in value:
            given[field.name] = from_plain(hints[field.name], value[field.name], arrays, path)
        elif field.default is MISSING and field.default_factory is MISSING:
            raise ValueError(f"{path} is missing")
    return kind(**given)


def _one_of(kinds: tuple[Any, ...], value: Any, arrays: Mapping[str, np.ndarray], place: str) -> Any:
    """The value as the first of several types that it fits."""
    if value is None and NoneType in kinds:
        return None
    for kind in (k for k in kinds if k is not NoneType):
        try:
            return from_plain(kind, value, arrays, place)
        except ValueError as error:
            found = error
    raise ValueError(str(found))


def _sequence(origin: type, args: tuple[Any, ...], value: Any, arrays: Mapping[str, np.ndarray], place: str) -> Any:
    if not isinstance(value, list):
        raise ValueError(f"{place} is not a list")
    each = len(args) == 1 or args[-1] is Ellipsis
    if not each and len(args) != len(value):
        raise ValueError(f"{place} has {len(value)} values in place of {len(args)}")
    kinds = [args[0]] * len(value) if each else list(args)
    pairs = enumerate(zip(kinds, value, strict=True))
    return origin(from_plain(kind, one, arrays, f"{place}[{i}]") for i, (kind, one) in pairs)


def _pairs(value: Any, place: str) -> list[Any]:
    """Keys and values of a mapping."""
    if not isinstance(value, dict):
        raise ValueError(f"{place} is not an object")
    pairs = value.get(PAIRS, list(value.items()))
    if not isinstance(pairs, list) or any(len(pair) != 2 for pair in pairs):
        raise ValueError(f"{place} has no pairs")
    return pairs


def _untyped(value: Any, arrays: Mapping[str, np.ndarray], place: str) -> Any:
    """A value without a declared type: numbers, text, lists, arrays and objects."""
    if isinstance(value, list):
        return [_untyped(one, arrays, f"{place}[{i}]") for i, one in enumerate(value)]
    if not isinstance(value, dict):
        return value
    if ARRAY in value:
        return _array(value, arrays, place)
    return {_key(key): _untyped(one, arrays, f"{place}.{key}") for key, one in _pairs(value, place)}


def _key(key: Any) -> Any:
    return tuple(map(_key, key)) if isinstance(key, list) else key


def _array(value: Any, arrays: Mapping[str, np.ndarray], place: str) -> np.ndarray:
    name = value.get(ARRAY) if isinstance(value, dict) else None
    if not isinstance(name, str) or name not in arrays:
        raise ValueError(f"the array of {place} is missing")
    return arrays[name]


def _single(kind: Any, value: Any, place: str) -> Any:
    """A number, a text or a truth value."""
    allowed = (int, float) if kind is float else kind
    if not isinstance(kind, type) or not isinstance(value, allowed) or (kind is not bool and isinstance(value, bool)):
        raise ValueError(f"{place} is not of type {getattr(kind, '__name__', kind)}")
    return value


__all__ = ["from_plain", "to_plain"]
