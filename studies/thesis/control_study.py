"""Control half of the study: designs on a model, each verified on the nonlinear plant, stage by stage."""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from identification.lpv_model import LpvModel
from rotorsim.base.units import KRPM, TO_MPA
from rotorsim.control import Law, load_law
from rotorsim.control.designs import h2_scheduled
from rotorsim.plant import Plant
from studies.thesis.cached_cases import CachedCase, Progress, run_cases
from studies.thesis.claims.rules import points
from studies.thesis.printed import law_a
from studies.thesis.stage_key import key_of

HOME = "studies.thesis.control_cases"
OPEN = "open loop"


def _at(name: str) -> tuple[str, str]:
    """Changes of a specification that put its design to the named point of the rules."""
    ((speed, pressure),) = points(name)
    return f"speed={speed / KRPM * 1000:.6g} rpm", f"pressure={pressure * TO_MPA:.6g} MPa"


DESIGNS: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "lpv": ("lpv", "rig", ()),
    "lpv thesis": ("lpv", "thesis", ("order_X=2", "order_Y=0")),
    "h2_scheduled": ("h2_scheduled", "", ()),
    "p": ("p", "", _at("decentralised")),
    "softening": ("lead", "softening", _at("decentralised")),
    "hardening": ("lead", "hardening", _at("decentralised")),
    "placement": ("placement", "", _at("placement_design")),
    "lqr": ("lqr", "", ()),
    "hinf": ("hinf", "rig", ()),
    "hinf thesis": ("hinf", "thesis", ()),
    "hinf reduced": ("hinf", "thesis", (*_at("reduced_design"), "order=4")),
    "hinf critical": ("hinf", "thesis", _at("safe_design")),
    "youla": ("youla", "", _at("cell")),
}
"""Name in the study: design, preset and changes; what takes longest comes first."""
EIGHT_BAR: dict[str, tuple[str, str, tuple[str, ...]]] = {"placement": ("placement", "", _at("placement_design_8"))}
"""Designs that are made at the thesis' own pressure on a model that holds there."""
RINGING = {"placement": "placement", "hinf reduced": "reduced_hits", "p": "decentralised", "softening": "decentralised",
           "hardening": "decentralised"}  # fmt: skip
"""Points of the rules that the damping under a law is measured at."""
FITTED = {"placement": "placement_thesis", "printed": "placement_thesis", "p": "decentralised"}
"""Points of the rules that ring-downs under a law are read at as the thesis reads them."""
NEAR_FILM = ("lpv thesis", "hinf thesis")
"""Laws whose hits are repeated next to the film."""
NO_HITS = ("youla", "local", "hinf reduced", "hinf critical", "printed")
HELD_OUT = ("lpv", "hinf")
RUN_UP = ("lpv thesis", "hinf thesis")
EXTENDED = ("p", "softening", "placement", "lqr", "hinf", "hinf critical", "lpv", "h2_scheduled")
BIASED = {"hinf, bias y +1.5 V": ("hinf", (0.0, 1.5)), "hinf, bias y -1.5 V": ("hinf", (0.0, -1.5))}
"""Run-ups with a constant reference, which moves the rotor in its bearing."""
BY_SIZE = ("hinf thesis", "hinf", "p")
CELL = ("local", "h2_scheduled", "youla")
SINGLE = ("coast", "static_map")
"""Cases of the plant without a law, at the points of the rules of the same name."""
VERIFIED = ("hinf", "lpv")


@dataclass
class ControlStudy:
    """Results of the stages, as plain values by law; laws themselves; names of laws that a quick study leaves out."""

    laws: dict[str, Law] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    overview: dict[str, dict[str, Any]] = field(default_factory=dict)
    impacts: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    held_out: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    by_size: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    ringing: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    fitted: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    near_film: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    runup: dict[str, dict[str, Any]] = field(default_factory=dict)
    tabled: dict[str, dict[str, Any]] = field(default_factory=dict)
    safe: dict[str, dict[str, Any]] = field(default_factory=dict)
    cell: dict[str, float] = field(default_factory=dict)
    whirl: dict[str, list[float]] = field(default_factory=dict)
    coast: dict[str, bool] = field(default_factory=dict)
    static_map: dict[str, Any] = field(default_factory=dict)
    verified: dict[str, dict[str, Any]] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    def ratio(self, name: str) -> np.ndarray:
        """Closed over open norm of the impact response (20, 2)."""
        return _ratio(self.impacts, name)

    def held_ratio(self, name: str) -> np.ndarray:
        """The same at the held-out points."""
        return _ratio(self.held_out, name)

    def effort(self, name: str) -> np.ndarray:
        """Mean control effort (2,) [V/N]."""
        return _effort(self.impacts[name])

    def held_effort(self, name: str) -> np.ndarray:
        """The same at the held-out points."""
        return _effort(self.held_out[name])

    def damping(self, name: str) -> float:
        """Smallest damping ratio of the answers to hits."""
        return float(min(e["damping"] for e in self.impacts[name]))


