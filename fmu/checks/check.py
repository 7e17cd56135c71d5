"""Checks of an exported unit: standard, trajectory against the Python plant, states, instances, step sizes, speed."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from fmu.checks.importer import ImportedUnit, Instance, fmpy
from fmu.checks.linear_check import linear_checks
from fmu.checks.reference_plant import plant_outputs
from fmu.checks.schemas import findings
from fmu.info import holds, machine_text, opened, start, stored
from fmu.kinds import law_unit, linear_unit, plant_unit
from fmu.law_unit import INPUTS, OUTPUTS, LawUnit, answered
from fmu.linear_model import LinearUnit
from fmu.model import PlantUnit, Unit
from fmu.places import workspace
from fmu.reference import reference_inputs
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant

TOLERANCE = 1e-9
"""Deviation from a stored reference, relative to each output's largest value, on another C library."""
MOST_STEPS = 10_000_000
"""Communication steps of a comparison, at most."""
BAD_STEPS = {"0": 0.0, "negative": -1e-3, "NaN": float("nan"), "1.5 samples": 1.5}


@dataclass(frozen=True)
class Check:
    """One line of the table."""

    name: str
    value: str
    passed: bool | None
    """None for a remark, such as a time, which depends on what else the computer does."""


def check(path: Path, duration: float = 1.0) -> Iterator[Check]:
    """Run all checks, one after another; from the third on, the machine code of the unit runs in this process."""
    with ImportedUnit(path) as unit:
        yield from _standard(path, unit)
        model = model_of(path)
        n = max(round(min(duration / model.sample, MOST_STEPS + 1)), 100)
        if n > MOST_STEPS:
            raise DataError(f"{path}: {duration:g} s take over {MOST_STEPS} steps of {model.sample:g} s; check less")
        jobs: list[Callable[[], Iterator[Check]]] = []
        if isinstance(model, PlantUnit):
            jobs += [partial(job, unit, model, n) for job in (_trajectory, _long_steps)]
        elif isinstance(model, LinearUnit):
            jobs.append(lambda: (Check(*found) for found in linear_checks(unit, model, n)))
        elif isinstance(model, LawUnit):
            jobs.append(lambda: iter([_law(unit, model, n)]))
        jobs += [partial(job, unit, model, path) for job in (_reference, _replay, _second, _steps, _pace)]
        for job in jobs:
            yield from _guarded(job)


def _guarded(job: Callable[[], Iterator[Check]]) -> Iterator[Check]:
    """Checks of a job; whatever a unit of others makes of it is a check that failed."""
    try:
        yield from job()
    except RotorsimError:
        raise
    except Exception as error:  # FMPy, and all that expects what a unit of ours has
        reason = (str(error).splitlines() or [""])[0][:100]
        yield Check("the unit's own description", f"does not fit its file: {type(error).__name__} {reason}", False)


def model_of(path: Path) -> Unit:
    """Source of a unit (machine file, model or law), read from the unit."""
    kind = holds(path)
    if kind == "plant":
        return plant_unit(Plant(Machine.from_text(machine_text(path))), *start(path))
    with opened(path) as files, workspace() as folder:
        file = folder / f"{kind}.json"  # a name of ours: that in the unit may be any path
        file.write_bytes(files[f"resources/{kind}.json"])
        return (law_unit if kind == "law" else linear_unit)(file, *start(path))


def _law(unit: ImportedUnit, model: LawUnit, n: int) -> Check:
    """A swing of the disc while speed and pressure rise, in unit and law."""
    inputs = {name: model.stimuli(n, model.sample)[name] for name in INPUTS}
    rows = run(unit, inputs, model.sample, list(OUTPUTS))
    return Check(f"{n * model.sample:g} s against the law in Python", *_equal(answered(model.law, inputs), rows))


def _standard(path: Path, unit: ImportedUnit) -> Iterator[Check]:
    fmpy()
    from fmpy.validation import validate_fmu

    with redirect_stdout(io.StringIO()):
        problems = validate_fmu(unit.folder)
    for name, found in (("fmpy validate", problems), ("official schemas", findings(path))):
        yield Check(name, f"{len(found)} problems{'' if not found else ': ' + found[0][:80]}", not found)


def _trajectory(unit: ImportedUnit, model: PlantUnit, n: int) -> Iterator[Check]:
    yield compare(unit, model, n, model.sample, f"{n * model.sample:g} s against the Python plant")


