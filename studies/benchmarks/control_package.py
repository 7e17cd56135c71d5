"""Own numerics of controller design against those of the package `control`: same result, times side by side.

Made on Model 2 of the shipped rig at 3000 rpm, 0.5 MPa. Rows that need slycot are left out where it is not installed:
it is under the GPL, an extra of the tests, and never imported.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from typing import Any

import numpy as np

from identification.local.simulation import zero_order_hold
from rotorsim.base.foreign_systems import control_package
from rotorsim.base.units import KRPM, RIG_SAMPLE
from rotorsim.control.designs import lqr
from rotorsim.control.designs.hinf import truncated
from rotorsim.control.designs.hinf_synthesis import Generalised, Weights, mixed_sensitivity, solve
from rotorsim.control.plants import design_plant, sampled_plant
from rotorsim.control.sampled_loop import closed_poles, law_system, loop_of
from rotorsim.control.systems import System, largest, response, sampled_riccati, tustin
from studies.benchmarks.control_laws import rig_model
from studies.benchmarks.result import Figure

POINT = (3 * KRPM, 0.5e6)
REPEATS = 7
FREQUENCIES = np.geomspace(1.0, 2000.0, 200)
"""Frequencies [Hz] of the responses."""


@dataclass(frozen=True)
class TimedTask:
    """A task done both ways: times [ms], largest deviation relative to the largest value, what is used and why."""

    task: str
    own: float
    library: float
    deviation: float
    used: str


class Tasks:
    """The tasks on one plant; `needs_slycot` names those that the package does not do alone."""

    needs_slycot = ("truncation", "hinf")

    def __init__(self) -> None:
        self.control, self.model = control_package(), rig_model()
        self.plant = sampled_plant(self.model, *POINT)
        self.continuous = design_plant(self.model, *POINT)
        n = self.plant.order
        self.Q, self.R = self.plant.C.T @ self.plant.C, np.eye(2)
        self.noise = 1e-2 * np.eye(n)

    @cached_property
    def controller(self) -> System:
        """Linear quadratic controller of the plant."""
        return law_system(lqr.design(self.model, lqr.Spec(*POINT)), *POINT)

    def ss(self, system: System, Ts: float) -> Any:
        """A system of the package."""
        return self.control.ss(*system, Ts, remove_useless_states=False)

    def lqr(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """Regulator's gain."""
        A, B = self.plant.A, self.plant.B

        def own() -> np.ndarray:
            P = sampled_riccati(A, B, self.Q, self.R, "no regulator")
            return np.linalg.solve(self.R + B.T @ P @ B, B.T @ P @ A)

        return own, lambda: self.control.dlqr(A, B, self.Q, self.R, method="scipy")[0]

    def kalman(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """Gain of the Kalman filter, predicting."""
        A, C, G = self.plant.A, self.plant.C, np.eye(self.plant.order)

        def own() -> np.ndarray:
            P = sampled_riccati(A.T, C.T, self.noise, self.R, "no filter")
            return np.linalg.solve(self.R + C @ P @ C.T, C @ P @ A.T).T

        return own, lambda: self.control.dlqe(A, G, C, self.noise, self.R, method="scipy")[0]

    def placement(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """State feedback for poles that decay faster by half."""
        from scipy.signal import place_poles

        s = np.linalg.eigvals(self.continuous.A)
        A, B = self.continuous.A, self.continuous.B
        wanted = s.real * 1.5 + 1e-3 * np.arange(len(s)) * (s.imag == 0) + 1j * s.imag
        return lambda: place_poles(A, B, wanted).gain_matrix, lambda: self.control.place(A, B, wanted)

    def poles(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """Poles of the closed loop, by size."""
        G, K, control = self.plant, self.controller, self.control

        def library() -> np.ndarray:
            return np.sort_complex(control.feedback(self.ss(G, RIG_SAMPLE), self.ss(K, RIG_SAMPLE), 1).poles())

        return lambda: np.sort_complex(closed_poles(G, K)), library

    def zero_order_hold(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """Discretisation of the continuous plant with held inputs."""
        G, Ts = self.continuous, RIG_SAMPLE * 1e3

        def library() -> np.ndarray:
            made = self.control.sample_system(self.ss(G, 0), Ts, "zoh")
            return np.hstack([made.A, made.B])

        return lambda: np.hstack(zero_order_hold(G.A, G.B, Ts)), library

    def tustin(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """Discretisation by the trapezoidal rule, as a frequency response: the states are scaled differently."""
        G, Ts = self.continuous, RIG_SAMPLE * 1e3
        z = np.exp(2j * np.pi * FREQUENCIES * RIG_SAMPLE)
        own = tustin(G, Ts)
        made = self.control.sample_system(self.ss(G, 0), Ts, "tustin")
        np.testing.assert_allclose(made.D, own.D, atol=1e-9)
        return (
            lambda: response(tustin(G, Ts), z),
            lambda: response(System(*_matrices(self.control.sample_system(self.ss(G, 0), Ts, "tustin"))), z),
        )

    def frequency_response(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """Plant's response at 200 frequencies."""
        z, G = np.exp(2j * np.pi * FREQUENCIES * RIG_SAMPLE), self.ss(self.plant, RIG_SAMPLE)
        return lambda: response(self.plant, z), lambda: np.moveaxis(G(z), 2, 0)

    def margins(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """Disk margin of all loops at once, at the output, from S - I/2."""
        z, control = np.exp(2j * np.pi * FREQUENCIES * RIG_SAMPLE), self.control

        def own() -> float:
            found = loop_of(self.plant, self.controller, RIG_SAMPLE, FREQUENCIES)
            return float(1 / largest(found.So - np.eye(2) / 2).max())

        def library() -> float:
            L = self.ss(self.plant, RIG_SAMPLE) * self.ss(self.controller, RIG_SAMPLE)
            S = control.feedback(control.ss([], [], [], np.eye(2), RIG_SAMPLE), L, 1)
            return float(1 / np.linalg.norm(np.moveaxis(S(z), 2, 0) - np.eye(2) / 2, 2, axis=(1, 2)).max())

        return own, library

    def truncation(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """Balanced truncation of the continuous plant to four states, as a frequency response."""
        s, G = 2e-3j * np.pi * FREQUENCIES, self.continuous
        return (
            lambda: response(truncated(G, 4), s),
            lambda: response(System(*_matrices(self.control.balred(self.ss(G, 0), 4))), s),
        )

    def hinf(self) -> tuple[Callable[[], Any], Callable[[], Any]]:
        """Least gamma of the mixed-sensitivity problem."""
        P = mixed_sensitivity(self.continuous, Weights())
        whole = self.control.ss(*_whole(P), 0)
        return lambda: solve(P), lambda: self.control.hinfsyn(whole, 2, 2)[2]


BOUNDS = {"hinf": 1e-6}
"""Bounds of deviations that are not 1e-8: both searches for gamma end within a tolerance."""
USED = {
    "lqr": "scipy's Riccati solver, which both call, with a check that the loop decays",
    "kalman": "as the regulator",
    "placement": "own: scipy's place_poles, which is all that the package calls",
    "poles": "own: one matrix instead of three systems",
    "zero_order_hold": "own: one exponential, without the system around it",
    "tustin": "own: the thesis' scaling of the states, which a table over operating points needs",
    "frequency_response": "own: all frequencies at once",
    "margins": "own: both ends of the loop; `control.disk_margins` takes a call a frequency",
    "truncation": "own: the package needs slycot (GPL)",
    "hinf": "own: the package needs slycot (GPL); proven bounds below and above",
}
"""Package that rotorsim uses for each task, and the reason."""


def compared() -> list[TimedTask]:
    """Every task both ways, those for slycot only where it is installed."""
    tasks, rows = Tasks(), []
    for name, used in USED.items():
        if name in Tasks.needs_slycot and find_spec("slycot") is None:
            continue
        own, library = getattr(tasks, name)()
        (mine, first), (other, second) = _timed(own), _timed(library)
        mine, other = np.asarray(mine), np.asarray(other)
        deviation = float(np.abs(mine - other).max() / np.abs(other).max())
        rows.append(TimedTask(name, first, second, deviation, used))
    return rows


def against_control() -> Iterator[Figure]:
    """Times of both, and the deviation with its bound."""
    for row in compared():
        yield Figure(f"{row.task}: own", row.own, "ms")
        yield Figure(f"{row.task}: package control", row.library, "ms")
        yield Figure(f"{row.task}: deviation", row.deviation, "1", BOUNDS.get(row.task, 1e-8))


def markdown(rows: list[TimedTask]) -> str:
    """The rows as the table of the documentation."""
    lines = ["| task | own ms | `control` ms | deviation | used |", "|---|---|---|---|---|"]
    lines += [
        f"| {r.task.replace('_', ' ')} | {r.own:.3g} | {r.library:.3g} | {r.deviation:.1g} | {r.used} |" for r in rows
    ]
    return "\n".join(lines)


def _timed(job: Callable[[], Any]) -> tuple[Any, float]:
    """Result and shortest time [ms] of several calls."""
    found, shortest = job(), np.inf
    for _ in range(REPEATS):
        begin = time.perf_counter()
        job()
        shortest = min(shortest, time.perf_counter() - begin)
    return found, shortest * 1e3


def _matrices(system: Any) -> list[np.ndarray]:
    return [np.asarray(getattr(system, letter)) for letter in "ABCD"]


def _whole(P: Generalised) -> tuple[np.ndarray, ...]:
    """A, B, C, D of a generalised plant."""
    D22 = np.zeros((P.D21.shape[0], P.D12.shape[1]))
    return P.A, np.hstack([P.B1, P.B2]), np.vstack([P.C1, P.C2]), np.block([[P.D11, P.D12], [P.D21, D22]])
