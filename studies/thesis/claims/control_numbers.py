"""Numbers for claims C1 to C12 on control and N2 to N5, from the study of control."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from identification.lpv_model import LpvModel
from rotorsim.base.rounding import decays
from rotorsim.base.units import KRPM, MPA, TO_HZ
from rotorsim.control.designs import h2_scheduled, hinf
from rotorsim.control.designs.h2_scheduled import fit, held_out
from rotorsim.control.designs.hinf_synthesis import closed, controller, mixed_sensitivity, solve
from rotorsim.control.law import Law
from rotorsim.control.law_from_system import table_axes
from rotorsim.control.plants import Model, design_plant, sampled_plant, scaled_model
from rotorsim.control.sampled_loop import closed_poles, law_system, model_loop, root_locus, sweep
from rotorsim.control.systems import System, gain, largest, peak_gain, response
from studies.thesis.claims.rules import points
from studies.thesis.control_study import OPEN, ControlStudy
from studies.thesis.printed import lead_figures, proportional_figures

BAND = (70.0, 190.0)
"""Frequencies [Hz] between which S is cut (thesis, B.5)."""
GRID = 16
"""Points along each axis over which the worst gamma is looked for (thesis, E.3.1)."""
GAINS = np.linspace(-2.0, 2.0, 4001)
"""Gains [V/um] among which the stable ones are looked for."""
HIGHEST = 600.0
"""Frequency [Hz] up to which poles belong to the rotor."""
Figures = dict[str, float]
Part = Callable[[ControlStudy, LpvModel], Figures]


def control_numbers(found: ControlStudy, model: LpvModel) -> dict[str, Figures]:
    """Numbers by claim and figure; those of a law that was refused or not made are left out."""
    return {number: numbers_of(number, found, model) for number in dict.fromkeys(number for number, _, _ in _PARTS)}


def control_left_out(found: ControlStudy) -> set[str]:
    """Claims whose figures are missing because a quick study makes no law for them, and not because one was refused."""
    needed: dict[str, set[str]] = {}
    for number, names, _ in _PARTS:
        needed.setdefault(number, set()).update(names)
    return {
        number
        for number, names in needed.items()
        if not names.isdisjoint(found.left_out) and names.isdisjoint(found.refused)
    }


def laws_of(claims: Collection[str]) -> set[str]:
    """Names of the laws that the figures of these claims need."""
    return {name for number, needed, _ in _PARTS if number in claims for name in needed}


def numbers_of(claim: str, found: ControlStudy, model: Any) -> Figures:
    """Numbers of one claim, from the laws that `found` holds; a local model does where its figures are at one point."""
    known: Figures = {}
    for number, needed, part in _PARTS:
        if number == claim and found.laws.keys() >= set(needed):
            known |= part(found, model)
    return known


def _placement(found: ControlStudy, model: LpvModel) -> Figures:
    open_, closed_ = (_ringing(found, name, "placement")["zeta"][1] for name in (OPEN, "placement"))
    return {"open": open_, "closed": closed_, "lift": closed_ / open_}


def _decrements(found: ControlStudy, name: str, words: tuple[str, str, str]) -> Figures:
    """Vertical damping at the thesis' pressure by the logarithmic decrement, without and with a law; a ratio."""
    if not found.fitted:
        return {}
    open_, closed_ = (_at_point(found.fitted[one], "placement_thesis")["decrement"] for one in (OPEN, name))
    return dict(zip(words, (open_, closed_, closed_ / open_), strict=True))


def _placement_thesis(found: ControlStudy, model: LpvModel) -> Figures:
    return _decrements(found, "placement", ("open_8", "closed_8", "lift_8"))


def _printed_law(found: ControlStudy, model: LpvModel) -> Figures:
    return {k: v for k, v in _decrements(found, "printed", ("open", "closed", "lift")).items() if k != "open"}


def _ringing(found: ControlStudy, name: str, at: str, number: int = 0) -> dict:
    """The ring-down at a named point of the rules."""
    return _at_point(found.ringing[name], at, number)


