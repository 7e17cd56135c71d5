r"""Motion under given forces, exact for forces that are linear between the times.

With A the state matrix and B what a force does, over a step h from force f_0 to f_1,

.. math:: x_1 = e^{Ah} x_0 + \Gamma_0 B f_0 + \Gamma_1 B f_1

with the three matrices out of one exponential of an augmented matrix; no step is too long for accuracy or stability.
The recurrence runs in blocks: all blocks advance together from zero, in matrix products, then the few true starts of
the blocks are found one after the other, and added.

Source: C. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395.
Assumes: constant speed and matrices.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from fe_shaft import modal
from fe_shaft.labelled import dataset

if TYPE_CHECKING:
    import xarray as xr

    from fe_shaft.rotor import Rotor

Matrix = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TimeResult:
    """Displacements `yout` (n_t, ndof) [m, rad] at times `t` (n_t,) [s], and the last state (2 ndof,), q then dq/dt."""

    t: Matrix
    yout: Matrix
    last: Matrix
    nodes_pos: Matrix

    def dataset(self) -> xr.Dataset:
        """Labelled data over time and node."""
        nodes = 4 * len(self.nodes_pos)
        return dataset(
            {
                "x": (("time", "node"), self.yout[:, 0:nodes:4], "m", "displacement in x"),
                "y": (("time", "node"), self.yout[:, 1:nodes:4], "m", "displacement in y"),
            },
            {
                "time": (("time",), self.t, "s", "time"),
                "z": (("node",), self.nodes_pos, "m", "position along the shaft"),
            },
        )


def run_time_response(
    rotor: Rotor, speed: float, F: ArrayLike, t: ArrayLike, initial: ArrayLike | None = None
) -> TimeResult:
    """Motion of `rotor` at `speed` [rad/s].

    Parameters
    ----------
    F : array (n_t, ndof)
        Forces and moments [N, N m], linear between the times.
    t : array (n_t,)
        Times [s], evenly spaced.
    initial : array (ndof,) or (2 ndof,), optional
        Displacements, or displacements and velocities, at t[0]; at rest without it.

    Raises
    ------
    ValueError
        If the shapes do not fit, times are uneven or something is not finite.
    """
    t, F, start = _checked(rotor, t, F, initial)
    if len(t) == 1:
        return TimeResult(t, start[None, : rotor.ndof], start, rotor.nodes_pos)
    free, scale = rotor.free, _frequency(rotor)
    M, D, K = modal.free_matrices(rotor, speed)
    n, h = len(free), float(t[1] - t[0])
    A = modal.state_matrix(M, D, K)
    A[:n, n:] *= scale  # velocities in units that make the state well scaled for the exponential
    A[n:, :n] /= scale
    used = np.flatnonzero(np.any(F[:, free] != 0, axis=0))
    B = np.vstack([np.zeros((n, len(used))), np.linalg.solve(M, np.eye(n)[:, used]) / scale])
    step, now, after = _exponentials(A, B, h)
    loads = F[:, free[used]]
    x0 = np.concatenate([start[free], start[rotor.ndof + free] / scale])
    states = _recurrence(step, loads[:-1] @ now.T + loads[1:] @ after.T, x0, n)
    yout = np.zeros((len(t), rotor.ndof))
    yout[:, free] = states[0]
    last = np.zeros(2 * rotor.ndof)
    last[free], last[rotor.ndof + free] = states[1][:n], states[1][n:] * scale
    return TimeResult(t, yout, last, rotor.nodes_pos)


def _checked(rotor: Rotor, t: ArrayLike, F: ArrayLike, initial: ArrayLike | None) -> tuple[Matrix, Matrix, Matrix]:
    t, F = np.atleast_1d(np.asarray(t, dtype=float)), np.asarray(F, dtype=float)
    if F.shape != (len(t), rotor.ndof):
        raise ValueError(
            f"time response: F has shape {F.shape}, expected {(len(t), rotor.ndof)}: a row for every time."
        )
    if len(t) > 1 and (not np.allclose(np.diff(t), t[1] - t[0], rtol=1e-6) or not t[1] > t[0]):
        raise ValueError("time response: the times are not evenly spaced and ascending; give e.g. np.arange(n) * h.")
    start = np.zeros(2 * rotor.ndof)
    if initial is not None:
        given = np.asarray(initial, dtype=float)
        if given.shape not in ((rotor.ndof,), (2 * rotor.ndof,)):
            raise ValueError(f"time response: initial has shape {given.shape}; give ({rotor.ndof},) or twice as many.")
        start[: len(given)] = given
    if not (np.all(np.isfinite(F)) and np.all(np.isfinite(start)) and np.all(np.isfinite(t))):
        raise ValueError("time response: F, t or initial hold NaN or infinite values; check them.")
    return t, F, start


def _frequency(rotor: Rotor) -> float:
    """A frequency [rad/s] of the size of the rotor's middle ones."""
    return float(np.sqrt(np.median(np.diag(rotor.K())[rotor.free] / np.diag(rotor.parts.M)[rotor.free])))


def _exponentials(A: Matrix, B: Matrix, h: float) -> tuple[Matrix, Matrix, Matrix]:
    """exp(A h) and the effects of the force before and after a step."""
    n, m = B.shape
    full = np.zeros((n + 2 * m, n + 2 * m))
    full[:n, :n], full[:n, n : n + m] = A * h, B * h
    full[n : n + m, n + m :] = np.eye(m)
    grown = expm(full)
    held, ramp = grown[:n, n : n + m], grown[:n, n + m :]
    return grown[:n, :n], held - ramp, ramp


def _recurrence(step: Matrix, push: Matrix, x0: Matrix, n: int) -> tuple[Matrix, Matrix]:
    """Displacements (n_t, n) and last state (2n,) of x_k+1 = step x_k + push_k."""
    count = len(push)
    length = max(1, int(np.sqrt(count)))
    blocks = -(-count // length)
    flat_push = np.zeros((blocks * length, len(x0)))
    flat_push[:count] = push
    padded = flat_push.reshape(blocks, length, -1)
    transposed = np.ascontiguousarray(step.T)
    state = np.zeros((blocks, len(x0)))
    for j in range(length):
        state = state @ transposed + padded[:, j]
    leap = np.linalg.matrix_power(transposed, length)
    starts = np.empty((blocks, len(x0)))
    x = x0
    for b in range(blocks):
        starts[b] = x
        x = x @ leap + state[b]
    states = np.empty((length, blocks, len(x0)))
    state = starts
    for j in range(length):
        state = state @ transposed + padded[:, j]
        states[j] = state
    flat = states.transpose(1, 0, 2).reshape(blocks * length, -1)[:count]
    return np.vstack([x0[None, :n], flat[:, :n]]), flat[-1]
