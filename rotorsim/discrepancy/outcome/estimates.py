"""Estimates of a fit: effect parameters, calibration, evidence, undetermined combinations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rotorsim.discrepancy.fit.least_squares import ParameterFit
from rotorsim.discrepancy.fit.parameters import FitParameter, contributions, lobes, setting, wave
from rotorsim.discrepancy.fit.uncertainty import sd_of_polar
from rotorsim.discrepancy.outcome.findings import IdentifiedEffect
from rotorsim.discrepancy.search.candidates import Form
from rotorsim.discrepancy.search.search import EffectSearch, Hypothesis
from rotorsim.discrepancy.twin.twin import Twin
from rotorsim.effects.base import WHERE


def found_of(twin: Twin, form: Form, fit: ParameterFit, V: np.ndarray, tie_class: tuple[str, ...]) -> IdentifiedEffect:
    """Estimated parameters of a form with standard deviations, as in its table of the machine file."""
    own = {k: fit.point.values.get(k, 0.0) for k in (*form.parameters, *form.refine)}
    absolute = setting(twin, contributions(own, 0.0, 0.0), form.fixed)
    parameters = {key.split(".")[2]: value for key, value in absolute.items()}
    table = next(iter(absolute)).split(".")[1]
    for where in WHERE:
        place = getattr(twin.effect(form.effect, int(table)), where, None)
        parameters |= {} if place is None else {where: place}
    at = {k: i for i, k in enumerate(fit.parameters)}
    sd: dict[str, float] = {}
    if len(form.parameters) == 2 and "~" in form.parameters[0].key:
        i, j = (at[k] for k in form.parameters)
        path = form.parameters[0].key[:-2]
        pair = path.split(".")[2].split("~")
        name, table = path.split(".")[:2]
        effect = twin.effect(name, int(table))
        n = form.fixed.get(f"{name}.{table}.{pair[0]}_lobes", lobes(effect, pair[0]))
        c, s = (fit.point.values.get(k, 0.0) for k in form.parameters)
        own_wave = wave(effect, pair[0], pair[1], n)
        _, _, sd[pair[0]], sd[pair[1]] = sd_of_polar(c, s, V[np.ix_([i, j], [i, j])], own_wave)
        sd[pair[1]] /= n
    for parameter in (*form.parameters, *form.refine):
        if "~" not in parameter.key and parameter in at:
            sd[parameter.key.split(".")[2]] = float(np.sqrt(V[at[parameter], at[parameter]]))
    return IdentifiedEffect(form.effect, form.key, parameters, sd, tie_class)


def calibration_of(
    fit: ParameterFit, V: np.ndarray, parameters: Sequence[FitParameter]
) -> dict[str, tuple[float, float]]:
    """Calibration parameters and standard deviations by name; V (k, k) is the covariance of all parameters."""
    at = {k: i for i, k in enumerate(fit.parameters)}
    return {k.name: (fit.point.values.get(k, 0.0), float(np.sqrt(V[at[k], at[k]]))) for k in parameters}


def evidence_of(base: ParameterFit, best: Hypothesis | None, search: EffectSearch | None) -> dict[str, float]:
    """Sums of squares and excess misfit before and with the effect."""
    evidence = {"chi2_calibrated": base.chi2, "numbers": float(len(base.residual))}
    if search is not None:
        evidence |= {"flagged_excess": search.base_excess, "held_out_excess": search.base_held}
    if best is not None:
        evidence |= {
            "chi2_with_effect": best.fit.chi2,
            "share_gone": best.gone,
            "held_out_excess_with_effect": best.held_out,
        }
    return evidence


def null_sentence(null: dict[str, float]) -> str:
    """Sentence about a combination of parameters that the records do not determine."""
    parts = " ".join(f"{v:+.2f} {n}" for n, v in sorted(null.items(), key=lambda x: -abs(x[1])))
    return f"the calibration has a null vector that the records do not determine: {parts}; its priors hold it"
