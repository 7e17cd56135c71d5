"""Random sequences of sensor faults under five laws on the nonlinear plant of the shipped rig.

Each sequence is 2.5 s at a speed and a pressure that rise or fall, with one to three faults of 1 to 300 ms, 0.1 s or
more apart, and up to three hits of 21 N. One of the laws is scheduled over speed and pressure.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rotorsim.base.units import RIG_SAMPLE
from rotorsim.control import Law
from rotorsim.control.designs import h2_scheduled, hinf, lead, lqr, placement
from rotorsim.control.guard import BAD, FADE, LEAST, SLOW
from rotorsim.control.law import LIMIT
from rotorsim.plant import Plant
from studies.benchmarks.control_laws import rig_model
from studies.benchmarks.result import Figure

SEQUENCES, SAMPLES = 200, 12_500
FIRST, LAST = 1500, 9000
"""Samples between which faults begin and hits come; the law finds its centre before."""
RANGES = ((30.0, 600.0), (0.3e6, 0.7e6))
"""Speeds [rad/s] and pressures [Pa]; scheduled H2 laws begin at 26 rad/s."""
ROUNDING = 1e-9
"""Steps [V] that differ by less are the same: a part of an output is a rounded product."""
WRONG = ("reversed_x", "reversed_y", "both_reversed", "swapped")
KINDS = (
    "nan", "infinite", "stuck_x", "stuck_y", "both_stuck", *WRONG, "offset", "at_the_rail", "speed_lost",
    "speed_nan", "pressure_lost", "pressure_nan", "missing", "spikes",
)  # fmt: skip


@dataclass(frozen=True)
class SensorFault:
    """A fault of a kind from sample `first` to `last`, of axis 0 or 1 where it is of one."""

    kind: str
    first: int
    last: int
    axis: int


@dataclass
class FaultyLaw:
    """A law behind sensors with faults, and what it has given."""

    law: Law
    faults: tuple[SensorFault, ...]
    rng: np.random.Generator
    outputs: list[np.ndarray] = field(default_factory=list)
    alarms: list[int] = field(default_factory=list)
    bad: list[bool] = field(default_factory=list)
    held: np.ndarray = field(default_factory=lambda: np.zeros(2))

    def applied(self, reference: np.ndarray) -> None:
        """Reference that acts, given to the law."""
        self.law.applied(reference)

    def step(self, measured: np.ndarray, speed: float, pressure: float) -> np.ndarray:
        """Reference (2,) [V] of the law for what its sensors show."""
        k = len(self.outputs)
        now = [one for one in self.faults if one.first <= k < one.last]
        seen: tuple[Any, float, float] = np.array(measured), speed, pressure
        for one in now:
            seen = shown(one, *seen, self.held, self.rng)
        if not now:
            self.held = np.array(measured)
        self.outputs.append(self.law.step(*seen))
        self.alarms.append(self.law.alarm_code)
        self.bad.append(bool(self.law.memory[self.law.layout.guard + BAD] > 0))
        return self.outputs[-1]


def shown(
    fault: SensorFault, measured: np.ndarray, speed: float, pressure: float, held: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, float, float]:
    """Displacement (2,) [m], speed and pressure as the sensors show them."""
    at, kind = fault.axis, fault.kind
    signs = {"reversed_x": (-1, 1), "reversed_y": (1, -1), "both_reversed": (-1, -1)}
    if kind in signs:
        return measured * signs[kind], speed, pressure
    if kind == "swapped":
        return measured[::-1].copy(), speed, pressure
    values = {"nan": np.nan, "infinite": np.inf, "offset": measured[at] + 60e-6, "at_the_rail": 250e-6}
    if kind in values:
        measured[at] = values[kind]
    elif "stuck" in kind:
        axes = {"stuck_x": [0], "stuck_y": [1]}.get(kind, [0, 1])
        measured[axes] = held[axes]
    elif kind == "missing" and rng.random() < 0.4:
        measured[:] = np.nan
    elif kind == "spikes" and rng.random() < 0.05:
        measured[at] += rng.choice([-1, 1]) * rng.uniform(20e-6, 1e-3)
    speed = {"speed_lost": 0.0, "speed_nan": np.nan}.get(kind, speed)
    return measured, speed, {"pressure_lost": 0.0, "pressure_nan": np.nan}.get(kind, pressure)


@dataclass(frozen=True)
class FaultRun:
    """A sequence: samples with contact, outputs that are not finite, largest departure of the disc [m] before the first
    alarm of a wrong connection, largest at all; largest step of the output [V] in a return and on the way out, each
    less the largest of the law itself (`excess`); alarm at the end, samples until a wrong connection of 80 ms or more
    was found (None: not found)."""

    contact: int
    not_finite: int
    before_alarm: float
    departure: float
    returning: float
    leaving: float
    alarm: int
    found_after: tuple[int | None, ...]


def drawn(rng: np.random.Generator) -> tuple[tuple[SensorFault, ...], np.ndarray]:
    """Faults and forces on the disc (n, 2) [N]."""
    faults, at = [], FIRST
    for _ in range(int(rng.integers(1, 4))):
        first = at + int(rng.integers(100, 1500))
        last = first + int(np.exp(rng.uniform(np.log(5), np.log(1500))))
        faults.append(SensorFault(str(rng.choice(KINDS)), first, last, int(rng.integers(2))))
        at = last + 500
        if at > LAST - 2000:
            break
    forces = np.zeros((SAMPLES, 2))
    for _ in range(int(rng.integers(0, 4))):
        k = int(rng.integers(FIRST, LAST))
        forces[k : k + int(rng.integers(3, 11))] += rng.uniform(-15, 15, 2)
    return tuple(faults), forces


def ramp(rng: np.random.Generator, low: float, high: float) -> np.ndarray:
    """Values (n,) between two that are drawn."""
    first, last = rng.uniform(low, high, 2)
    return np.linspace(float(first), float(last), SAMPLES)


def sequence(plant: Plant, laws: dict[str, Law], seed: int) -> FaultRun:
    """Run one random sequence."""
    rng = np.random.default_rng(seed)
    law = laws[str(rng.choice(sorted(laws)))]
    speed, pressure = (ramp(rng, *limits) for limits in RANGES)
    faults, forces = drawn(rng)
    faulty = FaultyLaw(law.with_(), faults, rng)
    record = plant.simulate(SAMPLES * RIG_SAMPLE, speed, pressure, controller=faulty, disc_force=forces, seed=seed)
    disc = record["disc"].to_numpy()
    away = np.abs(disc - disc[1200:FIRST].mean(axis=0)).max(axis=1)
    alarms, outputs = np.array(faulty.alarms), np.array(faulty.outputs)
    found = tuple(latency(alarms, one) for one in faults if one.kind in WRONG and one.last - one.first >= 400)
    wrong = [away[one.first : one.first + n + 1].max() for one in faults if one.kind in WRONG
             for n in [latency(alarms, one)] if n is not None]  # fmt: skip
    returning, leaving = excess(outputs, alarms, np.array(faulty.bad))
    return FaultRun(int(record["contact"].sum()), int(np.sum(~np.isfinite(outputs))), max(wrong, default=0.0),
                   float(away.max()), returning, leaving, int(alarms[-1]), found)  # fmt: skip


def excess(outputs: np.ndarray, alarms: np.ndarray, bad: np.ndarray) -> tuple[float, float]:
    """Largest step [V] of outputs (n, 2) in returns, and on ways out, less the largest where the law acted fully.

    `alarms` (n,) are codes, `bad` (n,) whether a sample was bad. The last sample of a return has no alarm any more and
    counts as one of it. A step of LEAST counts as the law's own.
    """
    steps = np.append(0.0, np.abs(np.diff(outputs, axis=0)).max(axis=1))
    alarm_before = np.append(False, alarms[:-1] > 0)
    own = max(float(steps[~bad & ~alarm_before].max(initial=0.0)), LEAST)
    returning, leaving = (float(steps[which].max(initial=0.0)) for which in (~bad & alarm_before, bad))
    return returning - own, leaving - own


def latency(alarms: np.ndarray, fault: SensorFault) -> int | None:
    """Samples from a fault to the first alarm while it lasts."""
    during = np.flatnonzero(alarms[fault.first : fault.last])
    return int(during[0]) if len(during) else None


def above(excesses: list[float]) -> int:
    """Number of differences that are more than rounding."""
    return sum(one > ROUNDING for one in excesses)


def sensor_faults() -> Iterator[Figure]:
    """Contacts, outputs that are not finite and missing returns of 200 sequences; how soon wrong signs are found."""
    model = rig_model()
    laws = {"hinf": hinf.design(model, hinf.PRESETS["rig"]), "lqr": lqr.design(model), "lead": lead.design(model),
            "placement": placement.design(model), "h2_scheduled": h2_scheduled.design(model)}  # fmt: skip
    plant = Plant("dtu_gas_bearing")
    outcomes = [sequence(plant, laws, seed) for seed in range(SEQUENCES)]
    found = [n for one in outcomes for n in one.found_after]
    seen = [n for n in found if n is not None]
    yield Figure(f"sequences of {SEQUENCES} with contact", sum(one.contact > 0 for one in outcomes), "1", 0)
    yield Figure("  with outputs that are not finite", sum(one.not_finite > 0 for one in outcomes), "1", 0)
    yield Figure("  in which the law is not back at the end", sum(one.alarm > 0 for one in outcomes), "1", 0)
    returning, leaving = [[getattr(one, name) for one in outcomes] for name in ("returning", "leaving")]
    yield Figure("  with a larger step of a return than the law's own", above(returning), "1", 0)
    yield Figure("  by, at most (below 0: all are smaller)", max(returning), "V", ROUNDING)
    yield Figure("  with a larger step on the way out than the law's own", above(leaving), "1")
    yield Figure("  by, at most", max(0.0, *leaving), "V", LIMIT * SLOW / FADE)
    yield Figure("wrong signs of 80 ms or more", len(found), "1")
    yield Figure("  not found", len(found) - len(seen), "1", 0)
    yield Figure("  found after, at most", max(seen, default=0), "samples")
    yield Figure("  disc away when found, at most", 1e6 * max(one.before_alarm for one in outcomes), "um", 30)
    yield Figure("disc away at all, at most", 1e6 * max(one.departure for one in outcomes), "um")
