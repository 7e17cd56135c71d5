"""The plant of a diagnosis: compiled once with every candidate in it; a setting is a change of its parameter record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from rotorsim.discrepancy.equipped import equip
from rotorsim.discrepancy.turning import in_motion
from rotorsim.effects import REGISTRY, Effect
from rotorsim.errors import ConvergenceError, MachineFileError, NoLiftOffError
from rotorsim.machine import Machine
from rotorsim.plant.assemble import Assembly, assemble
from rotorsim.plant.columns import READ
from rotorsim.plant.equilibrium import settle
from rotorsim.plant.simulation import Simulation

Setting = Mapping[str, float]
"""Values by key: 'effect.table.parameter' (absolute, SI) or a name of FACTORS (a relative change)."""
FACTORS = ("curtain_discharge", "shaft_damping", "shaft_stiffness", "actuator_x", "actuator_y")
FAILURES = (ConvergenceError, NoLiftOffError, MachineFileError)


@dataclass(frozen=True)
class Twin:
    """A machine with all candidates at a grid (n_theta, n_z) and a step [s]; `seed_scatter` keeps its noise."""

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
        machine = machine.replace("grid.n_theta", self.grid[0]).replace("grid.n_z", self.grid[1])
        return machine.replace("solver.time_step", f"{self.step!r} s"), slots

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
        ours = Effect.__module__.rpartition(".")[0]
        kinds = {n: REGISTRY[n] for n in sorted({*self.slots, *self.machine.effects})}
        return tuple(n for n, k in kinds.items() if n == "creep" or (k.states and not k.__module__.startswith(ours)))

    def lingers(self, setting: Setting, balanced: bool) -> bool:
        """Whether a setting has an effect at work whose memory is long; `balanced` excitation makes nothing creep."""
        slow = [name for name in self.slow if not (balanced and name == "creep")]
        if any(e != type(e)() for name in slow for e in self.machine.effects.get(name, ())):
            return True
        return any(key.split(".")[0] in slow and value for key, value in setting.items() if "." in key)

    def set(self, setting: Setting) -> Assembly:
        """The assembly with other parameters; nothing is compiled."""
        a = self.assembly
        record, w = a.record.copy(), a.w.copy()
        changes: dict[tuple[str, int], dict[str, float]] = {}
        for key, value in setting.items():
            if key in FACTORS or key.startswith("bearing."):
                _scale(a, record, w, key, value)
            elif "." in key:
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
        a = self.set(setting)
        try:
            w = settle(a, float(rows[0, 0]), pressure)
            w[a.rotor.angle] = angle
            if turning:
                w = in_motion(a, w, float(rows[0, 0]), pressure)
            return Simulation(a, w).advance(rows)[:, READ : READ + 5]
        except FAILURES:
            return np.full((len(rows), 5), np.nan)


def _scale(a: Assembly, record: Any, w: np.ndarray, key: str, change: float) -> None:
    """Relative changes of what no effect describes."""
    n = a.rotor.n
    if key == "curtain_discharge":
        w[a.film.curtain : a.film.curtain + a.film.n_inj] *= 1 + change
    elif key == "shaft_damping":
        w[a.rotor.C : a.rotor.C + n * n] *= 1 + change
    elif key == "shaft_stiffness":
        _add(a, w, a.rotor.K, change * a.mesh.shaft_stiffness)
    elif key.startswith("bearing."):
        _, number, what = key.split(".")
        bearing: Any = a.machine.bearings[int(number)]
        row = a.mesh.shape(bearing.position)["xy".index(what[1])]
        own = getattr(bearing, f"{what[0]}{what[1]}{what[1]}")
        size = getattr(bearing, f"{what[0]}xx") if own is None else own
        _add(a, w, a.rotor.K if what[0] == "k" else a.rotor.C, change * size * np.outer(row, row))
    elif key in ("actuator_x", "actuator_y"):
        for name in ("pin", "sign"):
            record[0][f"{name}_{key[-1]}"][:] *= 1 + change


def _add(a: Assembly, w: np.ndarray, offset: int, matrix: np.ndarray) -> None:
    """Add to a modal matrix of the shaft's coordinates."""
    n, m = a.rotor.n, a.rotor.n_shaft
    block = w[offset : offset + n * n].reshape(n, n)
    block[:m, :m] += matrix.T
