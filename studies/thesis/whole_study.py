"""Complete reproduction from a machine file: campaign, identification, designs, verification, claims, report."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from identification import load_model
from identification.lpv_model import LpvModel
from rotorsim.base.cache import Cache
from rotorsim.base.errors import DataError
from rotorsim.base.files import write_text
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.report.page import Block, save_study_page
from rotorsim.study.identification_vs_physics import study
from rotorsim.study.identify_records import COUNTED, QUICK, StudyGrid, run, sources_of
from rotorsim.study.pages import identification_blocks
from studies.thesis.cached_cases import CachedCase, Progress, run_cases
from studies.thesis.claims.control_numbers import control_left_out, control_numbers, laws_of, numbers_of
from studies.thesis.claims.edited import edited, edited_block, edited_markdown
from studies.thesis.claims.hysteresis import hysteresis_numbers
from studies.thesis.claims.identification_numbers import identification_left_out, identification_numbers
from studies.thesis.claims.judge import Judged
from studies.thesis.claims.rules import as_run, claims, machines, points
from studies.thesis.claims.targets import targets
from studies.thesis.claims.verdicts import claims_blocks, markdown, verdicts
from studies.thesis.control_study import ControlStudy, control_study, ringing_study
from studies.thesis.page import aims_block, as_run_block, blocks_of, control_blocks, plain_blocks
from studies.thesis.stage_key import key_of

CLAIMED = ("rest", "turning", "runout", "orders")
"""Points of the rules that have records of their own where the grid has none."""
DESIGN_MODEL = "model_2.json"
"""Laws are designed on Model 2: it has the right gain at rest, which Model 3 has not (docs/identification.md)."""


@dataclass
class Whole:
    """Verdicts on all claims, rules edited since the first run, sections of the report, aims, times of stages [s]."""

    edited: list[str] = field(default_factory=list)
    claims: list[Judged] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    targets: list[dict[str, Any]] = field(default_factory=list)
    control: ControlStudy = field(default_factory=ControlStudy)
    seconds: dict[str, float] = field(default_factory=dict)


def whole_study(
    plant: Plant, out: Path, progress: Progress, workers: int = 2, quick: bool = False, as_shipped: bool = False
) -> Whole:
    """Everything that is not yet in `out`, then claims and sections; the report is written to `out`.

    The other machines run as the thesis' rig did, or `as_shipped`.

    Raises
    ------
    DataError
        If a campaign was stopped before its end.
    StoreError
        If `out` holds campaigns of another machine.
    """
    if plant.machine.actuators is None or plant.assembly.film_model is None:
        raise DataError(
            f"{plant.machine.name}: has no actuators in a gas film; there is nothing to identify or control"
        )
    found, stages, clock = Whole(), out / "stages", _Clock()
    out.mkdir(parents=True, exist_ok=True)
    found.edited = edited(out)
    folders = run(plant.machine, layout(quick), out, workers)
    clock.lap("campaign")
    kept, model = _identification(plant, folders, out, workers, progress)
    clock.lap("identification")
    found.control = control_study(plant, model, stages, progress, workers, quick)
    clock.lap("designs and verification")
    elsewhere = {
        name: _on_machine(_other(name, as_shipped), grid_of(grid), out / name, progress, workers, quick)
        for name, grid in machines().items()
    }
    clock.lap("the other assemblies")
    numbers = kept["numbers"] | _hysteresis(plant, stages, progress) | control_numbers(found.control, model)
    left_out = {*kept.get("left_out", ()), *control_left_out(found.control)}
    found.claims = verdicts(numbers, left_out=left_out, elsewhere=elsewhere)
    write_text(out / "claims.md", edited_markdown(found.edited) + markdown(found.claims))
    found.targets, found.seconds = kept["targets"], clock.laps
    clock.lap("claims")
    times = [(name, f"{seconds:.0f} s") for name, seconds in clock.laps.items()]
    found.blocks = [
        *edited_block(found.edited),
        *([] if as_shipped else [as_run_block()]),
        *claims_blocks(found.claims),
        *control_blocks(found.control),
        *blocks_of(kept["blocks"]),
        Block("Time", "Of this run; what an earlier one has left is not made again.", ("stage", "wall time"), times),
    ]
    title, text = f"Study of {plant.machine.name}", "A virtual rig against a thesis. All records are simulated."
    save_study_page(title, text, found.blocks, out / "report.html")
    return found


def layout(quick: bool = False) -> StudyGrid:
    """Grid of the study: the thesis', or three by three of its points, and the claims' extra points."""
    usual = QUICK if quick else StudyGrid()
    return replace(usual, more=tuple(q for name in CLAIMED for q in points(name)))


def _other(name: str, as_shipped: bool) -> Plant:
    machine = load_machine(name)
    return Plant(machine if as_shipped else as_run(machine))


def _on_machine(
    plant: Plant, grid: StudyGrid, folder: Path, progress: Progress, workers: int, quick: bool
) -> dict[str, dict[str, float]]:
    """Numbers of the claims measured on another machine, whose study is in a folder of its own."""
    usual = QUICK if quick else grid
    folders = run(plant.machine, replace(usual, more=points("orders")), folder, workers)
    kept, model = _identification(plant, folders, folder, workers, progress)
    moved = [claim.number for claim in claims() if claim.machine == plant.machine.name]
    laws = ringing_study(plant, model, folder / "stages", laws_of(moved), progress, workers)
    return {number: kept["numbers"].get(number) or numbers_of(number, laws, model) for number in moved}


def grid_of(name: str) -> StudyGrid:
    """Grid of named operating points."""
    speeds, pressures = (tuple(sorted(set(column))) for column in zip(*points(name), strict=True))
    return StudyGrid(speeds, pressures)


class _Clock:
    """Wall time between laps."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.laps[name], self._last = now - self._last, now