def _at_point(rows: list[dict], at: str, number: int = 0) -> dict:
    """The row at a named point of the rules."""
    speed, pressure = points(at)[number]
    return next(row for row in rows if np.allclose((row["speed"], row["pressure"]), (speed, pressure), rtol=1e-9))


def _reduced(found: ControlStudy, model: LpvModel) -> Figures:
    loops = [model_loop(found.laws["hinf reduced"], model, *q) for q in points("realisations")]
    frequency, S = loops[0].frequency, np.array([largest(loop.So) for loop in loops])
    band = S[:, (frequency > BAND[0]) & (frequency < BAND[1])]
    figures = {"band_high": band.max(), "band_low": band.min(), "low": S[:, 0].max(), "peak": S.max(),
               "peak_at": frequency[S.max(axis=0).argmax()]}  # fmt: skip
    for k, name in enumerate(("4", "7")):
        for word, law in (("open", OPEN), ("closed", "hinf reduced")):
            figures[f"{word}_{name}"] = _ringing(found, law, "reduced_hits", k)["zeta"][0]
    return {name: float(value) for name, value in figures.items()}


def _proportional(found: ControlStudy, model: LpvModel) -> Figures:
    (q,) = points("decentralised")
    plant = sampled_plant(model, *q)
    law = found.laws["p"]
    (w0, zeta0), (w1, zeta1) = _modes(np.linalg.eigvals(plant.A), law), _modes(_loop_poles(law, model, *q), law)
    alone, held = (_ringing(found, name, "decentralised") for name in (OPEN, "p"))
    figures = {"open_w_1": w0[0] * TO_HZ}
    for k, axis in enumerate("xy"):
        figures |= {f"w_{k + 1}": w1[k] / w0[k], f"zeta_{k + 1}": zeta1[k], f"lift_{k + 1}": zeta1[k] / zeta0[k]}
        figures |= {f"measured_w_{axis}": held["wn"][k] / alone["wn"][k], f"measured_zeta_{axis}": held["zeta"][k]}
    return {name: float(value) for name, value in figures.items()}


def _two_modes(found: ControlStudy, model: LpvModel) -> Figures:
    """Both modes of a fit, slowest first, as Tables C.3 and C.4 list them."""
    if not found.fitted:
        return {}
    held, alone = (_at_point(found.fitted[name], "decentralised") for name in ("p", OPEN))
    figures = {f"fit_w_{k + 1}": held["wn"][k] / alone["wn"][k] for k in range(2)}
    return figures | {f"fit_zeta_{k + 1}": held["zeta"][k] for k in range(2)}


def _continuous_p(found: ControlStudy, model: LpvModel) -> Figures:
    """C3's model before it is sampled, as Tables C.3 and C.4 expect it."""
    figures = proportional_figures(_scaled(model))
    return _continuous({name: value for name, value in figures.items() if name != "open_w_1"})


def _continuous_lead(found: ControlStudy, model: LpvModel) -> Figures:
    """C4's sensitivities and gains before the laws are sampled, as Paper D draws them."""
    return _continuous(lead_figures(_scaled(model)))


def _continuous(figures: Figures) -> Figures:
    return {f"continuous_{name}": value for name, value in figures.items()}


def _scaled(model: LpvModel) -> System:
    return scaled_model(model, *points("decentralised")[0])


def _loop_poles(law: Law, model: LpvModel, speed: float, pressure: float) -> np.ndarray:
    return closed_poles(sampled_plant(model, speed, pressure, law.Ts), law_system(law, speed, pressure))


def _modes(z: np.ndarray, law: Law) -> tuple[np.ndarray, np.ndarray]:
    """Natural frequencies [rad/s] and damping ratios (2,) of the two slowest oscillating poles; NaN without."""
    s = np.log(z[np.abs(z) > 1e-9].astype(complex)) / law.Ts
    s = s[(s.imag > 1.0) & (np.abs(s) < 2 * np.pi * HIGHEST)]
    s = np.append(s[np.argsort(np.abs(s))], [np.nan, np.nan])[:2]
    return np.abs(s), -s.real / np.abs(s)


def _softening(found: ControlStudy, model: LpvModel) -> Figures:
    return _lead(found, model, "softening") | {f"softening_{axis}": _lift(found, "softening", k)
                                               for k, axis in enumerate("xy")}  # fmt: skip


