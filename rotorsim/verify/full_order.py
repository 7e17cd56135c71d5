r"""Sampled loop of a law with the full-order linear plant: film, rotor, actuators, hold and a sample of delay.

.. math:: G(z) = z^{-1} \, Z\{ H_0(s) \, G_{plant}(s) \, G_{actuators}(s) \}

Every film node is a state, a few hundred in all, so that neither truncation nor identification stands between law and
physics. The actuators' response is that of their pins to a small pseudo-random reference, as a second-order lag for
each axis: their hysteresis has no linearisation.

Cites: astrom_1997.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

import identification as idn
from rotorsim.base.constants import TO_UM
from rotorsim.control.law import Law
from rotorsim.control.loop.sampled_loop import closed_poles, law_system, loop_of, smallest_damping
from rotorsim.control.numerics.systems import System, balanced_states, held, late, series
from rotorsim.experiments import prbs
from rotorsim.plant import Plant

HIGHEST = 1000.0
"""Frequency [Hz] up to which margins are taken."""


@dataclass(frozen=True)
class FullOrder:
    """Loop at an operating point [rad/s], [Pa]: states, radius of the outermost pole, damping, margins."""

    speed: float
    pressure: float
    states: int
    radius: float
    damping_open: float
    damping: float
    peak: float
    disk_margin: float
    gain_margin: float
    phase_margin: float


def pins(plant: Plant, amplitude: float = 0.2) -> System:
    """Actuators (4 states, SI) from references to the displacement of a pin of each axis, as the plant shows it."""
    record = prbs(plant, 0.0, 0.5e6, amplitude=amplitude, duration=2.0, sequence=1)
    model = idn.identify(record, "actuator").model
    return System(model.A, model.B, model.C / 2, model.D)  # identified is the difference of a pair


def full_plant(plant: Plant, speed: float, pressure: float, actuators: System) -> System:
    """The sampled plant in um and V with the law's sample of delay."""
    found = plant.linearise(speed, pressure)
    per_volt = pin_per_volt(plant)
    rotor = System(found.A, found.B[:, :2] / per_volt, found.C * TO_UM, np.zeros((2, 2)))
    # pressures next to displacements would cost most of the digits
    return late(held(balanced_states(series(actuators, rotor)), plant.machine.sampling_time))


def pin_per_volt(plant: Plant) -> float:
    """Travel [m] of an ideal pin for a volt, which the linearisation assumes."""
    assert plant.machine.injection is not None
    return float(plant.machine.injection.pin_per_volt)


def full_order(plant: Plant, law: Law, points: Iterable[tuple[float, float]]) -> list[FullOrder]:
    """The loop at operating points [rad/s], [Pa]."""
    actuators, rows = pins(plant), []
    for speed, pressure in points:
        G, K = full_plant(plant, speed, pressure, actuators), law_system(law, speed, pressure)
        own = smallest_damping(np.linalg.eigvals(G.A), law.Ts)
        z = closed_poles(G, K)
        loop = loop_of(G, K, law.Ts, np.geomspace(0.5, HIGHEST, 150))
        rows.append(FullOrder(speed, pressure, G.order, float(np.abs(z).max()), own, smallest_damping(z, law.Ts),
                              loop.peak, loop.disk_margin, loop.gain_margin, loop.phase_margin))  # fmt: skip
    return rows
