"""Plant of a diagnosis, compiled once with all candidates; effects are set through its parameter record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Any

import numpy as np

from rotorsim.analysis.supply import regulator_pressure
from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.base.errors import ConvergenceError, MachineFileError, NoLiftOffError
from rotorsim.discrepancy.linear_algebra import NoAnswerError
from rotorsim.discrepancy.twin.instrumented import equip
from rotorsim.discrepancy.twin.periodic_motion import in_motion
from rotorsim.effects import REGISTRY, Effect
from rotorsim.machine import Machine
from rotorsim.plant.assemble import Assembly, assemble
from rotorsim.plant.equilibrium import settle
from rotorsim.plant.kernels.columns import READ
from rotorsim.plant.simulation import Simulation

Setting = Mapping[str, float]
"""Values by key: 'effect.table.parameter' (absolute, SI) or a name of FACTORS (a relative change)."""
FACTORS = ("curtain_discharge", "shaft_damping", "shaft_stiffness", "actuator_x", "actuator_y")
PRESSURE = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
"""Column of a run's input rows that is the supply."""
USUAL_STEP = 1e-4
"""Step [s] of a machine for which the steps of twins were chosen."""
FAILURES = (ConvergenceError, NoLiftOffError, MachineFileError, NoAnswerError)


@dataclass(frozen=True)
class Twin:
    """Machine with all candidates at a grid (n_theta, n_z) and a step [s]; `seed_scatter` keeps its noise."""

    machine: Machine
    grid: tuple[int, int] = (32, 8)
    step: float = 2e-4
    also: tuple[str, ...] = ()
    scatter: bool = False
    only: tuple[str, ...] | None = None
    """Effects that can be candidates; all when None."""

    @cached_property
    def equipped(self) -> tuple[Machine, dict[str, int]]:
        """The machine that is simulated, and the table number of every candidate."""
        machine, slots = equip(self.machine, self.also, self.scatter, self.only)
        n_theta, n_z = self.grid
        changes = {"grid.n_theta": n_theta, "grid.n_z": n_z, "solver.time_step": self._step()}
        if self.machine.solver.sampling_rate is not None or self.machine.drive.highest_speed is not None:
            changes["solver.sampling_rate"] = 1 / RIG_SAMPLE  # that of the records which are compared
        return machine.with_(changes), slots

    def _step(self) -> float:
        """The step [s], as much finer as the machine's own step is than the usual one."""
        finer = min(self.machine.time_step / USUAL_STEP, 1.0)
        return self.step if finer == 1.0 else RIG_SAMPLE / ceil(RIG_SAMPLE / (finer * self.step) - 1e-9)

    @property
    def slots(self) -> dict[str, int]:
        """Table number of every effect that can be a candidate."""
        return self.equipped[1]

    @cached_property
    def assembly(self) -> Assembly:
        """Kernels and workspace of the neutral setting."""
        return assemble(self.equipped[0])

    def effect(self, name: str, table: int) -> Effect:
        """An effect as the neutral setting has it."""
        return self.equipped[0].effects[name][table]

    @cached_property
    def slow(self) -> tuple[str, ...]:
        """Effects with states that may remember longer than a record's beginning."""
        names = sorted({*self.slots, *self.machine.effects})
        return tuple(n for n in names if REGISTRY[n].states and REGISTRY[n].memory != "short")

    def lingers(self, setting: Setting, balanced: bool) -> bool:
        """Whether a setting has an effect at work whose memory is long; `balanced` excitation makes nothing creep."""
        slow = [name for name in self.slow if not (balanced and REGISTRY[name].memory == "mean")]
        if any(e != type(e)() for name in slow for e in self.machine.effects.get(name, ())):
            return True
        return any(key.split(".")[0] in slow and value for key, value in setting.items() if "." in key)

    def set(self, setting: Setting) -> Assembly:
        """The assembly with other parameters; nothing is compiled."""
        a = self.assembly
        record, w = a.record.copy(), a.w.copy()
        changes: dict[tuple[str, int], dict[str, float]] = {}
        for place, axis in sorted({(k.split(".")[1], k[-1]) for k in setting if k.startswith("bearing.")}):
            stiffer, lossier = (setting.get(f"bearing.{place}.{what}{axis}", 0.0) for what in "kc")
            _bear(a, w, int(place), axis, stiffer, lossier)
        for key, value in setting.items():
            if key in FACTORS:
                _scale(a, record, w, key, value)
            elif "." in key and not key.startswith("bearing."):
                name, table, parameter = key.split(".")
                changes.setdefault((name, int(table)), {})[parameter] = value
        for (name, number), values in changes.items():
            effect: Any = replace(self.effect(name, number), **values)
            row = record[f"{name}_{number}"]
            for parameter, value in (values | effect.derived(a.machine)).items():
                row[parameter] = value
        return replace(a, record=record, w=w)

    def run(
        self, setting: Setting, rows: np.ndarray, pressure: float, angle: float = 0.0, turning: bool = False
    ) -> np.ndarray:
        """Readings (n, 5) for input rows (n, 6) from the equilibrium at the first speed; NaN where there is none.

        With `turning` a rotor on linear bearings is in its periodic motion already.
        """
        a, speed = self.set(setting), float(rows[0, 0])
        try:
            regulator = self.regulator(setting, speed, pressure)
            w = settle(a, speed, regulator)
            w[a.rotor.angle] = angle
            if turning:
                w = in_motion(a, w, speed, regulator)
            fed = rows + (regulator - pressure) * PRESSURE if regulator != pressure else rows
            return Simulation(a, w).advance(fed)[:, READ : READ + 5]
        except FAILURES:
            return np.full((len(rows), 5), np.nan)

    def regulator(self, setting: Setting, speed: float, pressure: float) -> float:
        """Gauge pressure [Pa] at the regulator of a record whose gauge, at the injectors, reads `pressure` [Pa, gauge].

        What the machine file's own supply line loses is in the reading already; a line that is a candidate loses more.
        """
        if not any(e.port == "supply" and e != type(e)() for own in self.machine.effects.values() for e in own):
            return pressure
        filed = {k: v for k, v in setting.items() if getattr(REGISTRY.get(k.split(".")[0]), "port", "") != "supply"}
        return regulator_pressure(self.set(filed), speed, pressure)


