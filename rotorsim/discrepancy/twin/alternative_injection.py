r"""Alternative injector law (orifice or loss factor), for the sensitivity to an error of the law.

.. math:: C_{d1}\,\pi d_p\,g\,\Phi(P_s, P_k) \;\leftrightarrow\; l_f\,(P_s^2 - P_k^2)

Conductances are matched by the flow at rest at `MIDDLE`, so that what differs is how the flow depends on the pressures.
Sources: Morosi & Santos (2011) for the orifice; Pierart & Santos (2015) for the loss factor.

Cites: morosi_2011, pierart_2015.
"""

from __future__ import annotations

from dataclasses import replace
from math import pi, sqrt

from rotorsim.discrepancy.fit.calibration import flow_key
from rotorsim.discrepancy.fit.parameters import FitParameter
from rotorsim.discrepancy.twin.twin import FAILURES, Setting, Twin
from rotorsim.machine import Machine
from rotorsim.plant.equilibrium import settle

MIDDLE = 0.5e6
"""Gauge pressure [Pa] at which both laws give the same flow."""
SPEED = 300.0
MOST_ROUNDS = 6
STEP = 0.02
"""Step of the flow's relative change in finite differences."""


def other_law(twin: Twin) -> tuple[Twin, dict[FitParameter, float]] | None:
    """Twin with the alternative injector law and the drift that matches the flow; None if there is none."""
    machine = twin.machine
    key = flow_key(twin)
    if not machine.injectors or not key:
        return None
    other = replace(twin, machine=exchanged(machine))
    try:
        return other, {FitParameter(key, STEP): _drift(twin, other, key)}
    except FAILURES:
        return None


def exchanged(machine: Machine) -> Machine:
    """Machine with the alternative injector law and a matching coefficient."""
    common = machine.injection
    assert common is not None
    high = MIDDLE + machine.gas.ambient_pressure
    # a choked seat against half the pressure behind it
    choked = 0.6847 / sqrt(machine.gas.R * machine.gas.temperature) * pi * common.pin_diameter
    each = choked * common.seat_gap / (0.75 * high)
    if common.law == "orifice":
        size = (common.pin_discharge or 0.0) * each
        return machine.with_({"injection.loss_factor": float(f"{size:.6g}"), "injection.law": "loss_factor"})
    return machine.with_({"injection.pin_discharge": (common.loss_factor or 0.0) / each, "injection.law": "orifice"})


def _drift(twin: Twin, other: Twin, key: str) -> float:
    """Drift of the other law's coefficient at which the flows at rest are equal."""
    wanted, drift = _flow(twin, {}), 0.0
    for _ in range(MOST_ROUNDS):
        found = _flow(other, {key: drift} if drift else {})
        if abs(found / wanted - 1) < 1e-4:
            break
        drift = (1 + drift) * wanted / found - 1
    return drift


def _flow(twin: Twin, setting: Setting) -> float:
    """Mass flow [kg/s] of all injectors at rest."""
    a = twin.set(setting)
    w = settle(a, SPEED, MIDDLE)
    first = a.film.film_flow
    return float(sum(a.film_part(w, k)[first : first + a.film.n_inj].sum() for k in range(len(a.films))))
