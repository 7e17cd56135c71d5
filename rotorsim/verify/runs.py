"""Runs of a plant with a law, with another controller or without, for rows of inputs, up to a limit of the machine.

Plant and law run as one compiled kernel, bit-identical to `experiments.controlled`: a small generated module, as the
plant's own is, so that numba keeps its machine code on disk. Another controller is a function, an object with a `step`
or a system of the package `control`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import ModuleType
from typing import Any

import numpy as np

from rotorsim.base.cache import key_of, sources_hash
from rotorsim.base.errors import ConvergenceError
from rotorsim.base.foreign_systems import is_linear
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control.law import LIMIT, Law
from rotorsim.experiments.experiment import reference_range
from rotorsim.experiments.running import choked, passed
from rotorsim.plant import Plant
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.calls import load_module
from rotorsim.plant.controller import (
    Controller,
    as_controller,
    ask,
    call,
    check_actuators,
    check_any_controller,
    name_of,
)
from rotorsim.plant.kernels.layout import COLUMNS, READ
from rotorsim.plant.simulation import Simulation

NEVER = 10**15


@dataclass(frozen=True, eq=False)
class Run:
    """Samples of a run, every `Ts` [s]; `ended` is empty, or the sentence of what stopped it.

    `at_limit` is true where that was a limit of the machine; the samples are those before it. `alarms`: bad samples,
    in which the law was suspended, of how many in which it ran, and its sentence about them.
    """

    table: np.ndarray
    rows: np.ndarray
    ended: str = ""
    Ts: float = RIG_SAMPLE
    at_limit: bool = False
    alarms: tuple[int, int, str] = (0, 0, "")

    def count(self, seconds: float) -> int:
        """Samples in a time [s]."""
        return round(seconds / self.Ts)

    def column(self, name: str) -> np.ndarray:
        """One column of the sample table."""
        return self.table[:, COLUMNS.index(name)]

    def pair(self, name: str) -> np.ndarray:
        """Columns x and y (n, 2)."""
        at = COLUMNS.index(f"{name}_x")
        return self.table[:, at : at + 2]

    @property
    def disc(self) -> np.ndarray:
        """Disc (n, 2) [m]."""
        return self.pair("disc")

    @property
    def reference(self) -> np.ndarray:
        """Reference (n, 2) [V] that the actuators got."""
        return self.rows[:, 2:4]

    @property
    def touched(self) -> bool:
        """Whether the journal touched its sleeve."""
        return bool(self.column("contact").any())

    @property
    def time(self) -> np.ndarray:
        """Time (n,) [s]."""
        return np.arange(len(self.table)) * self.Ts


@dataclass(frozen=True)
class Frozen:
    """A sensor that hangs: channel 0 or 1, from `time` [s] on."""

    channel: int
    time: float


def run_rows(
    plant: Plant, law: AnyLaw | None, rows: np.ndarray, seed: int = 0, fault: Frozen | None = None,
    position: float | None = None,
) -> Run:  # fmt: skip
    """Run from the equilibrium of the first row: columns as `Simulation.advance` takes them, (n, 6).

    The force acts at a `position` [m] along the shaft, that of the disc by default.
    A step without solution or a limit of the machine ends the run; what was simulated is kept. Raises NoLiftOffError,
    DataError, LawError.
    """
    rows = np.array(rows, float)
    simulation = plant.start(float(rows[0, 0]), float(rows[0, 1]), seed=seed)
    if position is not None:
        simulation.strike_at(position)
    if law is not None:
        check_actuators(plant.machine, law.name)
    if why := choked(simulation):
        table = np.zeros((0, simulation.columns))
        return Run(table, rows[:0], why, plant.machine.sampling_time, at_limit=True)
    return within_limits(simulation, _unlimited(plant, simulation, law, rows, fault))


def _unlimited(plant: Plant, simulation: Simulation, law: AnyLaw | None, rows: np.ndarray, fault: Frozen | None) -> Run:
    """Continue a simulation without a law or under one, whatever limits it passes."""
    if law is None:
        Ts = plant.machine.sampling_time
        try:
            return Run(simulation.advance(rows), rows, Ts=Ts)
        except ConvergenceError as error:
            table = error.where["table"]
            return Run(table, rows[: len(table)], str(error), Ts)
    if isinstance(law, Law):
        law.check_sampling(plant.machine.sampling_time)
        return run_law(simulation, law, rows, fault)
    centre = plant.equilibrium(float(rows[0, 0]), float(rows[0, 1])).disc
    return run_other(simulation, as_controller(law.given, lambda: centre), rows, fault)


def within_limits(simulation: Simulation, run: Run) -> Run:
    """The run up to where it passed a limit of the machine; `simulation` stands where it ended.

    Choked feed holes are looked at there, and not on the way.
    """
    found = passed(simulation.assembly, run.table)
    if found is None and not run.ended and (why := choked(simulation)):
        found = len(run.table), why
    if found is None:
        return run
    first, why = found
    return replace(run, table=run.table[:first], rows=run.rows[:first], ended=why, at_limit=True)


def run_law(simulation: Simulation, law: Law, rows: np.ndarray, fault: Frozen | None = None) -> Run:
    """Continue a simulation under a law at rest."""
    law.reset()
    a, Ts = simulation.assembly, simulation.assembly.sampling_time
    used = rows.copy()
    used[:, 1] += a.machine.gas.ambient_pressure
    out = np.zeros((len(rows), simulation.columns))
    row, line = np.zeros((1, 6)), np.zeros((1, simulation.columns))
    frozen, channel = (NEVER, -1) if fault is None else (round(fault.time / Ts), fault.channel)
    done = loop_module(a).run_loop(
        simulation.w, a.ix, a.parameters, used, out, a.steps_per_sample, row, line, law.memory, law.table, law.axes,
        law.layout, law.settings, np.zeros(2), reference_range(a.machine), frozen, channel, np.zeros(2),
    )  # fmt: skip
    used[:, 1] -= a.machine.gas.ambient_pressure
    ended = "" if done == len(rows) else f"no solution of the step at t = {done * Ts:.4f} s"
    return Run(out[:done], used[:done], ended, Ts, alarms=(law.bad_samples, done, law.past_alarms))


def run_other(simulation: Simulation, controller: Controller, rows: np.ndarray, fault: Frozen | None) -> Run:
    """Continue a simulation under a controller that is not a law, sample by sample in Python, as `run_law` does."""
    call(controller, "reset")
    used, tables, output, held = rows.copy(), [], np.zeros(2), np.zeros(2)
    limit, Ts = reference_range(simulation.assembly.machine), simulation.assembly.sampling_time
    frozen = NEVER if fault is None else round(fault.time / Ts)
    for k in range(len(rows)):
        used[k, 2:4] = np.clip(rows[k, 2:4] + output, -limit, limit)
        try:
            tables.append(simulation.advance(used[k : k + 1]))
        except ConvergenceError as error:
            table = np.concatenate([*tables, error.where["table"]])
            return Run(table, used[:k], str(error), Ts, alarms=_alarms(controller, k))
        row = tables[-1][0]
        seen = row[READ : READ + 2].copy()
        if fault is not None and k >= frozen:
            seen[fault.channel] = held[fault.channel]
        held = seen
        angle, speed, pressure = row[READ + 2 : READ + 5]
        output = ask(controller, seen, speed, pressure, angle, k * Ts, used[k, 2:4])
    return Run(np.concatenate(tables), used, Ts=Ts, alarms=_alarms(controller, len(rows)))


def _alarms(controller: Controller, samples: int) -> tuple[int, int, str]:
    """`Run.alarms` of a controller; none of one that does not count them."""
    return int(getattr(controller, "bad_samples", 0)), samples, str(getattr(controller, "past_alarms", ""))


def steady_rows(speed: float, pressure: float, duration: float, Ts: float = RIG_SAMPLE) -> np.ndarray:
    """Rows at constant speed [rad/s] and pressure [Pa], every `Ts` [s]."""
    rows = np.zeros((round(duration / Ts), 6))
    rows[:, 0], rows[:, 1] = speed, pressure
    return rows


@dataclass(frozen=True, eq=False)
class Other:
    """Any controller under the names that a verification prints; its matrices are not known."""

    given: Any
    name: str
    Ts: float = RIG_SAMPLE
    limit: float = LIMIT
    order: str = "not known"
    hash: str = "none"
    about: dict[str, Any] = field(default_factory=dict)


AnyLaw = Law | Other


def as_law(given: Any) -> AnyLaw:
    """The law of a linear system of the package `control`, else the controller as it is; raises DataError."""
    if isinstance(given, (Law, Other)):
        return given
    if is_linear(given) and given.ninputs == 2:
        return Law.from_control(given)
    check_any_controller(given)
    name = getattr(given, "name", None) or getattr(given, "__name__", None)
    return Other(given, str(name or name_of(given)), about={"controller": type(given).__name__})


TEXT = '''from reynolds.jit import kernel
from rotorsim.control.law_kernel import clip, step
from {plant} import run


@kernel
def run_loop(w, ix, P, rows, out, n, row, line, lw, table, axes, L, S, command, limit, frozen, channel, held):
    """Advance by one sample for each row; references are added to the law's and limited. Returns samples done.

    From sample `frozen` on the law sees channel `channel` as it was (a sensor that hangs).
    """
    for i in range(rows.shape[0]):
        for k in range(6):
            row[0, k] = rows[i, k]
        row[0, 2] = clip(rows[i, 2] + command[0], limit)
        row[0, 3] = clip(rows[i, 3] + command[1], limit)
        rows[i, 2] = row[0, 2]
        rows[i, 3] = row[0, 3]
        if run(w, ix, P, row, line, n) < 1:
            return i
        for k in range(out.shape[1]):
            out[i, k] = line[0, k]
        if i <= frozen:
            held[0] = line[0, {read}]
            held[1] = line[0, {read} + 1]
        x = held[0] if channel == 0 else line[0, {read}]
        y = held[1] if channel == 1 else line[0, {read} + 1]
        if L.pn > 0:
            lw[L.applied] = 1.0
            lw[L.applied + 1] = rows[i, 2]
            lw[L.applied + 2] = rows[i, 3]
        step(lw, table, axes, L, S, x, y, line[0, {read} + 3], line[0, {read} + 4], line[0, {read} + 2], command)
    return rows.shape[0]
'''


def loop_module(assembly: Assembly) -> ModuleType:
    """The module with `run_loop` for a machine."""
    text = TEXT.format(plant=assembly.module.run.__module__, read=READ)
    key = key_of(text, sources_hash("rotorsim/control/guard.py", "rotorsim/control/law_kernel.py"))
    return load_module(f"rotorsim_loop_{key[:16]}", lambda: text)