def _scale(a: Assembly, record: Any, w: np.ndarray, key: str, change: float) -> None:
    """Relative changes of what no effect describes."""
    if key == "curtain_discharge":
        for k in range(len(a.films)):
            a.film_part(w, k)[a.film.curtain : a.film.curtain + a.film.n_inj] *= 1 + change
    elif key == "shaft_damping":
        _add(a, w, a.rotor.C, change * a.mesh.shaft_damping)
    elif key == "shaft_stiffness":
        _add(a, w, a.rotor.K, change * a.mesh.shaft_stiffness)
    elif key in ("actuator_x", "actuator_y"):
        for name in ("pin", "sign"):
            record[0][f"{name}_{key[-1]}"][:] *= 1 + change


def _bear(a: Assembly, w: np.ndarray, number: int, axis: str, stiffer: float, lossier: float) -> None:
    """Change a linear bearing along an axis."""
    bearing = a.machine.bearings[number]
    row = a.mesh.between(number)["xy".index(axis)]
    k, c = of_axis(bearing, axis)
    for offset, more in zip(
        (a.rotor.K, a.rotor.C), np.subtract(of_bearing(k, c, stiffer, lossier), (k, c)), strict=True
    ):
        _add(a, w, offset, more * np.outer(row, row))


def of_axis(bearing: Any, axis: str) -> tuple[float, float]:
    """Stiffness [N/m] and damping [N s/m] of a linear bearing along an axis."""
    k, c = (getattr(bearing, f"{what}{axis}{axis}") for what in "kc")
    return bearing.kxx if k is None else k, bearing.cxx if c is None else c


def of_bearing(k: float, c: float, stiffer: float, lossier: float) -> tuple[float, float]:
    """Stiffness [N/m] and damping [N s/m] of a bearing after relative changes of compliance and loss.

    A bearing acts in series with the shaft, by 1 / (k + i w c), close to 1 / k - i w c / k^2: the response is linear
    in these two numbers, and parameters that records do not distinguish make a straight valley for a fit.
    """
    return k / (1 - stiffer), c * (1 + lossier) / (1 - stiffer) ** 2


def _add(a: Assembly, w: np.ndarray, offset: int, matrix: np.ndarray) -> None:
    """Add to the first coordinates of a modal matrix."""
    n, m = a.rotor.n, len(matrix)
    block = w[offset : offset + n * n].reshape(n, n)
    block[:m, :m] += matrix.T
