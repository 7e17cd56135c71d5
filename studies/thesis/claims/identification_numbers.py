"""Numbers for claims I1 to I12 and N1 on identification, from the study of identification."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from identification import Identification, open_pair, sampling_time
from identification.local.greybox import actuator_poles
from identification.records.prefilter import REST, rest_length
from rotorsim.base.units import TO_HZ, TO_UM
from rotorsim.study.identification_vs_physics import RECIPE, Study, errors
from studies.thesis.claims.rules import points

MS = 1e3
VOLT = 4.5e-6
"""Metres of pin for a volt of its transducer (thesis, eq. C.1)."""
Figures = dict[str, float]


def identification_numbers(study: Study) -> dict[str, Figures]:
    """Numbers by claim and figure; a figure whose records are not there is left out."""
    return {
        "I1": _data(study), "I2": _fits(study, "rest"), "I3": _fits(study, "turning"), "I4": _runout(study),
        "I5": _orders(study), "I6": _surfaces(study), "I7": _ranges(study), "I8": _gains(study),
        "I9": _actuators(study), "I10": _cross(study), "I11": _deviations(study), "I12": _white(study),
        "N1": _computed(study),
    }  # fmt: skip


def identification_left_out(study: Study) -> set[str]:
    """Claims whose records are not there: the points of Paper C, of which a quick grid has six of fifteen."""
    return set() if _has(study, "paper_c") else {"I10"}


def _has(study: Study, name: str) -> bool:
    """Whether all points of this name of the rules have records."""
    return len(study.at(points(name))) >= len(points(name))


def _data(study: Study) -> Figures:
    record, _ = open_pair(study.points[0].source)
    u, Ts = np.asarray(record["reference"].values), sampling_time(record)
    return {"duration": len(u) * Ts, "rate": 1 / Ts, "amplitude": float(np.abs(u).max()),
            "rest": float(min(rest_length(u), REST)), "median": float(RECIPE.median)}  # fmt: skip


def _fits(study: Study, name: str) -> Figures:
    found = study.at(points(name))
    if not found:
        return {}
    both = {"identification": found[0].found["3"].fit, "validation": found[0].validation.get("3", ())}
    return {f"{part}_{axis}": 100 * float(v) for part, fit in both.items() for axis, v in zip("xy", fit, strict=False)}


def _runout(study: Study) -> Figures:
    found = [point.runout for point in study.at(points("runout")) if point.runout is not None]
    return (
        {name: float(a.max()) * TO_UM for name, a in zip(("before", "after"), found[0], strict=True)} if found else {}
    )


def _orders(study: Study) -> Figures:
    if not study.sweep:
        return {}
    mean = {name: 100 * float(np.mean([fits[name] for _, fits in study.sweep])) for name in study.sweep[0][1]}
    figures = {"model_2": mean["Model 2"], "model_3": mean["Model 3"], "difference": mean["Model 3"] - mean["Model 2"]}
    for start, end in (("", ""), ("ahead_", " by prediction")):
        low, knee, high = (mean[f"order {n}{end}"] for n in (4, 6, 8))
        figures |= {f"{start}order_6": knee, f"{start}rise": knee - low, f"{start}beyond": high - knee}
    return figures


def _surfaces(study: Study) -> Figures:
    ratio = study.lpv.rms_hold_out / study.lpv.rms_identification
    return {"median": float(np.median(ratio)), "worst": float(np.max(ratio))}


def _ranges(study: Study) -> Figures:
    """Ends of the ranges over the grid; cross gains in the thesis' sense of rotation."""
    found = study.models("2")
    gain, delay = _stack(found, "static_gain") * TO_UM, _stack(found, "delay") * MS
    wn, zeta = _stack(found, "wn"), _stack(found, "zeta")
    columns = {"w_x": wn[:, 0], "w_y": wn[:, 1], "zeta_x": zeta[:, 0], "zeta_y": zeta[:, 1], "tau_x": delay[:, 0],
               "tau_y": delay[:, 1], "gxx": gain[:, 0, 0], "gxy": -gain[:, 0, 1], "gyx": -gain[:, 1, 0],
               "gyy": gain[:, 1, 1]}  # fmt: skip
    ends = {"low": np.min, "high": np.max}
    return {f"{name}_{end}": float(of(v)) for name, v in columns.items() for end, of in ends.items()}


