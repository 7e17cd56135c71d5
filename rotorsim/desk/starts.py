"""Machines that an empty page begins with: texts of shipped machines, some with other values."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from rotorsim.desk.design import Design
from rotorsim.machine import machine_text
from rotorsim.machine.file_text import with_values


@dataclass(frozen=True)
class Start:
    """Title and sentence of a beginning, the shipped machine that it is made from, and the values that differ."""

    title: str
    text: str
    machine: str
    name: str
    values: dict[str, str] = field(default_factory=dict)


STARTS = {
    "springs": Start("Rotor on springs", "One disc in the middle of a uniform shaft on two linear bearings.",
                     "plain_rotor", "my_rotor"),
    "tables": Start("Rotor on tables", "A pump's rotor on oil bearings, which are tables over the speed, in housings.",
                    "pump_on_tables", "my_pump"),
    "overhung": Start("Overhung wheel", "A wheel beyond the second bearing of a uniform shaft.", "plain_rotor",
                      "my_overhung_wheel",
                      {"bearings.1.position": "450 mm", "discs.0.position": "600 mm",
                       "description": "Wheel that overhangs the second of two linear bearings"}),
    "films": Start("Rotor on two gas films", "A rigid rotor on two plain self-acting bearings.",
                   "rigid_rotor_self_acting", "my_gas_rotor"),
    "spindle": Start("Aerostatic spindle", "A spindle on two bearings with two rows of orifices each.",
                     "aerostatic_spindle", "my_spindle"),
}  # fmt: skip
"""Beginnings by key, in the order of the page."""


def begin(key: str, folder: Path, path: Path | None = None) -> Design:
    """The design of a beginning, to be saved at a path or under the first free name in a folder."""
    start = STARTS[key]
    name = start.name if path is None else path.stem
    text = with_values(machine_text(start.machine), {"name": name} | start.values)
    return Design(text, path or free(folder, name))


def free(folder: Path, name: str) -> Path:
    """The first path of a name that does not exist yet."""
    number, path = 2, folder / f"{name}.toml"
    while path.exists():
        path, number = folder / f"{name}_{number}.toml", number + 1
    return path
