r"""Time response at constant speed, exact for forces that vary linearly between time points.

With A the state matrix and B what a force does, over a step h from force f_0 to f_1,

.. math:: x_1 = e^{Ah} x_0 + \Gamma_0 B f_0 + \Gamma_1 B f_1

with the three matrices out of one exponential of an augmented matrix; no step is too long for accuracy or stability.
The recurrence runs in blocks: what the forces of a block do from rest, and what its start does, are matrix products
over all blocks at once; only the starts of the blocks are found one after the other.

Unbalance is not sampled: at constant speed its steady whirl q_u is known in closed form, so that the rest q - q_u
is moved by the other forces alone, from what the initial state leaves. Gravity is a constant force.

Source: C. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395.
Assumes: constant speed and matrices.

Cites: vanloan_1978.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from fe_shaft import modal
from fe_shaft.assembly import AssembledRotor
from fe_shaft.modal import dataset
from fe_shaft.response import run_unbalance_response, weight
from fe_shaft.shaft import ShaftError

if TYPE_CHECKING:
    import xarray as xr

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Unbalance:
    """Mass times eccentricity `magnitude` [kg m] on node `node`, at `phase` [rad] from x towards y at t = 0.

    Examples
    --------
    >>> import fe_shaft
    >>> fe_shaft.Unbalance(2, magnitude=1e-5, phase=0.5 * np.pi).node
    2
    """

    node: int
    magnitude: float
    phase: float = 0.0


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
    rotor: AssembledRotor,
    speed: float,
    F: ArrayLike | None,
    t: ArrayLike,
    initial: ArrayLike | None = None,
    unbalance: Sequence[Unbalance] = (),
    gravity: float = 0.0,
) -> TimeResult:
    """Motion of `rotor` at `speed` [rad/s].

    Parameters
    ----------
    F : array (n_t, ndof) or None
        Forces and moments [N, N m], linear between the times.
    t : array (n_t,)
        Times [s], evenly spaced; the shaft's angle is speed t.
    initial : array (ndof,) or (2 ndof,), optional
        Displacements, or displacements and velocities, at t[0]; at rest without it.
    unbalance : sequence of Unbalance
        Turns with the shaft; exact at any step.
    gravity : float
        Along -y [m/s2].

    Raises
    ------
    ShaftError
        If the shapes do not fit, times are uneven, something is not finite, or the shaft has hysteretic damping.

    Examples
    --------
    >>> import fe_shaft
    >>> t = np.linspace(0.0, 0.1, 101)
    >>> rotor.run_time_response(100.0, None, t, unbalance=[fe_shaft.Unbalance(3, 1e-5)]).yout.shape
    (101, 28)
    """
    if rotor.hysteretic:
        raise ShaftError(
            "time response: hysteretic damping (eta_h) has no law in time; give viscous damping in its place, "
            "eta_v = eta_h / (frequency of the whirl against the shaft)."
        )
    t = np.atleast_1d(np.asarray(t, dtype=float))
    t, F, start = _checked(rotor, t, np.zeros((len(t), rotor.ndof)) if F is None else F, initial)
    if gravity:
        F = F + weight(rotor, gravity)
    whirl = _whirl(rotor, speed, unbalance)
    turned = whirl * np.exp(1j * speed * t[0])
    rest = _forced(rotor, speed, F, t, start - np.concatenate([turned.real, (1j * speed * turned).real]))
    if not unbalance:
        return rest
    last = whirl * np.exp(1j * speed * t[-1])
    yout = rest.yout + (np.exp(1j * speed * t)[:, None] * whirl).real
    return replace(rest, yout=yout, last=rest.last + np.concatenate([last.real, (1j * speed * last).real]))


def _whirl(rotor: AssembledRotor, speed: float, unbalance: Sequence[Unbalance]) -> NDArray[np.complex128]:
    """Steady whirl (ndof,) [m, rad] of all unbalances together."""
    if not unbalance or not speed:
        return np.zeros(rotor.ndof, dtype=complex)
    nodes, sizes, phases = zip(*((u.node, u.magnitude, u.phase) for u in unbalance), strict=True)
    return run_unbalance_response(rotor, nodes, sizes, phases, speed).response[:, 0]


def _forced(rotor: AssembledRotor, speed: float, F: Matrix, t: Matrix, start: Matrix) -> TimeResult:
    """Motion under sampled forces from a state (2 ndof,)."""
    if len(t) == 1:
        return TimeResult(t, start[None, : rotor.ndof], start, rotor.nodes_pos)
    free = rotor.free
    scale = float(np.sqrt(np.median(np.diag(rotor.K())[free] / np.diag(rotor.parts.M)[free])))  # a middle frequency
    M, D, K = modal.free_matrices(rotor, speed)
    n, h = len(free), float(t[1] - t[0])
    A = modal.state_matrix(M, D, K)
    A[:n, n:] *= scale  # velocities in units that make the state well scaled for the exponential
    A[n:, :n] /= scale
    used = np.flatnonzero(np.any(F != 0, axis=0)[free])
    B = np.vstack([np.zeros((n, len(used))), np.linalg.solve(M, np.eye(n)[:, used]) / scale])
    step, now, after = _exponentials(A, B, h)
    loads = F[:, free[used]]
    x0 = np.concatenate([start[free], start[rotor.ndof + free] / scale])
    states = _recurrence(step, np.hstack([now, after]), np.hstack([loads[:-1], loads[1:]]), x0, n)
    yout = np.zeros((len(t), rotor.ndof))
    yout[:, free] = states[0]
    last = np.zeros(2 * rotor.ndof)
    last[free], last[rotor.ndof + free] = states[1][:n], states[1][n:] * scale
    return TimeResult(t, yout, last, rotor.nodes_pos)


def _checked(
    rotor: AssembledRotor, t: ArrayLike, F: ArrayLike, initial: ArrayLike | None
) -> tuple[Matrix, Matrix, Matrix]:
    t, F = np.atleast_1d(np.asarray(t, dtype=float)), np.asarray(F, dtype=float)
    if F.shape != (len(t), rotor.ndof):
        raise ShaftError(
            f"time response: F has shape {F.shape}, expected {(len(t), rotor.ndof)}: a row for every time."
        )
    if len(t) > 1 and (not np.allclose(np.diff(t), t[1] - t[0], rtol=1e-6) or not t[1] > t[0]):
        raise ShaftError("time response: the times are not evenly spaced and ascending; give e.g. np.arange(n) * h.")
    start = np.zeros(2 * rotor.ndof)
    if initial is not None:
        given = np.asarray(initial, dtype=float)
        if given.shape not in ((rotor.ndof,), (2 * rotor.ndof,)):
            raise ShaftError(f"time response: initial has shape {given.shape}; give ({rotor.ndof},) or twice as many.")
        start[: len(given)] = given
    if not (np.all(np.isfinite(F)) and np.all(np.isfinite(start)) and np.all(np.isfinite(t))):
        raise ShaftError("time response: F, t or initial hold NaN or infinite values; check them.")
    return t, F, start


def _exponentials(A: Matrix, B: Matrix, h: float) -> tuple[Matrix, Matrix, Matrix]:
    """exp(A h) and the effects of the force before and after a step."""
    n, m = B.shape
    full = np.zeros((n + 2 * m, n + 2 * m))
    full[:n, :n], full[:n, n : n + m] = A * h, B * h
    full[n : n + m, n + m :] = np.eye(m)
    grown = expm(full)
    held, ramp = grown[:n, n : n + m], grown[:n, n + m :]
    return grown[:n, :n], held - ramp, ramp


def _recurrence(step: Matrix, push: Matrix, u: Matrix, x0: Matrix, n: int) -> tuple[Matrix, Matrix]:
    """Displacements (n_t, n) and last state (2n,) of x_k+1 = step x_k + push u_k, u (n_t - 1, m)."""
    count, m = u.shape
    length = max(1, min(int(np.sqrt(count / 8)), 4 * n // max(m, 1)))  # short where a block has many forces
    blocks = -(-count // length)
    padded = np.zeros((blocks * length, m))
    padded[:count] = u
    steps = padded.reshape(blocks, length * m)
    free, answers = _powers(step, push, length, n)
    pushed = steps @ answers[::-1].reshape(length * m, len(x0))
    starts = np.empty((blocks + 1, len(x0)))
    starts[0] = x0
    leap = np.linalg.matrix_power(step, length)
    for b in range(blocks):
        starts[b + 1] = leap @ starts[b] + pushed[b]
    moved = starts[:-1] @ free.T + steps @ _causal(answers[:, :, :n])
    flat = moved.reshape(blocks * length, n)[:count]
    last = starts[count // length]
    for k in range(count - count % length, count):
        last = step @ last + push @ u[k]
    return np.vstack([x0[None, :n], flat]), last


def _powers(step: Matrix, push: Matrix, length: int, n: int) -> tuple[Matrix, Matrix]:
    """Displacements (length n, 2n) after 1 to `length` steps of a state; states (length, m, 2n) after a push."""
    free, answers = np.empty((length, n, len(step))), np.empty((length, push.shape[1], len(step)))
    free[0], answers[0] = step[:n], push.T
    for j in range(1, length):
        free[j] = free[j - 1] @ step
        answers[j] = answers[j - 1] @ step.T
    return free.reshape(length * n, -1), answers


def _causal(answers: Matrix) -> Matrix:
    """Displacements (length m, length n) at every step of a block for a push at every step of it."""
    length, m, n = answers.shape
    table = np.zeros((length, m, length, n))
    for i in range(length):
        table[i, :, i:] = answers[: length - i].transpose(1, 0, 2)
    return table.reshape(length * m, length * n)
