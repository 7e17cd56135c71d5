"""Loops of diagnoses and experiments on machines with one hidden effect: `rotorsim bench decide` and `bench ties`.

A loop begins with the record of one operating point, so that many explanations tie, and makes the experiments that
are planned on the hidden machine. Seeds from `diagnose.REPORTING` on are for the figures that are reported.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.files import write_text
from rotorsim.bench.detectable import Detectable
from rotorsim.bench.diagnose import STEP
from rotorsim.bench.hidden_case import hidden_case
from rotorsim.bench.result import Figure
from rotorsim.discrepancy.blind_test.hide import Truth, hide, scaled, truth_twin
from rotorsim.discrepancy.diagnosis import Workshop
from rotorsim.discrepancy.loop.decide import decide
from rotorsim.discrepancy.loop.rigs import record_on
from rotorsim.discrepancy.loop.steps import Step, Steps
from rotorsim.discrepancy.odds.explanation import SURE
from rotorsim.discrepancy.plan.options import Option
from rotorsim.discrepancy.search.candidates import candidates
from rotorsim.discrepancy.search.indistinguishable import class_of
from rotorsim.discrepancy.twin.twin import Twin
from rotorsim.machine import Machine, load_machine

ALLOW = ("speed", "amplitude")
BUDGET = 6.5
"""Minutes of rig time: three experiments."""
LEAST = 2.0
"""Times its detectable size that a hidden effect has at least."""
POINTS = 1
"""Operating points of the records that a loop begins with."""
FAINT = (1.0, 3.0)
"""Times its detectable size that a hidden effect has where ties are looked for."""


@dataclass(frozen=True)
class LoopCase:
    """A loop's outcome: the most probable explanation after each step, its probability and whether it is right.

    truths : probability of the hidden one after each step
    expected : chance of a decision that the plan gave for the experiment before a step; NaN for the first
    """

    number: int
    hidden: tuple[str, ...]
    times: float
    tops: tuple[tuple[str, float, bool], ...]
    truths: tuple[float, ...]
    expected: tuple[float, ...]
    experiments: tuple[str, ...]
    end: str
    status: str

    @property
    def decided(self) -> int | None:
        """Experiments after which the hidden explanation had 95 %; None if it never had."""
        return next((k for k, p in enumerate(self.truths) if p >= SURE), None)

    @property
    def tie(self) -> bool:
        """Whether no explanation had 95 % before the first experiment."""
        return bool(self.tops) and self.tops[0][1] < SURE

    @property
    def wrong(self) -> bool:
        """Whether another explanation ever had 95 %."""
        return any(p >= SURE and not right for _, p, right in self.tops)


@dataclass(frozen=True)
class HiddenRig:
    """A hidden machine in memory."""

    machine: Machine
    twin: Twin
    truth: Truth
    records: list[Any]
    name: str = "hidden"

    def check(self, out: Any) -> None:
        """It is there."""

    def begin(self, given: Any) -> list[Any]:
        """The records to begin with."""
        return self.records

    def arrived(self) -> list[Any]:
        """None: the machine is recorded by experiments alone."""
        return []

    def run(self, option: Option, number: int, waiting: Callable[[], None]) -> list[Any]:
        """Record of an experiment."""
        return [record_on(self.machine, self.twin, self.truth.point, self.truth.seed, option, number)]


def loops(
    count: int, seed: int, path: Path | None = None, machine: str = "dtu_gas_bearing", faint: bool = False
) -> Iterator[LoopCase]:
    """Loops from seed on, whose hidden effect is large enough; those in the file `path` are not run again.

    Those of `faint` effects are taken that tie at first.

    Examples
    --------
    >>> import rotorsim as rs
    >>> for case in rs.bench.loops(1, 100_000):  # doctest: +SKIP
    ...     print(case.hidden, case.decided)
    """
    done, loaded = _kept(path), load_machine(machine)
    truth_plant, workshop = replace(truth_twin(loaded), step=STEP), Workshop.of(loaded)
    seen = Detectable.of(loaded, truth_plant, workshop)
    found, number = 0, seed
    while found < count:
        if number not in done:
            case = run_loop(number, loaded, truth_plant, workshop, seen, faint)
            if case is not None and (case.tie or not faint):
                done[number] = case
                _keep(done, path)
        if number in done:
            found += 1
            yield done[number]
        number += 1


def run_loop(
    number: int, machine: Machine, truth_plant: Twin, workshop: Workshop, seen: Detectable, faint: bool = False
) -> LoopCase | None:
    """One loop; none for an effect that is too small."""
    _, truth, records = hidden_case(number, "single", machine, truth_plant)
    times = seen.times(truth)
    if faint and times > 0:
        wanted = float(np.random.default_rng([number, 29]).uniform(*FAINT))
        truth, times = scaled(truth, wanted / times), wanted
        records = hide(machine, (), truth.seed, truth=truth, twin=truth_plant, tiled=True)
    elif times < LEAST:
        return None
    rng = np.random.default_rng([number, 23])
    fitted = sorted({r.attrs["record"].removesuffix("_repeat") for r in records if r.attrs["role"] == "fit"})
    chosen = set(rng.choice(fitted, POINTS, replace=False))
    own = [r for r in records if r.attrs["record"].removesuffix("_repeat") in chosen]
    seen_steps: list[Steps] = []
    try:
        d = decide(machine, HiddenRig(machine, truth_plant, truth, own), BUDGET, allow=ALLOW, workshop=workshop,
                   shown=seen_steps.append)  # fmt: skip
    except RotorsimError as error:
        return LoopCase(number, tuple(f.key for f in truth.forms), times, (), (), (), (), f"error: {error}", "error")
    hidden = tuple(f.key for f in truth.forms)
    steps, known = seen_steps[-1], {f.key for f in candidates(workshop.twin)}
    tops, truths = zip(*(_of_step(step, hidden, known) for step in steps.steps), strict=True)
    return LoopCase(
        number, hidden, times, tops, truths, tuple(np.nan if s.expected is None else s.expected for s in steps.steps),
        tuple(s.experiment for s in steps.steps), steps.end, d.status,
    )  # fmt: skip


def _of_step(step: Step, hidden: tuple[str, ...], known: set[str]) -> tuple[tuple[str, float, bool], float]:
    """The most probable explanation of a step, and the probability of the hidden one."""
    target = sorted(class_of(key, known) for key in hidden)
    rights = {name: sorted(class_of(k, known) for k in name.split(" with ")) == target for name in step.odds}
    name = max(step.odds, key=lambda one: step.odds[one])
    return (name, step.odds[name], rights[name]), sum(p for n, p in step.odds.items() if rights[n])


def loop_figures(found: list[LoopCase]) -> Iterator[Figure]:
    """Rates with the bounds that they should meet.

    Examples
    --------
    >>> import rotorsim as rs
    >>> for figure in rs.bench.loop_figures(list(rs.bench.loops(10, 100_000))):  # doctest: +SKIP
    ...     print(figure.name, figure.value)
    """
    decided = [c.decided is not None for c in found]
    yield Figure("loops not decided within three experiments", 1 - float(np.mean(decided)), "1", 0.10)
    yield Figure("loops with a wrong explanation at 95 %", float(sum(c.wrong for c in found)), "1", 0.0)
    ties = [c for c in found if c.tie]
    breakable = [c for c in ties if len(c.truths) > 1]
    for most, bound in ((1, 0.2), (2, 0.05)):
        broken = [c.decided is not None and c.decided <= most for c in breakable]
        left = 1 - float(np.mean(broken)) if broken else np.nan
        yield Figure(f"ties not broken by {most} experiments, of {len(breakable)}", left, "1", bound)
    pairs = [(e, t >= SURE) for c in found for e, t in zip(c.expected[1:], c.truths[1:], strict=True)]
    if pairs:
        promised, kept = np.array(pairs, float).T
        yield Figure("promised chance of a decision, mean", float(promised.mean()), "1")
        yield Figure("decisions that came", float(kept.mean()), "1")


def _keep(done: Mapping[int, LoopCase], path: Path | None) -> None:
    if path is not None:
        write_text(path, "".join(json.dumps(asdict(case)) + "\n" for case in done.values()))


def _kept(path: Path | None) -> dict[int, LoopCase]:
    """Loops by number that are in a file."""
    done: dict[int, LoopCase] = {}
    lines = path.read_text(encoding="utf-8").splitlines() if path is not None and path.exists() else []
    for number, line in enumerate(lines, 1):
        try:
            row: dict[str, Any] = json.loads(line)
            lists = {k: v for k, v in row.items() if isinstance(v, list)}
            tuples = {k: tuple(map(tuple, v)) if k == "tops" else tuple(v) for k, v in lists.items()}
            done[row["number"]] = LoopCase(**(row | tuples))
        except (ValueError, KeyError, TypeError) as error:
            text = f"{path}: line {number} is not a case of 'rotorsim bench decide'; name another file"
            raise DataError(text) from error
    return done
