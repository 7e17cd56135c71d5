r"""Transient tests of a law: impacts and their norms, ramps, overload, a frozen sensor, noise, and the safe speed.

The norms of impact responses are those of the thesis (section E.5.1, eqs. E.26 to E.28),

.. math:: V_p = \|p\| / \|f\|, \qquad V_r = \|r\| / \|f\|

over a tenth of a second from a hit on, 500 samples of the rig. Every run has a twin with the same noise and without
hits; the difference of the two is the answer to the hit alone, where the thesis filters the imbalance out of one
record.

The safe speed is that at which the disc leaves the safety circle in a run-up (thesis Paper F, eq. F.1).

.. math:: (p_x - c_x)^2 + (p_y - c_y)^2 < r^2

The thesis' circle has r = 20 um about (10, -3) um in the coordinates of its sensors, whose signs it leaves open. Here
the circle lies about the disc's equilibrium at the start, moved by `centre`, zero by default. The run ends at a limit
of the machine too, and what it exceeds of the range in which its model was checked is stated.

Cites: thesis.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rotorsim.base.errors import LimitError
from rotorsim.base.units import KRPM, MPA, RIG_SAMPLE, TO_HZ, TO_RPM, TO_UM
from rotorsim.control.law import Law
from rotorsim.experiments.catalogue.impact import Impact
from rotorsim.experiments.running import choked
from rotorsim.machine.limits import limits_of
from rotorsim.plant import Plant
from rotorsim.plant.simulation import Simulation
from rotorsim.plant.validity import beyond
from rotorsim.verify.runs import AnyLaw, Frozen, Run, as_law, run_rows, steady_rows

REST = 0.4
"""Time [s] at constant values before and after a change."""
POINTS = tuple((w * KRPM, p * MPA) for w in (0.0, 1.5, 3.0, 4.5, 6.0) for p in (0.3, 0.433, 0.567, 0.7))
"""The twenty operating points of E.5.1 [rad/s, Pa]."""
IMPACT_LEAD = 0.4
"""Time [s] before the first hit: a law seeks its centre and wakes."""
RESPONSE = 0.1
"""Duration [s] of a response."""
PULSE = 1e-3
"""Duration [s] of a hit."""
CALM = 0.1
"""Time [s] between the end of an answer and the next hit."""
CONFIRM = 3
"""A circle is left when as many samples in a row lie outside."""
PLACES = 25
"""Speeds at whose equilibria feed holes are looked at for choking, where a machine limits it."""


def changing(
    speeds: tuple[float, float], pressures: tuple[float, float], duration: float, Ts: float = RIG_SAMPLE
) -> np.ndarray:
    """Rows every `Ts` [s] that stay, go straight from the first to the second values in `duration` [s], and stay."""
    rest, n = round(REST / Ts), max(round(duration / Ts), 1)
    part = np.concatenate([np.zeros(rest), np.arange(1, n + 1) / n, np.ones(rest)])
    rows = np.zeros((len(part), 6))
    rows[:, 0] = speeds[0] + (speeds[1] - speeds[0]) * part
    rows[:, 1] = pressures[0] + (pressures[1] - pressures[0]) * part
    return rows


def speed_ramp(plant: Plant, law: AnyLaw | None, rate: float, pressure: float = 0.5e6) -> Run:
    """From rest to 6 krpm at one pressure, at a rate [rad/s^2]."""
    Ts = plant.machine.sampling_time
    return run_rows(plant, law, changing((0.0, 6 * KRPM), (pressure, pressure), 6 * KRPM / rate, Ts))


def pressure_step(plant: Plant, law: AnyLaw | None, low: float = 0.3e6, high: float = 0.7e6) -> Run:
    """From one pressure to the other from one sample to the next, at 3 krpm."""
    Ts = plant.machine.sampling_time
    return run_rows(plant, law, changing((3 * KRPM, 3 * KRPM), (low, high), Ts, Ts))


def pressure_ramp(plant: Plant, law: AnyLaw | None, low: float = 0.7e6, high: float = 0.3e6) -> Run:
    """From one pressure to the other within half a second, at 3 krpm."""
    Ts = plant.machine.sampling_time
    return run_rows(plant, law, changing((3 * KRPM, 3 * KRPM), (low, high), 0.5, Ts))


def overload(plant: Plant, law: AnyLaw | None, peak: float) -> Run:
    """A hit that drives the references to their limits, at 3 krpm and 0.5 MPa."""
    Ts = plant.machine.sampling_time
    rows = steady_rows(3 * KRPM, 0.5e6, 1.0, Ts)
    hammer = Impact(peak=peak, angle=np.pi / 4, lead=REST, spacing=0.5, Ts=Ts)
    own = hammer.rows(0, hammer.samples)
    rows[: len(own), 4:6] += own[:, 4:6]
    return run_rows(plant, law, rows)


def frozen_sensor(plant: Plant, law: AnyLaw | None, channel: int) -> Run:
    """A displacement sensor that hangs, at 3 krpm and 0.5 MPa."""
    rows = steady_rows(3 * KRPM, 0.5e6, 1.2, plant.machine.sampling_time)
    return run_rows(plant, law, rows, fault=Frozen(channel, REST))


def at_rest(plant: Plant, law: AnyLaw, speed: float = 0.0, pressure: float = 0.5e6) -> Run:
    """A run in which nothing happens."""
    return run_rows(plant, law, steady_rows(speed, pressure, 0.8, plant.machine.sampling_time))


def noise(run: Run) -> np.ndarray:
    """Standard deviation (2,) [V] of the reference in a run at rest; infinite where the run ended."""
    return np.full(2, np.inf) if run.ended else run.reference[run.count(REST) :].std(axis=0)


def runup(plant: Plant, law: AnyLaw | None, rate: float, pressure: float, stop: float, down: bool = True) -> Run:
    """From rest to `stop` [rad/s] and, if `down`, back again, at a rate [rad/s^2]."""
    up = changing((0.0, stop), (pressure, pressure), stop / rate, plant.machine.sampling_time)
    return run_rows(plant, law, np.vstack([up, up[::-1]]) if down else up)


def amplitude(run: Run, first: int, last: int, name: str = "disc") -> float:
    """Amplitude [m] at the shaft's frequency of the larger axis, over samples first to last."""
    return float(amplitudes(run, first, last, name).max())


