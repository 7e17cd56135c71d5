"""Catalogue of controller designs: names, presets, and specifications changed by text such as ``weights.k_0=0.7``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

from rotorsim.base.suggest import did_you_mean
from rotorsim.base.units import parse
from rotorsim.control import designs
from rotorsim.control.designs.plants import Model
from rotorsim.control.errors import DesignError
from rotorsim.control.law import Law

DESIGNS = {
    "p": "decentralised proportional control (thesis C)",
    "lead": "decentralised P-lead, softening or hardening (D)",
    "placement": "pole placement with a Luenberger observer (A)",
    "lqr": "linear quadratic regulator on a Kalman filter",
    "hinf": "H-infinity mixed sensitivity at one operating point (B, E, F)",
    "lpv": "LPV synthesis over speed and pressure (E)",
    "h2_scheduled": "gain-scheduled H2 with notch and integral action (G)",
    "youla": "Youla-scheduled H2 for one operating point (G)",
}
"""Name and what it is."""


def module_of(name: str) -> Any:
    """Module of a design; raises DesignError for an unknown name."""
    if name not in DESIGNS:
        raise DesignError(f"design: '{name}' is not known; {did_you_mean(name, DESIGNS)}")
    return getattr(designs, name)


UNITS = {"speed": ("rad/s", "4000 rpm"), "slowest": ("rad/s", "1000 rpm"), "pressure": ("Pa", "0.5 MPa")}
"""Fields that are read with a unit: the one they are kept in, and an example."""


def make_spec(name: str, changes: Sequence[str] = (), preset: str = "") -> Any:
    """Specification of a design: its defaults or a preset, changed by texts ``field=value``; raises DesignError."""
    module = module_of(name)
    spec = module.Spec()
    if preset:
        known = getattr(module, "PRESETS", {})
        if preset not in known:
            hint = f"known are {', '.join(known)}" if known else "it has none, use --spec"
            raise DesignError(f"design {name}: no preset '{preset}'; {hint}")
        spec = known[preset]
    for change in changes:
        path, equals, value = change.partition("=")
        if not equals:
            raise DesignError(f"--spec: '{change}' is not FIELD=VALUE; write e.g. weights.k_0=0.7")
        spec = _changed(spec, path.strip().split("."), value.strip(), change)
    return spec


def design(name: str, model: Model, changes: Sequence[str] = (), preset: str = "") -> Law:
    """Law of a design by its name."""
    law: Law = module_of(name).design(model, make_spec(name, changes, preset))
    return law


def _changed(spec: Any, path: list[str], value: str, setting: str) -> Any:
    names = [field.name for field in fields(spec)]
    if path[0] not in names:
        raise DesignError(f"--spec: '{setting}': no field '{path[0]}'; known are {', '.join(names)}")
    old = getattr(spec, path[0])
    if len(path) > 1:
        if not is_dataclass(old):
            raise DesignError(f"--spec: '{setting}': '{path[0]}' has no fields of its own; write {path[0]}=VALUE")
        return replace(spec, **{path[0]: _changed(old, path[1:], value, setting)})
    return replace(spec, **{path[0]: _value(old, path[0], value, setting)})


def _value(old: Any, name: str, text: str, setting: str) -> Any:
    """The text as a value of the kind that the field holds; speeds and pressures have units."""
    if name in UNITS:
        return _quantity(text, setting, *UNITS[name])
    try:
        if isinstance(old, bool):
            return {"true": True, "false": False}[text.lower()]
        if name == "order" and text.lower() in ("none", "auto"):
            return None
        if isinstance(old, tuple):
            numbers = tuple(type(old[0])(part) for part in text.replace("x", ",").split(","))
            if len(numbers) != len(old) and name != "orders":
                raise ValueError
            return numbers
        return type(old)(text) if old is not None else int(text)
    except (ValueError, KeyError) as error:
        raise DesignError(f"--spec: '{setting}': '{text}' is not a value like {old}; give another") from error


def _quantity(text: str, setting: str, unit: str, example: str) -> float:
    try:
        return float(parse(text, unit))
    except (ValueError, KeyError) as error:
        raise DesignError(f"--spec: '{setting}': '{text}' is not a number with a unit; write e.g. {example}") from error
