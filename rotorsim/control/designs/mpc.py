r"""Model-predictive control: the regulator of `lqr` under limits of the reference and of the film thickness.

.. math:: \min_{u_0 \dots u_{N-1}, s} \sum_{k<N} (y_k/y_0)^2 + (u_k/u_0)^2 + x_N^T P x_N + \rho s^2, \qquad
          |u_k| \le u_{max}, \quad d_i^T y_k \le r + s, \quad s \ge 0

P is the cost of the unlimited regulator, so that the two agree as long as no limit is met. d_i are eight directions, r
is what the disc may move until the film is `film` thick; s gives way where that cannot be kept. The quadratic program
is solved anew in each sample by OSQP, so there is no table to save or export. Needs the package `osqp`. The estimate
follows the reference that acts, `applied`, which is not the controller's own where one is added to it. A sample is bad
where it is not a finite number, and the output comes in at once: limits of plausibility and a fade-in are of `Law`.

Cites: astrom_1997, stellato_2020.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

import numpy as np

from rotorsim.base.errors import DesignError, OtherMachine
from rotorsim.control.designs.lqr import Gains, LqrSpec, gains
from rotorsim.control.designs.specification import count, number
from rotorsim.control.guard import FARTHEST, OK, SENSOR, SIZE, Guarded, guard
from rotorsim.control.law import LIMIT, other_machine
from rotorsim.control.plants import Model
from rotorsim.control.systems import System

DIRECTIONS = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, -1.0]]) / np.array([[1], [1], [2**0.5], [2**0.5]])
"""Directions in which the displacement is limited, both ways."""
SOFT = 1000.0
"""Cost of a limit of the film that is exceeded by 1 um, in those of y_0."""
SETTINGS = {
    "verbose": False, "adaptive_rho": False, "rho": 1.0, "eps_abs": 1e-4, "eps_rel": 1e-4, "max_iter": 4000,
    "check_termination": 10, "polishing": False, "warm_starting": True,
}  # fmt: skip
"""Settings of the solver; nothing in them depends on the time that it takes."""


@dataclass(frozen=True)
class PredictiveSpec(LqrSpec):
    """Operating point, weights and noise levels as of `lqr`; horizon and limits.

    `film_at_rest` and `journal_per_disc` are by default those of the shipped rig, the first at rest and 0.3 MPa, where
    it is thinnest; give those of another machine or point, the first from ``plant.equilibrium(speed, pressure).h_min``.
    """

    horizon: int = count(20, "Samples that are looked ahead.")
    limit: float = number(LIMIT, "V", "Largest reference.", above=0)
    film: float = number(5.0, "um", "Least film thickness.", above=0)
    film_at_rest: float = number(17.0, "um", "Least film thickness in the equilibrium.", above=0)
    journal_per_disc: float = number(0.4, "1", "Displacement of the journal for that of the disc.", above=0)
    average: float = number(0.2, "s", "Time in which the centre is sought.", low=0)

    @property
    def reach(self) -> float:
        """Displacement [um] of the disc from the centre at which the film may become `film` thick."""
        return (self.film_at_rest - self.film) / self.journal_per_disc


Spec = PredictiveSpec


def design(model: Model, spec: PredictiveSpec | None = None) -> Predictive:
    """The controller; raises DesignError where `lqr` does, without film to spare, or without the package `osqp`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> law = rs.control.mpc.design(rs.load_model("model.json"))
    >>> law.step((0.0, 0.0), 300.0, 0.5e6).shape
    (2,)
    """
    spec = spec or PredictiveSpec()
    if find_spec("osqp") is None:
        raise DesignError("mpc: needs the package osqp; pip install 'rotorsim[mpc]'")
    if spec.reach <= 0:
        raise DesignError(
            f"mpc.film = {spec.film:g} um: the film is {spec.film_at_rest:g} um thick at rest already; "
            "allow a thinner one"
        )
    found = gains(model, spec)
    return Predictive(spec, found, Program(spec, found), machine=str(getattr(model, "machine", "")))


@dataclass(eq=False, repr=False)
class Predictive(Guarded):
    """The running controller; what it has measured is in um from its centre, what acts in V from the mean then.

    `machine` is name and fingerprint of the model's machine, empty where unknown.
    """

    spec: PredictiveSpec
    gains: Gains
    program: Program
    name: str = "mpc"
    machine: str = ""
    state: np.ndarray = field(init=False, repr=False)
    memory: np.ndarray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.reset()

    def __repr__(self) -> str:
        """Horizon, limits and operating point."""
        one = self.spec
        return f"<mpc: {one.horizon} samples ahead, within {one.limit:g} V and {one.reach:.3g} um of the centre>"

    @property
    def Ts(self) -> float:
        """Sampling time [s]."""
        return self.spec.Ts

    def reset(self) -> None:
        """Forget the past."""
        self.state, self.memory = np.zeros(self.gains.plant.order), np.zeros(SIZE)
        self.sums, self.references, self.samples, self.unsolved = np.zeros(2), np.zeros(2), 0, 0
        self.acting: np.ndarray | None = None
        self.program.start()

    def check_sampling(self, Ts: float) -> None:
        """Raise DesignError unless the sampling time is that of the plant, Ts [s]."""
        if abs(self.Ts / Ts - 1) > 1e-9:
            raise DesignError(
                f"mpc: Ts = {self.Ts * 1e3:g} ms, and the plant samples every {Ts * 1e3:g} ms; "
                f"design it with Ts = {Ts:g} s",
                argument="Ts",
                value=self.Ts,
            )

    def check_machine(self, name: str) -> None:
        """Warn OtherMachine if it was designed on a model of another machine than that of this name."""
        if sentence := other_machine(self.name, self.machine, name):
            warnings.warn(sentence, OtherMachine, stacklevel=4)

    def applied(self, reference: Any) -> None:
        """Reference (2,) [V] that acts in this sample, given before `step` where it is not the last output.

        `simulate`, experiments and verification give it.
        """
        self.acting = np.array(reference, float)

    def step(self, measured: Any, speed: float, pressure: float) -> np.ndarray:
        """Reference (2,) [V] for the next sample from the measured disc (2,) [m]; held where that is not finite."""
        measured, output = np.asarray(measured, float), np.zeros(2)
        average = round(self.spec.average / self.Ts)
        bad = not np.all(np.abs(measured) < FARTHEST)
        self.samples += not bad
        acting, self.acting = self.acting, None
        if not bad and self.samples <= average:
            self.sums += measured
            self.references += 0.0 if acting is None else acting
        elif self.samples >= average:
            if acting is not None:
                self.state[-2:] = acting - self.references / max(average, 1)
            if not bad:
                output = self.decide(1e6 * (measured - self.sums / max(average, 1)))
        guard(self.memory, SENSOR if bad else OK, output)
        self.advance(output)
        return output

    def decide(self, seen: np.ndarray) -> np.ndarray:
        """Output (2,) [V] for a displacement (2,) [um] from the centre, which corrects the estimate."""
        self.state += self.gains.L @ (seen - self.gains.plant.C @ self.state)
        output, solved = self.program.solve(self.state)
        self.unsolved += not solved
        return output

    def advance(self, output: np.ndarray) -> None:
        """Estimate of the next sample's state under an output (2,) [V], which the last two states then hold."""
        self.state = self.gains.plant.A @ self.state + self.gains.plant.B @ output


