"""Live plant without clock or page: settings in, samples out; a law that stays at its limit is switched off.

A setting acts from the next sample on. No setting ends the rig: a value beyond its limits is clamped, one that does
not fit is refused, a step without solution stops the plant until it is reset; `messages` holds the reasons. The drive
holds a speed with limited acceleration; the hammer exerts half-sine forces on the disc with an exact impulse.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rotorsim.base.errors import ControllerError, ConvergenceError, RotorsimError
from rotorsim.effects import REGISTRY
from rotorsim.experiments.experiment import reference_range
from rotorsim.experiments.running import FeedbackLoop
from rotorsim.live.laws import DECAY, StabilityVerdict, check, motion, running
from rotorsim.live.modes import own_copy
from rotorsim.live.settings import (
    BEARING,
    OFF,
    PAUSE,
    START,
    RigSettings,
    equip,
    update_derived,
    with_value,
    write_effect,
)
from rotorsim.machine import Machine
from rotorsim.plant import Plant
from rotorsim.plant.kernels.layout import FORCE, N_INPUTS, REFERENCE, SPEED, SUPPLY, inputs_of
from rotorsim.plant.simulation import Simulation, describe, settle

SCATTER = tuple(f"{name}.{effect.random_part}" for name, effect in sorted(REGISTRY.items()) if effect.random_part)
"""Parameters that the noise switch turns off."""
SENTENCES = 40
IDLE = ("impulse", "acceleration", "pace", BEARING)
"""Settings that change nothing of the motion."""
FIRST_SPEEDS = tuple(k * 100 * np.pi / 3 for k in (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 30.0))
"""Speeds [rad/s], 0 to 30 krpm, that a rig is tried to begin at if its film does not carry it at rest."""
LOOK = 1000
"""Samples in which a controller may be at the actuators' limit for `FULL` of the time."""
FULL = 0.2


@dataclass(frozen=True)
class Hit:
    """Impact with its ring-down in progress: first sample and axis."""

    sample: int
    axis: int