def _gains(study: Study) -> Figures:
    found, (speed, pressure) = study.models("2"), study.q.T
    gain = np.abs(_stack(found, "static_gain"))
    direct, cross = gain[:, [0, 1], [0, 1]].mean(axis=1), gain[:, [0, 1], [1, 0]].mean(axis=1)
    means = {f"{name}_pressure": _stack(found, key).mean(axis=1)
             for name, key in (("w", "wn"), ("zeta", "zeta"), ("delay", "delay"))}  # fmt: skip
    return {"ratio": float(direct.mean() / cross.mean()), "cross_speed": _correlation(speed, cross),
            **{name: _correlation(pressure, values) for name, values in means.items()}}  # fmt: skip


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.corrcoef(one, other)[0, 1]) if np.ptp(one) and np.ptp(other) else float("nan")


def _actuators(study: Study) -> Figures:
    if not study.actuators:
        return {}
    poles = np.array([actuator_poles(one.theta) for one, _ in study.actuators])
    gains = np.array([np.diag(one.static_gain) for one, _ in study.actuators]) / VOLT
    fits = np.array([fit for _, fit in study.actuators])
    means = {"p1_x": poles[:, 0, 0], "p2_x": poles[:, 0, 1], "p1_y": poles[:, 1, 0], "p2_y": poles[:, 1, 1],
             "gain_x": gains[:, 0], "gain_y": gains[:, 1], "fit_x": 100 * fits[:, 0],
             "fit_y": 100 * fits[:, 1]}  # fmt: skip
    spreads = {"gain_spread": _spread(gains), "pole_spread": _spread(poles)}
    return {name: float(values.mean()) for name, values in means.items()} | spreads


def _spread(values: np.ndarray) -> float:
    """Largest range over the points of any entry over its mean [%]."""
    return float(100 * (np.ptp(values, axis=0) / values.mean(axis=0)).max())


def _cross(study: Study) -> Figures:
    """Over the points of Paper C, all of which must be there."""
    found = [point.validation["2"] for point in study.at(points("paper_c")) if point.validation]
    if len(found) < len(points("paper_c")):
        return {}
    fits = 100 * np.array(found)
    found_by = {"mean": fits.mean(axis=0), "sd": fits.std(axis=0, ddof=1)}
    return {f"{name}_{axis}": float(values[k]) for name, values in found_by.items() for k, axis in enumerate("xy")}


def _deviations(study: Study) -> Figures:
    """Root mean squares over the centres, where nothing was fitted."""
    if not study.centres:
        return {}
    held = [point.found["2"] for point in study.centres]
    surfaces = [study.lpv_2.derived(r.speed, r.pressure) for r in held]
    rms = {key: np.sqrt(np.mean(np.square(_stack(held, key) - [s[key] for s in surfaces]), axis=0))
           for key in ("wn", "zeta", "delay", "static_gain")}  # fmt: skip
    return {
        "w_1": rms["wn"][0] * TO_HZ, "w_2": rms["wn"][1] * TO_HZ, "zeta_1": float(rms["zeta"][0]),
        "zeta_2": float(rms["zeta"][1]), "tau_x": rms["delay"][0] * MS, "tau_y": rms["delay"][1] * MS,
        "gain": float(rms["static_gain"].mean()) * TO_UM,
    }  # fmt: skip


def _white(study: Study) -> Figures:
    return {"white": float(np.mean([one.residuals.white for one in study.results]))}


def _computed(study: Study) -> Figures:
    """Largest difference of a frequency of the linearised physics from Model 2's, over the grid [%]."""
    return {"largest": float(100 * np.abs(errors(study, "2")["wn"]).max())}


def _stack(found: Iterable[Identification], key: str) -> np.ndarray:
    return np.array([getattr(one, key) for one in found])
