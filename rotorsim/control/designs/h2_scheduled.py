r"""Gain-scheduled H2 control with imbalance notch and integral action (thesis Paper G).

The generalised plant of a local design (figure G.2) has 14 states for Model 3:

.. math:: z = \begin{bmatrix} W_p y\\ W_u u\\ W_i \int y \end{bmatrix}, \quad y_\Delta = \int y + W_n w_n, \quad
          y = G u + G_f w_f, \qquad K = K_\Delta / s

w_f is a force on the rotor. W_p peaks at the shaft's speed, so that imbalance is rejected there; the integrators bring
the disc back to its centre. Two Riccati equations give its H2-optimal controller

.. math:: K_\Delta: \quad A_K = A + B_2 F + L C_2, \quad B_K = -L, \quad C_K = F

The local controllers' matrices are interpolated entry by entry as polynomials in speed and pressure (section G.2):

.. math:: k_{lm}(q) = \sum_{i + j \le n} c_{ij} q_1^i q_2^j

A share of the local controllers is held out to measure it; the corners of the range never are. The order of the
polynomials is the lowest whose loop is stable on a fine grid and whose imbalance response at the held-out points is
within `tolerance` of the local designs': second order, the thesis' choice, may leave points unstable.

Cites: thesis, zhou_1996.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import solve_continuous_are

from rotorsim.base.errors import DesignError
from rotorsim.base.units import KRPM, RIG_SAMPLE
from rotorsim.control.designs.hinf_synthesis import Generalised, high_pass, notch
from rotorsim.control.designs.lpv_problem import functions, scaled
from rotorsim.control.designs.specification import (
    Specification,
    count,
    delay_of,
    loop_delay,
    number,
    register,
    sampling_time,
)
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import constant_law, discrete, make_law, over_grid, table_axes
from rotorsim.control.plants import Model, design_plant, point_text, sampled_plant
from rotorsim.control.sampled_loop import law_system, sweep
from rotorsim.control.systems import System, block_diag, response, series, side_by_side


@dataclass(frozen=True)
class H2Weights(Specification):
    """Thesis section G.3.1.

    The thesis leaves the imbalance gain B_delta and the units of W_i and W_n open; `force`, `W_i` and `W_n` are
    chosen here.
    """

    zeta_1: float = number(0.3, "1", "Damping ratio of W_p's zeros.")
    zeta_2: float = number(0.01, "1", "Damping ratio of W_p's poles.")
    k_0: float = number(0.5, "1", "W_p at rest over its level.")
    level: float = number(0.5, "1", "W_p at high frequency.")
    A_b: float = number(10 / 11, "1", "Inverse of W_u at rest.")
    over_M_b: float = number(165.0, "1", "1/M_b: W_u at high frequency.")
    omega_b: float = number(22000 * np.pi, "1/s", "Corner of W_u.", example=69000.0)
    W_i: float = number(1e-3, "1/ms", "Weight of the integral of the displacement.")
    W_n: float = number(0.5, "um*ms", "Level of the noise on the integral.")
    force: float = number(1.0, "um/ms^2", "Level of the force on the rotor.")


def scheduled_plant(plant: System, speed: float, weights: H2Weights) -> Generalised:
    """The generalised plant of a continuous plant in um, V and ms at a speed [rad/s]."""
    one = notch(speed / 1e3, weights.zeta_1, weights.zeta_2, weights.k_0, weights.level)
    up = high_pass(weights.omega_b / 1e3, weights.A_b, weights.over_M_b)
    Wp, Wu = side_by_side(one, one), side_by_side(up, up)
    n, p, u = plant.order, Wp.order, Wu.order
    A = block_diag(plant.A, Wp.A, Wu.A, np.zeros((2, 2)))
    A[n : n + p, :n], A[n + p + u :, :n] = Wp.B @ plant.C, plant.C
    total = len(A)
    B1 = np.zeros((total, 4))
    B1[2:4, :2] = weights.force * np.eye(2)
    B2 = np.vstack([plant.B, np.zeros((p, 2)), Wu.B, np.zeros((2, 2))])
    C1 = np.zeros((6, total))
    C1[:2, :n], C1[:2, n : n + p] = Wp.D @ plant.C, Wp.C
    C1[2:4, n + p : n + p + u] = Wu.C
    C1[4:, n + p + u :] = weights.W_i * np.eye(2)
    C2 = np.zeros((2, total))
    C2[:, n + p + u :] = np.eye(2)
    D12 = np.vstack([np.zeros((2, 2)), Wu.D, np.zeros((2, 2))])
    D21 = np.hstack([np.zeros((2, 2)), weights.W_n * np.eye(2)])
    return Generalised(A, B1, B2, C1, C2, np.zeros((6, 4)), D12, D21)


def with_integrator(K: System) -> System:
    """K / s: the controller that the plant itself meets."""
    integrator = System(np.zeros((2, 2)), np.eye(2), np.eye(2), np.zeros((2, 2)))
    return series(integrator, K)


def h2_controller(P: Generalised) -> System:
    """The optimal controller; raises DesignError where a Riccati equation has no stabilising solution."""
    try:
        R = P.D12.T @ P.D12
        X = solve_continuous_are(P.A, P.B2, P.C1.T @ P.C1, R, s=P.C1.T @ P.D12)
        F = -np.linalg.solve(R, P.B2.T @ X + P.D12.T @ P.C1)
        V = P.D21 @ P.D21.T
        Y = solve_continuous_are(P.A.T, P.C2.T, P.B1 @ P.B1.T, V, s=P.B1 @ P.D21.T)
        L = -np.linalg.solve(V, P.C2 @ Y + P.D21 @ P.B1.T).T
    except (np.linalg.LinAlgError, ValueError) as error:
        raise DesignError(f"h2: a Riccati equation has no stabilising solution ({error}); check the weights") from error
    return System(P.A + P.B2 @ F + L @ P.C2, -L, F, np.zeros((P.B2.shape[1], P.C2.shape[0])))


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Coefficients (t, N, N) of the packed matrices [A B; C D] over exponents of q scaled to [-1, 1]."""

    coefficients: np.ndarray
    exponents: tuple[tuple[int, int], ...]
    low: np.ndarray
    high: np.ndarray
    states: int

    def at(self, speed: float, pressure: float) -> System:
        """The interpolated controller."""
        basis = functions(self.exponents, scaled(self.low, self.high, np.array([speed, pressure])))
        whole, n = np.tensordot(basis, self.coefficients, 1), self.states
        return System(whole[:n, :n], whole[:n, n:], whole[n:, :n], whole[n:, n:])


