"""Sweep of a machine: its definition, its cells, and its run in memory.

The analyses of `rotorsim.analysis.cases` that give the quantities are each computed over those axes alone that change
them: a lift-off pressure does not depend on the supply pressure.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields as parameters_of
from functools import lru_cache
from itertools import product
from typing import Any

from rotorsim.analysis.axes import Field
from rotorsim.analysis.cases import ANALYSES, REASON, Analysis
from rotorsim.analysis.sweeps.axes import POINTS, Over, read_over
from rotorsim.analysis.sweeps.quantities import SweepQuantity, read_quantities
from rotorsim.analysis.sweeps.result import SweepResult, result_of
from rotorsim.analysis.varied import with_fields
from rotorsim.analysis.whirl_onset import highest_speed
from rotorsim.analysis.workers import spread
from rotorsim.base.constants import TO_RPM
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.interrupt import finishing
from rotorsim.base.units import parse, show
from rotorsim.machine.rim_speed import ask_rim_speed
from rotorsim.machine.schema import Machine
from rotorsim.machine.usual import ask_machine
from rotorsim.plant.plant import Plant, as_plant

WHAT = ("lift_off", "onset", "flow")


@dataclass(frozen=True)
class Sweep:
    """Definition of a sweep: machine, axes, quantities, and the point where speed and pressure are not axes."""

    machine: Machine
    fields: tuple[Field, ...]
    quantities: tuple[SweepQuantity, ...]
    speed: float
    pressure: float
    highest: float

    @property
    def kinds(self) -> tuple[type[Analysis], ...]:
        """Analyses that give the quantities."""
        return tuple(dict.fromkeys(quantity.kind for quantity in self.quantities))

    def axes_of(self, kind: type[Analysis]) -> tuple[Field, ...]:
        """The axes that change an analysis."""
        known = {entry.name for entry in parameters_of(kind)}
        return tuple(field for field in self.fields if field.path not in POINTS or field.path in known)

    def fixed(self, kind: type[Analysis]) -> dict[str, float]:
        """Parameters [SI] of an analysis that are not axes."""
        values = {"speed": self.speed, "pressure": self.pressure, "highest_speed": self.highest}
        axes = {field.path for field in self.fields}
        return {e.name: values[e.name] for e in parameters_of(kind) if e.name in values and e.name not in axes}

    def cells(self) -> Iterator[tuple[type[Analysis], tuple[int, ...]]]:
        """Every analysis with the place of each of its cells, machine by machine."""
        for kind in self.kinds:
            for place in product(*(range(len(field.values)) for field in self.axes_of(kind))):
                yield kind, place

    def case(self, kind: type[Analysis], place: tuple[int, ...]) -> tuple[Analysis, list[tuple[str, Any]]]:
        """Analysis of a cell, and the machine's values there by path."""
        chosen = {f.path: f.values[k] for f, k in zip(self.axes_of(kind), place, strict=True)}
        point = {name: parse(chosen.pop(name), unit) for name, unit in POINTS.items() if name in chosen}
        return kind(**self.fixed(kind), **point), list(chosen.items())


def make_sweep(
    machine: Plant | Machine | str,
    over: Over,
    what: str | tuple[str, ...] | list[str] = WHAT,
    speed: float | str = 0.0,
    pressure: float | str = 0.5e6,
    highest_speed: float | str | None = None,
) -> Sweep:
    """A sweep, checked before anything is computed; see `sweep`."""
    plant = as_plant(machine)
    ask_machine(plant.machine)
    fields = read_over(over, plant.machine)
    quantities = read_quantities(what, plant.machine)
    top = highest_of(plant) if highest_speed is None else _si("highest_speed", highest_speed, "rad/s")
    found = Sweep(plant.machine, fields, quantities, _si("speed", speed, "rad/s"), _si("pressure", pressure, "Pa"), top)
    _check(found)
    return found


def highest_of(plant: Plant) -> float:
    """Highest speed [rad/s] of onset and peak, rounded to three digits, when none is given."""
    return parse(f"{highest_speed(plant) * TO_RPM:.3g} rpm", "rad/s")


def _si(name: str, value: float | str, unit: str) -> float:
    try:
        number = float(parse(value, unit)) if isinstance(value, str) else float(value)
    except ValueError as error:
        raise DataError(f"{name}: {error}") from error
    if not 0 <= number < float("inf") or (name == "highest_speed" and not number):
        raise DataError(f"{name}: '{show(number, unit)}' is out of range; give a number from 0 to what the shaft holds")
    return number


