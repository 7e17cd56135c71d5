"""The whole circle from a machine file: campaign, identification, designs, verification, all claims, one report."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from identification import load_model
from identification.lpv import LpvModel
from rotorsim.errors import DataError
from rotorsim.plant import Plant
from rotorsim.report.study_page import Block, save_study_page
from rotorsim.study.cache import find, keep, key_of
from rotorsim.study.claims import Claim
from rotorsim.study.control import ControlStudy, control_study
from rotorsim.study.hysteresis import hysteresis_claim
from rotorsim.study.page import blocks_of, claims_block, control_blocks, plain_blocks
from rotorsim.study.plans import QUICK, Layout, run
from rotorsim.study.pool import Case, Told, run_cases

DESIGN_MODEL = "model_2.json"
"""Laws are designed on Model 2: it has the right gain at rest, which Model 3 has not (docs/identification.md)."""


@dataclass
class Whole:
    """All claims, the report's sections, aims of identification, wall time [s] of the stages."""

    claims: list[Claim] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    targets: list[dict[str, Any]] = field(default_factory=list)
    control: ControlStudy = field(default_factory=ControlStudy)
    seconds: dict[str, float] = field(default_factory=dict)


def whole_study(plant: Plant, out: Path, told: Told, workers: int = 2, quick: bool = False) -> Whole:
    """Everything that is not yet in `out`, then claims and sections; the report is written to `out`.

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
    folders = run(plant.machine, QUICK if quick else Layout(), out, workers)
    clock.lap("campaign")
    kept = _identification(plant, folders, stages, workers, quick, told)
    for name, text in kept["models"].items():
        (out / name).write_text(text, encoding="utf-8")
    clock.lap("identification")
    model = load_model(out / DESIGN_MODEL)
    assert isinstance(model, LpvModel)
    found.control = control_study(plant, model, stages, told, workers, quick)
    clock.lap("designs and verification")
    found.claims = [*_i_claims(plant, kept, stages, told), *_c_claims(found.control, model)]
    found.targets, found.seconds = kept["targets"], clock.laps
    clock.lap("claims")
    times = [(name, f"{seconds:.0f} s") for name, seconds in clock.laps.items()]
    found.blocks = [
        claims_block(found.claims),
        *control_blocks(found.control),
        *blocks_of(kept["blocks"]),
        Block("Time", "Of this run; what an earlier one has left is not made again.", ("stage", "wall time"), times),
    ]
    title, text = f"Study of {plant.machine.name}", "A virtual rig against a thesis. All records are simulated."
    save_study_page(title, text, found.blocks, out / "report.html")
    return found


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
    plant: Plant, folders: list[Path], stages: Path, workers: int, quick: bool, told: Told
) -> dict[str, Any]:
    """Claims, aims, sections and models, from `stages` or made now."""
    key = key_of(plant.machine.hash, *_records(folders), kind="identification")
    known = find(stages, "identification", key)
    return known if known else keep(stages, "identification", key, _identify(plant, folders, workers, quick, told))


def _identify(plant: Plant, folders: list[Path], workers: int, quick: bool, told: Told) -> dict[str, Any]:
    import json

    from rotorsim.study.claims import claims
    from rotorsim.study.identification_vs_physics import study
    from rotorsim.study.page import identification_blocks
    from rotorsim.study.plans import HELD
    from rotorsim.study.sources import sources_of
    from rotorsim.study.targets import targets

    sources = sources_of(folders)
    total, done = sum(source.role not in HELD for source in sources), [0]

    def count() -> None:
        done[0] += 1
        told("operating point", done[0], total)

    found = study(plant, sources, workers, 1 if quick else 3, 2, count)
    reached = targets(found)
    models = {"model.json": found.refined, DESIGN_MODEL: found.lpv_2}
    return {
        "claims": [asdict(c) for c in claims(found)],
        "targets": [asdict(t) for t in reached],
        "blocks": plain_blocks(identification_blocks(found, reached)),
        "models": {name: json.dumps(model.to_dict(), indent=1) + "\n" for name, model in models.items()},
    }


def _i_claims(plant: Plant, kept: dict[str, Any], stages: Path, told: Told) -> list[Claim]:
    """Rows I1 to I13; the last is of the actuators and not of the campaign's records."""
    rows = [Claim(**row) for row in kept["claims"]]
    if plant.machine.actuators is None:
        return rows
    key = key_of(plant.machine.hash, plant.assembly.module.__name__, kind="hysteresis")
    case = Case("hysteresis", "hysteresis", key, "rotorsim.study.hysteresis:hysteresis", (plant.machine.text,))
    last = hysteresis_claim(run_cases(stages, [case], 1, told)["hysteresis"])
    return [last if row.number == last.number else row for row in rows]


def _c_claims(found: ControlStudy, model: LpvModel) -> list[Claim]:
    from rotorsim.study.control_claims import control_claims

    return control_claims(found, model)