def exponents(order: int) -> tuple[tuple[int, int], ...]:
    """Exponents of all monomials in two variables up to a total degree."""
    return tuple((i, total - i) for total in range(order + 1) for i in range(total, -1, -1))


def fit(points: np.ndarray, systems: list[System], order: int) -> Surfaces:
    """Least squares through controllers of one basis at points (k, 2) [rad/s, Pa]."""
    low, high = points.min(axis=0), points.max(axis=0)
    powers = exponents(order)
    whole = np.array([np.block([[s.A, s.B], [s.C, s.D]]) for s in systems])
    found = np.linalg.lstsq(functions(powers, scaled(low, high, points)), whole.reshape(len(whole), -1), rcond=None)[0]
    return Surfaces(found.reshape(len(powers), *whole.shape[1:]), powers, low, high, systems[0].order)


def held_out(rows: int, columns: int) -> np.ndarray:
    """Which of a grid's points (rows x columns, the last index fastest) are held out: about a third, no corner."""
    i, j = np.divmod(np.arange(rows * columns), columns)
    corner = ((i == 0) | (i == rows - 1)) & ((j == 0) | (j == columns - 1))
    return ((i + 2 * j) % 3 == 1) & ~corner


@dataclass(frozen=True)
class ScheduledH2Spec(Specification):
    """Weights, grids and the orders of interpolation that are tried, in turn."""

    weights: H2Weights = field(default_factory=H2Weights)
    grid: tuple[int, int] = count((10, 10), "Speeds and pressures of the local designs.")
    slowest: float = number(1 * KRPM, "rad/s", "Lowest speed of the grids.", low=0)
    orders: tuple[int, ...] = count((2, 3, 4, 5), "Orders of interpolation that are tried, in turn.", low=0)
    tolerance: float = number(0.1, "1", "Excess of the imbalance response over the local designs' that passes.")
    delay: float | None = loop_delay(None)
    fine: tuple[int, int] = count((40, 15), "Speeds and pressures of the stability check.")
    table: tuple[int, int] = count((21, 9), "Speeds and pressures of the law's table.")
    refresh: float = number(0.01, "s", "How often the law reads its table.", above=0)
    Ts: float = sampling_time()


