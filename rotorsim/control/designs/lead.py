r"""Decentralised P-lead control, softening or stiffening (thesis Paper D, eq. D.7, Table D.1).

.. math:: K_j = -\kappa_j \frac{\tau_j s + 1}{\alpha_j \tau_j s + 1} H(s), \qquad
          H(s) = \left(\frac{\omega_l}{s + \omega_l}\right)^2

The sign is the thesis' own for D: u = -K y, so that a positive kappa hardens. Its gains [V/um] belong to its Model 2;
`scale` multiplies them for a rig with other gains or lags. The softening row's lead poles, 4e5 and 6e6 rad/s, are
beyond what samples can show; alpha tau is at least Ts/2, whose pole Tustin's rule puts to z = 0.

Cites: thesis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.base.units import MPA
from rotorsim.control.designs.p import low_pass
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
from rotorsim.control.law_from_system import constant_law, discrete, proved_law
from rotorsim.control.plants import MILLI, Model
from rotorsim.control.systems import System, gain, series, side_by_side


@dataclass(frozen=True)
class LeadSpec(Specification):
    """Gains, time constants and alpha by axis; the loop is checked at one operating point."""

    kappa: tuple[float, float] = number((-0.132, -0.090), "V/um", "Gain by axis; positive hardens.")
    tau: tuple[float, float] = number((0.30, 0.0200), "ms", "Time constant of the lead by axis.", above=0)
    alpha: tuple[float, float] = number((0.0077, 0.0077), "1", "Ratio of lag to lead by axis.", above=0)
    low_pass: float = number(1000.0, "Hz", "Corner of the low-pass.", above=0)
    order: int = count(2, "Order of the low-pass.", low=0)
    scale: float = number(1.0, "1", "Factor on both gains.")
    speed: float = shaft_speed(0.0)
    pressure: float = supply_pressure(0.5 * MPA)
    Ts: float = sampling_time()
    check: bool = True


Spec = LeadSpec


SOFTENING = LeadSpec()
"""Table D.1, second row: the default."""
HARDENING = LeadSpec(kappa=(0.0061, 0.0133), tau=(20.8, 11.3), alpha=(0.0036, 0.0148))
"""Table D.1, first row."""
PRESETS = {"softening": SOFTENING, "hardening": HARDENING}


def lead(kappa: float, tau: float, alpha: float, fastest: float) -> System:
    """kappa (tau s + 1) / (alpha tau s + 1), tau in ms; alpha tau is at least `fastest`."""
    pole = 1 / max(alpha * tau, fastest)
    alpha = 1 / (pole * tau)
    return System(
        np.array([[-pole]]),
        np.array([[1.0]]),
        np.array([[kappa * pole * (1 - 1 / alpha)]]),
        np.array([[kappa / alpha]]),
    )


@register("decentralised P-lead, softening or hardening (D)")
def design(model: Model, spec: LeadSpec | None = None) -> Law:
    """The law; raises DesignError if its loop with the model is unstable."""
    spec = spec or LeadSpec()
    axes = zip(spec.kappa, spec.tau, spec.alpha, strict=True)
    leads = side_by_side(*(lead(-spec.scale * kappa, tau, alpha, spec.Ts / 2 * MILLI) for kappa, tau, alpha in axes))
    filters = side_by_side(*(low_pass(spec.low_pass, spec.order),) * 2)
    made = discrete(series(series(leads, filters), gain(np.eye(2))), spec.Ts)
    return (proved_law if spec.check else constant_law)("lead", model, made, spec)