def _long_steps(unit: ImportedUnit, model: PlantUnit, n: int) -> Iterator[Check]:
    step = 5 * model.sample
    yield compare(unit, model, max(n // 10, 20), step, f"the same in steps of {1e3 * step:g} ms")


def compare(unit: ImportedUnit, model: PlantUnit, n: int, step: float, name: str) -> Check:
    """A run-up with steps and a hit in unit and plant."""
    inputs = reference_inputs(model, n, step)
    truth = plant_outputs(model, inputs, step)
    rows = run(unit, inputs, step, list(truth))
    worst, same = 0.0, True
    for k, (values, good) in enumerate(truth.values()):
        same = same and np.array_equal(values[good], rows[good, k])
        worst = max(worst, deviation(values[good], rows[good, k]))
    return Check(
        name, "equal to the last bit" if same else f"relative deviation {worst:.2g}", same or worst < TOLERANCE
    )


def deviation(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference over the largest value."""
    return float(np.abs(a - b).max(initial=0.0) / max(np.abs(a).max(initial=0.0), 1e-300))


def run(unit: ImportedUnit, inputs: Mapping[str, np.ndarray], step: float, outputs: list[str]) -> np.ndarray:
    """A run of a fresh instance from its start values."""
    instance = unit.instance()
    instance.initialise()
    rows = instance.run(inputs, step, outputs)
    instance.close()
    return rows


def _reference(unit: ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
    header, given = stored(path, "in.csv")
    names, wanted = stored(path, "out.csv")
    if not wanted:
        yield Check("stored reference", "none: exported for other computers only", True)
        return
    table, target = np.array(given), np.array(wanted)
    inputs = {name: table[:, k] for k, name in enumerate(header) if k}
    rows = run(unit, inputs, float(table[1, 0] - table[0, 0]), names[1:])
    worst = max(deviation(target[:, k + 1], rows[:, k]) for k in range(rows.shape[1]))
    yield Check("stored reference", f"relative deviation {worst:.2g}", worst < TOLERANCE)


def _replay(unit: ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
    inputs, outputs = reference_inputs(model, 200, model.sample), unit.names("output")
    first = {k: v[:100] for k, v in inputs.items()}
    last = {k: v[100:] for k, v in inputs.items()}
    instance = unit.instance()
    instance.initialise()
    instance.run(first, model.sample, outputs)
    saved = instance.save()
    rows = [instance.run(last, model.sample, outputs, 100)]
    instance.restore(saved)
    rows.append(instance.run(last, model.sample, outputs, 100))
    yield Check("state taken back and replayed", *_equal(rows[0], rows[1]))
    foreign = (saved[:-8], b"x" * len(saved), saved[:-4] + b"abcd")
    refused = [refuses(partial(instance.restore, blob)) for blob in foreign]
    yield Check("truncated, foreign and damaged states", f"{sum(refused)} of 3 refused", all(refused))
    instance.slave.reset()
    instance.initialise()
    rows = [run(unit, first, model.sample, outputs), instance.run(first, model.sample, outputs)]
    yield Check("reset", *_equal(rows[0], rows[1]))
    instance.close()


def _second(unit: ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
    inputs, outputs = reference_inputs(model, 100, model.sample), unit.names("output")
    one, two = unit.instance("one"), unit.instance("two")
    one.initialise()
    two.initialise()
    rows: list[list[np.ndarray]] = [[], []]
    for k in range(100):
        for i, instance in enumerate((one, two)):
            row = {name: values[k : k + 1] for name, values in inputs.items()}
            rows[i].append(instance.run(row, model.sample, outputs, k)[1])
    one.close()
    two.close()
    yield Check("second instance next to the first", *_equal(np.array(rows[0]), np.array(rows[1])))


def _equal(a: np.ndarray, b: np.ndarray) -> tuple[str, bool]:
    same = np.array_equal(a, b)
    return ("equal to the last bit" if same else f"relative deviation {deviation(a, b):.2g}"), same


def refuses(call: Callable[[], object]) -> bool:
    """Whether a call ends with an error of the unit."""
    try:
        call()
    except Exception:  # FMPy's own exception, or its assertion
        return True
    return False


def _steps(unit: ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
    instance = unit.instance()
    instance.initialise()
    refused = {name: refuses(partial(instance.step, 0.0, h * model.sample)) for name, h in BAD_STEPS.items()}
    instance.step(0.0, model.sample)
    yield Check(
        "communication steps " + ", ".join(BAD_STEPS),
        f"{sum(refused.values())} of {len(refused)} refused",
        all(refused.values()),
    )
    instance.close()


def _pace(unit: ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
    begin = time.perf_counter()
    instance = unit.instance()
    instance.initialise()
    ready = time.perf_counter() - begin
    yield Check("load and initialise", f"{ready:.3f} s", None)
    cost = step_cost(instance, model.sample, 2000)
    yield Check(
        f"doStep of {1e3 * model.sample:g} ms",
        f"{cost * 1e6:.1f} us, {model.sample / cost:.1f} x real time",
        None,
    )
    instance.close()


def step_cost(instance: Instance, sample: float, n: int) -> float:
    """Median time [s] of a communication step of one sample."""
    times = np.empty(n)
    for k in range(n):
        begin = time.perf_counter()
        instance.step(k * sample, sample)
        times[k] = time.perf_counter() - begin
    return float(np.median(times))
