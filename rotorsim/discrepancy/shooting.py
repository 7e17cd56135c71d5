r"""Periodic motion of a rotor on linear bearings under inputs that repeat, by few runs where effects bend it.

With x the state, F(x) what a period changes of it, and B the inverse of what the linear plant forgets of it by then,

.. math:: s_i = B_i F(x_i), \quad x_{i+1} = x_i + s_i, \quad y_i = F(x_i) - F(x_{i+1}), \quad
          B_{i+1} = B_i + \frac{(s_i - B_i y_i)\,s_i' W B_i}{s_i' W B_i y_i}

which is one step where the plant is linear, and takes fewer than with B kept where a law bends it. The weights W
make displacement and velocity of a step equally large. A motion with slightly other numbers begins in the one found.

Forces that remember the motion begin in the states that the run before ended in, and settle with it.

Assumes: nothing but these and the rotor remembers. Source: Aprille & Trick (1972) for the shots, Broyden (1965),
Math. Comp. 19, 577, for their inverse.

Cites: aprille_1972.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.discrepancy.twin import FAILURES, ROUNDS, Setting, Twin, _forgotten, _put_in_motion, state_places
from rotorsim.plant.kernels.layout import READ
from rotorsim.plant.linearise import linearise
from rotorsim.plant.simulation import Simulation, settle

SETTLED = 1e-6
"""Last correction of the state, relative, up to which the run that led to it is the motion."""
NEARBY, SHARE = 1e-5, 1e-3
"""The same of a motion that begins in one nearby, and as a share of the first correction, which may be small itself."""
MOST_REMEMBERING = 24
"""Most runs where forces remember the motion."""
BENT = 3
"""Runs from which on a motion is not that of a linear plant, and motions with slightly other numbers begin in it."""


@dataclass(frozen=True, eq=False)
class ForcedMotion:
    """Readings (n, 5) over a period, workspaces at rest and in the motion, inverse B (2 n, 2 n), number of runs."""

    twin: Twin
    readings: np.ndarray
    rest: np.ndarray
    moving: np.ndarray
    inverse: np.ndarray
    runs: int


def forced_motion(
    twin: Twin, setting: Setting, rows: np.ndarray, pressure: float, angle: float, near: ForcedMotion | None = None
) -> ForcedMotion | None:
    """The motion under rows (n, 6) of a period, from that of slightly other numbers on; None where none is found.

    None too where effects remember and no force does, or shots of forces without memory do not settle. With memory the
    readings are NaN then: a plant that is linear there would be another one.
    """
    a, speed = twin.set(setting), float(rows[0, 0])
    remembering = {call.effect.port for call in a.calls if call.effect.states}
    if remembering and not {"motion"} <= remembering <= {"motion", "sensor"}:
        return None
    try:
        w = settle(a, speed, twin.regulator(setting, speed, pressure))
        w[a.rotor.angle] = angle
        rest, n = w.copy(), a.rotor.n
        A = linearise(a, w, speed).A
        B = _forgotten(a, A, len(rows), np.ones(1))
        if B is None:
            return None
        if near is not None and near.twin is twin and near.runs > BENT:
            _put_in_motion(w, a, a, near.rest, near.moving)
            w[a.rotor.matrix_speed], B = np.inf, near.inverse
        else:
            near = None
        at, begin, rates, clock = state_places(a)
        step = last = np.zeros(2 * n)
        enough = SETTLED
        for number in range(1, (MOST_REMEMBERING if remembering else ROUNDS) + 1):
            before, moved = w[at].copy(), w.copy()
            readings = Simulation(a, moved).advance(rows)[:, READ : READ + 5]
            change = moved[at] - before
            if not np.all(np.isfinite(change)):
                return None
            if number > 1:
                B = _turned(B, step, last - change)
            step, last = B @ change, change
            left = float(np.linalg.norm(step)) / max(float(np.linalg.norm(before)), 1e-300)
            if near is not None and number == 1:
                enough = min(NEARBY, SHARE * left)
            elif left <= enough:
                return ForcedMotion(twin, readings, rest, w, B, number)
            moved[at] = moved[begin] = before + step
            moved[rates] += A[n:] @ (step - change)
            moved[clock] = rest[clock]
            w = moved
        return ForcedMotion(twin, np.full_like(readings, np.nan), rest, w, B, number) if remembering else None
    except FAILURES:
        return None


def _turned(B: np.ndarray, step: np.ndarray, fall: np.ndarray) -> np.ndarray:
    """B (2 n, 2 n) as a step (2 n,) has it by which the change of a period falls; as it is where that has no size."""
    n = len(step) // 2
    rate = float(np.linalg.norm(step[n:])) / max(float(np.linalg.norm(step[:n])), 1e-300)
    row = (step * np.repeat([rate**2, 1.0], n)) @ B
    whole = float(row @ fall)
    return B if whole == 0.0 or not np.isfinite(whole) else B + np.outer(step - B @ fall, row) / whole
