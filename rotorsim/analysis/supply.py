r"""Pressure at the regulator from the pressure measured at the injectors, behind the supply line.

The flow at rest depends on the pressure at the injectors alone, so it is that of the machine without its line; the
regulator's pressure is the one that leaves, behind the line with this flow, the pressure that was read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import newton

from rotorsim.effects import numeric_fields
from rotorsim.machine.schema import Machine
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.calls import Call
from rotorsim.plant.equilibrium import describe, settle

AT_REST = 1e9
"""Time [s] in which a line has filled."""


def regulator_pressure(a: Assembly, speed: float, pressure: float) -> float:
    """Gauge pressure [Pa] at the regulator for `pressure` [Pa, gauge] at the injectors, at rest at `speed` [rad/s].

    The same without a supply line that loses anything. Raises as `settle`.
    """
    lines = [call for call in a.calls if call.effect.port == "supply"]
    if not lines:
        return pressure
    free = replace(a, record=_neutral(a, lines))
    flow = float(describe(free, settle(free, speed, pressure)).mass_flow.sum())
    left = a.module.supply_line
    ambient = a.machine.gas.ambient_pressure

    def missing(regulator: float) -> float:
        return pressure + ambient - float(left(a.w.copy(), a.parameters, AT_REST, regulator + ambient, flow)[1])

    loss = missing(pressure)
    return pressure if loss == 0 else float(newton(missing, pressure, x1=pressure + loss, tol=1e-3))


def felt(machines: Sequence[Machine], pressures: Sequence[float] | np.ndarray) -> np.ndarray:
    """Gauge pressures (p,) [Pa] that act on the machines: all, or 0 alone where gas is supplied to none.

    Raises DataError for a pressure below vacuum, also where none acts.
    """
    for machine in machines:
        for pressure in pressures:
            machine.gas.absolute(float(pressure))
    fed = any(machine.fed for machine in machines)
    return np.asarray(pressures, float) if fed else np.zeros(1)


def _neutral(a: Assembly, lines: list[Call]) -> Any:
    """The parameter record with these effects switched off."""
    record = a.record.copy()
    for call in lines:
        off = type(call.effect)()
        for name in numeric_fields(type(call.effect)):
            if hasattr(off, name):
                record[0][call.record][name] = getattr(off, name)
    return record
