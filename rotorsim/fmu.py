"""Functional mock-up units of plants, identified models and control laws: export, system of two, checks, content.

import rotorsim as rs
rs.fmu.export(rs.Plant("dtu_gas_bearing"), "rotor.fmu")
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmu import check as _check, export as _export, importer as _importer, ssp as _ssp
from fmu.export import choose
from fmu.linear_units import LawUnit
from fmu.model import PlantUnit, state_of
from fmu.turned import Over
from identification import LpvModel
from rotorsim.base.errors import DataError
from rotorsim.base.public import named
from rotorsim.control import Law
from rotorsim.machine import Machine
from rotorsim.plant import Plant

if TYPE_CHECKING:
    from fmu.check import Check
    from fmu.linear_units import LinearUnit
    from rotorsim.plant.simulation import Simulation

MODEL_FILES = (".json", ".mat")
Subject = Plant | Machine | LpvModel | Law | str | Path

__all__ = ["check", "export", "info", "law_code", "state", "system"]


def unit_of(
    subject: Subject, speed: float | None, pressure: float | None, over: Over | None = None, clocked: bool = False
) -> PlantUnit | LinearUnit | LawUnit:
    """Unit of a plant, a machine, a model or a law, with a clock if asked for; raises DataError for anything else."""
    if clocked:
        return _export.clocked(unit_of(subject, speed, pressure, over))
    if isinstance(subject, Machine) or (isinstance(subject, (str, Path)) and Path(subject).suffix not in MODEL_FILES):
        subject = Plant(subject)
    if isinstance(subject, Plant):
        return _export.plant_unit(subject, speed, pressure, over)
    if over:
        raise DataError("over: is for the values of a machine; a law and an identified model have none")
    if isinstance(subject, Law):
        return _export.law_unit(subject, speed, pressure)
    if isinstance(subject, (LpvModel, str, Path)):
        return _export.linear_unit(subject, speed, pressure)
    raise DataError(
        f"fmu export: {type(subject).__name__} is not a Plant, a machine, an LpvModel or a Law; give one of these"
    )


def export(
    subject: Subject,
    out: str | Path,
    fmi: Sequence[int] = (3,),
    targets: str = "host",
    cpu: str = "portable",
    speed: float | None = None,
    pressure: float | None = None,
    announce: Callable[[str], None] | None = None,
    name: str | None = None,
    source: bool = False,
    over: Over | None = None,
    clocked: bool = False,
) -> dict[int, Path]:
    """Write a plant, an identified LPV model or a control law as .fmu files that run without Python.

    Parameters
    ----------
    subject : Plant, Machine, LpvModel, Law or path
        A path ending in .json or .mat is that of an identified model, another one, or a name, that of a machine.
    out : path
        File to write; with two versions NAME_fmi2.fmu and NAME_fmi3.fmu.
    fmi : sequence of int
        2, 3 or both.
    targets : str
        Platforms with commas: "host", "x86_64-linux", "x86_64-windows", "aarch64-linux", ...
    cpu : str
        "portable" or "native".
    speed, pressure : float, optional
        Start [rad/s], [Pa, gauge]; by default 0 and 0.3 MPa, of a model the middle of its range. A machine without
        feed has no pressure.
    announce : callable, optional
        Given sentences: before kernels are compiled, and on each machine offered with which the unit does not start.
    name : str, optional
        Name of the model and of its libraries, an identifier; by default that of the subject and of its kind.
    source : bool
        Put the unit's sources next to its binaries.
    over : mapping, optional
        Values, in SI or as text, that the unit offers by paths of the machine: {"discs.0.mass": [1.2, "1.8 kg"]}.
    clocked : bool
        A law that answers at the ticks of a periodic clock (FMI 3.0).

    Returns
    -------
    dict
        By FMI version the file.

    Raises
    ------
    DataError, NoLiftOffError

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.fmu.export(law, "law.fmu", speed=300.0, pressure=0.5e6)[3].name
    'law.fmu'
    """
    chosen = _export.versions(",".join(map(str, fmi)))
    unit = unit_of(subject, speed, pressure, over, clocked)
    return _export.export(_export.named(unit, name), Path(out), chosen, choose(targets), cpu, announce, source)


def law_code(
    law: Law | str | Path, out: str | Path, precision: str = "float64", name: str | None = None
) -> tuple[Path, Path]:
    """Write a control law as C99 for a microcontroller, OUT.h and OUT.c, without FMI; returns both.

    In float64 it has the bits of `Law.step`; the header states the error of float32. Names in C begin with `name`, by
    default that of the files. Raises DataError, LawError.

    Examples
    --------
    >>> import rotorsim as rs
    >>> [path.name for path in rs.fmu.law_code("law.json", "law")]
    ['law.h', 'law.c']
    """
    return _export.export_code(_export.named(_export.law_unit(law), name), Path(out), precision)


def system(
    law: Law | str | Path,
    plant: Plant,
    out: str | Path,
    fmi: int = 2,
    targets: str = "host",
    cpu: str = "portable",
    speed: float | None = None,
    pressure: float | None = None,
    announce: Callable[[str], None] | None = None,
    ssp: int = 1,
) -> Path:
    """Write plant and control law, wired, as one .ssp file; parameters as for `export`.

    With `ssp` 2 the system has connectors, and its start values and their mapping are files (SSV, SSM).

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.fmu.system("law.json", plant, "loop.ssp").name
    'loop.ssp'
    """
    held: LawUnit = _export.law_unit(law, speed, pressure)
    wired = _export.plant_unit(plant, speed, pressure)
    return _ssp.export_system(wired, held, Path(out), fmi, choose(targets), cpu, announce, ssp)


def check(path: str | Path, duration: float = 1.0) -> Iterator[Check]:
    """Checks of a unit against the standard and, for `duration` [s], against the plant in Python.

    The machine code in the unit runs in this process, with all that it may do: check units only of people you trust.

    Examples
    --------
    >>> import rotorsim as rs
    >>> all(one.passed is not False for one in rs.fmu.check("rotor.fmu"))
    True
    """
    return _check.check(Path(path), duration)


def state(path: str | Path, simulation: Simulation) -> bytes:
    """State from which an instance of a plant's unit continues a simulation, e.g. one that is on its orbit.

    An importer deserialises it and sets it in place of the initialisation; the time there is 0. Raises DataError for
    a unit that holds no plant, or that of another machine.

    Examples
    --------
    >>> import rotorsim as rs
    >>> start = rs.fmu.state("rotor.fmu", plant.start(300.0, 0.5e6, begin="orbit"))  # doctest: +SKIP
    """
    unit = _check.model_of(Path(path))
    if not isinstance(unit, PlantUnit):
        raise DataError(f"{path}: holds no plant, whose state a simulation is; give the unit of a plant")
    return state_of(unit, simulation)


def info(path: str | Path) -> dict[str, Any]:
    """Facts about a unit that this software exported: kind, FMI version, start, platforms.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.fmu.info("rotor.fmu")["FMI version"]
    '3.0'
    """
    return _importer.info(Path(path))


if not TYPE_CHECKING:
    __getattr__, __dir__ = named(__name__, __all__)
