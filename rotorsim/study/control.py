"""The control half of the study: designs on a model, each on the nonlinear plant; stage by stage, on some processes."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from identification.lpv import LpvModel
from rotorsim.control import Law, h2_scheduled, load_law
from rotorsim.control.loops import law_system
from rotorsim.plant import Plant
from rotorsim.study.cache import key_of
from rotorsim.study.control_cases import CELL
from rotorsim.study.pool import Case, Told, run_cases

HOME = "rotorsim.study.control_cases"
OPEN = "open loop"
DESIGNS = {
    "lpv": ("lpv", "rig"),
    "lpv mild": ("lpv", "mild"),
    "lpv thesis": ("lpv", "thesis"),
    "h2_scheduled": ("h2_scheduled", ""),
    "p": ("p", ""),
    "softening": ("lead", "softening"),
    "hardening": ("lead", "hardening"),
    "placement": ("placement", ""),
    "lqr": ("lqr", ""),
    "hinf": ("hinf", "rig"),
    "hinf mild": ("hinf", "mild"),
    "hinf thesis": ("hinf", "thesis"),
    "youla": ("youla", ""),
}
"""Name in the study: design and preset; what takes longest comes first."""
RUN_UP = ("lpv", "hinf")
EXTENDED = ("p", "softening", "placement", "lqr", "hinf", "lpv", "h2_scheduled")
BIASED = {"hinf, bias y +1.5 V": ("hinf", (0.0, 1.5)), "hinf, bias y -1.5 V": ("hinf", (0.0, -1.5))}
"""Run-ups with a constant reference, which moves the rotor in its bearing."""
BY_SIZE = ("hinf thesis", "hinf", "p")
VERIFIED = ("hinf", "lpv")


@dataclass
class ControlStudy:
    """What the stages found, as plain values by law; laws themselves."""

    laws: dict[str, Law] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    overview: dict[str, dict[str, Any]] = field(default_factory=dict)
    impacts: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    by_size: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    runup: dict[str, float] = field(default_factory=dict)
    safe: dict[str, dict[str, Any]] = field(default_factory=dict)
    cell: dict[str, dict[str, float]] = field(default_factory=dict)
    cell_model: dict[str, float] = field(default_factory=dict)
    flipped: dict[str, float] = field(default_factory=dict)
    verified: dict[str, dict[str, Any]] = field(default_factory=dict)

    def ratio(self, name: str) -> np.ndarray:
        """Closed over open impact energy (20, 2)."""
        closed, open_ = (np.array([e["response"] for e in self.impacts[key]]) for key in (name, OPEN))
        return closed / open_

    def effort(self, name: str) -> np.ndarray:
        """Mean control energy (2,) [V/N]."""
        return np.array([e["effort"] for e in self.impacts[name]]).mean(axis=0)

    def damping(self, name: str) -> float:
        """Smallest damping ratio of the answers to hits."""
        return float(min(e["damping"] for e in self.impacts[name]))


def _silent(name: str, done: int, of: int) -> None:
    pass


def control_study(
    plant: Plant, model: LpvModel, folder: Path, told: Told = _silent, workers: int = 1, quick: bool = False
) -> ControlStudy:
    """Design, verify and run up; what an earlier call with the same model, machine and sources found is kept.

    Parameters
    ----------
    plant : the machine that the laws are verified on
    model : what they are designed on
    folder : where laws and results are kept
    told : called with what ended, how many have and how many there are
    workers : processes
    quick : without the LPV syntheses and the full verification
    """
    found = ControlStudy()
    folder.mkdir(parents=True, exist_ok=True)
    files = _Files(plant, model, folder)
    names = [name for name in DESIGNS if not (quick and name.startswith("lpv"))]
    cases = [*map(files.design, names), *_runs(files, {OPEN: ""})]
    first = run_cases(folder, cases if quick else [files.machine_code(), *cases], workers, told)
    for name in names:
        _take_design(found, files, name, first[f"design {name}"])
    _local(found, model, files)
    second = run_cases(folder, _runs(files, {name: str(files.law(name)) for name in found.laws}), workers, told)
    _take_runs(found, first | second)
    checked = [] if quick else [name for name in VERIFIED if name in found.laws]
    last = run_cases(folder, [files.verification(name, found) for name in checked], workers, told)
    found.verified = {name: last[f"verification {name}"] for name in checked}
    return found


class _Files:
    """Names and keys of what is kept."""

    def __init__(self, plant: Plant, model: LpvModel, folder: Path) -> None:
        self.folder, self.machine = folder, plant.machine.text
        self.physics = f"{plant.machine.hash} {plant.assembly.module.__name__}"
        self.text = json.dumps(model.to_dict(), sort_keys=True)
        self.model = folder / f"model-{key_of(self.text, kind='control')}.json"
        if not self.model.exists():
            model.save(self.model)

    def law(self, name: str) -> Path:
        """Where a law is kept."""
        return (
            self.folder
            / f"law-{name.replace(' ', '_')}-{key_of(self.text, *DESIGNS.get(name, ()), kind='control')}.json"
        )

    def design(self, name: str) -> Case:
        """The case that designs."""
        key = key_of(self.text, *DESIGNS[name], kind="control")
        arguments: tuple[Any, ...] = (str(self.model), *DESIGNS[name], [], str(self.law(name)))
        return Case(f"design-{name.replace(' ', '_')}", f"design {name}", key, f"{HOME}:design", arguments)

    def run(self, stage: str, name: str, law: str, *more: Any) -> Case:
        """A case that runs the plant."""
        fingerprint = load_law(Path(law)).hash if law else ""
        key = key_of(stage, self.physics, fingerprint, repr(more))
        title = f"{stage.replace('_', ' ')} {name}"
        return Case(stage, title, key, f"{HOME}:{stage}", (self.machine, law, *more))

    def machine_code(self) -> Case:
        """The case that spares the verifications, which run at the same time, from compiling the same twice."""
        key = key_of("machine code", self.physics)
        return Case("machine_code", "machine code", key, f"{HOME}:machine_code", (self.machine,))

    def verification(self, name: str, found: ControlStudy) -> Case:
        """The case that verifies a law whose hits are known."""
        return self.run("verification", name, str(self.law(name)), found.impacts[OPEN], found.impacts[name])


def _runs(files: _Files, laws: dict[str, str]) -> list[Case]:
    """Cases of the plant for laws by name; the slowest kind first."""
    alone = OPEN in laws
    cases = [files.run("extension", name, law) for name, law in laws.items() if alone or name in EXTENDED]
    for name, (law, bias) in BIASED.items():
        if law in laws:
            cases.append(files.run("extension", name, laws[law], bias))
    cases += [files.run("hits", name, law) for name, law in laws.items() if name not in ("youla", "local")]
    cases += [files.run("run_up", name, law) for name, law in laws.items() if alone or name in RUN_UP]
    cases += [files.run("hits_by_size", name, laws[name]) for name in BY_SIZE if name in laws]
    cases += [files.run("cell", name, laws[name]) for name in (OPEN, "local", "h2_scheduled", "youla") if name in laws]
    if alone:
        key = key_of("flipped", files.physics)
        cases.append(Case("flipped", "P with the other sign", key, f"{HOME}:flipped", (files.machine,)))
    return cases


def _take_design(found: ControlStudy, files: _Files, name: str, told: dict[str, Any]) -> None:
    if "refused" in told:
        found.refused[name] = told["refused"]
        return
    found.laws[name] = load_law(files.law(name))
    found.overview[name] = told["overview"]


def _take_runs(found: ControlStudy, told: dict[str, Any]) -> None:
    homes: dict[str, dict[str, Any]] = {
        "hits": found.impacts, "run up": found.runup, "extension": found.safe, "cell": found.cell,
        "hits by size": found.by_size,
    }  # fmt: skip
    for title in sorted(told, key=len):
        stage = max((s for s in homes if title.startswith(f"{s} ")), key=len, default="")
        if stage:
            homes[stage][title.removeprefix(f"{stage} ")] = told[title]
    found.flipped = told["P with the other sign"]


def _local(found: ControlStudy, model: LpvModel, files: _Files) -> None:
    """The local H2 design at the cell's centre, and what the model says of imbalance there."""
    found.cell_model[OPEN] = h2_scheduled.imbalance_response(model, None, *CELL)
    if "h2_scheduled" not in found.laws:
        return
    found.laws["local"] = h2_scheduled.local(model, *CELL)
    found.laws["local"].save(files.law("local"))
    for name in ("local", "h2_scheduled", "youla"):
        if name in found.laws:
            K = law_system(found.laws[name], *CELL)
            found.cell_model[name] = h2_scheduled.imbalance_response(model, K, *CELL)
