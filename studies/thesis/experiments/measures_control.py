"""Figures of the claims on control, measured on models of short records and by short runs of one plant.

Laws are those of the study, made again on models of the changed plant. Fewer points and shorter records than in the
study, as each function states; so a figure here differs from the study's even at a factor of 1, most by up to 3 %,
those of C2 and C7 by more. The README of this study lists how far and why.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rotorsim.analysis import critical_speeds, whirl_onset
from rotorsim.base.units import KRPM, MPA, RIG_SAMPLE, TO_HZ
from rotorsim.control import DesignError, Law
from rotorsim.control.catalogue import make_spec, module_of
from rotorsim.control.designs import hinf, lead
from rotorsim.control.plants import Model, sampled_plant
from rotorsim.control.sampled_loop import closed_poles, law_system
from rotorsim.plant import Plant
from rotorsim.verify.runs import run_rows, steady_rows
from rotorsim.verify.transients import amplitudes, impact_responses, safe_speed
from studies.thesis.claims.control_numbers import interpolated, numbers_of
from studies.thesis.claims.rules import points
from studies.thesis.control_cases import ringing
from studies.thesis.control_study import DESIGNS, OPEN, ControlStudy
from studies.thesis.experiments.limit import least_level
from studies.thesis.experiments.measures_identification import Figures, local, lpv

HITS = ((0.0, 0.433), (1.5, 0.7), (3.0, 0.567), (6.0, 0.433))
"""Points [krpm, MPa] that stand for the twenty of E.5.1."""
HIGHEST = 12 * KRPM
"""Speed [rad/s] that a run-up ends at."""


def _laws(model: Model, names: Iterable[str]) -> dict[str, Law]:
    """The study's laws on a model; those that their design refuses are left out."""
    made = {}
    for name in names:
        design, preset, changes = DESIGNS[name]
        try:
            made[name] = module_of(design).design(model, make_spec(design, list(changes), preset))
        except DesignError:
            continue
    return made


def _claims(numbers: Iterable[str], found: ControlStudy, model: Model) -> Figures:
    return {f"{claim}.{name}": v for claim in numbers for name, v in numbers_of(claim, found, model).items()}


def _rung(plant: Plant, laws: dict[str, Law], at: str) -> ControlStudy:
    """A study that holds laws and the damping of hits with and without them."""
    found = ControlStudy(laws=laws)
    found.ringing = {name: ringing(plant, law, points(at)) for name, law in [(OPEN, None), *laws.items()]}
    return found


def placement(plant: Plant, shipped: Plant) -> Figures:
    """C1, on a model of one record."""
    model = local(plant, *points("placement_design")[0]).model
    return _claims(["C1"], _rung(plant, _laws(model, ["placement"]), "placement"), model)


def reduced(plant: Plant, shipped: Plant) -> Figures:
    """C2, on surfaces over nine points."""
    model = lpv(plant)
    return _claims(["C2"], _rung(plant, _laws(model, ["hinf reduced"]), "reduced_hits"), model)


def decentralised(plant: Plant, shipped: Plant) -> Figures:
    """C3 and C4, on a model of one record."""
    model = local(plant, *points("decentralised")[0]).model
    found = _rung(plant, _laws(model, ["p", "softening", "hardening"]), "decentralised")
    return _claims(["C3", "C4"], found, model) | {"C4.radius": _radius(model)}


def _radius(model: Model) -> float:
    """Largest pole radius of the loop with hardening control, which its design refuses from one on."""
    (q,) = points("decentralised")
    law = lead.design(model, replace(lead.HARDENING, check=False))
    return float(np.abs(closed_poles(sampled_plant(model, *q), law_system(law, *q))).max())


def limit(plant: Plant, shipped: Plant) -> Figures:
    """C2: level of Fig. B.4's sensitivity below which no linear controller keeps, on a model of one record."""
    (q,) = points("reduced_design")
    return {"C2.least": least_level(local(plant, *q).model, *q)}


def nominal(plant: Plant, shipped: Plant) -> Figures:
    """C5, on surfaces over nine points."""
    return _claims(["C5"], ControlStudy(), lpv(plant))


def interpolation(plant: Plant, shipped: Plant) -> Figures:
    """C10 with surfaces of second order, on a model over nine points: points of the fine grid that they leave unstable,
    and excess of the imbalance response at the held-out ones over the local designs'."""
    excess, unstable = interpolated(lpv(plant))
    return {"C10.unstable": float(unstable), "C10.excess": excess}


def hits(plant: Plant, shipped: Plant) -> Figures:
    """C7 at `HITS`: response with H-infinity, the thesis' weights, over that without control."""
    law = _nominal_law(plant)
    found = [[impact_responses(plant, one, w * KRPM, p * MPA) for w, p in HITS] for one in (law, None)]
    closed, open_ = (np.array([one.response for one in some]) for some in found)
    return {f"C7.hinf_{axis}": float((closed / open_)[:, k].mean()) for k, axis in enumerate("xy")}


def _nominal_law(plant: Plant) -> Law:
    """H-infinity with the thesis' weights on a model of one record in the middle of the range."""
    return hinf.design(local(plant, *points("nominal")[0]).model, hinf.PRESETS["thesis"])


def run_end(plant: Plant, shipped: Plant) -> Figures:
    """C8 at the end of the run-up alone: amplitude with H-infinity of that without control, at a constant speed."""
    amplitude = []
    for law in (_nominal_law(plant), None):
        run = run_rows(plant, law, steady_rows(*points("run_up")[0], 3.0))
        amplitude.append(np.asarray(amplitudes(run, len(run.table) - round(0.35 / RIG_SAMPLE), len(run.table))))
    return {f"C8.hinf_{axis}": float(100 * amplitude[0][k] / amplitude[1][k]) for k, axis in enumerate("xy")}


def safe(plant: Plant, shipped: Plant) -> Figures:
    """C11: where the open loop leaves its circle, at 2 krpm/s."""
    found = safe_speed(plant, None, stop=HIGHEST, rate=2 * KRPM)
    return {"C11.open": found.speed * TO_HZ} if found.left else {}


def whirl(plant: Plant, shipped: Plant) -> Figures:
    """C12 of the linearised plant."""
    at = np.array([pressure for _, pressure in points("whirl")])
    found, first = whirl_onset(plant, at), critical_speeds(plant, at, (1,)).critical_speed.values[:, 0, 0]
    names = [f"{pressure / MPA * 10:.0f}" for pressure in at]
    both = {"onset": found.onset_speed.values / first, "frequency": found.onset_ratio.values}
    return {f"C12.{key}_{name}": float(v[k]) for key, v in both.items() for k, name in enumerate(names)}
