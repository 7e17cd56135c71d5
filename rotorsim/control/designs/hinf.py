r"""H-infinity mixed sensitivity at one operating point (thesis Papers B, E, F; eqs. E.13 to E.15, E.25).

.. math:: \min_K \left\| \begin{bmatrix} W_p S\\ W_u K S \end{bmatrix} \right\|_\infty

The optimal controller has poles far beyond the sampling rate; `backoff` times the optimal gamma is taken. Reduction is
judged by S. Default weights are the thesis'; see `rotorsim.control.designs.weighted_plant` for `force`, and
`rotorsim.control.designs.uncertain` for the relative error of the model that the loop can be asked to stand.

Cites: skogestad_2005, thesis.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite

from rotorsim.base.constants import KRPM, MPA
from rotorsim.control.designs.hinf_synthesis import bounds, controller
from rotorsim.control.designs.specification import (
    Specification,
    count,
    delay_of,
    loop_delay,
    number,
    register,
    sampling_time,
    shaft_speed,
    supply_pressure,
)
from rotorsim.control.designs.uncertain import check_robust, scaled, uncertain_loop_norm
from rotorsim.control.designs.weighted_plant import MILD, RIG, Weights, closed, mixed_sensitivity
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import constant_law, discrete
from rotorsim.control.plants import Model, check_modes, design_plant, sampled_plant
from rotorsim.control.reduction import reduced
from rotorsim.control.sampled_loop import check_loop
from rotorsim.control.systems import peak_gain


@dataclass(frozen=True)
class HinfSpec(Specification):
    """Operating point, weights, order."""

    speed: float = shaft_speed(3 * KRPM)
    pressure: float = supply_pressure(0.5 * MPA)
    weights: Weights = field(default_factory=Weights)
    backoff: float = number(1.02, "1", "Factor on the optimal gamma; the optimum itself cannot be run.", low=1.001)
    delay: float | None = loop_delay(0.0)
    order: int | None = count(0, "Order of the reduced law; 0 keeps all states, None is judged by S.", low=0)
    tolerance: float = number(0.1, "1", "Change of S that a reduction may make.")
    uncertainty: float = number(
        0.0, "1", "Relative error of the model at its input that the loop stands; 0 for none.", low=0, high=0.99,
        example=0.3,
    )  # fmt: skip
    Ts: float = sampling_time()


Spec = HinfSpec


PRESETS = {"thesis": HinfSpec(), "rig": HinfSpec(weights=RIG, delay=None), "mild": HinfSpec(weights=MILD)}
"""'rig' and 'mild' are for the virtual rig and Model 2; see `rotorsim.control.designs.weighted_plant`."""


@register("H-infinity mixed sensitivity at one operating point (B, E, F)")
def design(model: Model, spec: HinfSpec | None = None) -> Law:
    """The law, with `gamma` the norm that its controller was made for.

    Raises
    ------
    DesignError
        If no controller meets the weights (the message names the condition), the loop of the one found does not
        keep its gamma, a pole is too fast for Ts, or a mode cannot be moved or seen.
    """
    spec = spec or HinfSpec()
    plant = design_plant(model, spec.speed, spec.pressure, delay_of(spec))
    check_modes(plant, "hinf")
    P = mixed_sensitivity(plant, spec.weights)
    scale = None
    if spec.uncertainty:
        P, best, scale = scaled(P, plant, spec.uncertainty)
    else:
        best = bounds(P)
    gamma = spec.backoff * best.high
    K = controller(P, gamma)
    about = {"optimal_gamma": best.high, "reached": peak_gain(closed(P, K))}
    if scale is not None:
        about |= {"scale": scale, "norm_of_uncertain_loop": uncertain_loop_norm(plant, K, spec.uncertainty)}
        check_robust(about["norm_of_uncertain_loop"], spec.uncertainty)
    if best.high > 1.001 * best.low:
        about["optimal_gamma_at_least"] = best.low
    if spec.order != 0:
        sampled = sampled_plant(model, spec.speed, spec.pressure, spec.Ts)
        K, change = reduced(
            K, sampled, lambda k: discrete(k, spec.Ts), spec.Ts, spec.order, spec.tolerance,
            lambda k: isfinite(peak_gain(closed(P, k))),
        )  # fmt: skip
        about |= {"order": K.order, "change_of_S": change, "reached": peak_gain(closed(P, K))}
    law = constant_law("hinf", model, discrete(K, spec.Ts), spec, gamma, about=about)
    check_loop(law, model, [(spec.speed, spec.pressure)])
    return law


__all__ = ["Spec", "Weights", "design"]
