"""Catalogue of controller designs: names, presets, and specifications changed by text such as ``weights.k_0=0.7``."""

from collections.abc import Iterator, Sequence
from dataclasses import Field, fields, is_dataclass, replace
from inspect import signature
from typing import Any

from identification import LpvModel
from rotorsim.base.display import Report, did_you_mean, quote, silent
from rotorsim.base.errors import DesignError
from rotorsim.base.quantity import quantity_of
from rotorsim.base.units import show
from rotorsim.control import designs
from rotorsim.control.designs.specification import DESIGNS as DESIGNS, explained
from rotorsim.control.law import Law
from rotorsim.control.plants import Model, frozen, only_point, outside, point_text, range_text

for _name in dir(designs):
    getattr(designs, _name)  # which registers it
for _name in [*designs.IN_ORDER, *sorted(set(DESIGNS) - set(designs.IN_ORDER))]:
    DESIGNS[_name] = DESIGNS.pop(_name)


def module_of(name: str) -> Any:
    """Module of a design; raises DesignError for an unknown name."""
    if name in designs.IN_PYTHON:
        call = f"rs.control.{name}.design(rs.load_model('model.json'))"
        raise DesignError(f"design: '{name}' is made in Python alone, with no law file: {call}")
    if name not in DESIGNS:
        raise DesignError(f"design: '{name}' is not known; {did_you_mean(name, DESIGNS)}")
    return getattr(designs, name)


def make_spec(name: str, changes: Sequence[str] = (), preset: str = "") -> Any:
    """Specification of a design: its defaults or a preset, changed by texts ``field=value``; raises DesignError.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.make_spec("lqr", ["u=1 V"]).u
    1.0
    """
    module = module_of(name)
    spec = module.Spec()
    if preset:
        known = getattr(module, "PRESETS", {})
        if preset not in known:
            hint = f"known are {', '.join(known)}" if known else "it has none, change fields of its specification"
            raise DesignError(f"design {name}: no preset '{preset}'; {hint}")
        spec = known[preset]
    for change in changes:
        path, equals, value = change.partition("=")
        if not equals:
            raise DesignError(f"spec: '{change}' is not FIELD=VALUE; write e.g. weights.k_0=0.7")
        spec = _changed(spec, path.strip().split("."), value.strip(), change)
    return spec


def design(name: str, model: Model, changes: Sequence[str] = (), preset: str = "", progress: Report = silent) -> Law:
    """Law of a design by its name; raises DesignError, also where the operating point must be given.

    `progress` is called with each step of a long design (lpv) before it starts. The law's sampling time is that of a
    sampled model unless `changes` give one.

    Examples
    --------
    >>> import rotorsim as rs
    >>> law = rs.control.design("lqr", lpv, ["u=0.5 V"])
    >>> law.name
    'lqr'
    """
    spec = make_spec(name, changes, preset)
    if model.Ts and not any(change.partition("=")[0].strip() == "Ts" for change in changes):
        spec = replace(spec, Ts=model.Ts)
    if hasattr(spec, "speed"):
        spec = _at_point(name, model, spec, changes)
    make = module_of(name).design
    law: Law = make(model, spec, progress) if "progress" in signature(make).parameters else make(model, spec)
    return law


def field_rows(spec: Any, above: str = "") -> Iterator[tuple[str, str, str, str, str]]:
    """Field, unit, default, limits and meaning of every number of a specification, in the order of its fields.

    Examples
    --------
    >>> import rotorsim as rs
    >>> next(rs.control.field_rows(rs.control.make_spec("lqr")))[0]
    'speed'
    """
    for entry in fields(spec):
        value, quantity, name = getattr(spec, entry.name), quantity_of(entry), above + entry.name
        if is_dataclass(value):
            yield from field_rows(value, f"{name}.")
        elif quantity is None:
            yield name, "", str(value).lower(), "true or false", ""
        else:
            values = value if isinstance(value, tuple) else (value,)
            texts = ["none" if one is None else show(one, quantity.unit) for one in values]
            parts = [text.partition(" ") for text in texts]
            digits = ",".join(number if number == "none" else f"{float(number):.6g}" for number, _, _ in parts)
            yield name, parts[0][2], digits, quantity.limits, quantity.doc


def _at_point(name: str, model: Model, spec: Any, changes: Sequence[str]) -> Any:
    """The specification at an operating point of the model: of one point, its own where `changes` give no other.

    Raises DesignError for a point outside the model's range, whatever a design makes of it.
    """
    given = {change.partition("=")[0].strip() for change in changes}
    if outside(model, spec.speed, spec.pressure):
        own = {key: value for key, value in (only_point(model) or {}).items() if key not in given}
        spec = replace(spec, **own)
    free = not given & {"speed", "pressure"}
    if free and isinstance(model, LpvModel) and outside(model, spec.speed, spec.pressure):
        raise DesignError(
            f"design {name}: the model holds for {range_text(model)}, and not for the usual "
            f"{point_text(spec.speed, spec.pressure)}; give a point within as fields of the specification, e.g. "
            f"speed='{show(model.low[0], 'rad/s')}' and pressure='{show(model.low[1], 'Pa')}'"
        )
    frozen(model, spec.speed, spec.pressure)
    return spec


def _changed(spec: Any, path: list[str], value: str, setting: str) -> Any:
    known = {entry.name: entry for entry in fields(spec)}
    if path[0] not in known:
        raise DesignError(f"spec: '{setting}': no field '{path[0]}'; known are {', '.join(known)}")
    old = getattr(spec, path[0])
    if len(path) > 1:
        if not is_dataclass(old):
            raise DesignError(f"spec: '{setting}': '{path[0]}' has no fields of its own; write {path[0]}=VALUE")
        return replace(spec, **{path[0]: _changed(old, path[1:], value, setting)})
    if is_dataclass(old):
        raise DesignError(f"spec: '{setting}': '{path[0]}' has several fields; write {path[0]}.FIELD=VALUE")
    try:
        read = _value(known[path[0]], value)
    except ValueError as error:
        raise DesignError(f"spec: '{setting}': {explained(spec, path[0], str(error))}") from error
    return replace(spec, **{path[0]: read})


def _value(entry: Field[Any], text: str) -> Any:
    """The text as a value of a field; raises ValueError with a sentence."""
    quantity, kind = quantity_of(entry), str(entry.type)
    if quantity is None:
        if text.lower() not in ("true", "false"):
            raise ValueError(f"{quote(text)} is neither true nor false; write one of them")
        return text.lower() == "true"
    if "None" in kind and text.lower() in ("none", "auto"):
        return None
    if not isinstance(entry.default, tuple):
        return quantity.parse(text)
    parts = [part.strip() for part in text.replace("x", ",").split(",")]
    if len(parts) != len(entry.default) and "..." not in kind:
        raise ValueError(f"{quote(text)} is not {len(entry.default)} values; write them with commas between")
    return tuple(quantity.parse(part) for part in parts)
