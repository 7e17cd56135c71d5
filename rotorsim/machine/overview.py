"""Content of a machine: one line, SI numbers, every field with its value and meaning, the sources it stands on."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import asdict, fields
from functools import lru_cache
from importlib.resources import files
from typing import Any

from rotorsim.base.references import cited_by, sorted_keys
from rotorsim.base.units import advised, show as text
from rotorsim.effects import REGISTRY, Effect
from rotorsim.machine.bearings import BearingCoefficients
from rotorsim.machine.file_text import declarations
from rotorsim.machine.part import Part
from rotorsim.machine.schema import Machine


def summary(machine: Machine) -> str:
    """Machine summary in half a line.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.summary(machine).split(":")[0]
    'dtu_gas_bearing'
    """
    film = machine.film
    parts = [f"{machine.name}: {machine.mass:.3g} kg on {len(machine.bearings)} bearings"]
    if film:
        several = len(machine.films) > 1
        films = f"{len(machine.films)} gas films" if several else "gas film"
        gaps = dict.fromkeys(text(one.clearance, "m") for one in machine.films)
        counts = ((len(machine.injectors), "injectors"), (machine.orifice_count, "orifices"))
        fed = ", ".join(f"{count} {name}" for count, name in counts if count) or "no feeding"
        every = f"{'each ' if several and len(gaps) == 1 else ''}with {' and '.join(gaps)} clearance"
        parts.append(f"{films}, {every}; in all {fed}" if several else f"{films} {every} and {fed}")
    acting = [name for name, several in machine.effects.items() if not all(map(_does_nothing, several))]
    parts.append(f"effects: {', '.join(acting) or 'none'}")
    if idle := [name for name in machine.effects if name not in acting]:
        parts.append(f"at neutral values and so without effect: {', '.join(idle)}")
    return "; ".join(parts)


def _does_nothing(effect: Effect) -> bool:
    """Whether every parameter of an effect has its default, the neutral value."""
    return all(getattr(effect, field.name) == field.default for field in fields(effect))


def si_numbers(machine: Machine) -> dict[str, Any]:
    """Values of a machine as SI numbers, with mass [kg] and content hash.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine.si_numbers(machine)["name"]
    'dtu_gas_bearing'
    """
    effects = {name: [asdict(effect) for effect in effects] for name, effects in machine.effects.items()}
    return {
        **machine.model_dump(exclude={"effects"}),
        "effects": effects,
        "mass": machine.mass,
        "hash": machine.hash,
    }


def rows(part: Any, path: str = "") -> Iterator[tuple[str, str, str]]:
    """Dotted path, value in engineering units and description of every field, also of those that are not set.

    Examples
    --------
    >>> import rotorsim as rs
    >>> next(rs.machine.rows(machine))[0]
    'name'
    """
    if isinstance(part, BearingCoefficients):
        alike = {"kyy": part.kxx, "cyy": part.cxx}
        part = part.model_copy(update={name: value for name, value in alike.items() if getattr(part, name) is None})
    for name, (spec, doc) in declarations(type(part)).items():
        if name == "kind":
            continue
        here, value = f"{path}.{name}".lstrip("."), getattr(part, name, None)
        if value is None or value == ():
            yield here, f"not set [{advised(spec.unit)[0]}]" if spec and spec.unit != "1" else "not set", doc
        elif isinstance(value, Part):
            yield from rows(value, here)
        elif isinstance(value, dict):
            for key, parts in value.items():
                yield from _list_rows(parts, f"{here}.{key}")
        elif isinstance(value, tuple) and name != "unusual":
            yield from _list_rows(value, here)
        else:
            yield here, text(value, spec.unit) if spec else str(value), doc


def _list_rows(parts: tuple[Any, ...], path: str) -> Iterator[tuple[str, str, str]]:
    single = len(parts) == 1 and path.startswith("effects.")
    for i, part in enumerate(parts):
        yield from rows(part, path if single else f"{path}.{i}")


SHAFT = ("elements", "rotor", "modal", "reduction")
"""Modules of `fe_shaft` from which a plant takes its rotor."""
FILM = ("film", "residual", "transient", "newton", "ring")
"""Modules of `reynolds` with which a plant solves its film."""


@lru_cache(maxsize=1)
def machine_sources() -> dict[str, list[str]]:
    """Return the keys of the sources of the shipped machines, by name."""
    text = (files("rotorsim.machine") / "sources.toml").read_text(encoding="utf-8")
    return dict(tomllib.loads(text))


def citations(machine: Machine) -> dict[str, list[str]]:
    """Return keys of sources by the part of the machine that stands on them, parts without a source left out.

    A key is one of `rotorsim.base.references.references`, or a whole reference that a user's own effect gives.
    """
    found = {"machine file": machine_sources().get(machine.name, [])}
    found["shaft"] = _of("fe_shaft", SHAFT)
    found["coupled step"] = list(cited_by("rotorsim.plant.kernels.modal_rotor"))
    if machine.film is not None:
        found["film"] = _of("reynolds", FILM)
        found["sleeves"] = _of(
            "reynolds", dict.fromkeys(name for film in machine.films for name in film.sleeve.modules)
        )
        found["equilibrium"] = list(cited_by("rotorsim.plant.kernels.equilibrium_kernel"))
    if machine.injectors:
        found["injectors"] = list(cited_by("reynolds.injector"))
    if machine.actuators is not None:
        found["actuators"] = list(cited_by("rotorsim.plant.kernels.injectors"))
    found |= {f"effects.{name}": list(REGISTRY[name].cites) for name in machine.effects}
    return {part: sorted_keys(keys) for part, keys in found.items() if keys}


def _of(package: str, modules: Iterable[str]) -> list[str]:
    return [key for module in modules for key in cited_by(f"{package}.{module}")]
