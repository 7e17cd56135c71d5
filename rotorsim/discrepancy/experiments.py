"""Experiments of a diagnosis: the standard campaign, and those that a rig can do next with their rig time.

The standard campaign has six operating points to fit, four held out, four untouched, at two amplitudes. A multisine's
period holds whole revolutions and its lines miss every order: lines are at odd multiples of 2.5 Hz, speeds at even
ones. A rotor without actuators is hit by a hammer instead.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from rotorsim.base.units import MPA, RIG_SAMPLE, TO_RPM, show
from rotorsim.discrepancy.changes import RING, WEIGHT, known_changes, ring_angle
from rotorsim.discrepancy.decision import allowed_here
from rotorsim.discrepancy.run_ups import RunupTrial, empty_sweep, planned_sweep
from rotorsim.discrepancy.trial import Trial, planned_trial
from rotorsim.effects.base import TURN
from rotorsim.experiments import Coastdown, Experiment, Impact, Multisine, Runup, Staircase, Steady
from rotorsim.experiments.experiment import parameters, reference_range
from rotorsim.machine import Machine

PERIOD, PERIODS, SPACING, LOW, HIGH = 0.8, 3, 4, 2.5, 250.0
"""Period [s] of the standard multisine, its periods, spacing of its lines in 1 / period, lowest and highest line
[Hz]."""
POINTS = {
    "fit": ((20, 0.30, 1.0), (40, 0.50, 0.5), (55, 0.70, 1.0), (70, 0.40, 0.5), (85, 0.60, 1.0), (100, 0.50, 0.5)),
    "held_out": ((30, 0.60, 1.0), (50, 0.35, 0.5), (65, 0.55, 1.0), (90, 0.45, 0.5)),
    "untouched": ((25, 0.45, 0.5), (45, 0.65, 1.0), (75, 0.50, 0.5), (95, 0.35, 1.0)),
}
"""Speed [Hz], pressure [MPa], amplitude [1 V, or 20 N of a hammer] by role."""
REPEATED = (1, 4)
"""Numbers of the records to fit that are made twice."""
SPEEDS = (0.0, 15.0, 30.0, 50.0, 70.0, 90.0, 110.0)
"""Shaft speeds [Hz] that a plan tries."""
SLOW_ROLL = 5.0
"""Shaft speed [Hz] of a slow roll."""
PRESSURES = (0.3, 0.5, 0.7)
"""Injection pressures [MPa] that a plan tries."""
AMPLITUDES = (1.0, 0.25, 2.0)
"""Amplitudes that a plan tries, relative to 1 V or a hit of 20 N, the usual one first."""
BIASES = ((1.0, 0.0), (0.0, 1.0))
"""Constant parts [V] of the reference of x and y."""
HIT, WIDTH, LEAD, APART, DIRECTION = 20.0, 2e-3, 0.4, 1.0, float(np.deg2rad(35.0))
"""A hit of the hammer [N, s], the time before the first and between hits [s], its direction [rad]."""
HOLD = 0.8
"""Time [s] that a step of the reference is held."""
WEIGHT_ANGLES = (0.0, 0.5 * np.pi)
"""Places [rad] on the shaft of a trial weight."""
WEIGHT_SIZE = 4e-6 / 3.5
"""Trial weight per mass of the rotor [m]: half a standard deviation of what the unbalance is calibrated by."""
RING_ANGLE = float(np.deg2rad(30.0))
"""Angle [rad] by which the ring of the probes is turned: off both axes, and not halfway between them."""
RATES = (0.5, 1.0, 2.0)
"""Ramp rates of a run-up relative to that of the records."""
PROBE_ANGLES = (0.0, 0.25 * np.pi, 0.5 * np.pi, 0.75 * np.pi)
"""Angles [rad] at which a single probe may stand."""
COAST = 2 * np.pi * 10.0
"""Rate [rad/s^2] of a coast-down: 600 rpm/s."""
SET_UP, MOUNT = 2.0, 10.0
"""Minutes in which a rig comes to a new operating point, and in which a weight is mounted or probes are turned."""
ALWAYS = ("speed", "pressure", "amplitude", "peak")
"""Parameters that a plan states even where they are the usual ones."""
NEAR = 0.02
"""Distance [Hz] within which speeds are one."""


@dataclass(frozen=True)
class PlannedRecord:
    """Planned record: file name, role, experiment, noise seed number."""

    name: str
    role: str
    experiment: Experiment
    noise: int


def campaign(machine: Machine) -> tuple[PlannedRecord, ...]:
    """Planned records of the standard campaign for a machine."""
    plan: list[PlannedRecord] = []
    for role, points in POINTS.items():
        for i, (hertz, pressure, amplitude) in enumerate(points):
            one = _experiment(machine, hertz, pressure, amplitude, len(plan))
            plan.append(PlannedRecord(f"{role}_{i + 1}", role, one, len(plan)))
    repeats = [
        PlannedRecord(f"{plan[i].name}_repeat", "fit", plan[i].experiment, len(plan) + k)
        for k, i in enumerate(REPEATED)
    ]
    return (*plan, *repeats)


def _experiment(machine: Machine, hertz: float, pressure: float, amplitude: float, number: int) -> Experiment:
    speed = 2 * np.pi * hertz
    if machine.film is not None and machine.injectors:
        return Multisine(speed, pressure * MPA, amplitude, LOW, HIGH, PERIOD, PERIODS, SPACING, sequence=number)
    angle = float(np.deg2rad(35 + 20 * (number % 3)))
    return Impact(speed, 0.0, 20 * amplitude, 2e-3, angle, 2, 1.0, 0.4)


@dataclass(frozen=True)
class ExperimentOption:
    """An experiment at an operating point, what is changed on purpose for it, and its minutes of rig time.

    weight : me [kg m] and angle [rad] of a trial weight and the number of its [[effects.unbalance]]; None for none
    probe_angle : angle [rad] of the only probe of a table of vectors
    ring : angle [rad] by which the ring of both probes is turned
    """

    experiment: Experiment
    minutes: float
    weight: tuple[float, float, int] | None = None
    probe_angle: float | None = None
    ring: float = 0.0
    like: RunupTrial | None = field(default=None, repr=False, compare=False)

    @property
    def speed(self) -> float:
        """Shaft speed [rad/s] at the beginning."""
        return self.experiment.initial()[0]

    @property
    def pressure(self) -> float:
        """Injection pressure [Pa], gauge."""
        return self.experiment.initial()[1]

    @property
    def stated(self) -> bool:
        """Whether its record has to state a change on purpose."""
        return self.weight is not None or bool(self.ring)

    @property
    def name(self) -> str:
        """Name as text."""
        one, pressure = self.experiment, f", {self.pressure / MPA:.2g} MPa" if self.pressure else ""
        if isinstance(one, Runup | Coastdown):
            text = f"{one.name} from {one.start * TO_RPM:.0f} to {one.stop * TO_RPM:.0f} rpm"
            text += f" at {(one.rate or 0.0) * TO_RPM:.0f} rpm/s{pressure}"
        else:
            text = f"{_what(one)} at {self.speed * TO_RPM:.0f} rpm{pressure}"
        if self.probe_angle is not None:
            text += f", probe at {np.degrees(self.probe_angle):.0f} deg"
        if self.weight is not None:
            text += f", trial weight of {1e6 * self.weight[0]:.3g} g*mm at {np.degrees(self.weight[1]):.0f} deg"
            text += f" in plane {self.weight[2] + 1}"
        if self.ring:
            text += f", sensor ring turned by {np.degrees(self.ring):.0f} deg"
        return text

    def changes(self, machine: Machine) -> dict[str, Any]:
        """Changes on purpose in SI units, as a record states them."""
        found: dict[str, Any] = {}
        if self.weight is not None:
            me, phase, plane = self.weight
            position = machine.effects["unbalance"][plane].position  # type: ignore[attr-defined]
            found[WEIGHT] = {"me": me, "phase": phase} | ({} if position is None else {"position": position})
        if self.ring:
            found[RING] = {"angle": (ring_angle(machine) + self.ring) % TURN}
        return found

    def trial(self, machine: Machine) -> Trial:
        """Inputs of the run without measured data."""
        if self.like is not None:
            found: Trial = planned_sweep(self.like, abs(getattr(self.experiment, "rate", 0.0)), self.probe_angle)
        elif isinstance(self.experiment, Coastdown):
            one = self.experiment
            speeds = np.arange(one.start, one.stop - 1e-9, -2 * np.pi * 2.5)[1:-1]  # a row for every 2.5 Hz
            found = planned_sweep(empty_sweep(speeds, one.pressure), one.rate or COAST, self.probe_angle)
        else:
            rows = self.experiment.rows(0, self.experiment.samples)
            found = replace(planned_trial("next", rows), probe_angle=self.probe_angle)
        return replace(found, changes=known_changes(machine, self.changes(machine), "next"))

    def table(self) -> dict[str, Any]:
        """Parameters of the experiment as a plan of a campaign has them, usual values left out."""
        one, out = self.experiment, {"kind": self.experiment.name}
        for item, known in parameters(one):
            value = getattr(one, item.name)
            if value is not None and (value != item.default or item.name in ALWAYS):
                out[item.name] = show(value, known.unit) if isinstance(value, float) and known.unit != "1" else value
        return out


def _what(one: Experiment) -> str:
    """Kind and size of an excitation, as text."""
    if isinstance(one, Multisine):
        axis = "" if one.axis == "both" else f" along {one.axis}"
        mean = f", biased by {one.mean_x:g} and {one.mean_y:g} V" if one.mean_x or one.mean_y else ""
        return f"multisine of {one.amplitude:g} V{axis}{mean}"
    if isinstance(one, Impact):
        return f"impact of {one.peak:g} N at {np.degrees(one.angle):.0f} deg"
    if isinstance(one, Staircase):
        return f"steps of {one.step:g} V, {one.hold:g} s each, along {one.axis}"
    return one.name.replace("_", " ")


def options(machine: Machine, trials: Sequence[Trial], allow: Iterable[str]) -> tuple[ExperimentOption, ...]:
    """Experiments with the allowed changes, otherwise as in the records; raises DataError for what cannot be done."""
    sweeps = [t for t in trials if isinstance(t, RunupTrial)]
    one_probe = any(t.probe_angle is not None for t in trials)
    allowed = allowed_here(machine, allow, len(sweeps) == len(trials), one_probe)
    if len(sweeps) == len(trials):
        return tuple(dict.fromkeys(_of_sweep(machine, sweeps[0], allowed)))
    records = [t for t in trials if not t.orders]
    probes = {t.probe_angle for t in records}
    angle = next(iter(probes)) if len(probes) == 1 else None
    return tuple(dict.fromkeys(replace(one, probe_angle=angle) for one in _of_points(machine, records, allowed)))


def _of_points(machine: Machine, trials: Sequence[Trial], allowed: Sequence[str]) -> Iterator[ExperimentOption]:
    """Records at constant speed, and coast-downs."""
    driven = bool(machine.injectors) and machine.actuators is not None
    points = _points(machine, trials, allowed)
    usual = [Multisine(s, p, 1.0, LOW, HIGH, PERIOD, PERIODS, SPACING, sequence=99) if driven
             else Impact(s, p, HIT, WIDTH, DIRECTION, 2, APART, LEAD) for s, p in points]  # fmt: skip
    for one, size in product(usual, AMPLITUDES if "amplitude" in allowed else (1.0,)):
        yield _timed(_sized(machine, one, size))
    for one in usual:
        if "axis" in allowed:
            yield from map(_timed, _of_one_axis(one))
        if "bias" in allowed and isinstance(one, Multisine):
            yield from (_timed(replace(one, mean_x=x, mean_y=y)) for x, y in BIASES)
        if "trial-weight" in allowed and one.speed > 0:
            yield from _weighed(machine, _timed(one))
        if "sensor-ring" in allowed:
            yield _on_turned_ring(_timed(one))
    yield from _of_pressures(points, allowed)


def _of_pressures(points: Sequence[tuple[float, float]], allowed: Sequence[str]) -> Iterator[ExperimentOption]:
    """Runs at every pressure: steps of the reference at the lowest speed, slow rolls, coast-downs from the highest."""
    slowest, highest = min(s for s, _ in points), max(s for s, _ in points)
    for pressure in sorted({p for _, p in points}):
        if "step" in allowed:
            yield from (_timed(Staircase(slowest, pressure, axis, 1.0, 1.0, HOLD)) for axis in "xy")
        if "slow-roll" in allowed:
            yield _timed(Steady(2 * np.pi * SLOW_ROLL, pressure, 2.5))
        if "coast-down" in allowed and highest > 4 * np.pi * SLOW_ROLL:
            yield _timed(Coastdown(highest, 2 * np.pi * SLOW_ROLL, COAST, pressure))


def _points(machine: Machine, trials: Sequence[Trial], allowed: Sequence[str]) -> list[tuple[float, float]]:
    """Operating points: speed [rad/s] and gauge pressure [Pa]."""
    there = sorted({(_on_grid(t.speed), round(t.pressure, -3)) for t in trials})
    if not {"speed", "pressure"} & set(allowed):
        return there
    hertz = sorted({_on_grid(2 * np.pi * f) for f in SPEEDS} if "speed" in allowed else {s for s, _ in there})
    pressures = [p * MPA for p in PRESSURES] if "pressure" in allowed else sorted({p for _, p in there})
    highest = machine.drive.highest_speed or np.inf
    return [(s, p) for s, p in product(hertz, pressures) if s <= highest]


def _on_grid(speed: float) -> float:
    """A speed [rad/s], at which a period holds whole turns if it is next to one."""
    whole = round(speed * PERIOD / (2 * np.pi)) / PERIOD
    return 2 * np.pi * whole if abs(speed / (2 * np.pi) - whole) < NEAR else speed


def _timed(one: Experiment) -> ExperimentOption:
    return ExperimentOption(one, SET_UP + one.samples * one.Ts / 60)


def _sized(machine: Machine, one: Multisine | Impact, size: float) -> Experiment:
    if isinstance(one, Impact):
        return replace(one, peak=one.peak * size)
    return replace(one, amplitude=min(one.amplitude * size, reference_range(machine)))


def _of_one_axis(one: Multisine | Impact) -> Iterator[Experiment]:
    if isinstance(one, Impact):
        yield from (replace(one, angle=angle) for angle in (0.0, 0.5 * np.pi))
    else:
        yield from (replace(one, axis=axis) for axis in "xy")


def _weighed(machine: Machine, option: ExperimentOption) -> Iterator[ExperimentOption]:
    """The same run with a trial weight, at two places in each plane."""
    me = float(f"{WEIGHT_SIZE * machine.mass:.1g}")
    for plane, angle in product(range(len(machine.effects["unbalance"])), WEIGHT_ANGLES):
        yield replace(option, weight=(me, angle, plane), minutes=option.minutes + MOUNT)


def _on_turned_ring(option: ExperimentOption) -> ExperimentOption:
    """The same run with the ring of the probes turned."""
    return replace(option, ring=RING_ANGLE, minutes=option.minutes + MOUNT)


def _of_sweep(machine: Machine, like: RunupTrial, allowed: Sequence[str]) -> Iterator[ExperimentOption]:
    """Run-ups over the speeds of a table of vectors."""
    rate = float(abs(like.rows[-1, 0] - like.rows[0, 0]) / (len(like.rows) * RIG_SAMPLE))
    low, high = float(min(like.speeds)), float(max(like.speeds))
    up = Runup(low, high, rate, like.pressure)
    usual = ExperimentOption(up, SET_UP + up.samples * up.Ts / 60, probe_angle=like.probe_angle, like=like)
    angles = PROBE_ANGLES if "axis" in allowed and like.probe_angle is not None else (like.probe_angle,)
    rates = RATES if "speed" in allowed else (1.0,)
    for angle, faster in product(angles, rates):
        one = replace(usual, experiment=replace(up, rate=rate * faster), probe_angle=angle)
        yield _mounted(one, like)
        if "trial-weight" in allowed and faster == 1.0:
            yield from _weighed(machine, _mounted(one, like))
        if "sensor-ring" in allowed and faster == 1.0:
            yield _on_turned_ring(one)
    if "slow-roll" in allowed:
        yield replace(_timed(Steady(2 * np.pi * SLOW_ROLL, like.pressure, 2.5)), probe_angle=like.probe_angle)
    if "coast-down" in allowed:
        down = Coastdown(high, low, rate, like.pressure)
        back = replace(like, speeds=np.sort(like.speeds)[::-1])
        yield replace(usual, experiment=down, like=back)


def _mounted(option: ExperimentOption, like: RunupTrial) -> ExperimentOption:
    """Experiment with the time in which a probe is turned to another angle."""
    turned = option.probe_angle != like.probe_angle
    return replace(option, minutes=option.minutes + MOUNT) if turned else option


def written_changes(machine: Machine, option: ExperimentOption) -> Mapping[str, Any]:
    """Changes on purpose, with units, as the plan of a campaign has them; empty for none."""
    units = {"me": "kg*m", "phase": "rad", "position": "m", "angle": "rad"}
    stated = option.changes(machine)
    return {name: {key: show(value, units[key]) for key, value in one.items()} for name, one in stated.items()}
