"""Unit kinds (plant, linear model, control law): construction from their files and generated sources."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from fmu import law_unit as law_tables, linear_model, tables
from fmu.kernel_object import ObjectTarget, write_objects
from fmu.law_unit import LawUnit
from fmu.linear_model import LinearUnit
from fmu.model import PlantUnit, Unit, check_name
from identification.errors import ModelError
from identification.lpv.model import LpvModel, load_model
from rotorsim.base.constants import MPA, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.control import Law, load_law
from rotorsim.machine.numerics import check_speed
from rotorsim.machine.running_limits import speed_limit
from rotorsim.plant import Plant

AnyUnit = TypeVar("AnyUnit", bound=PlantUnit | LinearUnit | LawUnit)
VACUUM = 101325.0
"""Gauge pressure [Pa] below the standard atmosphere at which nothing is left."""
SHARED = ("unit.c", "values.c", "state.c", "fmi2.c", "fmi3.c", "tables.c")


START = (0.0, 0.3e6)
"""Speed [rad/s] and gauge pressure [Pa] at which a plant starts unless another is asked for."""


def plant_unit(plant: Plant, speed: float | None = None, pressure: float | None = None) -> PlantUnit:
    """A plant that starts at a speed [rad/s] and gauge pressure [Pa], by default `START`.

    Raises DataError beyond the machine's limits, and for a pressure where gas is supplied to no film.
    """
    fed = bool(plant.assembly.film.n_inj)
    if pressure and not fed:
        raise DataError(
            f"pressure: {pressure / MPA:.4g} MPa is asked for, and gas is supplied to no film of {plant.machine.name}, "
            "whose unit has no input for it; leave it out"
        )
    speed = START[0] if speed is None else speed
    check_speed(plant.machine, speed)
    limit, why = speed_limit(plant.machine)
    if abs(speed) > limit:
        raise DataError(f"speed: {speed * TO_RPM:.6g} rpm is above {limit * TO_RPM:.6g} rpm ({why}); start lower")
    return PlantUnit(plant, speed, (START[1] if pressure is None else pressure) if fed else 0.0)


def named(unit: AnyUnit, name: str | None) -> AnyUnit:
    """A unit under a chosen name, which also names its libraries; raises DataError for one that is no identifier."""
    return unit if name is None else replace(unit, chosen_name=check_name(name))


def linear_unit(given: LpvModel | str | Path, speed: float | None = None, pressure: float | None = None) -> LinearUnit:
    """An identified model, or that of a file, at a point [rad/s], [Pa] or in the middle of its range; DataError."""
    path = Path("model" if isinstance(given, LpvModel) else given)
    try:
        model = given if isinstance(given, LpvModel) else load_model(path)
    except ModelError as error:
        raise DataError(f"model: {error}, or take 'plant'") from error
    if not isinstance(model, LpvModel):
        raise DataError(
            f"model: {path}: is a model of one operating point; give an LPV model, which 'rotorsim identify' "
            "writes of records at several points"
        )
    middle = model.basis.middle
    start = [float(m) if v is None else v for m, v in zip(middle, (speed, pressure), strict=True)]
    if start[1] < -VACUUM:
        raise DataError(f"pressure: {start[1] / MPA:.4g} MPa gauge is below vacuum; give more than -0.1013 MPa")
    return LinearUnit(model, path.stem, start[0], start[1])


def law_unit(given: Law | str | Path, speed: float | None = None, pressure: float | None = None) -> LawUnit:
    """A control law, or that of a file; speed [rad/s] and gauge pressure [Pa] are start values; raises LawError."""
    starts: dict[str, Any] = {name: v for name, v in (("speed", speed), ("pressure", pressure)) if v is not None}
    return LawUnit(given if isinstance(given, Law) else load_law(given), **starts)


def write_sources(unit: Unit, jobs: Mapping[str, ObjectTarget], folder: Path) -> tuple[str, ...]:
    """Write all C files and the objects NAME.o of the jobs; returns the names of the C files to be linked."""
    if isinstance(unit, PlantUnit):
        write_objects(unit.plant.machine.text, unit.assembly.module.__name__, unit.modules, dict(jobs), folder)
        texts = tables.header(unit), tables.source(unit)
    elif isinstance(unit, LinearUnit):
        texts = linear_model.header(unit), linear_model.source(unit)
    elif isinstance(unit, LawUnit):
        texts = law_tables.header(unit), law_tables.source(unit)
    else:
        raise TypeError(f"no unit: {unit!r}")
    for name, text in zip(("tables.h", "tables.c"), texts, strict=True):
        (folder / name).write_text(text, encoding="utf-8")
    for file in (Path(__file__).parent / "c").iterdir():
        shutil.copy(file, folder)
    return (*SHARED, unit.core)