class Rig:
    """Plant with every effect, its settings and the last seconds of samples.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rig = rs.live.Rig(machine, rs.live.read_laws([], machine))
    >>> rig.put("pressure", 0.5e6)
    >>> rig.advance(500).shape[0]
    500
    """

    def __init__(self, machine: Machine, laws: Mapping[str, Any], seed: int = 0) -> None:
        self.plant = Plant(equip(machine))
        self.machine = self.plant.machine
        self.laws, self.seed = laws, seed
        self.settings = RigSettings(self.machine, tuple(laws))
        self.assembly = replace(self.plant.assembly, record=self.plant.assembly.record.copy())
        self.messages: deque[tuple[int, str]] = deque(maxlen=SENTENCES)
        self.sentences = 0
        self.hammer = Hammer(self.Ts)
        self.loop: FeedbackLoop | None = None
        self.hit: Hit | None = None
        self.epoch, self.since, self.change = 0, 0, ""
        self.stopped, self.resume = "", START["pace"]
        self.history = History(self.assembly.columns + N_INPUTS)
        self.reset()

    @property
    def has_film(self) -> bool:
        """True if the machine has a gas film."""
        return self.assembly.film_model is not None

    @property
    def Ts(self) -> float:
        """Time between two samples [s]."""
        return self.machine.sampling_time

    @property
    def seen(self) -> int:
        """Samples since a setting was last changed."""
        return self.simulation.samples - self.since

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
        return self.settings.numbers["speed"] * self.sense

    @property
    def sense(self) -> float:
        """Sense of rotation that is set: 1 from x to y, -1 from y to x."""
        return -1.0 if self.settings.positions["sense"] == "backward" else 1.0

    @property
    def limit(self) -> float:
        """Largest reference [V]."""
        return reference_range(self.machine)

    @property
    def clearance(self) -> float:
        """Radial clearance of the film [m], infinite without one."""
        return float("inf") if self.machine.film is None else self.machine.film.clearance

    @property
    def shown(self) -> int:
        """Number of the film that is drawn, from 0."""
        return self.machine.film_names.index(self.settings.positions[BEARING]) if len(self.machine.films) > 1 else 0

    def notify(self, sentence: str) -> None:
        """Add a message for the pages."""
        self.sentences += 1
        self.messages.append((self.sentences, sentence))

    def in_force(self) -> dict[str, float | str]:
        """Values in force in the plant, by key: effects as its parameter record has them, everything else as set."""
        found = self.settings.everything()
        for key in self.settings.sliders:
            name, _, parameter = key.partition(".")
            found[key] = float(self.assembly.record[f"{name}_0"][parameter][0])
        return found

    def set(self, key: str, value: Any) -> None:
        """Set a number [SI] or a switch by its key; what cannot be set is reported and changes nothing."""
        try:
            self.put(key, value)
        except RotorsimError as error:
            self.notify(str(error))
            self.settings.revision += 1

    def put(self, key: str, value: Any) -> None:
        """Set a number [SI] or a switch by its key; raises RotorsimError and changes nothing if it cannot be."""
        before = self.settings.everything().get(key)
        if key in self.settings.switches:
            self._switch(key, self.settings.position(key, value))
        else:
            self._number(key, *self.settings.number(key, value))
        if key not in IDLE and self.settings.everything()[key] != before:
            self._changed("a setting was changed")

    def put_all(self, values: Mapping[str, Any]) -> None:
        """Set much at once; what only fits with other new values is tried after them, what never fits is reported."""
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

    def _changed(self, change: str) -> None:
        """Begin a new epoch: what was measured before is not of the plant as it is now."""
        self.epoch, self.since, self.change = self.epoch + 1, self.simulation.samples, change

    def toggle_pause(self) -> None:
        """Pause, or resume at the earlier pace."""
        paused = self.settings.positions["pace"] == PAUSE
        self.set("pace", self.resume if paused else PAUSE)

    def strike(self, axis: int, wait: int = 0) -> None:
        """Hit the disc along x (0) or y (1), some samples from now."""
        self.hammer.strike(self.settings.numbers["impulse"], axis, wait)
        self.hit = Hit(self.simulation.samples + wait, axis)

    def reset(self) -> bool:
        """Stand at the equilibrium of the speed and pressure that are set; returns whether there is one."""
        try:
            w = settle(self.assembly, self.target if self._held else self.speed, self.pressure)
        except RotorsimError as error:
            self.notify(str(error))
            if hasattr(self, "simulation"):
                return False
            w = self._first(error)
        self.rest = describe(self.assembly, w).disc
        w[self.assembly.rig.seed] = self.seed
        self.simulation = Simulation(self.assembly, w)
        self.stopped, self.hit, self.hammer = "", None, Hammer(self.Ts)
        self.history.clear()
        self._changed("reset")
        self._close_loop(self.settings.positions["controller"])
        return True

    def _first(self, error: RotorsimError) -> np.ndarray:
        """An equilibrium to begin with: at the highest pressure, else at the lowest speed where the film carries."""
        highest = self.settings.operating["pressure"].high if "pressure" in self.settings.operating else 0.0
        for speed in FIRST_SPEEDS:
            try:
                w = settle(self.assembly, speed, highest)
            except RotorsimError:
                continue
            self.settings.keep("speed", speed)
            return w
        raise error

    def advance(self, samples: int) -> np.ndarray:
        """Run on and return the new rows: the sample table and the inputs (n, 6) that were held."""
        if self.stopped:
            return self.history.last(0)
        rows = self._rows(samples)
        try:
            loop = self.loop
            table, used = (self.simulation.advance(rows), rows) if loop is None else loop.advance(self.simulation, rows)
        except ConvergenceError as error:
            table, used = error.where["table"], error.where.get("rows", rows)
            self.stopped = str(error)
            self.notify(f"{self.stopped}; reset goes back to the equilibrium")
        except ControllerError as error:
            table, used = error.where["table"], error.where["rows"]
            self._switch_off(str(error))
        new = np.hstack([table, used[: len(table)]])
        self.history.add(new)
        self._watch_limit()
        return new

    def _watch_limit(self) -> None:
        """Switch a controller off that is at the actuators' limit."""
        if self.loop is None:
            return
        asked = np.abs(inputs_of(self.history.last(min(LOOK, self.seen)))[:, REFERENCE]).max(axis=1)
        full = np.count_nonzero(asked >= 0.999 * self.limit)
        if full > FULL * LOOK:
            name = self.settings.positions["controller"]
            self._switch_off(f"{name}: at the actuators' limit of {self.limit:g} V for {full * self.Ts:.2f} s")

    def _switch_off(self, why: str) -> None:
        self._switch("controller", OFF)
        self._changed("the controller was switched off")
        self.notify(f"{why}; the controller is off")

    @property
    def alarm(self) -> str:
        """Why the controller does not act fully now, as a sentence; empty as long as it does or is off."""
        return "" if self.loop is None else getattr(self.loop.controller, "alarm", None) or ""

    @property
    def _held(self) -> bool:
        return self.settings.positions["drive"] == "speed"

    def _rows(self, samples: int) -> np.ndarray:
        """Input rows (n, 6) of the coming samples; the reference is the constant one."""
        numbers, rows = self.settings.numbers, np.zeros((samples, N_INPUTS))
        driven = self.settings.positions["drive"] == "torque"
        self.assembly.P.drive_torque = self.sense * numbers["torque"] if driven else 0.0
        if self._held:
            set_speed = float(self.simulation.w[self.assembly.rig.command])  # about which the shaft may wander
            rows[:, SPEED] = ramp(set_speed, self.target, numbers["acceleration"], samples, self.Ts)
        else:
            rows[:, SPEED] = np.nan
        rows[:, SUPPLY] = self.pressure
        rows[:, REFERENCE] = numbers.get("reference_x", 0.0), numbers.get("reference_y", 0.0)
        rows[:, FORCE] = self.hammer.take(samples)
        return rows

    def _number(self, key: str, value: float, remark: str) -> None:
        if key in self.settings.sliders:
            self._set_effect(key, value)
        self.settings.keep(key, value)
        if remark:
            self.notify(remark)

    def _set_effect(self, key: str, value: float) -> None:
        """Change an effect's parameter in machine, parameter record and workspace."""
        self.machine = with_value(self.machine, key, value)
        effect: Any = self.machine.effects[key.partition(".")[0]][0]
        self._write_effect(key, effect, key in SCATTER and self.settings.positions["noise"] == "off")

    def _write_effect(self, key: str, effect: Any, silent: bool) -> None:
        """Write a parameter of an effect, or its zero, into parameter record and workspace."""
        name, _, parameter = key.partition(".")
        write_effect(self.assembly, f"{name}_0", replace(effect, **{parameter: 0.0}) if silent else effect, parameter)
        update_derived(self.assembly, self.assembly.w)
        update_derived(self.assembly, self.simulation.w)

    def _switch(self, key: str, position: str) -> None:
        if key == "controller" and position != OFF:
            self.switch_on(position, self.check(position)())
            return
        if key == "pace" and position == PAUSE != self.settings.positions["pace"]:
            self.resume = self.settings.positions["pace"]
        if key == "noise":  # the switch shows its position once the plant follows it
            for name in SCATTER:
                if name in self.settings.sliders:
                    self._write_effect(name, self.machine.effects[name.partition(".")[0]][0], position == "off")
        self.settings.keep(key, position)
        if key == "controller":
            self.loop = None

    def check(self, name: str) -> Callable[[], StabilityVerdict]:
        """The check whether a controller holds this point, and the one that is set: may be called in any thread."""
        a, limit, law = own_copy(self.assembly), self.limit, running(self.laws[name], (0.0, 0.0))
        speed, target, pressure = self.speed, self.target if self._held else self.speed, self.pressure
        numbers = self.settings.numbers
        external = numbers.get("reference_x", 0.0), numbers.get("reference_y", 0.0)
        recent = self.history.last(min(2 * LOOK, max(self.seen - DECAY, 0))).copy()
        now = motion(recent, self.Ts, external, getattr(law, "runout", None))

        def work() -> StabilityVerdict:
            there = check(a, law, speed, pressure, now, limit)
            if there.why or abs(target - speed) < 1.0:
                return there
            return replace(there, why=check(a, law, target, pressure, None, limit).why)

        return work

    def switch_on(self, name: str, verdict: StabilityVerdict) -> None:
        """Switch a controller on that was checked; it holds the disc where its equilibrium is."""
        self.loop = None
        self.settings.keep("controller", OFF)
        if verdict.why:
            self.notify(f"{name}: {verdict.why}; the controller stays off")
            return
        try:
            disc = describe(self.assembly, settle(self.assembly, self.speed, self.pressure)).disc
            law = running(self.laws[name], (float(disc[0]), float(disc[1])))
            self.loop = FeedbackLoop(law, self.machine.sampling_time)
        except RotorsimError as error:
            self.notify(f"{error}; the controller stays off")
            return
        self.settings.keep("controller", name)
        self.notify(verdict.sentence(name))
        self._changed("the controller was switched on")

    def _close_loop(self, name: str) -> None:
        """Switch a controller on again after a reset."""
        self.loop = None
        if name != OFF:
            self._switch("controller", name)


