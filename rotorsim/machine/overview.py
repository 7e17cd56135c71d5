"""Content of a machine: one line, SI numbers, or every field with its value and meaning."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from rotorsim.base.units import show as text
from rotorsim.machine.bearings import Coefficients
from rotorsim.machine.part import Part
from rotorsim.machine.schema import Machine
from rotorsim.machine.toml import entries


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
    parts.append(f"effects: {', '.join(machine.effects) or 'none'}")
    return "; ".join(parts)


def si_numbers(machine: Machine) -> dict[str, Any]:
    """All values as SI numbers, with mass [kg] and content hash.

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
    """Dotted path, value in engineering units and description of every field.

    Examples
    --------
    >>> import rotorsim as rs
    >>> next(rs.machine.rows(machine))[0]
    'name'
    """
    if isinstance(part, Coefficients):
        alike = {"kyy": part.kxx, "cyy": part.cxx}
        part = part.model_copy(update={name: value for name, value in alike.items() if getattr(part, name) is None})
    for name, value, spec, doc in entries(part):
        if name == "kind":
            continue
        here = f"{path}.{name}".lstrip(".")
        if isinstance(value, Part):
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
