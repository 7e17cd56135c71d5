r"""Periodic motion of a rotor on linear bearings at constant speed, as initial state of a simulated record.

A lightly damped rotor takes minutes to forget how it was started. One step of Newton's method on the map over whole
turns finds its motion instead,

.. math:: x^* = x_1 + \Phi (I - \Phi)^{-1} (x_1 - x_0), \qquad \Phi = e^{A T}

with x_1 the state that the plant reaches from x_0 in T; exact where the plant is linear, repeated where effects
bend it. Source: Aprille & Trick (1972), Proc. IEEE 60, 108 (shooting).

Cites: aprille_1972.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from rotorsim.base.constants import RIG_SAMPLE
from rotorsim.base.rounding import decays
from rotorsim.discrepancy.linear_algebra import NoAnswerError, answer
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.linearise import linearise
from rotorsim.plant.simulation import Simulation

MOST_TURNS, ROUNDS = 12, 8
CLOSE = 0.01
"""Share of a sample by which turns may miss whole samples."""
SETTLED = 1e-6
"""Relative change of the state over the turns that counts as none."""


def whole_turns(speed: float) -> int:
    """Number of samples closest to whole revolutions at a speed [rad/s], up to MOST_TURNS of them."""
    turns = np.arange(1, MOST_TURNS + 1) * (2 * np.pi / abs(speed) / RIG_SAMPLE)
    miss = np.abs(turns - np.round(turns))
    close = np.flatnonzero(miss < max(CLOSE, 1.001 * miss.min()))
    return int(np.round(turns[close[0]]))


def in_motion(a: Assembly, w: np.ndarray, speed: float, pressure: float) -> np.ndarray:
    """Workspace with the machine in periodic motion at a speed [rad/s]; w itself if that motion is unstable."""
    if a.film_model is not None or abs(speed) < 1.0:
        return w
    rows = np.zeros((whole_turns(speed), 6))
    rows[:, 0], rows[:, 1] = speed, pressure
    try:
        phi = answer(expm, linearise(a, w, speed).A * (len(rows) * RIG_SAMPLE))
        if not decays(answer(np.linalg.eigvals, phi)):
            return w
        jump = phi @ answer(np.linalg.inv, np.eye(len(phi)) - phi)
    except NoAnswerError:
        return w
    n, angle = a.rotor.n, w[a.rotor.angle]
    at = np.concatenate([a.rotor.q + np.arange(n), a.rotor.v + np.arange(n)])
    # a step begins at the displacement and velocity of the last one's end, which it keeps apart
    begin = np.concatenate([a.rotor.q_old + np.arange(n), a.rotor.v_old + np.arange(n)])
    rest, began = w, {i: w[i] for i in (a.rig.tick, a.rotor.time, a.rotor.turns)}
    for _ in range(ROUNDS):
        before = w[at].copy()
        moved = w.copy()
        Simulation(a, moved).advance(rows)
        change = moved[at] - before
        if not np.all(np.isfinite(change)):
            return rest
        moved[at] += jump @ change
        moved[begin] = moved[at]
        w = moved
        w[a.rotor.angle] = angle
        if np.linalg.norm(change) < SETTLED * np.linalg.norm(before):
            break
    for i, value in began.items():
        w[i] = value
    return w