def ramp(speed: float, target: float, acceleration: float, samples: int, Ts: float) -> np.ndarray:
    """Speeds [rad/s] at the ends of the next samples of Ts [s] on a ramp from `speed` to `target`."""
    reach = acceleration * Ts * np.arange(1, samples + 1)
    return speed + np.clip(target - speed, -reach, reach)


WIDTH = 5
"""Samples of a hit: 1 ms at 5 kHz."""


def hit(impulse: float, axis: int, Ts: float) -> np.ndarray:
    """Force (WIDTH, 2) [N] on the disc along x (0) or y (1) for an impulse [N s], in samples of Ts [s]."""
    edges = np.cos(np.pi * np.arange(WIDTH + 1) / WIDTH)
    force = np.zeros((WIDTH, 2))
    force[:, axis] = impulse * (edges[:-1] - edges[1:]) / 2 / Ts
    return force


class Hammer:
    """Pending and active hammer impacts."""

    def __init__(self, Ts: float) -> None:
        self._Ts = Ts
        self._waiting = np.zeros((0, 2))

    def strike(self, impulse: float, axis: int, wait: int = 0) -> None:
        """Add a hit that begins after `wait` more samples."""
        blow = np.vstack([np.zeros((wait, 2)), hit(impulse, axis, self._Ts)])
        both = np.zeros((max(len(blow), len(self._waiting)), 2))
        both[: len(self._waiting)] += self._waiting
        both[: len(blow)] += blow
        self._waiting = both

    def take(self, samples: int) -> np.ndarray:
        """Force (samples, 2) [N] of the coming samples."""
        force = np.zeros((samples, 2))
        now = self._waiting[:samples]
        force[: len(now)], self._waiting = now, self._waiting[samples:]
        return force


LENGTH = 10_000
"""Samples that are kept: 2 s."""


class History:
    """Sliding window of at least the last `length` rows."""

    def __init__(self, columns: int, length: int = LENGTH) -> None:
        self._rows = np.zeros((2 * length, columns))
        self._length, self._end = length, 0
        self.total = 0

    def add(self, rows: np.ndarray) -> None:
        """Append rows (n, columns); more than `length` at a time keep their end."""
        self.total += len(rows)
        rows = rows[-self._length :]
        if self._end + len(rows) > len(self._rows):
            kept = self._rows[max(self._end - self._length, 0) : self._end].copy()
            self._rows[: len(kept)], self._end = kept, len(kept)
        self._rows[self._end : self._end + len(rows)] = rows
        self._end += len(rows)

    def last(self, count: int) -> np.ndarray:
        """The last rows, at most `count` of them (and of `length`)."""
        return self._rows[max(self._end - min(count, self._length), 0) : self._end]

    def clear(self) -> None:
        """Forget everything."""
        self._end = self.total = 0
