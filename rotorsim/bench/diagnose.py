"""How often a diagnosis is right, on machines in which something is hidden: `rotorsim bench diagnose`.

Cases are drawn in turn from kinds: nothing hidden, one effect, two, something that the catalogue does not have, an
effect that is taken out of the candidates, an undisclosed error of the injectors' law, and noise three times as high.
Records come from the full plant on a finer grid and step. Seeds below `REPORTING` are for tuning, those from it on for
the figures that are reported.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.bench.detectable import Detectable
from rotorsim.bench.result import Figure
from rotorsim.discrepancy import Diagnosis, diagnose, hide
from rotorsim.discrepancy.candidates import candidates
from rotorsim.discrepancy.classes import class_of
from rotorsim.discrepancy.design import Planned
from rotorsim.discrepancy.gap import reduction
from rotorsim.discrepancy.hidden import Truth, draw, truth_twin
from rotorsim.discrepancy.knobs import REFERENCE_PRESSURE, Knob, contributions, setting
from rotorsim.discrepancy.twin import Twin
from rotorsim.discrepancy.workflow import Workshop
from rotorsim.errors import DataError, RotorsimError
from rotorsim.machine import Machine, load_machine

REPORTING = 100_000
"""First seed of the reported figures; tuning uses those below."""
KINDS = ("none", "single", "single", "pair", "foreign", "single", "left_out", "law", "noise", "single")
"""What cases are, in turn."""
STEP = 2e-4 / 3
"""Step [s] of the records: a third of that of a diagnosis; their grid is that of `hide`."""
UNSEEN = ("creep", "slip", "viscosity", "torque_ripple", "rub", "base_vibration", "unbalance", "supply_droop")
"""Effects that are not drawn: undetectable on this rig with an excitation that has no mean, shape parameters that a
draw does not vary, or (a droop of the supply) told by the records' own gauge, which sits at the injectors."""
INJECTOR = " of injector "
MOST_DRAWS, AGAIN = 20, 10_000_000
"""How often a machine is drawn, and what lies between the seeds."""
ABOVE = 2.2
"""Times its detectable size above which a single effect should nearly always be named."""


@dataclass(frozen=True)
class Case:
    """One case's outcome."""

    number: int
    kind: str
    hidden: tuple[str, ...]
    steps: float
    times: float
    """How many times its detectable size the least hidden effect has."""
    status: str
    named: tuple[str, ...]
    verdict: str
    seconds: float
    reduction: float
    within: float
    """Share of the hidden parameters within two standard deviations (NaN where none was named)."""
    cpu: float
    """Seconds of one core."""


def foreign(kind: int) -> Callable[[np.ndarray, Planned], np.ndarray]:
    """A disturbance of the inputs that no effect of the catalogue makes."""

    def disturb(rows: np.ndarray, planned: Planned) -> np.ndarray:
        t = np.arange(len(rows)) * 2e-4
        angle = rows[0, 0] * t
        if kind == 0:
            rows[:, 4] += 0.6 * np.sin(2 * np.pi * 136.25 * t)
        elif kind == 1:
            rows[:, 4] += 0.5 * np.cos(4 * angle)
            rows[:, 5] += 0.5 * np.sin(4 * angle)
        elif kind == 2:
            rows[:, 5] += 0.8 * np.cos(0.5 * angle)
        elif kind == 3:
            rows[:, 1] *= 1 + 0.03 * np.sin(2 * np.pi * 31.25 * t)
        else:
            slow = 1 + 0.8 * np.cos(2 * np.pi * 6.25 * t)
            rows[:, 4] += 1.5 * slow * np.cos(angle)
            rows[:, 5] += 1.5 * slow * np.sin(angle)
        return rows

    return disturb


@dataclass(frozen=True)
class Bent(Knob):
    """A knob that counts by another power of the pressure than the calibration's trend does."""

    power: float = 0.0

    def share(self, speed: float, pressure: float) -> float:
        """1 at 1 MPa, 0 at the reference pressure."""
        return float(((pressure / REFERENCE_PRESSURE) ** self.power - 1) / (2**self.power - 1))


def law_error(truth: Truth, rng: np.random.Generator) -> Truth:
    """Another pressure law of the pins: 5 % more or less flow when the pressure doubles, by some power of it."""
    knob = Bent("discharge_drift.0.drift", 0.02, trend="pressure", power=float(rng.choice([-1.0, 0.5, 2.0])))
    values = {**truth.point.values, knob: float(rng.choice([-0.05, 0.05]))}
    return replace(truth, point=replace(truth.point, values=values))


