"""Machines whose kernels are compiled once, and their values that may be drawn at random.

Kernels are compiled for a machine's structure; `STRUCTURE` names the values that belong to it, so that all the others
can be drawn without a compilation.
"""

from collections.abc import Iterator
from dataclasses import fields
from functools import lru_cache
from typing import Any

from rotorsim.base.quantity import Quantity
from rotorsim.effects import FILM_PORTS, REGISTRY
from rotorsim.machine import load_machine
from rotorsim.machine.file_text import entries
from rotorsim.machine.part import Part
from rotorsim.machine.schema import Machine

STRUCTURE = (
    "grid.n_theta", "grid.n_z", "grid.symmetry", "solver.modes_per_plane", "injection.law", "actuators.mode",
    "injection.orifice_diameter", ".angle", ".offset", ".diameter", "bearings.1.length", ".kind", "solver.time_step",
)  # fmt: skip
"""Ends of paths whose values are part of the structure, and the time step, which makes a run as long as one likes."""
COARSE = {"grid.n_theta": 8, "grid.n_z": 4, "solver.time_step": "0.2 ms"}
NEEDED = {"encoder": "counts = 0"}


def with_effects(text: str, film: bool) -> str:
    """The machine's text with a table of every effect that it lacks, at neutral values."""
    lacking = [
        name
        for name, effect in REGISTRY.items()
        if f"[effects.{name}]" not in text and (film or effect.port not in FILM_PORTS)
    ]
    return text + "".join(f"\n[effects.{name}]\n{NEEDED.get(name, '')}\n" for name in lacking)


def changed(machine: Machine, values: dict[str, Any]) -> Machine:
    """The machine with other values."""
    for path, value in values.items():
        machine = machine.replace(path, value)
    return machine


@lru_cache
def texts() -> dict[str, str]:
    """Machine files by name: without a film, with everything, with ideal pins, with laminar pins, without injectors."""
    plain = load_machine("plain_rotor")
    rig = changed(load_machine("dtu_gas_bearing"), COARSE)
    laminar = changed(load_machine("dtu_gas_bearing_c"), COARSE | {"actuators.mode": "voltage"})
    ideal = changed(rig, {"actuators.mode": "ideal", "grid.symmetry": "none"})
    return {
        "plain": with_effects(plain.text, film=False),
        "everything": with_effects(changed(rig, {"grid.symmetry": "none"}).text, film=True),
        "ideal": ideal.text,
        "laminar": laminar.text,
    }


@lru_cache
def machines() -> dict[str, Machine]:
    """The machines of `texts`."""
    return {name: Machine.from_text(text) for name, text in texts().items()}


def quantities(part: Any, path: str = "") -> Iterator[tuple[str, Any, Quantity]]:
    """Dotted path, SI value, unit and limits of every number in a machine, absent ones of effects included."""
    for name, value, spec, _ in entries(part):
        here = f"{path}.{name}".lstrip(".")
        if isinstance(value, Part):
            yield from quantities(value, here)
        elif isinstance(value, tuple):
            for i, item in enumerate(value):
                yield from quantities(item, f"{here}.{i}")
        elif isinstance(value, dict):
            for key, items in value.items():
                for i, item in enumerate(items):
                    yield from quantities(item, f"{here}.{key}" + (f".{i}" if len(items) > 1 else ""))
        elif spec is not None:
            yield here, value, spec


@lru_cache
def free(name: str) -> tuple[tuple[str, Any, Quantity], ...]:
    """The quantities of a machine that are not part of its structure."""
    return tuple(q for q in quantities(machines()[name]) if not q[0].endswith(STRUCTURE))


@lru_cache
def names_of_effects() -> tuple[tuple[str, tuple[str, ...]], ...]:
    """All effects and their parameters."""
    return tuple((name, tuple(f.name for f in fields(effect))) for name, effect in sorted(REGISTRY.items()))