def _hardening(found: ControlStudy, model: LpvModel) -> Figures:
    return _lead(found, model, "hardening") | {"hardening_y": _lift(found, "hardening", 1)}


def _lead(found: ControlStudy, model: LpvModel, name: str) -> Figures:
    """Largest |S| at the model's two modes, and its peak."""
    (q,) = points("decentralised")
    law = found.laws[name]
    modes = _modes(np.linalg.eigvals(sampled_plant(model, *q).A), law)[0] * TO_HZ
    return {f"{name}_modes": float(largest(model_loop(law, model, *q, modes).So).max()),
            f"{name}_peak": model_loop(law, model, *q).peak}  # fmt: skip


def _lift(found: ControlStudy, name: str, axis: int) -> float:
    held, alone = (_ringing(found, one, "decentralised")["zeta"][axis] for one in (name, OPEN))
    return float(held / alone)


def _stable(found: ControlStudy, model: LpvModel) -> Figures:
    """Stable gains of the x loop alone; the thesis' D writes u = -K y."""
    (q,) = points("decentralised")
    low, high = stable_gains(sampled_plant(model, *q), gain(np.diag([1.0, 0.0])), GAINS)
    return {"gain_low": -high, "gain_high": -low}


def _nominal(found: ControlStudy, model: LpvModel) -> Figures:
    weights = hinf.Spec().weights
    P = mixed_sensitivity(design_plant(model, *points("nominal")[0]), weights)
    best = solve(P)
    K = controller(P, hinf.Spec().backoff * best)
    speeds, pressures = (np.linspace(model.low[i], model.high[i], GRID) for i in range(2))
    norms = np.array([[peak_gain(closed(mixed_sensitivity(design_plant(model, w, p), weights), K)) for p in pressures]
                      for w in speeds])  # fmt: skip
    i, j = np.unravel_index(norms.argmax(), norms.shape)
    there = peak_gain(closed(mixed_sensitivity(design_plant(model, 1.86 * KRPM, 0.3 * MPA), weights), K))
    return {"gamma": float(best), "worst": float(norms[i, j]), "worst_speed": float(speeds[i] / KRPM),
            "worst_pressure": float(pressures[j] / MPA), "ridge": float(there / max(norms.max(), there))}  # fmt: skip


def _lpv(found: ControlStudy, model: LpvModel) -> Figures:
    law = found.laws["lpv thesis"]
    return {"gamma": float(law.about["optimal_gamma"]), "fine": float("nan") if law.gamma is None else law.gamma}


def _hits(found: ControlStudy, model: LpvModel) -> Figures:
    lpv, robust = (found.ratio(f"{name} thesis") for name in ("lpv", "hinf"))
    effort = found.effort("lpv thesis") / found.effort("hinf thesis")
    means = {"lpv": lpv, "hinf": robust}
    figures = {f"{name}_{axis}": ratio[:, k].mean() for name, ratio in means.items() for k, axis in enumerate("xy")}
    figures |= {f"effort_{axis}": effort[k] for k, axis in enumerate("xy")}
    figures |= {f"{name}_raised": np.count_nonzero(~(ratio.max(axis=1) <= 1)) for name, ratio in means.items()}
    return {name: float(value) for name, value in figures.items()}


def _next_to_film(found: ControlStudy, model: LpvModel) -> Figures:
    """Ratios of means over the twenty points, as in Table E.3, of hits next to the film."""
    if not found.near_film:
        return {}
    names = {"lpv": "lpv thesis", "hinf": "hinf thesis", "open": OPEN}
    response, effort = ({short: np.array([row[key] for row in found.near_film[name]]) for short, name in names.items()}
                        for key in ("response", "effort"))  # fmt: skip
    alone, cost = response["open"], effort["lpv"].mean(axis=0) / effort["hinf"].mean(axis=0)
    figures = {f"near_effort_{axis}": cost[k] for k, axis in enumerate("xy")}
    for name in ("lpv", "hinf"):
        ratio = response[name].mean(axis=0) / alone.mean(axis=0)
        figures |= {f"near_{name}_{axis}": ratio[k] for k, axis in enumerate("xy")}
        raised = ~((response[name] / alone).max(axis=1) <= 1)
        figures |= {f"near_{name}_raised": np.count_nonzero(raised)}
    return {name: float(value) for name, value in figures.items()}


