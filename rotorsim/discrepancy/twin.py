"""Plant of a diagnosis: the user's machine with every effect at its neutral value, compiled once.

A candidate is then a change of parameters in the plant's record, and nothing is compiled for it; so is what single
records state as set on purpose. Effects that scatter readings (noise, quantisation, encoder, pressure transducer) are
left out: the diagnosis compares means, and what scatters is its floor.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Any

import numpy as np

from reynolds.transient import MID, OLD, STAGE
from rotorsim.base.errors import ConvergenceError, MachineFileError, NoAnswerError, NoLiftOffError
from rotorsim.base.rounding import answer, decays
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.discrepancy.changes import PLANE
from rotorsim.effects import REGISTRY, Effect, FilmEffect
from rotorsim.effects.base import OFF_SHAFT, WHERE
from rotorsim.machine import Machine
from rotorsim.machine.checks import misplaced
from rotorsim.plant.assemble import Assembly, assemble, put_rows, states_of
from rotorsim.plant.kernels.layout import READ
from rotorsim.plant.kernels.modal_rotor import SLOT
from rotorsim.plant.linearise import linearise
from rotorsim.plant.simulation import Simulation, settle

NO_SOLUTION = 1e-3
"""Size of the lines [m] that stand for a plant without solution."""
ROUNDS = 8
"""Most shots of a search for periodic motion."""
POINTS = 6
"""Samples between which the state after a turn is interpolated."""
NEAR = 600
"""Samples before a period in which a motion goes over to that with slightly other numbers."""
MOST_MOTIONS = 64
"""Motions that are kept."""
SETTLED = 1e-5
"""Last correction of the state, relative, from which on the motion is periodic."""
EXACT = 1e-9
"""Last correction of the state, relative, from which on the shot that led to it is the motion, and is not run again."""
READ_AT = (PLANE, *OFF_SHAFT)
"""Keys of the coordinate z [m] at which the displacement of the shaft, of a housing or of both apart is read."""
Setting = Mapping[str, float]
"""Values by key: 'effect.table.parameter' (absolute, SI), a name of FACTORS (a relative change), or one of READ_AT."""
FACTORS = ("curtain_discharge", "shaft_damping", "shaft_stiffness", "shaft_shear", "actuator_x", "actuator_y")
"""Keys of relative changes of numbers that no effect describes."""
PRESSURE = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
"""Mask of the supply pressure in the columns of a run's input rows."""
USUAL_STEP = 1e-4
"""Step [s] of a machine for which the steps of twins were chosen."""
FAILURES = (ConvergenceError, NoLiftOffError, MachineFileError, NoAnswerError)
"""Errors of a plant without solution."""


def fits(effect: Effect, machine: Machine) -> bool:
    """True if an effect has something to act on in the machine."""
    if misplaced(machine, effect) is not None:
        return False
    if effect.port in ("injector", "plenum") and not machine.injector_count(effect):
        return False
    if effect.port == "actuator" and not machine.injectors:
        return False
    if effect.port in ("amplifier", "actuator") and (machine.actuators is None or machine.actuators.mode == "ideal"):
        return False
    present = {**machine.effects, effect.name: (effect,)}
    return not effect.problems(machine.model_copy(update={"effects": present}))


def bearings_of(effect: type[Effect], machine: Machine) -> tuple[int | None, ...]:
    """Bearings that a candidate can be about: of several gas films each, else None alone."""
    films = machine.film_bearings
    return films if issubclass(effect, FilmEffect) and len(films) > 1 else (None,)


def own_tables(effect: type[Effect], machine: Machine) -> tuple[Effect, ...]:
    """Neutral tables of a candidate: for every bearing that it can be about all its places."""
    tables = []
    for bearing in bearings_of(effect, machine):
        own = [effect.neutral(machine, i) for i in range(effect.places)]
        own = own if bearing is None else [replace(e, bearing=bearing) for e in own]  # type: ignore[call-arg]
        tables += own if all(fits(e, machine) for e in own) else []
    return tuple(tables)