def run_case(
    number: int, machine: Machine, truth_plant: Twin, workshop: Workshop, seen: Detectable, threads: int = 1
) -> Case:
    """Hide and diagnose."""
    kind = KINDS[number % len(KINDS)]
    picked, truth, records = _hidden(number, kind, machine, truth_plant)
    begin, used = time.perf_counter(), time.process_time()
    effects = None
    if kind == "left_out":
        out = {f.effect for f in truth.forms}
        effects = [e for e in workshop.twin.slots if e not in out]
    steps = max((abs(complex(*a, *([0] * (2 - len(a))))) / f.knobs[0].step
                 for f, a in zip(truth.forms, truth.amplitudes, strict=True)), default=0.0)  # fmt: skip
    times = seen.times(truth)
    try:
        d = diagnose(machine, records, effects=effects, workshop=workshop, threads=threads)
    except RotorsimError as error:
        said = f"error: {error}"
        return Case(number, kind, tuple(picked), steps, times, said, (), "silent", 0.0, np.nan, np.nan, 0.0)
    seconds, cpu = time.perf_counter() - begin, time.process_time() - used
    named = tuple(f.form for f in d.effects)
    hidden = tuple(f.key for f in truth.forms)
    verdict = judged(kind, hidden, d, {f.key for f in candidates(workshop.twin)})
    gone, inside = reduction(d.gap), _within(d, truth, workshop.twin)
    return Case(number, kind, hidden, steps, times, d.status, named, verdict, seconds, gone, inside, cpu)


def _hidden(number: int, kind: str, machine: Machine, truth_plant: Twin) -> tuple[list[str], Truth, list[Any]]:
    """Effects, truth and records of a case; a machine that does not lift off is drawn again."""
    rng = np.random.default_rng([number, 11])
    pool = sorted({f.key for f in candidates(truth_plant) if f.effect not in UNSEEN})
    count = {"single": 1, "left_out": 1, "pair": 2}.get(kind, 0)
    for attempt in range(MOST_DRAWS):
        seed = number + attempt * AGAIN
        picked = _pick(pool, count, rng)
        truth = draw(truth_plant, picked, seed)
        disturb = foreign(int(rng.integers(5))) if kind == "foreign" else None
        if kind == "law":
            truth = law_error(truth, rng)
        if kind == "noise":
            values = {**truth.point.values, Knob("noise.0.sigma", 1e-7): 0.66e-6}
            truth = replace(truth, point=replace(truth.point, values=values))
        with suppress(DataError):
            records = hide(machine, picked, seed, truth=truth, disturb=disturb, twin=truth_plant, tiled=True)
            return picked, truth, records
    raise DataError(f"bench: case {number} has no machine that lifts off; begin with another seed")


def _pick(pool: list[str], count: int, rng: np.random.Generator) -> list[str]:
    """Keys of different effects."""
    while True:
        picked = [pool[i] for i in rng.choice(len(pool), count, replace=False)]
        if len({p.split(".")[0] for p in picked}) == count:
            return picked


def judged(kind: str, hidden: tuple[str, ...], d: Diagnosis, known: set[str]) -> str:
    """right (exact), class (a tie that holds it), silent, partial (or one of two), or wrong (a name that is not it)."""
    if d.status in ("no_disagreement", "unknown"):
        return "right" if not hidden and (d.status == "no_disagreement" or kind == "foreign") else "silent"
    if d.status == "partial":
        return "partial"
    said = [tuple(f.form for f in d.effects), *d.ties]
    target = sorted(class_of(h, known) for h in hidden)
    parts = [sorted(class_of(k, known) for k in keys) for keys in said]
    holds = [own == target for own in parts]
    if kind == "left_out":
        # what is named instead is no error if no record could tell it from what is hidden
        return "class" if any(holds) else "wrong"
    if any(len(own) < len(target) and all(c in target for c in own) for own in parts) and not any(holds):
        return "partial"
    if d.status == "named":
        due = any(len(class_of(h, known)) > 1 for h in hidden)
        return "right" if holds[0] and not due else "wrong"
    return "class" if any(holds) and hidden else "wrong"


def _within(d: Diagnosis, truth: Truth, twin: Twin) -> float:
    """Share of the hidden parameters within two standard deviations of what was found."""
    inside = []
    for found in d.effects if d.status in ("named", "tie") else ():
        for form, amplitude in zip(truth.forms, truth.amplitudes, strict=True):
            if form.key != found.form:
                continue
            hidden = setting(twin, contributions(dict(zip(form.knobs, amplitude, strict=True)), 0.0, 0.0), form.fixed)
            for key, value in hidden.items():
                parameter = key.split(".")[2]
                if parameter in found.sd:
                    away = _apart(found.parameters[parameter] - value, parameter, hidden, key)
                    inside.append(away < 2 * found.sd[parameter])
    return float(np.mean(inside)) if inside else float("nan")


