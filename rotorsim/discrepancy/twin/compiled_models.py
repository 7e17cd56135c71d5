r"""Compiled models of a diagnosis: the coarse twin of the fit, the fine one, and one with the injectors' other law.

The other law is the orifice where the machine has a loss factor, and the reverse:

.. math:: C_{d1}\,\pi d_p\,g\,\Phi(P_s, P_k) \;\leftrightarrow\; l_f\,(P_s^2 - P_k^2)

Conductances are matched by the flow at rest at `MATCHED_PRESSURE`, so that only the dependence of the flow on the
pressures differs. Sources: Morosi & Santos (2011) for the orifice; Pierart & Santos (2015) for the loss factor.

Cites: morosi_2011, pierart_2015.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from math import pi, sqrt

from rotorsim.discrepancy.twin.parameters import FitParameter, flow_key
from rotorsim.discrepancy.twin.plant import FAILURES, Setting, Twin
from rotorsim.machine import Machine
from rotorsim.plant.compose import is_compiled
from rotorsim.plant.equilibrium import settle

GRID, STEP = (32, 8), 2e-4
"""Film's nodes around and along, and time step [s], of the twin that is fitted."""
FINE_GRID, FINE_STEP = (32, 16), 1e-4
"""Film's nodes around and along, and time step [s], of the twin that shows the discretisation error."""
MATCHED_PRESSURE = 0.5e6
"""Gauge pressure [Pa] at which both laws give the same flow."""
MATCHED_SPEED = 300.0
"""Shaft speed [rad/s] at which the flows are matched."""
MOST_MATCHES = 6
"""Most corrections of the other law's coefficient until the flows are equal."""
FLOW_STEP = 0.02
"""Step of the flow's relative change in finite differences."""
Progress = Callable[[str], None]
"""Function of a stage's name, called with each step of the work."""


@dataclass(frozen=True)
class CompiledModels:
    """Compiled twins of a machine: the coarse one for the fit and the fine one for its discretisation error.

    Examples
    --------
    >>> import rotorsim as rs
    >>> models = rs.discrepancy.CompiledModels.of(machine)  # doctest: +SKIP
    >>> found = [rs.diagnose(machine, [file], models=models) for file in ("1.nc", "2.nc")]  # doctest: +SKIP
    """

    twin: Twin
    fine: Twin | None
    law: tuple[Twin, Mapping[FitParameter, float]] | None = None
    """The twin with the injectors' other law, and the changes that match its flow."""

    @classmethod
    def of(
        cls, machine: Machine, effects: Iterable[str] | None = None, progress: Progress = lambda _: None
    ) -> CompiledModels:
        """Compile the twins of a machine with all effects of the catalogue, or these, as candidates."""
        only = None if effects is None else tuple(sorted(set(effects)))
        fine_grid = GRID if machine.film is None else FINE_GRID
        twin = Twin(machine, GRID, STEP, only=only)
        if not is_compiled(twin.assembly.module):
            progress("compile")
        return cls(twin, Twin(machine, fine_grid, FINE_STEP, only=only), other_law(twin))


def other_law(twin: Twin) -> tuple[Twin, dict[FitParameter, float]] | None:
    """Twin with the alternative injector law and the drift that matches the flow; None if there is none."""
    machine = twin.machine
    key = flow_key(twin)
    if not machine.injectors or not key:
        return None
    other = replace(twin, machine=exchanged(machine))
    try:
        return other, {FitParameter(key, FLOW_STEP): _drift(twin, other, key)}
    except FAILURES:
        return None


def exchanged(machine: Machine) -> Machine:
    """Machine with the alternative injector law and a matching coefficient."""
    common = machine.injection
    assert common is not None
    high = MATCHED_PRESSURE + machine.gas.ambient_pressure
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
    for _ in range(MOST_MATCHES):
        found = _flow(other, {key: drift} if drift else {})
        if abs(found / wanted - 1) < 1e-4:
            break
        drift = (1 + drift) * wanted / found - 1
    return drift


def _flow(twin: Twin, setting: Setting) -> float:
    """Mass flow [kg/s] of all injectors at rest."""
    a = twin.set(setting)
    w = settle(a, MATCHED_SPEED, MATCHED_PRESSURE)
    first = a.film.film_flow
    return float(sum(a.film_part(w, k)[first : first + a.film.n_inj].sum() for k in range(len(a.films))))
