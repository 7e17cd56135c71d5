"""Success rate of diagnoses on machines with hidden effects: `python studies/benchmarks/measure.py diagnose`.

Cases are drawn in turn from kinds: nothing hidden, one effect, two, something that the catalogue does not have, an
effect that is taken out of the candidates, an undisclosed error of the injectors' law, and noise three times as high.
Records come from the full plant on a finer grid and step. Seeds below `REPORTING` are for tuning, those from it on for
the figures that are reported.
"""

import json
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.files import write_text
from rotorsim.discrepancy import diagnose
from rotorsim.discrepancy.calibration import CompiledModels
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.gap import reduction
from rotorsim.discrepancy.hidden_machine import truth_twin
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import Machine, load_machine
from studies.benchmarks.detectable import Detectable
from studies.benchmarks.hidden_case import KINDS, hidden_case
from studies.benchmarks.odds_score import scored
from studies.benchmarks.verdicts import VERDICTS, CaseVerdict, apart, calibrated, judged

REPORTING = 100_000
"""First seed of the reported figures; tuning uses those below."""
STEP = 2e-4 / 3
"""Step [s] of the records: a third of that of a diagnosis; their grid is that of `hide`."""


def run_case(
    number: int, machine: Machine, truth_plant: Twin, models: CompiledModels, seen: Detectable, threads: int = 1
) -> CaseVerdict:
    """Hide and diagnose."""
    kind = KINDS[number % len(KINDS)]
    picked, truth, records = hidden_case(number, kind, machine, truth_plant)
    begin, used = time.perf_counter(), time.process_time()
    effects = None
    if kind == "left_out":
        out = {f.effect for f in truth.forms}
        effects = {f.effect for f in candidates(models.twin)} - out
    steps = max((abs(complex(*a, *([0] * (2 - len(a))))) / f.parameters[0].step
                 for f, a in zip(truth.forms, truth.amplitudes, strict=True)), default=0.0)  # fmt: skip
    times = seen.times(truth)
    try:
        d = diagnose(machine, records, effects=effects, models=models, threads=threads)
    except RotorsimError as error:
        outcome = f"error: {error}"
        return CaseVerdict(number, kind, tuple(picked), steps, times, outcome, (), "missed", 0.0, np.nan, np.nan, 0.0)
    seconds, cpu = time.perf_counter() - begin, time.process_time() - used
    named = tuple(f.form for f in d.effects)
    hidden = tuple(f.key for f in truth.forms)
    verdict = judged(kind, hidden, d, {f.key for f in candidates(models.twin)})
    away = apart(d, truth, models.twin)
    inside = float(np.mean(np.array(away) < 2)) if away else np.nan
    return CaseVerdict(
        number, kind, hidden, steps, times, d.status, named, verdict, seconds, reduction(d.gap), inside, cpu,
        len(d.ties), scored(d.explanations, kind, hidden, {f.key for f in candidates(models.twin)}), away,
        calibrated(d, truth) if verdict in ("right", "class") else (),
    )  # fmt: skip


def cases(count: int, seed: int, path: Path | None = None, machine: str = "dtu_gas_bearing") -> Iterator[CaseVerdict]:
    """Cases from seed on; those in the file `path` already are not run again, new ones are added to it.

    Raises
    ------
    DataError
        If the file holds something else.
    WriteError
        If it cannot be written.
    """
    done = kept_cases(path)
    loaded = load_machine(machine)
    truth_plant, models = replace(truth_twin(loaded), step=STEP), CompiledModels.of(loaded)
    seen = Detectable.of(loaded, truth_plant, models)
    for number in range(seed, seed + count):
        if number not in done:
            done[number] = run_case(number, loaded, truth_plant, models, seen)
            keep(done.values(), path)
        yield done[number]


def reported_cases() -> list[CaseVerdict]:
    """Cases for reporting that are stored here, of the commit that the docs state."""
    return list(kept_cases(Path(__file__).parent / "odds.jsonl").values())


def keep(found: Iterable[CaseVerdict], path: Path | None) -> None:
    """Write cases, a line each, all in one step; raises WriteError."""
    if path is not None:
        write_text(path, "".join(json.dumps(asdict(case)) + "\n" for case in found))


def kept_cases(path: Path | None) -> dict[int, CaseVerdict]:
    """Cases by number that are in a file already."""
    if path is None or not path.exists():
        return {}
    done: dict[int, CaseVerdict] = {}
    for number, line in enumerate(path.read_text(encoding="utf-8-sig", errors="replace").splitlines(), 1):
        try:
            row: dict[str, Any] = json.loads(line)
            row["hidden"], row["named"] = tuple(row["hidden"]), tuple(row["named"])
            row["odds"] = tuple(map(tuple, row.get("odds", ())))
            row |= {name: tuple(row.get(name, ())) for name in ("apart", "calibrated")}
            if row["verdict"] not in VERDICTS:
                raise ValueError(row["verdict"])
            done[row["number"]] = CaseVerdict(**row)
        except (ValueError, KeyError, TypeError) as error:
            raise DataError(f"{path}: line {number} is not a case of the part diagnose; name another file") from error
    return done
