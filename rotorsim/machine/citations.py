"""Sources that the simulation of a machine stands on: its data, shaft, film, injectors, actuators and effects."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from importlib.resources import files

from rotorsim.base.references import cited_by, sorted_keys
from rotorsim.effects import REGISTRY
from rotorsim.machine.schema import Machine

SHAFT = ("elements", "shapes", "masses", "rotor", "modal", "reduction")
"""Modules of `fe_shaft` from which a plant takes its rotor."""
FILM = ("film", "residual", "transient", "newton", "ring", "steady")
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
        found["sleeves"] = [key for module in _forms(machine) for key in cited_by(f"reynolds.{module}")]
        found["equilibrium"] = list(cited_by("rotorsim.plant.kernels.equilibrium_kernel"))
    if machine.injectors:
        found["injectors"] = list(cited_by("reynolds.injector"))
    if machine.actuators is not None:
        found["actuators"] = list(cited_by("rotorsim.plant.kernels.piezo"))
    found |= {f"effects.{name}": list(REGISTRY[name].cites) for name in machine.effects}
    return {part: sorted_keys(keys) for part, keys in found.items() if keys}


def _forms(machine: Machine) -> list[str]:
    """Modules of `reynolds` for sleeves that are no plain cylinders."""
    foil = any(film.foil is not None for film in machine.films)
    textured = any(film.sleeve.textured for film in machine.films)
    return [
        name for name, there in (("sleeve", foil), ("texture", textured), ("differences", foil or textured)) if there
    ]


def _of(package: str, modules: tuple[str, ...]) -> list[str]:
    return [key for module in modules for key in cited_by(f"{package}.{module}")]
