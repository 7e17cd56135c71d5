"""Run of a sweep in memory, on one process or several."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

from rotorsim.analysis.cases import ANALYSES, REASON, Analysis
from rotorsim.analysis.sweeps.axes import Over
from rotorsim.analysis.sweeps.definition import WHAT, Sweep, make_sweep
from rotorsim.analysis.sweeps.result import SweepResult, result_of
from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.interrupt import finishing
from rotorsim.base.processes import spread
from rotorsim.machine.schema import Machine
from rotorsim.plant.plant import Plant


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
        for number, row in spread(_cell, [_job(defined, *cell) for cell in cells], workers):
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
