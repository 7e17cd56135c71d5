r"""Decentralised proportional control with a low-pass filter (thesis Paper C, eq. C.21).

.. math:: r = \mathrm{diag}(\kappa_x, \kappa_y) H(s) p / t, \qquad H(s) = \left(\frac{\omega_l}{s + \omega_l}\right)^n

kappa [m/m] is piezo reference per disc displacement and t [m/V] the transducer; positive feedback, whose damping comes
from the lag of film and actuators. Nothing of the model enters but the check that the loop is stable.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.base.units import MPA
from rotorsim.control.designs.specification import (
    Specification,
    count,
    number,
    register,
    sampling_time,
    shaft_speed,
    supply_pressure,
)
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import constant_law, discrete
from rotorsim.control.plants import MILLI, Model
from rotorsim.control.sampled_loop import check_loop
from rotorsim.control.systems import System, gain, series, side_by_side


@dataclass(frozen=True)
class ProportionalSpec(Specification):
    """Gains of Paper C; positive pushes outwards. The loop is checked at one operating point."""

    kappa_x: float = number(1.125, "1", "Reference x per displacement x, over the transducer.")
    kappa_y: float = number(0.99, "1", "Reference y per displacement y, over the transducer.")
    low_pass: float = number(1000.0, "Hz", "Corner of the low-pass.", above=0)
    order: int = count(1, "Order of the low-pass.", low=0)
    transducer: float = number(4.5, "um/V", "Displacement per volt of the transducer.", above=0)
    speed: float = shaft_speed(0.0)
    pressure: float = supply_pressure(0.5 * MPA)
    Ts: float = sampling_time()
    check: bool = True


Spec = ProportionalSpec


def low_pass(frequency: float, order: int) -> System:
    """1 / (1 + s/(2 pi f))^order in ms, `frequency` in Hz."""
    corner = 2 * np.pi * frequency / MILLI
    one = System(np.array([[-corner]]), np.array([[corner]]), np.eye(1), np.zeros((1, 1)))
    made = gain([[1.0]])
    for _ in range(order):
        made = series(made, one)
    return made


@register("decentralised proportional control (thesis C)")
def design(model: Model, spec: ProportionalSpec | None = None) -> Law:
    """The law; raises DesignError if its loop with the model is unstable."""
    spec = spec or ProportionalSpec()
    law = make(spec, model)
    if spec.check:
        check_loop(law, model, [(spec.speed, spec.pressure)])
    return law


def make(spec: ProportionalSpec, model: Model | None = None) -> Law:
    """The law, whatever it does to a loop; with plausibility limits where a model is given."""
    axes = (low_pass(spec.low_pass, spec.order),) * 2
    gains = gain(np.diag([spec.kappa_x, spec.kappa_y]) / spec.transducer)
    return constant_law("p", model, discrete(series(side_by_side(*axes), gains), spec.Ts), spec)