def of_each_film(present: tuple[Effect, ...], own: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """Tables, one for each film, of an effect that a film has once; neutral where the machine has none."""
    if all(getattr(e, "bearing", None) is None for e in own):
        return present
    common = next((e for e in present if getattr(e, "bearing", None) is None), None)
    named = {getattr(e, "bearing", None): e for e in present}
    return tuple(
        named.get(e.bearing, e if common is None else replace(common, bearing=e.bearing))  # type: ignore
        for e in own
    )


def equip(
    machine: Machine, also: tuple[str, ...] = (), scatter: bool = False, only: tuple[str, ...] | None = None,
    bare: bool = False,
) -> tuple[Machine, dict[str, int]]:  # fmt: skip
    """Machine with all candidates at neutral values, and the table number of each.

    An effect that may have several tables gets its own; a single one shares the machine's. Of several films each has
    a table. `also` adds effects
    that are otherwise left out, `scatter` keeps those of the sensors, `only` limits the candidates, to those that a
    calibration turns as well unless the machine is to be `bare`.
    """
    base = {name: own for name, own in machine.effects.items() if scatter or REGISTRY[name].role != "scatter"}
    slots: dict[str, int] = {}
    ahead: dict[str, tuple[Effect, ...]] = {}
    behind: dict[str, tuple[Effect, ...]] = {}
    for name in sorted(REGISTRY):
        effect = REGISTRY[name]
        if effect.role == "scatter" or (effect.role == "asymmetric" and name not in also):
            continue
        fixed = not bare and (effect.role == "set" or effect.calibration_of(machine))
        if only is not None and name not in only and not fixed:
            continue
        own = own_tables(effect, machine)
        if not own:
            continue
        if name in base:
            if effect.single:
                slots[name] = 0
                base[name] = of_each_film(base[name], own)
            else:
                slots[name] = len(base[name])
                base[name] = (*base[name], *own)
        else:
            slots[name] = 0
            (behind if effect.ends_chain else ahead)[name] = own
    return machine.with_({"effects": {**ahead, **base, **behind}}), slots


def a_turn(speed: float) -> tuple[int, np.ndarray]:
    """Samples that end a little after a turn at a speed [rad/s], and weights (POINTS,) of the last ones' states which
    interpolate that after the turn."""
    turn = 2 * np.pi / abs(speed) / RIG_SAMPLE
    last = max(round(turn), POINTS) + POINTS // 2 - 1
    at = np.arange(last - POINTS + 1, last + 1)
    others = ~np.eye(POINTS, dtype=bool)
    return last, np.array([np.prod((turn - at[o]) / (k - at[o])) for k, o in zip(at, others, strict=True)])


def in_motion(a: Assembly, w: np.ndarray, speed: float, pressure: float) -> np.ndarray:
    """Workspace of a rotor on linear bearings whose motion repeats with its turns; w itself if it is unstable."""
    if a.film_model is not None or abs(speed) < 1.0:
        return w
    return w if (found := repeating_motion(a, w, speed, pressure)) is None else found.w


@dataclass(frozen=True, eq=False)
class RepeatingMotion:
    """Workspace w in a motion that repeats, and whether the search for it has ended there.

    readings : (n, 5) over its inputs, where the last shot was that motion already and nothing but the rotor remembers
    """

    w: np.ndarray
    settled: bool
    readings: np.ndarray | None


def state_places(a: Assembly) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Places in a workspace of a rotor's displacement and velocity (2 n,), of those that a step begins at, which it
    keeps apart (2 n,), of the acceleration that it keeps too (n,), and of time, angle and turns (4,)."""
    R, n = a.rotor, np.arange(a.rotor.n)
    clock = np.array([R.angle, a.rig.tick, R.time, R.turns])
    return np.r_[R.q + n, R.v + n], np.r_[R.q_old + n, R.v_old + n], R.a_old + n, clock


def repeating_motion(
    a: Assembly, w: np.ndarray, speed: float, pressure: float, inputs: np.ndarray | None = None
) -> RepeatingMotion | None:
    r"""Motion at a speed [rad/s] that repeats with `inputs` (n, 6) in whole turns, or with the shaft alone; None for a
    rotor that is unstable.

    A lightly damped rotor takes minutes to forget how it was started. One step of Newton's method on the map over a
    turn finds its motion instead,

    .. math:: x^* = x_0 + (I - \Phi)^{-1} (x_1 - x_0)

    with x_1 the state that the plant reaches from x_0 and Phi what its linear model leaves of x_0 by then
    (`_forgotten`); exact where the plant is linear, repeated where effects bend it. A turn ends between samples, whose
    states are interpolated. Source: Aprille & Trick (1972), Proc. IEEE 60, 108 (shooting).

    Cites: aprille_1972.
    """
    last, weights = a_turn(speed) if inputs is None else (len(inputs), np.ones(1))
    rows = np.tile([speed, pressure, 0.0, 0.0, 0.0, 0.0], (last, 1)) if inputs is None else inputs
    A = linearise(a, w, speed).A
    if (forgotten := _forgotten(a, A, last, weights)) is None:
        return None
    rotor, n, began = a.rotor, a.rotor.n, w.copy()
    at, begin, rates, clock = state_places(a)
    turn = 2 * np.pi / abs(speed) if inputs is None else len(inputs) * RIG_SAMPLE
    remembers = any(call.effect.states for call in a.calls)
    # readings are those of the run's own samples; what sensors remember by their number ends where the run begins
    first = began[a.rig.tick] - (round(turn / RIG_SAMPLE) if remembers else 0)
    for number in range(1, ROUNDS + 1):
        before, moved, reached = w[at].copy(), w.copy(), np.zeros(3 * n)
        moved[a.rig.tick], moved[rotor.turns] = first, began[rotor.turns]
        run = Simulation(a, moved)
        readings = run.advance(rows[: last - len(weights)])
        for k, weight in enumerate(weights, last - len(weights)):
            readings = np.concatenate([readings, run.advance(rows[k : k + 1])])
            reached += weight * moved[[*at, *rates]]
        change = reached[: 2 * n] - before
        if not np.all(np.isfinite(change)):
            return None
        jump = forgotten @ change
        moved[at] = moved[begin] = before + jump
        moved[rates] = reached[2 * n :] + A[n:] @ (jump - change)
        # the time advances: lines that turn with no shaft do not settle
        moved[rotor.angle], moved[rotor.time] = began[rotor.angle], began[rotor.time] + number * turn
        w = moved
        left = float(np.linalg.norm(jump)) / max(float(np.linalg.norm(before)), 1e-300)
        if left <= SETTLED:
            break
    w[clock] = began[clock]
    exact = left <= EXACT and not remembers
    return RepeatingMotion(w, left <= SETTLED, readings[:, READ : READ + 5] if exact else None)


def _forgotten(a: Assembly, A: np.ndarray, samples: int, weights: np.ndarray) -> np.ndarray | None:
    r"""Matrix (I - Phi)^-1 (2 n, 2 n) with the `weights` of the states after the last samples; None where one grows.

    Phi holds powers of the plant's own step R, so that a linear plant repeats after one jump:

    .. math:: R = S\,(b\,S\,(I + a h A) + c I), \qquad S = (I - a h A)^{-1}, \qquad \Phi = \sum_k w_k R^{n_k}

    Cites: bank_1985.
    """
    eye, step = np.eye(len(A)), STAGE * a.sampling_time / a.steps_per_sample
    try:
        S = answer(np.linalg.inv, eye - step * A)
        one = answer(np.linalg.matrix_power, S @ (MID * S @ (eye + step * A) + OLD * eye), a.steps_per_sample)
        phi = weights[-1] * one
        for weight in weights[-2::-1]:
            phi = (phi + weight * eye) @ one
        phi = phi @ answer(np.linalg.matrix_power, one, samples - len(weights))
        return answer(np.linalg.inv, eye - phi) if decays(answer(np.linalg.eigvals, phi)) else None
    except NoAnswerError:
        return None


def in_forced_motion(a: Assembly, w: np.ndarray, speed: float, period: np.ndarray) -> np.ndarray:
    r"""Workspace of a turning rotor on linear bearings, w, in the motion that rows (n, 6) add when they repeat.

    Turning and forcing have periods that need not share a multiple, so the motion they give together has none. On
    linear bearings it is the sum of both: the deviation d from the motion w is that which the force's period repeats,

    .. math:: d^* = d_0 + (I - \Phi)^{-1} (d_1 - d_0)

    by the step of `in_motion`, on the difference of the runs with and without the force. Returns w itself where the
    rotor is unstable. Assumes: effects bend the plant little; what they do is left to a run.

    Cites: aprille_1972.
    """
    forgotten = _forgotten(a, linearise(a, w, speed).A, len(period), np.ones(1))
    if forgotten is None:
        return w
    at, begin, rates, clock = state_places(a)
    free, unforced = w.copy(), period.copy()
    unforced[:, 2:6] = 0.0
    free[a.rig.tick] -= len(period)  # what sensors remember by the number of a sample ends where the run begins
    Simulation(a, free).advance(unforced)
    # a step remembers the acceleration and sensors their readings, sums too, and the last force, which is as a period
    # of the force leaves it
    sensors = [
        a.rig.states + call.state + np.arange(call.effect.states) for call in a.calls if call.effect.port == "sensor"
    ]
    last = np.concatenate([rates, *sensors])
    start, found, d = w[at], w, np.zeros(len(at))
    for _ in range(ROUNDS):
        moved = found.copy()
        moved[a.rig.tick] -= len(period)
        Simulation(a, moved).advance(period)
        change = moved[at] - free[at] - d
        if not np.all(np.isfinite(change)):
            return w
        d = d + forgotten @ change
        found = moved
        found[at] = found[begin] = start + d
        found[last] += w[last] - free[last]
        found[clock] = w[clock]
        if np.linalg.norm(forgotten @ change) < SETTLED * np.linalg.norm(d):
            break
    return found


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
    bare: bool = False
    """Whether those that a calibration turns are candidates only where `only` names them."""

    @cached_property
    def equipped(self) -> tuple[Machine, dict[str, int]]:
        """The machine that is simulated, and the table number of every candidate."""
        machine, slots = equip(self.machine, self.also, self.scatter, self.only, self.bare)
        # finer by the factor by which the machine's own step is finer than the usual one
        finer = min(self.machine.time_step / USUAL_STEP, 1.0)
        step = self.step if finer == 1.0 else RIG_SAMPLE / ceil(RIG_SAMPLE / (finer * self.step) - 1e-9)
        n_theta, n_z = self.grid
        changes = {"grid.n_theta": n_theta, "grid.n_z": n_z, "solver.time_step": step}
        if self.machine.solver.sampling_rate is not None or self.machine.drive.highest_speed is not None:
            changes["solver.sampling_rate"] = 1 / RIG_SAMPLE  # that of the records which are compared
        return machine.with_(changes), slots

    @property
    def slots(self) -> dict[str, int]:
        """Table number of every effect that can be a candidate."""
        return self.equipped[1]

    @cached_property
    def _lean(self) -> dict[tuple[str, ...], Twin]:
        return {}

    def lean(self, setting: Setting) -> Twin:
        """The twin with the effects alone that a setting turns: its runs have the same bits and cost less."""
        names = turned_in(setting)
        if names not in self._lean:
            self._lean[names] = replace(self.with_candidates(*names), bare=True)
        return self._lean[names]

    def with_candidates(self, *names: str) -> Twin:
        """The twin with these candidates, and those that add coordinates: other coordinates are other machine code."""
        return replace(self, only=tuple(sorted({*names, *(n for n in self.slots if REGISTRY[n].port == "support")})))

    @cached_property
    def assembly(self) -> Assembly:
        """Kernels and workspace of the neutral setting.

        Six modes on the bearings of the file would make one of half their stiffness 1 % too stiff, one of a quarter
        3 %, and a calibration would answer for that.
        """
        return assemble(self.equipped[0], other_bearings=self.machine.film is None)

    @cached_property
    def plant_key(self) -> tuple[str, str]:
        """Hash of the machine that is simulated, and name of its machine code."""
        return self.equipped[0].hash, self.assembly.module.__name__

    def effect(self, name: str, table: int) -> Effect:
        """Effect with the numbers of the neutral setting."""
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
        """Assembly with other parameters; nothing is compiled."""
        a = self.assembly
        a.parameters  # noqa: B018  (with machine code, once)
        record, w = a.record.copy(), a.w.copy()
        changes: dict[tuple[str, int], dict[str, float]] = {}
        for place, axis in sorted({(k.split(".")[1], k[-1]) for k in setting if k.startswith("bearing.")}):
            stiffer, lossier = (setting.get(f"bearing.{place}.{what}{axis}", 0.0) for what in "kc")
            _bear(a, w, int(place), axis, stiffer, lossier)
        for key, value in setting.items():
            if key in READ_AT:
                put_rows(w, a.rotor.disc, a.mesh.moving(key, value), a.rotor.n)
            elif key in FACTORS:
                _scale(a, record, w, key, value)
            elif "." in key and not key.startswith("bearing."):
                name, table, parameter = key.split(".")
                changes.setdefault((name, int(table)), {})[parameter] = value
        for (name, number), values in changes.items():
            effect: Any = replace(self.effect(name, number), **values)
            if "position" in values:
                call = next(c for c in a.calls if c.record == f"{name}_{number}")
                put_rows(w, call.shape, a.mesh.influence(effect), a.rotor.n)
            row = record[f"{name}_{number}"]
            for parameter, value in (values | effect.derived(a.machine)).items():
                if parameter not in WHERE:
                    row[parameter] = value
        return a.with_numbers(record, w)

    def run(
        self, setting: Setting, rows: np.ndarray, pressure: float, angle: float = 0.0, turning: bool = False,
        repeating: bool = False, period: int = 0,
    ) -> np.ndarray:  # fmt: skip
        """Readings (n, 5) for input rows (n, 6) from the equilibrium at the first speed; NaN where there is none.

        With `turning` a rotor on linear bearings is in its periodic motion already, and with `repeating` in that of
        the rows, which hold whole turns. Of rows whose inputs repeat after `period` ones, with whole turns or not, it
        is in the motion of both, turning and input.
        """
        a, speed = self.set(setting), float(rows[0, 0])
        try:
            regulator = self.regulator(setting, speed, pressure)
            w = settle(a, speed, regulator)
            w[a.rotor.angle] = angle
            if turning and repeating and a.film_model is None:
                motion = repeating_motion(a, w, speed, regulator, rows)
                if motion is not None and motion.readings is not None:
                    return motion.readings
                w = w if motion is None else motion.w
            elif turning:
                w = in_motion(a, w, speed, regulator)
            if turning and period and a.film_model is None:
                w = in_forced_motion(a, w, speed, rows[:period])
            fed = rows + (regulator - pressure) * PRESSURE if regulator != pressure else rows
            return Simulation(a, w).advance(fed)[:, READ : READ + 5]
        except FAILURES:
            return np.full((len(rows), 5), np.nan)

    def over_period(
        self, setting: Setting, rows: np.ndarray, angle: float, pressure: float, length: int,
        near: Setting | None = None, led: Twin | None = None,
    ) -> np.ndarray:  # fmt: skip
        """Readings (length, 5) with a film over the last rows of (n, 6), which repeat; NaN without a solution.

        The rows before lead there from the equilibrium, or the last `NEAR` of them from the motion of a `near` setting
        where nothing takes longer. That is the motion of another lean twin, `led`, whose effects are
        among those of this one.
        """
        if near is not None and (
            self._settles_slowly
            or any(v and _settles_slowly(k) for k, v in setting.items())
            or any(_remembers(k) for k, v in setting.items() if near.get(k) != v)
        ):
            near = None
        ahead, speed = len(rows) - length - NEAR, float(rows[0, 0])
        own = (hash(rows.tobytes()), angle, pressure)
        try:
            if near is None or ahead < 0:
                return self._led(setting, rows, angle, pressure, own)[0][-length:]
            led = led if led is not None and _leads(led.assembly, self.assembly) else self
            kept = led._motions.get((_key(near), *own)) or led._led(near, rows, angle, pressure, own)[1]
            a, regulator = self.set(setting), self.regulator(setting, speed, pressure)
            w = settle(a, speed, regulator)
            _put_in_motion(w, a, led.assembly, *kept)
            w[a.rotor.matrix_speed] = np.inf  # the matrices are formed anew
            w[a.rotor.angle], w[a.rotor.time] = angle + speed * RIG_SAMPLE * ahead, RIG_SAMPLE * ahead
            fed = rows[ahead:] + (regulator - pressure) * PRESSURE
            return Simulation(a, w).advance(fed)[NEAR:, READ : READ + 5]
        except FAILURES:
            return np.full((length, 5), np.nan)

    def _led(
        self, setting: Setting, rows: np.ndarray, angle: float, pressure: float, own: tuple[Any, ...]
    ) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """Readings (n, 5) over rows (n, 6) from the equilibrium, and the workspaces there and `NEAR` samples before the
        end, which are kept."""
        a, speed = self.set(setting), float(rows[0, 0])
        w = settle(a, speed, regulator := self.regulator(setting, speed, pressure))
        w[a.rotor.angle] = angle
        rest, run, fed = w.copy(), Simulation(a, w), rows + (regulator - pressure) * PRESSURE
        first = run.advance(fed[:-NEAR])
        kept = self._keep((_key(setting), *own), (rest, w.copy()))
        return np.concatenate([first, run.advance(fed[-NEAR:])])[:, READ : READ + 5], kept

    def over_a_turn(
        self, setting: Setting, speed: float, pressure: float, angle: float, time: float
    ) -> np.ndarray | None:  # fmt: skip
        """Readings (n, 5) over a turn of the periodic motion of a rotor on linear bearings, from an angle [rad] and a
        time [s] on; None without one."""
        n = round(2 * np.pi / abs(speed) / RIG_SAMPLE)
        begin = angle - speed * n * RIG_SAMPLE, time - n * RIG_SAMPLE
        found = self._motion({k: v for k, v in setting.items() if not _is_of_sensors(k)}, speed, pressure, *begin)
        if found is None:
            return None
        a, w = self.set(setting), found.copy()
        read = slice(a.rotor.disc, a.rotor.disc + 2 * a.rotor.n)
        w[read] = a.w[read]
        # twice: sensors remember, and begin in those of another setting
        rows = np.tile([speed, pressure, 0.0, 0.0, 0.0, 0.0], (2 * n, 1))
        try:
            return Simulation(a, w).advance(rows)[n:, READ : READ + 5]
        except ConvergenceError:
            return None

    @cached_property
    def _settles_slowly(self) -> bool:
        """Whether the machine file has something at work that the drive or a resonance forgets slowly."""
        return any(_settles_slowly(n) for n, own in self.machine.effects.items() if any(e != type(e)() for e in own))

    @cached_property
    def _motions(self) -> dict[Any, Any]:
        """Workspaces of the last motions, by setting and inputs; None for a periodic one that was not found."""
        return {}

    def _motion(
        self, setting: Setting, speed: float, pressure: float, angle: float, time: float
    ) -> np.ndarray | None:  # fmt: skip
        """Workspace in periodic motion, which all planes and readings of the sensors share; None without one."""
        key = (_key(setting), speed, pressure, angle, time)
        with suppress(KeyError):
            return self._motions[key]
        a, found = self.set(setting), None
        with suppress(*FAILURES):
            w = settle(a, speed, pressure)
            w[a.rotor.angle], w[a.rotor.time] = angle, time
            found = repeating_motion(a, w, speed, pressure)
        return self._keep(key, found.w if found is not None and found.settled else None)

    def _keep(self, key: Any, motion: Any) -> Any:
        """A motion that is kept, the oldest ones are not."""
        for old in list(self._motions)[: 1 - MOST_MOTIONS]:
            self._motions.pop(old, None)
        self._motions[key] = motion
        return motion

    def regulator(self, setting: Setting, speed: float, pressure: float) -> float:
        """Gauge pressure [Pa] at the regulator of a record whose gauge, at the injectors, reads `pressure` [Pa, gauge].

        What the machine file's own supply line loses is in the reading already; a line that is a candidate loses more.
        """
        if not any(e.port == "supply" and e != type(e)() for own in self.machine.effects.values() for e in own):
            return pressure
        from rotorsim.analysis.supply import regulator_pressure  # for machines with a supply line alone

        filed = {k: v for k, v in setting.items() if getattr(REGISTRY.get(k.split(".")[0]), "port", "") != "supply"}
        return regulator_pressure(self.set(filed), speed, pressure)


def _leads(b: Assembly, a: Assembly) -> bool:
    """Whether a motion of `b` can be one of `a`, another assembly of the machine with more effects.

    Rotor, films, drive and actuators are at the same places, and `b` has every effect of `a` that keeps references:
    one that is off keeps them too, so that a step of its delay begins with those before.
    """
    kept = {call.record for call in b.calls}
    if any(c.effect.port == "reference" and c.effect.states and c.record not in kept for c in a.calls):
        return False
    stages = a.rig.old == b.rig.old and a.rig.n_stroke_states == b.rig.n_stroke_states
    return stages and a.rotor._replace(turning=0) == b.rotor._replace(turning=0)


def _put_in_motion(w: np.ndarray, a: Assembly, b: Assembly, rest: np.ndarray, moving: np.ndarray) -> None:
    """Move a workspace w of `a` from rest as `moving` of `b` is moved from `rest`, whose effects `a` has too."""
    end = a.rig.motion
    moved = np.flatnonzero(rest[:end] != moving[:end])
    w[moved] = moving[moved]
    own = {call.record: call for call in a.calls}
    for call in b.calls:
        here = own[call.record]
        sizes = {"state": 0 if call.effect.port == "actuator" else states_of(call.effect, b.machine)}
        sizes["slot"] = SLOT if call.effect.port == "motion" else 0
        to, begin = here.numbers(a.rotor, a.rig), call.numbers(b.rotor, b.rig)
        for name, size in sizes.items():
            part = slice(begin[name], begin[name] + size)
            changed = rest[part] != moving[part]
            w[to[name] : to[name] + size][changed] = moving[part][changed]


def turned_in(setting: Setting) -> tuple[str, ...]:
    """Effects that a setting turns."""
    return tuple(sorted({k.split(".")[0] for k in setting if "." in k and not k.startswith("bearing.")}))


def _settles_slowly(key: str) -> bool:
    """Whether a key is of an effect that the drive or a resonance forgets slowly."""
    effect = REGISTRY.get(key.split(".")[0])
    return effect is not None and (effect.port in ("torque", "support") or effect.braking is not None)


def _remembers(key: str) -> bool:
    """Whether a key is of an effect with states that remember long."""
    effect = REGISTRY.get(key.split(".")[0])
    return effect is not None and bool(effect.states) and effect.memory != "short"


def _key(setting: Setting) -> tuple[tuple[str, float], ...]:
    """Values in the order of their names."""
    return tuple(sorted(setting.items()))


def _is_of_sensors(key: str) -> bool:
    """Whether a key of a setting changes readings alone."""
    return key in READ_AT or getattr(REGISTRY.get(key.split(".")[0]), "port", "") == "sensor"


def _scale(a: Assembly, record: Any, w: np.ndarray, key: str, change: float) -> None:
    """Change relatively a number that no effect describes."""
    if key == "curtain_discharge":
        for k in range(len(a.films)):
            a.film_part(w, k)[a.film.curtain : a.film.curtain + a.film.n_inj] *= 1 + change
    elif key == "shaft_damping":
        _add(a, w, a.rotor.C, change * a.mesh.shaft_damping)
    elif key == "shaft_stiffness":
        _add(a, w, a.rotor.K, change * a.mesh.shaft_stiffness)
    elif key == "shaft_shear":
        _add(a, w, a.rotor.K, change * a.mesh.shear_softening)
    elif key in ("actuator_x", "actuator_y"):
        for name in ("pin", "sign"):
            record[0][f"{name}_{key[-1]}"][:] *= 1 + change


def _bear(a: Assembly, w: np.ndarray, number: int, axis: str, stiffer: float, lossier: float) -> None:
    """Change a linear bearing along an axis, one that is a table at all its speeds alike."""
    i = "xy".index(axis)
    if number in a.mesh.tables.values:
        size = 8 * a.rotor.n_points
        at = a.rotor.table_values + size * list(a.mesh.tables.values).index(number)
        K, C = w[at : at + size].reshape(-1, 2, 2, 2).swapaxes(0, 1)
        K[:, i, i], C[:, i, i] = of_bearing(K[:, i, i], C[:, i, i], stiffer, lossier)
        return
    row = a.mesh.between(number)[i]
    k, c = of_axis(a.machine.bearings[number], axis)
    for offset, more in zip(
        (a.rotor.K, a.rotor.C), np.subtract(of_bearing(k, c, stiffer, lossier), (k, c)), strict=True
    ):
        _add(a, w, offset, more * np.outer(row, row))


def of_axis(bearing: Any, axis: str) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness [N/m] and damping [N s/m] of a bearing along an axis, each (speeds,); (0,) of a film.

    A linear bearing has one of each, a table one for each of its speeds.
    """
    if bearing.coefficients is None:
        return np.zeros(0), np.zeros(0)
    i = "xy".index(axis)
    K, C = (np.reshape(matrices, (-1, 2, 2))[:, i, i] for matrices in bearing.coefficients)
    return K, C


def of_bearing(k: Any, c: Any, stiffer: float, lossier: float) -> tuple[Any, Any]:
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
