r"""Youla-scheduled control (thesis Paper G, G.11 to G.14): local H2 designs blended by the Youla parameter Q.

For a stable plant the parameter of a controller is its closed loop T = K (I - G K)^{-1}, so that blending Q is blending
T, and what runs is

.. math:: K(q) = (I + \bar T G)^{-1} \bar T, \qquad \bar T = \sum_i \lambda_i T_i

over the corners of the cell of the design grid that holds q. The loop is stable, but the order is that of all corners
together, and between design points the notches of the T_i fall apart. One law for one operating point.

Cites: thesis, zhou_1996.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rotorsim.base.errors import DesignError
from rotorsim.base.units import KRPM, MPA
from rotorsim.control.designs import h2_scheduled
from rotorsim.control.designs.h2_scheduled import with_integrator
from rotorsim.control.designs.specification import Specification, register, sampling_time, shaft_speed, supply_pressure
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import discrete, no_antiwindup, proved_law, table_axes
from rotorsim.control.plants import Model, sampled_plant
from rotorsim.control.systems import System, added, feedback, gain


@dataclass(frozen=True)
class YoulaSpec(Specification):
    """Operating point, by default a cell's centre as in figure G.6; the local designs' specification."""

    speed: float = shaft_speed(5.72 * KRPM)
    pressure: float = supply_pressure(0.678 * MPA)
    local: h2_scheduled.Spec = field(default_factory=h2_scheduled.Spec)
    Ts: float = sampling_time()


Spec = YoulaSpec


@register("Youla-scheduled H2 for one operating point (G)")
def design(model: Model, spec: YoulaSpec | None = None) -> Law:
    """The law; raises DesignError for a point outside the design grid."""
    spec = spec or YoulaSpec()
    speeds, pressures = table_axes(model, spec.local.grid, spec.local.slowest)
    plant = sampled_plant(model, spec.speed, spec.pressure, spec.Ts)
    blend = gain(np.zeros((2, 2)))
    for speed, a in _corners(speeds, spec.speed, "speed"):
        for pressure, b in _corners(pressures, spec.pressure, "pressure"):
            if a * b > 0:
                K = discrete(
                    with_integrator(h2_scheduled.local_controller(model, spec.local, speed, pressure)), spec.Ts
                )
                blend = added(blend, feedback(K, plant), a * b)
    K = feedback(blend, System(plant.A, plant.B, -plant.C, -plant.D))
    return proved_law("youla", model, K, spec, antiwindup=no_antiwindup)


def _corners(axis: np.ndarray, value: float, name: str) -> list[tuple[float, float]]:
    """The two design points about a value and their weights."""
    if not axis[0] <= value <= axis[-1]:
        raise DesignError(
            f"youla.{name} = {value:.4g}: lies outside the design grid, {axis[0]:.4g} to {axis[-1]:.4g}; choose within"
        )
    if len(axis) == 1:
        return [(float(axis[0]), 1.0)]
    k = min(int(np.searchsorted(axis, value, side="right")) - 1, len(axis) - 2)
    b = (value - axis[k]) / (axis[k + 1] - axis[k])
    return [(float(axis[k]), 1 - b), (float(axis[k + 1]), b)]