def _records(folders: Iterable[Path]) -> Sequence[str]:
    """Names of all records, which are hashes of what they follow from."""
    return sorted(path.name for folder in folders for path in folder.rglob("*.nc"))


def _identification(
    plant: Plant, folders: list[Path], out: Path, workers: int, progress: Progress
) -> tuple[dict[str, Any], LpvModel]:
    """Numbers, aims, sections and models, from the stages of `out` or made now, and the model that laws are made on."""
    key = key_of(plant.machine.hash, *_records(folders), kind="identification")
    cache, name = Cache(out / "stages", required=True), f"identification-{key}"
    kept = cache.find(name) or cache.keep(name, _identify(plant, folders, workers, progress))
    for file, text in kept["models"].items():
        write_text(out / file, text)
    model = load_model(out / DESIGN_MODEL)
    assert isinstance(model, LpvModel)
    return kept, model


def _identify(plant: Plant, folders: list[Path], workers: int, progress: Progress) -> dict[str, Any]:
    sources = sources_of(folders)
    total, done = sum(source.role in COUNTED for source in sources), [0]

    def count() -> None:
        done[0] += 1
        progress("operating point", done[0], total)

    found = study(plant, sources, workers, 2, count, points("orders"))
    reached = targets(found)
    models = {"model.json": found.refined, DESIGN_MODEL: found.lpv_2}
    return {
        "numbers": identification_numbers(found),
        "left_out": sorted(identification_left_out(found)),
        "targets": [asdict(t) for t in reached],
        "blocks": plain_blocks([aims_block(reached), *identification_blocks(found)]),
        "models": {name: json.dumps(model.to_dict(), indent=1) + "\n" for name, model in models.items()},
    }


def _hysteresis(plant: Plant, stages: Path, progress: Progress) -> dict[str, dict[str, float]]:
    """Numbers of claim I13, which is of the actuators and not of the campaign's records."""
    key = key_of(plant.machine.hash, plant.assembly.module.__name__, kind="hysteresis")
    case = CachedCase(
        "hysteresis", "hysteresis", key, "studies.thesis.claims.hysteresis:hysteresis", (plant.machine.text,)
    )
    return {"I13": hysteresis_numbers(run_cases(stages, [case], 1, progress)["hysteresis"])}
