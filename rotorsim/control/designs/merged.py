r"""Order reduction of Model 2, and of Model 3 with dead times, to six states: lags and delays in one all-pass per axis.

Film delay, actuators, or dead time and lag, and the loop's own delay become one delay for each axis, a first-order Pade
approximation:

.. math:: \frac{2/\tau - s}{2/\tau + s}, \qquad \tau = \frac2r + \frac{a_1}{a_0} + \tau_{loop}
          \quad\text{or}\quad \frac2r + \frac1p + \tau_{loop}

which keeps the gain at every frequency and the phase where it matters, below 200 Hz. One lag (Model 3 without dead
time) cannot: with the phase of a millisecond at the modes it takes a quarter of the gain away there, so that fitting
the modes raises the gain at rest by as much. Laws are checked against the whole model.

Cites: skogestad_2005.
"""

from __future__ import annotations

import numpy as np

from rotorsim.control.numerics.systems import System

ORDER, DELAYED = 10, 8
"""States of Model 2 and of Model 3 with dead times."""


def is_model_2(system: System) -> bool:
    """Whether a continuous system has the states of Model 2: rotor (4), delays (2), actuators (4)."""
    A, B = system.A, system.B
    if system.order != ORDER or B[:7].any() or B[8].any() or A[4:6, :4].any() or A[6:, :6].any():
        return False
    chains = not (A[4, 5] or A[5, 4] or A[6:8, 8:].any() or A[8:, 6:8].any() or A[2:6, [7, 9]].any())
    return bool(chains and np.all(np.diag(A)[4:6] < 0) and np.all(A[[7, 9], [6, 8]] < 0) and _pade(A))


def _pade(A: np.ndarray) -> bool:
    """Whether rotor and delays of Model 2 are driven as a Pade approximation drives them, not as a lag behind pins.

    Through the delays the pins' force is twice that past them, with the other sign; not quite where rates drive too.
    """
    through, past = np.diag(A[2:4, 4:6]) * A[[4, 5], [6, 8]], np.diag(A[2:4][:, [6, 8]])
    twice = -2 * past * -np.diag(A)[4:6]
    return bool(np.all(np.abs(through - twice) < 0.5 * np.abs(twice)))


def is_delayed_model_3(system: System) -> bool:
    """Whether a continuous system has the states of Model 3 with dead times: rotor (4), lags (2), dead times (2)."""
    A, B = system.A, system.B
    if system.order != DELAYED or B[:4].any() or A[4:, :4].any() or A[6:, 4:6].any() or A[2:4, 6:].any():
        return False
    own = A[4:6, 4:6], A[4:6, 6:], A[6:, 6:], B[4:6], B[6:]
    diagonal = not any((M - np.diag(np.diag(M))).any() for M in own)
    passing = np.allclose(B[4:6], A[4:6, 4:6])  # of an all-pass, past the dead times; two lags in a row have none
    return bool(diagonal and passing and np.all(np.diag(A)[4:] < 0) and np.all(np.diag(B[6:]) != 0))


def merged(system: System, delay: float = 0.0) -> System:
    """Model 2, or Model 3 with dead times, in six states, later by `delay` in the system's unit of time."""
    A, B = system.A, system.B
    own = 2 / -np.diag(A)[4:6]
    if system.order == DELAYED:
        return _all_pass(system, A[2:4, 4:6], own / 2 + 2 / -np.diag(A)[6:] + delay)
    slow, fast = -A[[7, 9], [6, 8]], -A[[7, 9], [7, 9]]
    drive = -A[2:4][:, [6, 8]] @ np.diag(B[[7, 9], [0, 1]] / slow)
    return _all_pass(system, drive, own + fast / slow + delay)


def _all_pass(system: System, drive: np.ndarray, tau: np.ndarray) -> System:
    """The rotor driven by `drive` (2, 2) behind delays tau (2,)."""
    T = np.diag(2 / tau)
    whole = np.zeros((6, 6))
    whole[:4, :4] = system.A[:4, :4]
    whole[2:4, 4:6], whole[4:6, 4:6] = 2 * drive @ T, -T
    into = np.vstack([np.zeros((2, 2)), -drive, np.eye(2)])
    return System(whole, into, system.C[:, :6] * np.array([1, 1, 0, 0, 0, 0]), system.D)
