"""The machine that runs: settings in, samples out. It knows no clock and no page.

What a person sets acts from the next sample on. Nothing a person does ends the rig: a value beyond its limits is
clamped, one that does not fit is refused, a step without solution stops the plant until it is reset; `said` tells.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from rotorsim.errors import ConvergenceError, DataError, RotorsimError
from rotorsim.experiments.loop import Loop
from rotorsim.live import drive
from rotorsim.live.effects import equip, with_value
from rotorsim.live.hammer import Hammer
from rotorsim.live.history import History
from rotorsim.live.laws import running
from rotorsim.live.operating import OFF
from rotorsim.live.parameters import renew, write_effect
from rotorsim.live.settings import Settings
from rotorsim.machine import Machine
from rotorsim.plant import Plant
from rotorsim.plant.columns import COLUMNS
from rotorsim.plant.equilibrium import describe, settle
from rotorsim.plant.simulation import Simulation

SCATTER = ("noise.sigma", "pressure_transducer.sigma")
"""What the noise switch turns off."""
INPUTS = 6
SENTENCES = 40


class Rig:
    """A plant with every effect in it, its settings and the last seconds of its samples."""

    def __init__(self, machine: Machine, laws: Mapping[str, Any], seed: int = 0) -> None:
        self.plant = Plant(equip(machine))
        self.machine = self.plant.machine
        self.laws, self.seed = laws, seed
        self.settings = Settings(self.machine, tuple(laws))
        self.assembly = replace(self.plant.assembly, record=self.plant.assembly.record.copy())
        self.drag = float(self.assembly.P.dry_drag)
        self.said: deque[tuple[int, str]] = deque(maxlen=SENTENCES)
        self.sentences = 0
        self.hammer = Hammer()
        self.loop: Loop | None = None
        self.impact: tuple[int, int] | None = None
        self.stopped = ""
        self.history = History(len(COLUMNS) + max(self.assembly.film.n_inj, 0) + INPUTS)
        self.reset()

    @property
    def has_film(self) -> bool:
        """Whether the machine has a gas film."""
        return self.assembly.film_model is not None

    @property
    def speed(self) -> float:
        """Speed of the shaft now [rad/s]."""
        return float(self.simulation.w[self.assembly.rotor.speed])

    @property
    def pressure(self) -> float:
        """Supply pressure that is set [Pa, gauge]."""
        return float(self.settings.numbers.get("pressure", 0.0))

    @property
    def target(self) -> float:
        """Speed that is set, with its sense [rad/s]."""
        return self.settings.numbers["speed"] * (-1.0 if self.settings.positions["sense"] == "backward" else 1.0)

    def say(self, sentence: str) -> None:
        """Tell the people at the rig something."""
        self.sentences += 1
        self.said.append((self.sentences, sentence))

    def in_force(self) -> dict[str, float | str]:
        """What acts in the plant now, by key: effects as its parameter record has them, everything else as set."""
        found = self.settings.everything()
        for key in self.settings.sliders:
            name, _, parameter = key.partition(".")
            found[key] = float(self.assembly.record[f"{name}_0"][parameter][0])
        return found

    def set(self, key: str, value: Any) -> None:
        """Set a number [SI] or a switch by its key; what cannot be is said and changes nothing."""
        try:
            self.put(key, value)
        except RotorsimError as error:
            self.say(str(error))
            self.settings.revision += 1

    def put(self, key: str, value: Any) -> None:
        """Set a number [SI] or a switch by its key; raises RotorsimError and changes nothing if it cannot be."""
        if key in self.settings.switches:
            self._switch(key, self.settings.position(key, value))
        else:
            self._number(key, *self.settings.number(key, value))

    def put_all(self, values: Mapping[str, Any]) -> None:
        """Set much at once; what only fits beside other new values is tried after them, what never does is said."""
        left = dict(values)
        while left:
            refused = {key: value for key, value in left.items() if not self._fits(key, value)}
            if len(refused) == len(left):
                break
            left = refused
        for key, value in left.items():
            self.set(key, value)

    def _fits(self, key: str, value: Any) -> bool:
        try:
            self.put(key, value)
        except RotorsimError:
            return False
        return True

    def strike(self, axis: int) -> None:
        """Hit the disc along x (0) or y (1)."""
        self.hammer.strike(self.settings.numbers["impulse"], axis)
        self.impact = (self.simulation.samples, axis)

    def reset(self) -> bool:
        """Stand at the equilibrium of the speed and pressure that are set; returns whether there is one."""
        try:
            w = settle(self.assembly, self.target if self._held else self.speed, self.pressure)
        except RotorsimError as error:
            self.say(str(error))
            if hasattr(self, "simulation"):
                return False
            w = settle(self.assembly, 0.0, self.settings.control("pressure").high if self.has_film else 0.0)
        self.rest = describe(self.assembly, w).disc
        w[self.assembly.rig.seed] = self.seed
        self.simulation = Simulation(self.assembly, w)
        self.stopped, self.impact, self.hammer = "", None, Hammer()
        self.history.clear()
        self._close_loop(self.settings.positions["controller"])
        return True

    def advance(self, samples: int) -> np.ndarray:
        """Run on and return the new rows: the sample table beside the inputs (n, 6) that were held."""
        if self.stopped:
            return self.history.last(0)
        rows = self._rows(samples)
        try:
            loop = self.loop
            table, used = (self.simulation.advance(rows), rows) if loop is None else loop.advance(self.simulation, rows)
        except ConvergenceError as error:
            table, used = error.where["table"], error.where.get("rows", rows)
            self.stopped = str(error)
            self.say(f"{self.stopped}; reset goes back to the equilibrium")
        except DataError as error:
            self._switch("controller", OFF)
            self.say(f"{error}; the controller is off")
            return self.history.last(0)
        new = np.hstack([table, used[: len(table)]])
        self.history.add(new)
        return new

    @property
    def _held(self) -> bool:
        return self.settings.positions["drive"] == "speed"

    def _rows(self, samples: int) -> np.ndarray:
        """Input rows (n, 6) of the coming samples; the reference is the constant one."""
        numbers, rows = self.settings.numbers, np.zeros((samples, INPUTS))
        torque = numbers["torque"] if self.settings.positions["drive"] == "torque" else 0.0
        drive.lay_on(self.assembly.P, self.drag, torque)
        if self._held:
            rows[:, 0] = drive.ramp(self.speed, self.target, numbers["acceleration"], samples)
        else:
            rows[:, 0] = drive.torque_rows(self.speed, torque, self.drag, samples)
        rows[:, 1] = self.pressure
        rows[:, 2:4] = numbers.get("reference_x", 0.0), numbers.get("reference_y", 0.0)
        rows[:, 4:6] = self.hammer.take(samples)
        return rows

    def _number(self, key: str, value: float, remark: str) -> None:
        if key in self.settings.sliders:
            self._set_effect(key, value)
        self.settings.keep(key, value)
        if remark:
            self.say(remark)

    def _set_effect(self, key: str, value: float) -> None:
        """Change an effect's parameter in machine, parameter record and workspace."""
        name, _, parameter = key.partition(".")
        effect = with_value(self.machine, key, value)
        tables = (effect, *self.machine.effects[name][1:])
        self.machine = self.machine.model_copy(update={"effects": self.machine.effects | {name: tables}})
        silent = key in SCATTER and self.settings.positions["noise"] == "off"
        write_effect(self.assembly, f"{name}_0", replace(effect, **{parameter: 0.0}) if silent else effect, parameter)
        renew(self.assembly, self.assembly.w)
        renew(self.assembly, self.simulation.w)

    def _switch(self, key: str, position: str) -> None:
        self.settings.keep(key, position)
        if key == "controller":
            self._close_loop(position)
        if key == "noise":
            for name in SCATTER:
                if name in self.settings.sliders:
                    self._set_effect(name, self.settings.numbers[name])

    def _close_loop(self, name: str) -> None:
        """Switch a controller on; it holds the disc where its equilibrium is."""
        self.loop = None
        if name == OFF:
            return
        try:
            disc = describe(self.assembly, settle(self.assembly, self.speed, self.pressure)).disc
            self.loop = Loop(running(self.laws[name], (float(disc[0]), float(disc[1]))))
        except RotorsimError as error:
            self.settings.keep("controller", OFF)
            self.say(f"{error}; the controller stays off")
