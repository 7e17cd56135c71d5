r"""Safe speed: run-up until the disc leaves the safety circle (thesis Paper F, eq. F.1).

.. math:: (p_x - c_x)^2 + (p_y - c_y)^2 < r^2

The thesis' circle has r = 20 um about (10, -3) um in the coordinates of its sensors, whose signs it leaves open. Here
the circle lies about the disc's equilibrium at the start, moved by `centre`, zero by default. The run ends at a limit
of the machine too, and what it exceeds of the range in which its model was checked is stated.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rotorsim.base.constants import KRPM, TO_HZ, TO_RPM, TO_UM
from rotorsim.base.errors import LimitError
from rotorsim.control.law import Law
from rotorsim.experiments.limits import choked
from rotorsim.machine.limits import limits_of
from rotorsim.plant import Plant
from rotorsim.plant.simulation import Simulation
from rotorsim.plant.validity import beyond
from rotorsim.verify.runs import AnyLaw, Run, as_law, run_rows
from rotorsim.verify.transients import REST, changing

CONFIRM = 3
"""A circle is left when as many samples in a row lie outside."""
PLACES = 25
"""Speeds at whose equilibria feed holes are looked at for choking, where a machine limits it."""


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