def _energies(found: ControlStudy, model: LpvModel) -> Figures:
    """V_p of y over that of x without control, means of the twenty points, of hits next to the film."""
    if not found.near_film:
        return {}
    x, y = np.array([row["response"] for row in found.near_film[OPEN]]).mean(axis=0)
    return {"ratio": float(y / x)}


def _held_out(found: ControlStudy, model: LpvModel) -> Figures:
    lpv, robust = found.held_ratio("lpv"), found.held_ratio("hinf")
    return {"rig_lpv_worst": float(lpv.max()), "rig_hinf_worst": float(robust.max()),
            "rig_lpv_over_hinf": float(lpv.mean() / robust.mean()),
            "rig_effort": float(found.held_effort("lpv").mean() / found.held_effort("hinf").mean())}  # fmt: skip


def _runup_lpv(found: ControlStudy, model: LpvModel) -> Figures:
    return _runup(found, "lpv")


def _runup_hinf(found: ControlStudy, model: LpvModel) -> Figures:
    return _runup(found, "hinf")


def _runup(found: ControlStudy, name: str) -> Figures:
    held, alone = (found.runup[one]["amplitude"] for one in (f"{name} thesis", OPEN))
    return {f"{name}_{axis}": 100 * held[k] / alone[k] for k, axis in enumerate("xy")}


def _table_lpv(found: ControlStudy, model: LpvModel) -> Figures:
    return _tabled(found, "lpv")


def _table_hinf(found: ControlStudy, model: LpvModel) -> Figures:
    return _tabled(found, "hinf")


def _tabled(found: ControlStudy, name: str) -> Figures:
    """Amplitudes of a law that takes the slow-roll runout off, of the open loop's, which nothing is read in."""
    if f"{name} thesis" not in found.tabled:
        return {}
    held, alone = found.tabled[f"{name} thesis"]["amplitude"], found.runup[OPEN]["amplitude"]
    return {f"table_{name}_{axis}": 100 * held[k] / alone[k] for k, axis in enumerate("xy")}


def _runup_peaks(found: ControlStudy, model: LpvModel) -> Figures:
    return {f"{name}_{axis}": found.runup[OPEN][name][k] for name in ("half", "third") for k, axis in enumerate("xy")}


def _settings(found: ControlStudy, model: LpvModel) -> Figures:
    law = found.laws["lpv"]
    return {"refresh": 1 / (law.refresh * law.Ts), "rate": 1 / law.Ts, "limit": law.limit}


def _scheduled(found: ControlStudy, model: LpvModel) -> Figures:
    law, (q,) = found.laws["h2_scheduled"], points("cell")
    z = np.array([np.exp(1j * q[0] * law.Ts)])
    local, mine, youla = (largest(response(law_system(found.laws[name], *q), z))[0]
                          for name in ("local", "h2_scheduled", "youla"))  # fmt: skip
    moved = found.cell
    return {"states": float(law.order), "order": float(law.about["order"]), "gain": float(mine / local),
            "youla_gain": float(youla / mine), "amplitude": moved["h2_scheduled"] / moved["local"],
            "youla": moved["youla"] / moved["h2_scheduled"],
            "rejection": moved[OPEN] / moved["h2_scheduled"]}  # fmt: skip


def _second_order(found: ControlStudy, model: LpvModel) -> Figures:
    """NaN, which is not met, where a loop of the range is unstable: it has no steady response to an imbalance."""
    excess, unstable = interpolated(model)
    return {"second_order": float("nan") if unstable else excess}