def amplitudes(run: Run, first: int, last: int, name: str = "disc") -> np.ndarray:
    """Amplitudes (2,) [m] at the shaft's frequency along x and y, over samples first to last.

    A law with a notch removes what its sensors show: `disc_measured`, of which runout is a part, and not `disc`.
    """
    angle = run.column("angle")[first:last]
    basis = np.column_stack([np.cos(angle), np.sin(angle), np.ones(last - first)])
    found = np.linalg.lstsq(basis, run.pair(name)[first:last], rcond=None)[0]
    return np.asarray(np.hypot(found[0], found[1]))


def excursion(run: Run) -> float:
    """Largest distance [m] of the disc from a moving mean over 0.1 s; infinite where the run ended."""
    if run.ended:
        return float("inf")
    window = run.count(0.1)
    kernel = np.ones(window) / window
    padded = np.pad(run.disc, ((window // 2, window - window // 2 - 1), (0, 0)), mode="edge")
    mean = np.column_stack([np.convolve(padded[:, axis], kernel, mode="valid") for axis in range(2)])
    return float(np.linalg.norm(run.disc - mean, axis=1).max())


@dataclass(frozen=True)
class ImpactResponse:
    """Norms of the answers to hits along x and y at an operating point, square roots of energies.

    The response V_p (2,) [um/N] of the disc and the effort V_r (2,) [V/N] of the references; the largest |r| [V];
    contact.

    Also damping, why a run ended, and the `bad` samples in which an alarm suspended the law, of how many, with the
    sentence about them, of the run or its twin, whichever has more.
    """

    speed: float
    pressure: float
    response: tuple[float, float]
    effort: tuple[float, float]
    largest: float
    touched: bool
    damping: float
    ended: str = ""
    bad: int = 0
    samples: int = 0
    alarm: str = ""


def impact_responses(
    plant: Plant, law: AnyLaw | None, speed: float, pressure: float, peak: float = 20.0, position: float | None = None
) -> ImpactResponse:
    """Hit the disc, or the shaft at a position [m], along x, then along y, and measure."""
    with_, without, hit = _twins(plant, law, speed, pressure, peak, position)
    n = min(len(with_.table), len(without.table))
    p = (with_.disc[:n] - without.disc[:n]) * TO_UM
    r = with_.reference[:n] - without.reference[:n]
    ended = with_.ended or without.ended
    alarms = max(with_.alarms, without.alarms)
    if ended:
        return ImpactResponse(speed, pressure, (np.inf,) * 2, (np.inf,) * 2, np.inf, True, 0.0, ended, *alarms)
    response, effort = [], []
    for axis in range(2):
        part = _after(axis, with_)
        force = np.linalg.norm(hit[part, 4:6])
        response.append(float(np.linalg.norm(p[part]) / force))
        effort.append(float(np.linalg.norm(r[part]) / force))
    largest = float(np.abs(with_.reference).max(initial=0.0))
    return ImpactResponse(
        speed, pressure, (response[0], response[1]), (effort[0], effort[1]), largest,
        with_.touched, envelope_damping(p[_after(0, with_)], with_.Ts), "", *alarms,
    )  # fmt: skip


def impact_answers(
    plant: Plant, law: AnyLaw | None, speed: float, pressure: float, peak: float, position: float | None = None,
    duration: float = RESPONSE,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Disc (n, 2) [m] over a duration [s] from a hit along x and one along y, less its twin's; NaN if a run ended.

    The twin has no hits. They are on the disc, or at a position [m] along the shaft.
    """
    with_, without, _ = _twins(plant, law, speed, pressure, peak, position, duration)
    if with_.ended or without.ended:
        return (np.full((with_.count(duration), 2), np.nan),) * 2
    p = with_.disc - without.disc
    return p[_after(0, with_, duration)], p[_after(1, with_, duration)]


def _twins(
    plant: Plant, law: AnyLaw | None, speed: float, pressure: float, peak: float, position: float | None = None,
    duration: float = RESPONSE,
) -> tuple[Run, Run, np.ndarray]:  # fmt: skip
    """A run with a hit along x and one along y, its twin without, and the rows of the first."""
    Ts, spacing = plant.machine.sampling_time, duration + CALM
    quiet = steady_rows(speed, pressure, IMPACT_LEAD + 2 * spacing, Ts)
    hit = quiet.copy()
    for axis in range(2):
        lead = IMPACT_LEAD + axis * spacing
        hammer = Impact(peak=peak, width=PULSE, angle=axis * np.pi / 2, lead=lead, spacing=spacing, Ts=Ts)
        own = hammer.rows(0, min(hammer.samples, len(hit)))
        hit[: len(own), 4:6] += own[:, 4:6]
    return run_rows(plant, law, hit, position=position), run_rows(plant, law, quiet), hit


def _after(axis: int, run: Run, duration: float = RESPONSE) -> slice:
    """Samples of the answer to the hit along an axis."""
    first = run.count(IMPACT_LEAD + axis * (duration + CALM))
    return slice(first, first + run.count(duration))


def envelope_damping(p: np.ndarray, Ts: float = RIG_SAMPLE) -> float:
    """Damping ratio of a decay (n, 2), sampled every Ts [s]; 1 where it does not swing."""
    return ring_down(p, Ts)[1]


def ring_down(p: np.ndarray, Ts: float = RIG_SAMPLE) -> tuple[float, float]:
    """Natural frequency [rad/s] and damping ratio of a decay (n, 2) every Ts [s]: ln(E1/E2) = 2 zeta omega L.

    E1 and E2 are the energies of two stretches of equal length L in turn.

    L is half the record, or the time in which four fifths of the energy come; the frequency is that of the sign changes
    of the larger axis within both. Frequency NaN and damping 1 where the decay does not swing; both NaN for NaN.
    """
    energy = (p**2).sum(axis=1)
    total = energy.sum()
    if np.isnan(total):
        return float("nan"), float("nan")
    if not total > 0:
        return float("nan"), 1.0
    n = max(min(len(p) // 2, int(np.argmax(np.cumsum(energy) >= 0.8 * total))), 2)
    rate = float(np.log(energy[:n].sum() / max(energy[n : 2 * n].sum(), 1e-300))) / (n * Ts)
    axis = int((p**2).sum(axis=0).argmax())
    changes = np.flatnonzero(np.diff(np.sign(p[: 2 * n, axis])) != 0)
    if len(changes) < 2:
        return float("nan"), 1.0
    half = np.diff(changes).mean() * Ts
    wn = float(np.hypot(np.pi / half, rate / 2))
    return wn, float(rate / (2 * wn))


@dataclass(frozen=True, eq=False)
class SafeSpeed:
    """Speed [rad/s] at which the circle was left, or the last one reached; why the run ended; the run.

    `left` is true where the circle was left or a step had no solution; `checked` [rad/s] is the highest speed at which
    the machine's model was compared with measurements, None where its file states none; `beyond` are sentences about
    the range in which the model was checked that the run up to `speed` exceeds.
    """

    speed: float
    left: bool
    why: str
    run: Run
    checked: float | None = None
    beyond: tuple[str, ...] = ()


def safe_speed(
    plant: Plant, law: AnyLaw | Any | None, pressure: float = 0.3e6, start: float = 3 * KRPM, stop: float = 24 * KRPM,
    rate: float = 1 * KRPM, radius: float = 20e-6, centre: tuple[float, float] = (0.0, 0.0), seed: int = 0,
) -> SafeSpeed:  # fmt: skip
    """Run up from `start` to `stop` [rad/s] at `rate` [rad/s^2] and find the speed at which the circle is left.

    `law` is a Law or any controller that `closed_loop` takes, None for the open loop. The run ends at a limit of the
    machine; raises LimitError where it begins beyond one.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.verify.safe_speed(plant, law)
    """
    rows = changing((start, stop), (pressure, pressure), (stop - start) / rate, plant.machine.sampling_time)
    law = None if law is None else as_law(law)
    if isinstance(law, Law):
        law.check_machine(plant.machine.name)
    run = until_choked(plant, run_rows(plant, law, rows, seed), pressure)
    if run.at_limit and len(run.table) < run.count(REST):
        raise LimitError(f"the run {run.ended}; begin lower or raise it")
    outside = _outside(run, radius, np.asarray(centre))
    speed = float(run.column("speed")[-1 if outside is None else outside])
    why = f"left the circle of {radius * TO_UM:g} um"
    if outside is None:
        why = run.ended or "reached the end of the ramp"
    left = outside is not None or (bool(run.ended) and not run.at_limit)
    checked = None if plant.machine.checked is None else plant.machine.checked.highest_speed
    return SafeSpeed(speed, left, why, run, checked, beyond(plant.assembly, start, speed, pressure))


def until_choked(plant: Plant, run: Run, pressure: float) -> Run:
    """A run-up until more feed holes are choked than the machine allows, where it has that limit.

    They are looked at in equilibria at a gauge pressure [Pa] and `PLACES` speeds of the run.
    """
    if limits_of(plant.machine).choked_feeds is None or not len(run.table):
        return run
    speeds = run.column("speed")
    for k in np.linspace(0, len(speeds) - 1, PLACES).astype(int):
        why = choked(Simulation.at_equilibrium(plant.assembly, float(speeds[k]), pressure))
        if why:
            return replace(run, table=run.table[:k], rows=run.rows[:k], ended=why, at_limit=True)
    return run


def _outside(run: Run, radius: float, centre: np.ndarray) -> int | None:
    """First of `CONFIRM` samples in a row outside the circle about the rest of the beginning."""
    middle = run.disc[: run.count(REST)].mean(axis=0) + centre
    outside = np.hypot(*(run.disc - middle).T) > radius
    long = np.flatnonzero(np.convolve(outside, np.ones(CONFIRM), mode="valid") == CONFIRM)
    return int(long[0]) if long.size else None


def comparison(alone: SafeSpeed, held: SafeSpeed) -> dict[str, Any]:
    """Safe speeds of the open and the closed loop as numbers, ready for JSON, with sentences.

    Returns
    -------
    dict
        open_rpm, closed_rpm; ratio; last_checked_rpm and times_checked, None where the machine file states no checked
        range; at_least, whether the closed loop had not left the circle; why, by loop; beyond, sentences; sentence.
    """
    times = held.speed / held.checked if held.checked else None
    return {
        "open_rpm": alone.speed * TO_RPM, "closed_rpm": held.speed * TO_RPM, "ratio": held.speed / alone.speed,
        "at_least": not held.left, "last_checked_rpm": None if held.checked is None else held.checked * TO_RPM,
        "times_checked": times, "why": {"open": alone.why, "closed": held.why}, "beyond": list(held.beyond),
        "sentence": sentence(alone, held),
    }  # fmt: skip


def sentence(alone: SafeSpeed, held: SafeSpeed) -> str:
    """Both safe speeds in a sentence, with how far they are beyond the speeds at which the model was checked."""
    more = "more than " if not held.left else ""
    text = (
        f"open loop {_speed(alone)}, {alone.why}; closed loop {_speed(held)}, {held.why}: {more}"
        f"{held.speed / alone.speed:.2f} times the open loop"
    )
    bad, samples, alarm = held.run.alarms if held.run else (0, 0, "")
    if bad:
        text = f"{text}; the law had alarms in the whole run, also beyond this speed, of {samples} samples {alarm}"
    if held.checked is None:
        return f"{text}; the machine file states no speeds at which its model was checked"
    checked = f"{held.checked * TO_RPM:.0f} rpm ({held.checked * TO_HZ:.0f} Hz)"
    last = f"the model was compared with measurements up to {checked}"
    if held.speed <= held.checked:
        return f"{text}; {last}"
    return f"{text}; {last}, and the closed loop's speed, {held.speed / held.checked:.2f} times that, is not checked"


def _speed(found: SafeSpeed) -> str:
    return f"{found.speed * TO_RPM:.0f} rpm ({found.speed * TO_HZ:.0f} Hz)"
