"""Checks of an exported unit: standard, trajectory against the Python plant, states, instances, step sizes, speed.

An identified model's unit is compared with `LpvModel.simulate`, and its derivatives with differences. The plant writes
what it is BEFORE a sample with that sample's inputs already held; a unit shows what it is at the END of a step. So row
k + 1 of the plant is what the unit shows after step k, but for what follows a held input at once (supply pressure, and
pins without actuators): there the rows at which that input has just changed are left out.

Files are validated against the official XML schemas of FMI 2.0, FMI 3.0 and SSP 1.0, as shipped with FMPy. The layered
standard of the stored reference (fmi-ls-ref) is published without a schema, so of its files only the manifest's
attributes are checked, by FMI 3.0's own schema of manifests.
"""

import io
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from fmu import importer
from fmu.archive import workspace
from fmu.export import law_unit, linear_unit, plant_unit
from fmu.linear_units import OUTPUTS, LawUnit, LinearUnit, answered
from fmu.model import PlantUnit, Unit
from fmu.variables import ROW
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.input_files import ArchiveError, read_archive
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.simulation import Simulation

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
    with importer.ImportedUnit(path) as unit:
        yield from _standard(path, unit)
        model = model_of(path)
        n = max(round(min(duration / model.sample, MOST_STEPS + 1)), 100)
        if n > MOST_STEPS:
            raise DataError(f"{path}: {duration:g} s take over {MOST_STEPS} steps of {model.sample:g} s; check less")
        jobs: list[Callable[[], Iterator[Check]]] = []
        if isinstance(model, PlantUnit):
            step, name = 5 * model.sample, f"{n * model.sample:g} s against the Python plant"
            jobs.append(lambda: iter([compare(unit, model, n, model.sample, name)]))
            text = f"the same in steps of {1e3 * step:g} ms"
            jobs.append(lambda: iter([compare(unit, model, max(n // 10, 20), step, text)]))
            jobs.append(lambda: _offered(unit, model, max(n // 10, 20)))
        elif isinstance(model, LinearUnit):
            jobs.append(lambda: linear_checks(unit, model, n))
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
    kind = importer.holds(path)
    if kind == "plant":
        plant = Plant(Machine.from_text(importer.machine_text(path)))
        return plant_unit(plant, *importer.start(path), importer.offered(path))
    with importer.opened(path) as files, workspace() as folder:
        file = folder / f"{kind}.json"  # a name of ours: that in the unit may be any path
        file.write_bytes(files[f"resources/{kind}.json"])
        unit = (law_unit if kind == "law" else linear_unit)(file, *importer.start(path))
        clocked = b"<Clock " in files["modelDescription.xml"]
        return replace(unit, clocked=True) if clocked and isinstance(unit, LawUnit) else unit


def _law(unit: importer.ImportedUnit, model: LawUnit, n: int) -> Check:
    """A swing of the disc while speed and pressure rise, in unit and law."""
    inputs = model.stimuli(n, model.sample)
    rows = run(unit, inputs, model.sample, list(OUTPUTS))
    return Check(f"{n * model.sample:g} s against the law in Python", *_equal(answered(model.law, inputs), rows))


def _standard(path: Path, unit: importer.ImportedUnit) -> Iterator[Check]:
    importer.fmpy()
    from fmpy.validation import validate_fmu

    with redirect_stdout(io.StringIO()):
        problems = validate_fmu(unit.folder)
    for name, found in (("fmpy validate", problems), ("official schemas", findings(path))):
        yield Check(name, f"{len(found)} problems{'' if not found else ': ' + found[0][:80]}", not found)


def _offered(unit: importer.ImportedUnit, model: PlantUnit, n: int) -> Iterator[Check]:
    """Every machine that the unit offers besides its own."""
    chosen = product(*(one.values for one in model.choices))
    for values, variant in list(zip(chosen, model.variants, strict=True))[1:]:
        start = {one.name: value for one, value in zip(model.choices, values, strict=True)}
        name = "with " + ", ".join(f"{key} = {value:.6g}" for key, value in start.items())
        yield compare(unit, variant, n, model.sample, name, start)


def compare(
    unit: importer.ImportedUnit,
    model: PlantUnit,
    n: int,
    step: float,
    name: str,
    start: Mapping[str, float] | None = None,
) -> Check:
    """A run-up with steps and a hit in unit and plant."""
    inputs = importer.reference_inputs(model, n, step)
    truth = plant_outputs(model, inputs, step)
    rows = run(unit, inputs, step, list(truth), start)
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


def run(
    unit: importer.ImportedUnit,
    inputs: Mapping[str, np.ndarray],
    step: float,
    outputs: list[str],
    start: Mapping[str, float] | None = None,
) -> np.ndarray:
    """A run of a fresh instance from its start values, or from others."""
    instance = unit.instance()
    instance.initialise(start)
    rows = instance.run(inputs, step, outputs)
    instance.close()
    return rows


def _reference(unit: importer.ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
    header, given = importer.stored(path, "in.csv")
    names, wanted = importer.stored(path, "out.csv")
    if not wanted:
        yield Check("stored reference", "none: exported for other computers only", True)
        return
    table, target = np.array(given), np.array(wanted)
    inputs = {name: table[:, k] for k, name in enumerate(header) if k}
    rows = run(unit, inputs, float(table[1, 0] - table[0, 0]), names[1:])
    worst = max(deviation(target[:, k + 1], rows[:, k]) for k in range(rows.shape[1]))
    yield Check("stored reference", f"relative deviation {worst:.2g}", worst < TOLERANCE)


def _replay(unit: importer.ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
    inputs, outputs = importer.reference_inputs(model, 200, model.sample), unit.names("output")
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


def _second(unit: importer.ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
    inputs, outputs = importer.reference_inputs(model, 100, model.sample), unit.names("output")
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


def _steps(unit: importer.ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
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


def _pace(unit: importer.ImportedUnit, model: Unit, path: Path) -> Iterator[Check]:
    begin = time.perf_counter()
    instance = unit.instance()
    instance.initialise()
    ready = time.perf_counter() - begin
    yield Check("load and initialise", f"{ready:.3f} s", None)
    cost = step_cost(instance, model.sample, 2000)
    yield Check(
        f"doStep of {1e3 * model.sample:g} ms", f"{cost * 1e6:.1f} us, {model.sample / cost:.1f} x real time", None
    )
    instance.close()


def step_cost(instance: importer.Instance, sample: float, n: int) -> float:
    """Median time [s] of a communication step of one sample."""
    times = np.empty(n)
    for k in range(n):
        begin = time.perf_counter()
        instance.step(k * sample, sample)
        times[k] = time.perf_counter() - begin
    return float(np.median(times))


POINTS = 5


def simulated(model: LinearUnit, inputs: dict[str, np.ndarray], step: float) -> np.ndarray:
    """Outputs (n + 1, 2) [m] of the model in Python for input rows of a unit held over `step` [s]."""
    per = round(step / model.sample)
    held = {name: np.repeat(values, per) for name, values in inputs.items()}
    u = np.stack([held["piezo.ref_x"], held["piezo.ref_y"]], axis=1)
    speed, pressure = (np.append(v, v[-1]) for v in (held["shaft.speed_ref"], held["injection.pressure"]))
    y = model.lpv.simulate(np.vstack([u, u[-1]]), speed, pressure, model.sample, tolerance=0.0)
    return np.asarray(y[::per])


def moving_inputs(model: LinearUnit, n: int) -> dict[str, np.ndarray]:
    """References that step and an operating point that moves through the range; it stays where C moves with it."""
    s = np.linspace(0.0, 1.0, n)
    moves = 0.0 if model.lpv.kind == "blackbox" else 1.0
    low, high = model.lpv.low, model.lpv.high
    return {
        "piezo.ref_x": np.where(s > 0.1, 0.5, 0.0),
        "piezo.ref_y": np.where(s > 0.5, -0.5, 0.0),
        "shaft.speed_ref": low[0] + (high[0] - low[0]) * moves * np.round(20 * s) / 20,
        "injection.pressure": low[1] + (high[1] - low[1]) * moves * np.round(10 * s) / 10,
    }


def model_exchange(unit: importer.ImportedUnit, stop: float | None = None) -> Any:
    """An instance for model exchange, in continuous-time mode at t = 0; `stop` [s] is the end of the run."""
    instance = importer.Instance(unit, "exchange", None, {}, "Model")
    instance.initialise(stop=stop)
    (instance.slave.updateDiscreteStates if unit.is_3 else instance.slave.newDiscreteStates)()
    instance.slave.enterContinuousTimeMode()
    return instance.slave


def jacobian(unit: importer.ImportedUnit, instance: Any, unknowns: list[str], knowns: list[str]) -> np.ndarray:
    """Directional derivatives (unknowns, knowns), column by column."""
    refs = {name: v.valueReference for name, v in unit.variables.items()}
    rows = [refs[name] for name in unknowns]
    columns = [instance.getDirectionalDerivative(rows, [refs[known]], [1.0]) for known in knowns]
    return np.array(columns, float).T


def names(model: LinearUnit) -> tuple[list[str], list[str]]:
    """Unknowns and knowns in the order of [A B; C D]."""
    states = [f"x[{k + 1}]" for k in range(model.order)]
    inputs = ["piezo.ref_x", "piezo.ref_y"]
    return [f"der({s})" for s in states] + ["disc.x", "disc.y"], states + inputs


def derivative_error(unit: importer.ImportedUnit, model: LinearUnit) -> float:
    """Largest deviation of the directional derivatives from A, B, C, D at random points, over the largest element."""
    rng, worst = np.random.default_rng(0), 0.0
    instance = model_exchange(unit)
    set_real = instance.setFloat64 if unit.is_3 else instance.setReal
    refs = [unit.variables[name].valueReference for name in ("shaft.speed_ref", "injection.pressure")]
    for _ in range(POINTS):
        q = rng.uniform(model.lpv.low, model.lpv.high)
        set_real(refs, q.tolist())
        found = jacobian(unit, instance, *names(model))
        m = model.lpv.at(*q)
        wanted = np.block([[m.A, m.B], [m.C, m.D]])
        worst = max(worst, float(np.abs(found - wanted).max() / np.abs(wanted).max()))
    instance.terminate()
    instance.freeInstance()
    return worst


def linear_checks(unit: importer.ImportedUnit, model: LinearUnit, n: int) -> Iterator[Check]:
    """A run over the range against the model in Python, and derivatives where it is continuous."""
    inputs = moving_inputs(model, n)
    truth = simulated(model, inputs, model.sample)
    instance = unit.instance()
    instance.initialise({name: float(values[0]) for name, values in inputs.items()})
    rows = instance.run(inputs, model.sample, ["disc.x", "disc.y"])
    instance.close()
    worst = deviation(truth, rows)
    yield Check(f"{n * model.sample:g} s against the Python model", f"relative deviation {worst:.2g}", worst < 1e-9)
    if model.continuous:
        error = derivative_error(unit, model)
        yield Check("directional derivatives against A, B, C, D", f"relative deviation {error:.2g}", error < 1e-12)


AT_ONCE = {
    "injection.line_pressure": ("injection.pressure",),
    "meas.pressure": ("injection.pressure",),
    "piezo.position": ("piezo.ref_x", "piezo.ref_y"),
    "meas.pin": ("piezo.ref_x", "piezo.ref_y"),
}


def plant_rows(model: PlantUnit, inputs: Mapping[str, np.ndarray], step: float) -> np.ndarray:
    """Input rows (samples, 6) of the plant for rows of a unit that are held over `step` [s]; the speed is linear."""
    per = round(step / model.sample)
    n = len(inputs["drive.on"])
    rows = np.zeros((n * per, 6))
    for column, name in enumerate(ROW):
        if column and name in inputs:
            rows[:, column] = np.repeat(inputs[name], per)
    before = np.concatenate([[model.speed], inputs["shaft.speed_ref"][:-1]])
    for k in range(per):
        end = inputs["shaft.speed_ref"]
        rows[k::per, 0] = end if k + 1 == per else before + (end - before) * ((k + 1) / per)
    rows[np.repeat(inputs["drive.on"], per) == 0.0, 0] = np.nan
    return rows


def plant_outputs(
    model: PlantUnit, inputs: Mapping[str, np.ndarray], step: float, seed: int = 0
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Values (n + 1,) of each output at the communication points, and which of them can be compared."""
    per = round(step / model.sample)
    rows = plant_rows(model, inputs, step)
    rows = np.vstack([rows, rows[-1:]])
    simulation = Simulation.at_equilibrium(model.assembly, model.speed, model.pressure, seed)
    table = simulation.advance(rows)
    found = {}
    for v in model.variables:
        if v.store == "output" and v.index < table.shape[1]:
            values = table[::per, v.index]
            if v.name == "film.touchdown":
                touched = table[1:, v.index].reshape(-1, per).max(axis=1)
                values = np.concatenate([table[:1, v.index], touched])
            found[v.name] = values, _comparable(model, v.name, inputs)
    if any(call.effect.port == "reference" for call in model.assembly.calls) and not model.assembly.rig.driven:
        _leave_out_late_jumps(model, table, per, found)
    return found


def _leave_out_late_jumps(
    model: PlantUnit, table: np.ndarray, per: int, found: Mapping[str, tuple[np.ndarray, np.ndarray]]
) -> None:
    """Take from what can be compared the communication points at which an ideal pin jumps in the plant's `table`.

    Effects on references let it jump later than the inputs; its sensor, if it has one, jumps with it.
    """
    for v in model.variables:
        if v.name.startswith("piezo.position") and v.name in found:
            jumps = np.diff(table[:, v.index], prepend=table[0, v.index])[::per] != 0
            for name in {v.name, v.name.replace("piezo.position", "meas.pin")} & set(found):
                found[name][1][jumps] = False


def _comparable(model: PlantUnit, name: str, inputs: Mapping[str, np.ndarray]) -> np.ndarray:
    n = len(inputs["drive.on"])
    good = np.ones(n + 1, bool)
    for prefix, causes in AT_ONCE.items():
        if name.startswith(prefix) and not ("piezo.ref_x" in causes and model.assembly.rig.driven > 0):
            for cause in causes:
                changes = np.flatnonzero(np.diff(inputs[cause]) != 0) + 1
                good[changes] = False
    # what the first row of the plant holds of the first inputs, the unit has only after its first step
    reals = [v for v in model.variables if v.store == "input" and v.kind == "real"]
    first = any(inputs[v.name][0] != float(v.start or 0.0) for v in reals)
    good[0] = good[0] and not (first and any(name.startswith(s) for s in AT_ONCE))
    return good


TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
MANIFEST = "fmi-ls-manifest.xml"
VALUES = "ssp/schema/SystemStructureParameterValues.xsd"
VALUES_ROOT = "{http://ssp-standard.org/SSP1/SystemStructureParameterValues}ParameterSet"
"""The schema of systems lets anything stand where the values of parameters are."""
UNCHECKED = "not checked, as FMPy has no schema of SSP 2.0"
"""Remark on a file without a schema: it breaks no rule that could be checked."""
LS_ROOT = "{http://fmi-standard.org/fmi-ls-manifest}fmiLayeredStandardManifest"


def findings(path: str | Path) -> list[str]:
    """Violations of the official schemas in a .fmu or .ssp file, and in the units of the latter, one sentence each.

    Raises DataError for what is no archive, or one that is not read.
    """
    try:
        return list(_archive(Path(path).read_bytes(), ""))
    except ArchiveError as error:
        raise DataError(f"{path}: {error}") from error


def _archive(content: bytes, where: str) -> Iterator[str]:
    for name, file in read_archive(content).items():
        if name.endswith(".ssd") and b'version="2.0"' in file.partition(b"<ssd:System ")[0]:
            yield f"{where}{name}: {UNCHECKED}"
            continue
        schema = _schema(name, file)
        if schema:
            yield from _violations(file, schema, where + name)
        elif name.endswith(".fmu") and not where:  # a unit holds no units
            yield from _archive(file, f"{name}: ")


def _schema(name: str, content: bytes) -> str | None:
    """File of the schema below FMPy's folder, None for a file that has none."""
    if name == "modelDescription.xml":
        version = b'fmiVersion="3' in content
        return "schema/fmi3/fmi3ModelDescription.xsd" if version else "schema/fmi2/fmi2ModelDescription.xsd"
    if name == TERMINALS:
        return "schema/fmi3/fmi3TerminalsAndIcons.xsd"
    if name.endswith(MANIFEST):
        return "schema/fmi3/fmi3LayeredStandardManifest.xsd"
    if name == "sources/buildDescription.xml":
        return "schema/fmi3/fmi3BuildDescription.xsd"
    return "ssp/schema/SystemStructureDescription.xsd" if name.endswith(".ssd") else None


def _violations(content: bytes, schema: str, name: str) -> Iterator[str]:
    folder = Path(importer.fmpy().__file__).parent
    from lxml import etree

    try:
        importer.xml(content)
        root: Any = etree.fromstring(content)
    except (ValueError, SyntaxError) as error:  # those of ElementTree and of lxml are syntax errors
        yield f"{name}: {error}"
        return
    if name.endswith(MANIFEST):  # a layered standard may name its root as it likes
        root.tag = LS_ROOT
    for part, rules in [(root, schema), *((values, VALUES) for values in root.iter(VALUES_ROOT))]:
        checker = etree.XMLSchema(file=str(folder / rules))
        if not checker.validate(part):
            yield from (f"{name}, line {entry.line}: {entry.message}" for entry in checker.error_log)