def interpolated(model: Model, order: int = 2) -> tuple[float, int]:
    """Excess of the imbalance response held out by surfaces of an order, NaN where a loop is unstable; unstable points.

    The response is that of the H2 law between its design points; the points are those of the design's fine grid.
    """
    spec = h2_scheduled.Spec()
    speeds, pressures = table_axes(model, spec.grid, spec.slowest)
    at, out = np.array([(w, p) for w in speeds for p in pressures]), held_out(len(speeds), len(pressures))
    local = [h2_scheduled.local_controller(model, spec, w, p) for w, p in at]
    law = h2_scheduled.scheduled(model, spec, fit(at[~out], [local[k] for k in np.flatnonzero(~out)], order))
    fine = [np.linspace(axis[0], axis[-1], n) for axis, n in zip((speeds, pressures), spec.fine, strict=True)]
    unstable = sweep(law, model, *fine).unstable
    if any(sweep(law, model, *np.split(point, 2)).unstable for point in at[out]):
        return float("nan"), unstable
    held = [local[k] for k in np.flatnonzero(out)]
    return h2_scheduled.imbalance_excess(model, spec, law, at[out], held), unstable


def _safe(found: ControlStudy, model: LpvModel) -> Figures:
    return {"open": found.safe[OPEN]["speed"] * TO_HZ if found.safe[OPEN]["left"] else float("nan")}


def _extended(found: ControlStudy, model: LpvModel) -> Figures:
    return {"gain": found.safe["hinf critical"]["speed"] / found.safe[OPEN]["speed"]}


def _whirl(found: ControlStudy, model: LpvModel) -> Figures:
    share = found.safe[OPEN]["share"]
    names = [f"{pressure / MPA * 10:.0f}" for _, pressure in points("whirl")]
    figures = {f"{key}_{name}": found.whirl[key][k] for key in ("onset", "frequency") for k, name in enumerate(names)}
    return figures | ({} if share is None else {"run_up": share})


def _coast(found: ControlStudy, model: LpvModel) -> Figures:
    return {name: float(rubs) for name, rubs in found.coast.items()}


def _static(found: ControlStudy, model: LpvModel) -> Figures:
    if not found.static_map:
        return {}
    rms = {f"rms_{p}{u}": found.static_map["rms"][i][j] for i, p in enumerate("xy") for j, u in enumerate("xy")}
    return {"largest": found.static_map["largest"]} | rms


_PARTS: tuple[tuple[str, tuple[str, ...], Part], ...] = (
    ("C1", ("placement",), _placement),
    ("C1", ("placement",), _placement_thesis),
    ("C2", ("hinf reduced",), _reduced),
    ("C3", ("p",), _proportional),
    ("C3", ("p",), _two_modes),
    ("C3", (), _continuous_p),
    ("C4", (), _stable),
    ("C4", (), _continuous_lead),
    ("C4", ("softening",), _softening),
    ("C4", ("hardening",), _hardening),
    ("C5", (), _nominal),
    ("C6", ("lpv thesis",), _lpv),
    ("C7", ("lpv thesis", "hinf thesis"), _hits),
    ("C7", ("lpv thesis", "hinf thesis"), _next_to_film),
    ("C7", ("lpv", "hinf"), _held_out),
    ("C8", (), _runup_peaks),
    ("C8", ("lpv thesis",), _runup_lpv),
    ("C8", ("hinf thesis",), _runup_hinf),
    ("C8", ("lpv thesis",), _table_lpv),
    ("C8", ("hinf thesis",), _table_hinf),
    ("C9", ("lpv",), _settings),
    ("C10", ("h2_scheduled", "local", "youla"), _scheduled),
    ("C10", ("h2_scheduled",), _second_order),
    ("C11", (), _safe),
    ("C11", ("hinf critical",), _extended),
    ("C12", (), _whirl),
    ("N2", (), _coast),
    ("N3", (), _static),
    ("N4", (), _energies),
    ("N5", ("printed",), _printed_law),
)
"""Claim, the laws that its figures need, and what makes them."""


def stable_gains(plant: System, controller: System, gains: np.ndarray) -> tuple[float, float]:
    """Ends of the stretch of stable gains round zero; NaN where zero itself is not stable."""
    good = np.array([decays(row) for row in root_locus(plant, controller, gains)])
    at = int(np.abs(gains).argmin())
    if not good[at]:
        return float("nan"), float("nan")
    low = at - int(np.argmin(np.append(good[at::-1], False))) + 1
    high = at + int(np.argmin(np.append(good[at:], False))) - 1
    return float(gains[low]), float(gains[high])