class Program:
    """Quadratic program of a sample over the references of the horizon (2 N,) and the excess s of the film's limit."""

    def __init__(self, spec: PredictiveSpec, found: Gains) -> None:
        self.spec, self.found, N = spec, found, spec.horizon
        self.free, forced = predictions(found.plant, N)
        Q, n = np.eye(2) * (spec.u / spec.y) ** 2, found.plant.order
        weight = np.kron(np.eye(N), Q)
        outputs, states = slice(0, 2 * N), slice(2 * N, 2 * N + n)
        F, G = forced[outputs], forced[states]
        H = F.T @ weight @ F + np.eye(2 * N) + G.T @ found.P @ G
        self.gradient = F.T @ weight @ self.free[outputs] + G.T @ found.P @ self.free[states]
        self.H = np.block(
            [[2 * H, np.zeros((2 * N, 1))], [np.zeros((1, 2 * N)), np.array([[2 * SOFT * (spec.u / spec.y) ** 2]])]]
        )
        self.look = np.kron(np.eye(N), DIRECTIONS)
        rows = self.look @ F
        soft = np.ones((len(rows), 1))
        self.A = np.block([
            [np.eye(2 * N), np.zeros((2 * N, 1))], [rows, -soft], [rows, soft], [np.zeros((1, 2 * N)), np.eye(1)],
        ])  # fmt: skip
        self.ahead = self.look @ self.free[outputs]
        self.unlimited = -np.linalg.solve(self.H[:-1, :-1], 2 * self.gradient)

    def start(self) -> None:
        """Set the solver up, without what it has solved before."""
        self.solver: Any = None

    def bounds(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the constraints' rows."""
        N, moved = self.spec.horizon, self.ahead @ state
        far, limit = np.full(len(moved), 1e10), np.full(2 * N, self.spec.limit)
        low = np.concatenate([-limit, -far, -self.spec.reach - moved, [0.0]])
        return low, np.concatenate([limit, self.spec.reach - moved, far, [1e10]])

    def solve(self, state: np.ndarray) -> tuple[np.ndarray, bool]:
        """First reference (2,) [V], and whether it is the optimum; the limited regulator's where the solver fails.

        Where the unlimited regulator keeps every limit it is the optimum.
        """
        unlimited = self.unlimited @ state
        low, high = self.bounds(state)
        rows = self.A[:, :-1] @ unlimited
        if np.all(rows >= low) and np.all(rows <= high):
            return unlimited[:2], True
        q = np.append(2 * self.gradient @ state, 0.0)
        if self.solver is None:
            self.solver = solver(self.H, q, self.A, low, high)
        else:
            self.solver.update(q=q, l=low, u=high)
        found = self.solver.solve(raise_error=False)
        solved = found.info.status == "solved"
        first = found.x[:2] if solved else unlimited[:2]
        return np.clip(first, -self.spec.limit, self.spec.limit), solved


def predictions(plant: System, N: int) -> tuple[np.ndarray, np.ndarray]:
    """Outputs y_0 to y_N-1 (2 N) and x_N (n) from the state (n) and from the references (2 N), one below the other."""
    n = plant.order
    free, forced = np.zeros((2 * N + n, n)), np.zeros((2 * N + n, 2 * N))
    power, effect = np.eye(n), np.zeros((n, 2 * N))
    for k in range(N):
        free[2 * k : 2 * k + 2], forced[2 * k : 2 * k + 2] = plant.C @ power, plant.C @ effect
        effect = plant.A @ effect
        effect[:, 2 * k : 2 * k + 2] = plant.B
        power = plant.A @ power
    free[2 * N :], forced[2 * N :] = power, effect
    return free, forced


def solver(H: np.ndarray, q: np.ndarray, A: np.ndarray, low: np.ndarray, high: np.ndarray) -> Any:
    """A solver of OSQP for min z'Hz/2 + q'z under low <= A z <= high."""
    import osqp
    from scipy.sparse import csc_matrix, triu

    made = osqp.OSQP()
    made.setup(csc_matrix(triu(csc_matrix(H))), q, csc_matrix(A), low, high, **SETTINGS)
    return made