Spec = ScheduledH2Spec


@register("gain-scheduled H2 with notch and integral action (G)")
def design(model: Model, spec: ScheduledH2Spec | None = None) -> Law:
    """The law; raises DesignError if no order of interpolation passes, naming what the last one failed."""
    spec = spec or ScheduledH2Spec()
    speeds, pressures = table_axes(model, spec.grid, spec.slowest)
    points = np.array([(w, p) for w in speeds for p in pressures])
    local = [local_controller(model, spec, w, p) for w, p in points]
    out = held_out(len(speeds), len(pressures))
    fine = [np.linspace(axis[0], axis[-1], n) for axis, n in zip((speeds, pressures), spec.fine, strict=True)]
    fault = ""
    for order in spec.orders:
        surfaces = fit(points[~out], [local[k] for k in np.flatnonzero(~out)], order)
        law = scheduled(model, spec, surfaces)
        found = sweep(law, model, *fine)
        excess = imbalance_excess(model, spec, law, points[out], [local[k] for k in np.flatnonzero(out)])
        if not found.unstable and excess <= spec.tolerance:
            about = {"order": order, "hold_out_excess": excess, "held_out": int(out.sum()), "designs": len(points)}
            return law.with_(about=law.about | about)
        w, p = found.worst
        fault = (
            f"{found.unstable} of {found.radius.size} unstable, worst at {point_text(w, p)}"
            if found.unstable
            else f"the imbalance response at held-out points is up to {100 * excess:.0f} % above the local designs'"
        )
    raise DesignError(
        f"h2_scheduled: with order {spec.orders[-1]} {fault}; allow higher orders or a finer grid",
        argument="orders",
        value=spec.orders,
    )


def local(model: Model, speed: float, pressure: float, spec: ScheduledH2Spec | None = None) -> Law:
    """The law of one local design."""
    spec = spec or ScheduledH2Spec()
    made = discrete(with_integrator(local_controller(model, spec, speed, pressure)), spec.Ts)
    return constant_law("h2", model, made, spec, about={"speed": speed, "pressure": pressure})


def local_controller(model: Model, spec: ScheduledH2Spec, speed: float, pressure: float) -> System:
    """K_Delta at an operating point."""
    plant = design_plant(model, speed, pressure, delay_of(spec))
    return h2_controller(scheduled_plant(plant, speed, spec.weights))


def scheduled(model: Model, spec: ScheduledH2Spec, surfaces: Surfaces) -> Law:
    """Law of interpolated surfaces."""
    speeds, pressures = table_axes(model, spec.table, spec.slowest)
    grid = over_grid(speeds, pressures, lambda w, p: discrete(with_integrator(surfaces.at(w, p)), spec.Ts))
    return make_law("h2_scheduled", model, grid, speeds, pressures, spec, refresh=max(round(spec.refresh / spec.Ts), 1))


def imbalance_excess(model: Model, spec: ScheduledH2Spec, law: Law, points: np.ndarray, local: list[System]) -> float:
    """Largest excess of the imbalance response over the local designs', as a share of theirs."""
    worst = 0.0
    for (speed, pressure), K in zip(points, local, strict=True):
        mine = imbalance_response(model, law_system(law, speed, pressure), speed, pressure, spec.Ts)
        theirs = imbalance_response(model, discrete(with_integrator(K), spec.Ts), speed, pressure, spec.Ts)
        worst = max(worst, mine / theirs - 1)
    return worst


def imbalance_response(model: Model, K: System | None, speed: float, pressure: float, Ts: float = RIG_SAMPLE) -> float:
    """Norm of the disc's answer at the shaft's speed to a unit force turning with the shaft [um ms^2/um].

    The plant's answer to forces is continuous and the loop's sensitivity sampled; far below Nyquist they multiply.
    """
    plant = design_plant(model, speed, pressure)
    force = System(plant.A, np.vstack([np.zeros((2, 2)), np.eye(2), np.zeros((plant.order - 4, 2))]), plant.C, plant.D)
    turning = response(force, np.array([1j * speed / 1e3]))[0] @ np.array([1.0, -1j])
    if K is None:
        return float(np.linalg.norm(turning))
    sampled = sampled_plant(model, speed, pressure, Ts)
    z = np.array([np.exp(1j * speed * Ts)])
    So = np.linalg.inv(np.eye(2) - response(sampled, z)[0] @ response(K, z)[0])
    return float(np.linalg.norm(So @ turning))