def _ratio(found: dict[str, list[dict[str, Any]]], name: str) -> np.ndarray:
    closed, open_ = (np.array([e["response"] for e in found[key]]) for key in (name, OPEN))
    return np.asarray(closed / open_)


def _effort(responses: list[dict[str, Any]]) -> np.ndarray:
    return np.asarray(np.array([e["effort"] for e in responses]).mean(axis=0))


def _no_progress(name: str, done: int, of: int) -> None:
    pass


def control_study(
    plant: Plant,
    model: LpvModel,
    folder: Path,
    progress: Progress = _no_progress,
    workers: int = 1,
    quick: bool = False,
) -> ControlStudy:
    """Design, verify and run up; what an earlier call with the same model, machine and sources found is kept.

    Parameters
    ----------
    plant : the machine that the laws are verified on
    model : what they are designed on
    folder : where laws and results are kept
    progress : called with what ended, how many have and how many there are
    workers : processes
    quick : without the LPV syntheses and the full verification
    """
    found = ControlStudy(left_out=tuple(name for name in DESIGNS if quick and name.startswith("lpv")))
    folder.mkdir(parents=True, exist_ok=True)
    files = _KeptFiles(plant, model, folder)
    names = [name for name in DESIGNS if name not in found.left_out]
    cases = [*map(files.design, names), *_runs(files, {OPEN: ""})]
    first = run_cases(folder, cases if quick else [files.machine_code(), *cases], workers, progress)
    for name in names:
        _take_design(found, files, name, first[f"design {name}"])
    if "h2_scheduled" in found.laws:
        found.laws["local"] = h2_scheduled.local(model, *points("cell")[0])
        found.laws["local"].save(files.law("local"))
    _take_printed(found, files)
    second = run_cases(folder, _runs(files, {name: str(files.law(name)) for name in found.laws}), workers, progress)
    _take_runs(found, first | second)
    checked = [] if quick else [name for name in VERIFIED if name in found.laws]
    last = run_cases(folder, [files.verification(name, found) for name in checked], workers, progress)
    found.verified = {name: last[f"verification {name}"] for name in checked}
    return found


def ringing_study(
    plant: Plant,
    model: LpvModel,
    folder: Path,
    names: Collection[str] = tuple(RINGING),
    progress: Progress = _no_progress,
    workers: int = 1,
) -> ControlStudy:
    """Make those of the named designs whose damping in hits is measured, and their hits: claims C1 to C4, N3 and N5.

    Other parameters as of `control_study`.
    """
    names = [name for name in RINGING if name in names]
    found = ControlStudy()
    folder.mkdir(parents=True, exist_ok=True)
    files = _KeptFiles(plant, model, folder)
    still = files.alone("static_map", points("static_map")[0])
    first = run_cases(folder, [*map(files.design, names), still, *_hit_runs(files, {OPEN: ""})], workers, progress)
    for name in names:
        _take_design(found, files, name, first[f"design {name}"])
    _take_printed(found, files)
    second = run_cases(folder, _hit_runs(files, {name: str(files.law(name)) for name in found.laws}), workers, progress)
    _take_runs(found, first | second)
    return found


def designs_on(model: LpvModel) -> dict[str, tuple[str, str, tuple[str, ...]]]:
    """Designs on a model; that of Paper A at its own pressure, 8 bar, where the model holds there."""
    return DESIGNS if model.outside(*points("placement_design_8")[0]) else DESIGNS | EIGHT_BAR


class _KeptFiles:
    """Names and keys of what is kept."""

    def __init__(self, plant: Plant, model: LpvModel, folder: Path) -> None:
        self.folder, self.machine = folder, plant.machine.text
        self.physics = f"{plant.machine.hash} {plant.assembly.module.__name__}"
        self.designs = designs_on(model)
        self.text = json.dumps(model.to_dict(), sort_keys=True)
        self.model = folder / f"model-{key_of(self.text, kind='control')}.json"
        if not self.model.exists():
            model.save(self.model)

    def law(self, name: str) -> Path:
        """File in which a law is kept."""
        return self.folder / f"law-{name.replace(' ', '_')}-{self._key(name)}.json"

    def _key(self, name: str) -> str:
        return key_of(self.text, repr(self.designs.get(name, ())), kind="control")

    def design(self, name: str) -> CachedCase:
        """The case that designs."""
        design, preset, changes = self.designs[name]
        arguments = (str(self.model), design, preset, list(changes), str(self.law(name)))
        return CachedCase(
            f"design-{name.replace(' ', '_')}", f"design {name}", self._key(name), f"{HOME}:design", arguments
        )

    def run(self, stage: str, name: str, law: str, *more: Any, title: str = "") -> CachedCase:
        """A case that runs the plant; `title` distinguishes cases of one stage and law."""
        fingerprint = load_law(Path(law)).hash if law else ""
        key = key_of(stage, self.physics, fingerprint, repr(more))
        label = f"{title or stage.replace('_', ' ')} {name}"
        return CachedCase(stage, label, key, f"{HOME}:{stage}", (self.machine, law, *more))

    def alone(self, stage: str, given: Any) -> CachedCase:
        """A case of the plant that is no law's."""
        key = key_of(stage, self.physics, repr(given))
        return CachedCase(stage, stage, key, f"{HOME}:{stage}", (self.machine, given))

    def machine_code(self) -> CachedCase:
        """The case that spares the verifications, which run at the same time, from compiling the same twice."""
        key = key_of("machine code", self.physics)
        return CachedCase("machine_code", "machine code", key, f"{HOME}:machine_code", (self.machine,))

    def verification(self, name: str, found: ControlStudy) -> CachedCase:
        """The case that verifies a law whose hits are known."""
        return self.run("verification", name, str(self.law(name)), found.impacts[OPEN], found.impacts[name])


