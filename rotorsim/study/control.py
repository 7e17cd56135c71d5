"""The control half of the study: designs on a model, each on the nonlinear plant; resumable stage by stage."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from identification.lpv import LpvModel
from rotorsim.control import DesignError, Law, h2_scheduled, load_law
from rotorsim.control.analysis import overview
from rotorsim.control.designs import make_spec, module_of
from rotorsim.control.plants import KRPM
from rotorsim.plant import Plant
from rotorsim.sampling import SAMPLE
from rotorsim.study.cache import kept, key_of
from rotorsim.verify import safe_speed
from rotorsim.verify.impacts import POINTS, impact_energies
from rotorsim.verify.running import run_rows, steady_rows
from rotorsim.verify.transients import amplitude, runup

DESIGNS = {
    "p": ("p", ""),
    "softening": ("lead", "softening"),
    "hardening": ("lead", "hardening"),
    "placement": ("placement", ""),
    "lqr": ("lqr", ""),
    "hinf thesis": ("hinf", "thesis"),
    "hinf": ("hinf", "rig"),
    "lpv": ("lpv", "rig"),
    "h2_scheduled": ("h2_scheduled", ""),
    "youla": ("youla", ""),
}
"""Name in the study: design and preset."""
CELL = (5.72 * KRPM, 0.678e6)
"""Centre of a cell of the H2 grid (thesis, figure G.6)."""
RUN_UP = ("p", "softening", "lqr", "hinf", "lpv")
Told = Callable[[str], None]


@dataclass
class ControlStudy:
    """What the stages found, as plain values by law: overview, impacts, run-up, cell; laws themselves."""

    laws: dict[str, Law] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    overview: dict[str, dict[str, Any]] = field(default_factory=dict)
    impacts: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    runup: dict[str, float] = field(default_factory=dict)
    safe: dict[str, dict[str, Any]] = field(default_factory=dict)
    cell: dict[str, float] = field(default_factory=dict)
    cell_model: dict[str, float] = field(default_factory=dict)

    def ratio(self, name: str) -> np.ndarray:
        """Closed over open impact energy (20, 2)."""
        closed, open_ = (np.array([e["response"] for e in self.impacts[key]]) for key in (name, "open loop"))
        return closed / open_

    def effort(self, name: str) -> np.ndarray:
        """Mean control energy (2,) [V/N]."""
        return np.array([e["effort"] for e in self.impacts[name]]).mean(axis=0)

    def damping(self, name: str) -> float:
        """Smallest damping ratio of the answers to hits."""
        return float(min(e["damping"] for e in self.impacts[name]))


def control_study(plant: Plant, model: LpvModel, folder: Path, tell: Told | None = None) -> ControlStudy:
    """Design, verify and run up; what an earlier call with the same model, machine and sources found is kept."""
    say, found = tell or (lambda _: None), ControlStudy()
    model_text = json.dumps(model.to_dict(), sort_keys=True)
    for name, (design, preset) in DESIGNS.items():
        say(f"design {name}")
        _design(found, model, folder, name, design, preset, key_of(model_text, design, preset))
    _local(found, model)
    machine = plant.machine.hash
    cases: dict[str, Law | None] = {"open loop": None, **found.laws}
    for name, law in cases.items():
        if name in ("youla", "local"):
            continue
        say(f"hits: {name}")
        key = key_of("impacts", machine, law.hash if law else "")
        found.impacts[name] = kept(folder, "hits", key, partial(_impacts, plant, law))
    for name in ("open loop", *RUN_UP):
        if name in cases:
            say(f"run-up: {name}")
            law = cases[name]
            key = key_of("runup", machine, law.hash if law else "")
            told = kept(folder, "runup", key, partial(_run_up, plant, law))
            found.runup[name], found.safe[name] = told["amplitude"], told["safe"]
    for name in ("open loop", "local", "h2_scheduled", "youla"):
        if name in cases:
            say(f"imbalance between design points: {name}")
            law = cases[name]
            key = key_of("cell", machine, law.hash if law else "")
            found.cell[name] = kept(folder, "cell", key, partial(_cell, plant, law))
    return found


def _design(found: ControlStudy, model: LpvModel, folder: Path, name: str, design: str, preset: str, key: str) -> None:
    path = folder / f"law-{name.replace(' ', '_')}-{key}.json"
    if not path.exists():
        try:
            law = module_of(design).design(model, make_spec(design, (), preset))
        except DesignError as error:
            found.refused[name] = str(error)
            return
        folder.mkdir(parents=True, exist_ok=True)
        law.save(path)
    law = found.laws[name] = load_law(path)
    if name != "youla":
        found.overview[name] = kept(folder, "overview", key, lambda: overview(law, model))


def _local(found: ControlStudy, model: LpvModel) -> None:
    from rotorsim.control.loops import law_system

    found.laws["local"] = h2_scheduled.local(model, *CELL)
    found.cell_model["open loop"] = h2_scheduled.imbalance_response(model, None, *CELL)
    for name in ("local", "h2_scheduled", "youla"):
        if name in found.laws:
            K = law_system(found.laws[name], *CELL)
            found.cell_model[name] = h2_scheduled.imbalance_response(model, K, *CELL)


def _impacts(plant: Plant, law: Law | None) -> list[dict[str, Any]]:
    return [asdict(impact_energies(plant, law, *q)) for q in POINTS]


def _run_up(plant: Plant, law: Law | None) -> dict[str, Any]:
    run = runup(plant, law, 0.5 * KRPM, 0.7e6, 6 * KRPM)
    half = len(run.table) // 2
    safe = safe_speed(plant, law, stop=36 * KRPM, rate=2 * KRPM)
    tail = safe.run.disc[-round(0.2 / SAMPLE) :, 1]
    spectrum = np.abs(np.fft.rfft((tail - tail.mean()) * np.hanning(len(tail))))
    whirl = float(np.fft.rfftfreq(len(tail), SAMPLE)[spectrum.argmax()])
    last = float(safe.run.column("speed")[-1])
    told = {"speed": safe.speed, "left": safe.left, "why": safe.why, "whirl_hz": whirl, "last": last}
    told["onset"] = _onset(safe.run.disc, safe.run.column("speed"))
    return {"amplitude": amplitude(run, half - round(0.35 / SAMPLE), half), "safe": told}


def _onset(disc: np.ndarray, speed: np.ndarray) -> float | None:
    """Speed [rad/s] from which on the parts below 0.7 of the shaft's frequency stay above all others; None if never."""
    window = round(0.2 / SAMPLE)
    n = len(disc) // window
    y = disc[: n * window, 1].reshape(n, window)
    heights = np.abs(np.fft.rfft((y - y.mean(axis=1, keepdims=True)) * np.hanning(window), axis=1))
    frequency, mean = np.fft.rfftfreq(window, SAMPLE), speed[: n * window].reshape(n, window).mean(axis=1)
    below = frequency[heights.argmax(axis=1)] < 0.7 * mean / (2 * np.pi)
    if not below[-1]:
        return None
    return float(mean[n - int(np.argmin(np.append(below[::-1], False)))])


def _cell(plant: Plant, law: Law | None) -> float:
    run = run_rows(plant, law, steady_rows(*CELL, 3.0))
    return amplitude(run, len(run.table) // 2, len(run.table), "disc_measured")