def _apart(difference: float, parameter: str, hidden: dict[str, float], key: str) -> float:
    """Size of a difference; phases repeat after a turn, places of lobes after one lobe."""
    if not parameter.endswith("phase"):
        return abs(difference)
    turn = 2 * np.pi / hidden.get(key.replace("_phase", "_lobes"), 1.0)
    return abs((difference + turn / 2) % turn - turn / 2)


def cases(count: int, seed: int, path: Path | None = None, machine: str = "dtu_gas_bearing") -> Iterator[Case]:
    """Cases from seed on; those in the file `path` already are not run again, new ones are appended."""
    loaded = load_machine(machine)
    truth_plant, workshop = replace(truth_twin(loaded), step=STEP), Workshop.of(loaded)
    seen = Detectable.of(loaded, truth_plant, workshop)
    done: dict[int, Case] = {}
    if path is not None and path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            told: dict[str, Any] = json.loads(line)
            told["hidden"], told["named"] = tuple(told["hidden"]), tuple(told["named"])
            done[told["number"]] = Case(**told)
    for number in range(seed, seed + count):
        case = done.get(number) or run_case(number, loaded, truth_plant, workshop, seen)
        if path is not None and number not in done:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(case)) + "\n")
        yield case


def confusion(found: list[Case]) -> str:
    """Verdicts by kind as a table."""
    columns = ("right", "class", "partial", "silent", "wrong")
    rows = ["| kind | cases | " + " | ".join(columns) + " |", "|---|---|" + "---|" * len(columns)]
    for kind in dict.fromkeys(KINDS):
        own = [c for c in found if c.kind == kind]
        if own:
            counts = [sum(c.verdict == v for c in own) for v in columns]
            rows.append(f"| {kind} | {len(own)} | " + " | ".join(map(str, counts)) + " |")
    return "\n".join(rows)


def _place(key: str) -> str:
    """Which injector a key is of; '' where it is of none."""
    return key.partition(INJECTOR)[2]


def figures(found: list[Case]) -> Iterator[Figure]:
    """Rates beside what they should reach; a bound on what must be small, none on what must be large."""

    def share(kinds: tuple[str, ...], verdicts: tuple[str, ...], least: float = 0.0) -> float:
        own = [c for c in found if c.kind in kinds and c.times >= least]
        return sum(c.verdict in verdicts for c in own) / len(own) if own else float("nan")

    yield Figure("singles not named (exact or class)", 1 - share(("single",), ("right", "class"), 1.0), "1", 0.30)
    yield Figure(
        f"singles above {ABOVE}x the detectable size not named",
        1 - share(("single",), ("right", "class"), ABOVE), "1", 0.10,
    )  # fmt: skip
    yield Figure("singles, wrong names", share(("single",), ("wrong",)), "1", 0.03)
    yield Figure("no effect, wrong names", share(("none",), ("wrong",)), "1", 0.03)
    yield Figure("out of the catalogue, wrong names", share(("foreign",), ("wrong",)), "1", 0.03)
    yield Figure("error of the injectors' law, wrong names", share(("law",), ("wrong",)), "1", 0.03)
    yield Figure("left out of the candidates, wrong names", share(("left_out",), ("wrong",)), "1", 0.10)
    yield Figure("noise x3, wrong names", share(("noise",), ("wrong",)), "1", 0.0)
    yield Figure("pairs not both named", 1 - share(("pair",), ("right", "class"), 1.0), "1", 0.40)
    yield Figure("pairs, wrong names", share(("pair",), ("wrong",)), "1", 0.05)
    told = [c for c in found if c.verdict in ("right", "class") and c.named]
    left = [1 - c.reduction for c in told if np.isfinite(c.reduction)]
    if left:
        yield Figure("gap left on untouched records, median", float(np.median(left)), "1", 0.20)
        yield Figure("gap left on untouched records, tenth percentile", float(np.percentile(left, 90)), "1", 0.50)
    numbered = [c for c in told if any(INJECTOR in key for key in c.hidden)]
    if numbered:
        missed = [c for c in numbered if not {_place(k) for k in c.hidden} & {_place(k) for k in c.named}]
        yield Figure("another injector than the hidden one", len(missed) / len(numbered), "1", 0.10)
    inside = [c.within for c in told if np.isfinite(c.within)]
    if inside:
        yield Figure("true sizes beyond two standard deviations", 1 - float(np.mean(inside)), "1", 0.10)
    seconds = [c.seconds for c in found if c.seconds > 0]
    if seconds:
        yield Figure("one diagnosis, median", float(np.median(seconds)), "s", 180.0)
        yield Figure("one diagnosis, median, one core's time", float(np.median([c.cpu for c in found])), "s")
        yield Figure("one diagnosis, longest", float(max(seconds)), "s", 900.0)
