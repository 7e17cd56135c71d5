r"""Pole placement with a Luenberger observer (thesis Paper A, section A.4).

The lightly damped discrete poles keep their real part and get `share` of their imaginary part; all others stay. The
observer's poles are those of the open loop, each to the power `observer` times faster.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rotorsim.base.errors import DesignError
from rotorsim.base.rounding import ALIKE
from rotorsim.base.units import KRPM, MPA
from rotorsim.control.designs.specification import (
    Specification,
    number,
    register,
    sampling_time,
    shaft_speed,
    supply_pressure,
)
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import proved_law
from rotorsim.control.plants import Model, check_modes, design_plant, short_sampled_plant
from rotorsim.control.systems import System, observer_law


@dataclass(frozen=True)
class PlacementSpec(Specification):
    """Operating point, where the poles go and how much faster the observer is."""

    speed: float = shaft_speed(4.1 * KRPM)
    pressure: float = supply_pressure(0.5 * MPA)
    share: float = number(0.5, "1", "Share of the imaginary part of lightly damped poles that stays.", above=0, high=1)
    observer: float = number(4.0, "1", "Power of the observer's poles: how much faster they are.")
    light: float = number(0.3, "1", "Damping ratio below which a pole is lightly damped.")
    Ts: float = sampling_time()


Spec = PlacementSpec


def target(poles: np.ndarray, share: float, light: float) -> np.ndarray:
    """Poles z of the closed loop: those with a damping ratio below `light` lose imaginary part."""
    s = np.log(np.where(np.abs(poles) > 1e-9, poles, 1e-9).astype(complex))
    moved = (np.abs(s.imag) > 1e-6) & (-s.real < light * np.abs(s))
    return np.where(moved, poles.real + 1j * share * poles.imag, poles)


@register("pole placement with a Luenberger observer (A)")
def design(model: Model, spec: PlacementSpec | None = None) -> Law:
    """The law; raises DesignError where a mode cannot be placed."""
    from scipy.signal import place_poles

    spec = spec or PlacementSpec()
    check_modes(design_plant(model, spec.speed, spec.pressure), "placement")
    plant = short_sampled_plant(model, spec.speed, spec.pressure, spec.Ts)
    poles = np.linalg.eigvals(plant.A)
    wanted = target(poles, spec.share, spec.light)
    try:
        F = place_poles(plant.A, plant.B, wanted).gain_matrix
        L = _observer(plant, spec.observer)
    except ValueError as error:
        raise DesignError(f"placement: the poles cannot be placed ({error}); take another share or observer") from error
    return proved_law("placement", model, observer_law(plant, F, L), spec)


def _observer(plant: System, faster: float) -> np.ndarray:
    """Gain (n, 2) of a current observer; the input register, the last two states, is known and not observed."""
    from scipy.signal import place_poles

    n = plant.order - 2
    A, C = plant.A[:n, :n], plant.C[:, :n]
    poles = np.linalg.eigvals(A)
    wanted = _distinct(np.abs(poles) ** faster * np.exp(1j * np.angle(poles)))
    return np.vstack([place_poles(A.T, A.T @ C.T, wanted).gain_matrix.T, np.zeros((2, 2))])


def _distinct(poles: np.ndarray) -> np.ndarray:
    """Real poles, ascending, moved apart a little: no more than two may coincide, in whatever order they are found."""
    real = np.abs(poles.imag) <= ALIKE * np.abs(poles)
    apart = np.sort(poles.real[real]) + 1e-3 * np.arange(np.count_nonzero(real))
    return np.concatenate([poles[~real], apart])