def _runs(files: _KeptFiles, laws: dict[str, str]) -> list[CachedCase]:
    """Cases of the plant for laws by name; the slowest kind first."""
    alone = OPEN in laws
    some = {"impacts": list(points("impacts")), "held_out": list(points("held_out"))}
    cases = [
        files.run("run_up", name, law, points("run_up")[0]) for name, law in laws.items() if alone or name in RUN_UP
    ]
    if alone:
        cases += [files.alone(stage, points(stage)[0]) for stage in SINGLE]
    cases += [files.run("run_up", name, law, points("run_up")[0], True, title="run up with table")
              for name, law in laws.items() if name in RUN_UP]  # fmt: skip
    cases += [files.run("extension", name, law) for name, law in laws.items() if alone or name in EXTENDED]
    cases += [files.run("extension", name, laws[law], bias) for name, (law, bias) in BIASED.items() if law in laws]
    cases += [files.run("hits", name, law, some["impacts"]) for name, law in laws.items() if name not in NO_HITS]
    cases += [files.run("hits", name, law, some["impacts"], True, title="hits next to the film")
              for name, law in laws.items() if alone or name in NEAR_FILM]  # fmt: skip
    cases += [files.run("hits", name, law, some["held_out"], title="held out hits")
              for name, law in laws.items() if alone or name in HELD_OUT]  # fmt: skip
    cases += [files.run("hits_by_size", name, laws[name]) for name in BY_SIZE if name in laws]
    cases += _hit_runs(files, laws)
    cases += [files.run("cell", name, law, points("cell")[0]) for name, law in laws.items() if alone or name in CELL]
    whirl = files.alone("whirl", [pressure for _, pressure in points("whirl")])
    return [*cases, whirl] if alone else cases


def _hit_runs(files: _KeptFiles, laws: dict[str, str]) -> list[CachedCase]:
    """Cases of the plant whose hits show the damping under laws by name."""
    cases = [files.run("ring_downs", name, law, _ringing(name)) for name, law in laws.items() if _ringing(name)]
    return cases + [files.run("fits", name, law, _ringing(name, FITTED))
                    for name, law in laws.items() if _ringing(name, FITTED)]  # fmt: skip


def _ringing(name: str, at: dict[str, str] = RINGING) -> list[tuple[float, float]]:
    """Points at which the damping under a law is measured; without a law, all of them."""
    named = dict.fromkeys(at.values()) if name == OPEN else [at[name]] if name in at else []
    return [q for one in named for q in points(one)]


def _take_design(found: ControlStudy, files: _KeptFiles, name: str, result: dict[str, Any]) -> None:
    if "refused" in result:
        found.refused[name] = result["refused"]
        return
    found.laws[name] = load_law(files.law(name))
    found.overview[name] = result["overview"]


def _take_printed(found: ControlStudy, files: _KeptFiles) -> None:
    """Take the law that the thesis prints."""
    found.laws["printed"] = law_a()
    found.laws["printed"].save(files.law("printed"))


def _take_runs(found: ControlStudy, result: dict[str, Any]) -> None:
    homes: dict[str, dict[str, Any]] = {
        "hits": found.impacts, "held out hits": found.held_out, "hits by size": found.by_size,
        "ring downs": found.ringing, "fits": found.fitted, "hits next to the film": found.near_film,
        "run up": found.runup, "run up with table": found.tabled, "extension": found.safe, "cell": found.cell,
    }  # fmt: skip
    for title in sorted(result, key=len):
        stage = max((s for s in homes if title.startswith(f"{s} ")), key=len, default="")
        if stage:
            homes[stage][title.removeprefix(f"{stage} ")] = result[title]
    found.whirl, found.coast, found.static_map = (result.get(name, {}) for name in ("whirl", *SINGLE))