def _check(sweep: Sweep) -> None:
    """Refuse axes that change nothing; question unusual corners."""
    used = {field.path for kind in sweep.kinds for field in sweep.axes_of(kind)}
    for field in sweep.fields:
        if field.path not in used:
            names = ", ".join(quantity.name for quantity in sweep.quantities)
            raise DataError(f"--over: {field.path} does not change {names}; leave the axis out or add a quantity")
    own = [field for field in sweep.fields if field.path not in POINTS]
    for end in (0, -1):
        machine = with_fields(sweep.machine, own, [field.values[end] for field in own])
        ask_machine(machine)
    speeds = [parse(f.values[-1], "rad/s") for f in sweep.fields if f.path == "speed"]
    for speed in (sweep.speed, sweep.highest, *speeds):
        ask_rim_speed(sweep.machine, speed, "speed")


def sweep(
    machine: Plant | Machine | str,
    over: Over,
    what: str | tuple[str, ...] | list[str] = WHAT,
    speed: float | str = 0.0,
    pressure: float | str = 0.5e6,
    highest_speed: float | str | None = None,
    workers: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> SweepResult:
    """Quantities of a machine over values of its file, over speed and supply pressure.

    Parameters
    ----------
    machine : Plant, Machine or str
        The machine, its name or its file.
    over : mapping or sequence of str
        Axes: values by path of the machine file, or of `speed` and `pressure`, as 'FROM:TO:COUNT', as values with
        commas, or in percent of the machine's own value; or texts 'PATH=VALUES'. A star stands for every entry of a
        list: 'bearings.*.clearance'.
    what : str or sequence of str
        Quantities: lift_off [Pa], onset [rad/s], load [N], flow [kg/s], damping, frequency [rad/s], peak [m].
    speed, pressure : float or str
        Operating point [rad/s], [Pa, gauge] where these are not axes.
    highest_speed : float or str, optional
        Speed [rad/s] up to which onset and peak are searched; by default 40000 rpm, or four times the rotor's first
        natural frequency where that is more.
    workers : int
        Processes.
    progress : callable, optional
        Called with the cells done and in all.

    Returns
    -------
    SweepResult
        Over the axes; NaN where a cell has no result, with the reason. After Ctrl-C it holds what was done.

    Raises
    ------
    DataError, MachineFileError
        For an unknown path or quantity, values without a unit, beyond a limit or not ascending, or too many cells.

    Examples
    --------
    >>> import rotorsim as rs
    >>> over = {"bearings.1.clearance": "24 um, 26 um"}
    >>> found = rs.analysis.sweep("dtu_gas_bearing", over, "flow", pressure="0.5 MPa")
    >>> found.best["flow"]["at"]
    {'bearings.1.clearance': '24 um'}
    """
    defined = make_sweep(machine, over, what, speed, pressure, highest_speed)
    if workers < 1:
        raise DataError(f"workers = {workers}: give the number of processes, 1 or more")
    cells = list(defined.cells())
    rows: list[tuple[str, tuple[int, ...], dict[str, Any]]] = []
    try:
        for number, row in spread(_cell, [_job(defined, *cell) for cell in cells], min(workers, len(cells))):
            rows.append((cells[number][0].name, cells[number][1], row))
            if progress:
                progress(len(rows), len(cells))
    except KeyboardInterrupt:
        if not rows:
            raise
        finishing()
    return result_of(defined, rows)


def _job(defined: Sweep, kind: type[Analysis], place: tuple[int, ...]) -> tuple[Any, ...]:
    case, values = defined.case(kind, place)
    return defined.machine.text, tuple(values), kind.name, vars(case)


def _cell(text: str, values: tuple[tuple[str, Any], ...], kind: str, parameters: dict[str, float]) -> dict[str, Any]:
    """Result of a cell, in this process or another."""
    try:
        plant = _plant(text, values)
    except MachineFileError as error:
        return {REASON: error.problems[0]}
    return ANALYSES[kind](**parameters).run(plant)


@lru_cache(maxsize=4)
def _plant(text: str, values: tuple[tuple[str, Any], ...]) -> Plant:
    machine = Machine.from_text(text)
    for path, value in values:
        machine = machine.replace(path, value)
    return Plant(machine)
