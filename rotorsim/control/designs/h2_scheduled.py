r"""Gain-scheduled H2 control with imbalance notch and integral action (thesis Paper G).

Local designs over a grid of operating points, interpolated entry by entry (`designs.interpolation`). The order
of the polynomials is the lowest whose loop is stable on a fine grid and whose imbalance response at the held-out points
is within `tolerance` of the local designs': second order, the thesis' choice, may leave points unstable.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rotorsim.base.constants import KRPM, RIG_SAMPLE
from rotorsim.control.designs.h2_local import h2_controller
from rotorsim.control.designs.h2_plant import H2Weights, scheduled_plant, with_integrator
from rotorsim.control.designs.interpolation import Surfaces, fit, held_out
from rotorsim.control.designs.plants import Model, design_plant, point_text, sampled_plant
from rotorsim.control.designs.specification import (
    Specification,
    count,
    delay_of,
    loop_delay,
    number,
    register,
    sampling_time,
)
from rotorsim.control.errors import DesignError
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import constant_law, discrete, make_law, over_grid, table_axes
from rotorsim.control.loop.sampled_loop import law_system, sweep
from rotorsim.control.numerics.systems import System, response


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
    raise DesignError(f"h2_scheduled: with order {spec.orders[-1]} {fault}; allow higher orders or a finer grid")


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


__all__ = ["H2Weights", "Spec", "design", "local"]
