"""Machine files: TOML with units, validated and converted to SI."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from rotorsim.base.display import neither
from rotorsim.base.errors import MachineFileError
from rotorsim.base.input_files import instead
from rotorsim.base.public import named
from rotorsim.machine.bearings import LinearBearing, Point, Support, TableBearing
from rotorsim.machine.catalogue import catalogue, describe
from rotorsim.machine.file_text import read_text
from rotorsim.machine.gas_film import (
    Foil,
    Gas,
    GasFilm,
    Grooves,
    Injection,
    Lobes,
    Orifices,
    PinnedInjector,
    RingFeed,
    SpiralGrooves,
    Steps,
    ThrustBearing,
)  # fmt: skip
from rotorsim.machine.numerics import Checked, Grid, Limits, Solver
from rotorsim.machine.plausibility import ask_machine
from rotorsim.machine.rotor import (
    Disc,
    HousingAcceleration,
    HousingVelocity,
    Layer,
    LumpedMass,
    Probe,
    Section,
    Shaft,
    ShaftMaterial,
    ShaftMode,
    ShaftProbe,
)
from rotorsim.machine.rotor_import import bearing_points, from_ross
from rotorsim.machine.schema import Machine, differences, rows, si_numbers, summary

__all__ = [
    "Checked",
    "Disc",
    "Foil",
    "Gas",
    "GasFilm",
    "Grid",
    "Grooves",
    "HousingAcceleration",
    "HousingVelocity",
    "Injection",
    "Layer",
    "Limits",
    "LinearBearing",
    "Lobes",
    "LumpedMass",
    "Machine",
    "Orifices",
    "PinnedInjector",
    "Point",
    "Probe",
    "RingFeed",
    "Section",
    "Shaft",
    "ShaftMaterial",
    "ShaftMode",
    "ShaftProbe",
    "Solver",
    "SpiralGrooves",
    "Steps",
    "Support",
    "TableBearing",
    "ThrustBearing",
    "bearing_points",
    "catalogue",
    "describe",
    "differences",
    "from_ross",
    "load_machine",
    "machine_text",
    "rows",
    "shipped_machines",
    "si_numbers",
    "summary",
]


if not TYPE_CHECKING:
    __getattr__, __dir__ = named(__name__, __all__)


def shipped_machines() -> tuple[str, ...]:
    """Names of the machines that come with rotorsim.

    Examples
    --------
    >>> import rotorsim as rs
    >>> "dtu_gas_bearing" in rs.shipped_machines()
    True
    """
    folder = files("rotorsim.machine") / "rigs"
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def machine_text(name_or_path: str | Path) -> str:
    """Text of a shipped machine or of a machine file, comments included.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.machine_text("plain_rotor").splitlines()[0].startswith("#") or "name" in rs.machine_text("plain_rotor")
    True
    """
    name = str(name_or_path)
    if name in shipped_machines():
        return (files("rotorsim.machine") / "rigs" / f"{name}.toml").read_text(encoding="utf-8")
    if not Path(name).exists():
        raise MachineFileError(neither(name, "a shipped machine", shipped_machines()), argument="machine", value=name)
    return read_text(Path(name))


def load_machine(name_or_path: str | Path) -> Machine:
    """Load a shipped machine by name or a machine file by path.

    Raises
    ------
    MachineFileError
        With one line per problem: file, path of the field, value, limit or unit, way out.

    Warns
    -----
    Unusual
        Of values far from all that is built (`rotorsim.machine.plausibility`) that the file does not name in `unusual`.

    Examples
    --------
    >>> from rotorsim.machine import load_machine
    >>> load_machine("plain_rotor").name
    'plain_rotor'
    """
    text = machine_text(name_or_path)
    try:
        machine = Machine.from_text(text)
    except MachineFileError as error:
        ours = instead(name_or_path, "a machine file (TOML)", "a machine file")
        problems = (f"{ours}; 'rotorsim machine new PATH' writes one",) if ours else error.problems
        raise MachineFileError("\n".join(f"{name_or_path}: {problem}" for problem in problems)) from error
    ask_machine(machine, str(name_or_path))
    return machine
