"""Loops of diagnoses and experiments on machines with one hidden effect: the parts `decide` and `ties`.

A loop begins with the record of one operating point, so that many explanations tie, and makes the experiments that
are planned on the hidden machine. Seeds from `diagnose.REPORTING` on are for the figures that are reported.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.base.errors import RotorsimError
from rotorsim.discrepancy.calibration import CompiledModels
from rotorsim.discrepancy.candidates import candidates, class_of
from rotorsim.discrepancy.comparison import THREADS, simulate
from rotorsim.discrepancy.data_vector import make_layout
from rotorsim.discrepancy.decision import DecisionStep, DecisionSteps
from rotorsim.discrepancy.diagnosis import diagnose, trials_of
from rotorsim.discrepancy.experiments import ExperimentOption, options
from rotorsim.discrepancy.hidden_machine import HiddenTruth, hide, truth_twin
from rotorsim.discrepancy.loop import decide, record_on
from rotorsim.discrepancy.records import open_records
from rotorsim.discrepancy.twin import Twin
from rotorsim.discrepancy.verdict import SURE
from rotorsim.machine import Machine, load_machine
from studies.benchmarks.detectable import Detectable
from studies.benchmarks.diagnose import STEP
from studies.benchmarks.hidden_case import hidden_case, scaled
from studies.benchmarks.loop_case import LoopCase, Rejected, counted, read_cases
from studies.benchmarks.result import Figure

ALLOW = ("speed", "amplitude")
BUDGET = 6.5
"""Minutes of rig time: three experiments."""
LEAST = 2.0
"""Times its detectable size that a hidden effect has at least."""
POINTS = 1
"""Operating points of the records that a loop begins with."""
FAINT = (1.0, 3.0)
"""Times its detectable size that a hidden effect has where ties are looked for."""
TRIED = 3
"""Experiments that are tried where the first one has not decided: those in which the hidden effect shows most."""
UNBROKEN = f"the {TRIED} allowed experiments that show the effect most do not break the tie, alone, and leave it"


@dataclass(frozen=True)
class HiddenRig:
    """A hidden machine in memory."""

    machine: Machine
    twin: Twin
    truth: HiddenTruth
    records: list[Any]
    name: str = "hidden"

    def check(self, out: Any) -> None:
        """Nothing to check."""

    def begin(self, given: Any) -> list[Any]:
        """The records to begin with."""
        return self.records

    def arrived(self) -> list[Any]:
        """None: the machine is recorded by experiments alone."""
        return []

    def run(self, option: ExperimentOption, number: int, waiting: Callable[[], None]) -> list[Any]:
        """Record of an experiment."""
        return [record_on(self.machine, self.twin, self.truth.point, self.truth.seed, option, number)]


def loops(
    count: int, seed: int, path: Path | None = None, machine: str = "dtu_gas_bearing", faint: bool = False
) -> Iterator[LoopCase]:
    """Loops from seed on, whose hidden effect is large enough; of `faint` effects ties that one experiment can break.

    Seeds in the file `path` are not run again: neither loops, nor what was rejected.
    """
    done, loaded = read_cases(path), load_machine(machine)
    truth_plant, models = replace(truth_twin(loaded), step=STEP), CompiledModels.of(loaded)
    seen = Detectable.of(loaded, truth_plant, models)

    def run(number: int) -> LoopCase | Rejected:
        return run_loop(number, loaded, truth_plant, models, seen, faint)

    yield from counted(run, count, seed, done, path)


def run_loop(
    number: int, machine: Machine, truth_plant: Twin, models: CompiledModels, seen: Detectable, faint: bool = False
) -> LoopCase | Rejected:
    """One loop; rejected where the effect is too small, or where a `faint` one is not a tie that can be broken."""
    _, truth, records = hidden_case(number, "single", machine, truth_plant)
    times = seen.times(truth)
    if faint and times > 0:
        wanted = float(np.random.default_rng([number, 29]).uniform(*FAINT))
        truth, times = scaled(truth, wanted / times), wanted
        records = hide(machine, (), truth.seed, truth=truth, twin=truth_plant, tiled=True)
    elif times < LEAST:
        return Rejected(number, f"effect of {times:.3g} times its detectable size, less than {LEAST:g}")
    rng = np.random.default_rng([number, 23])
    fitted = sorted({r.attrs["record"].removesuffix("_repeat") for r in records if r.attrs["role"] == "fit"})
    chosen = set(rng.choice(fitted, POINTS, replace=False))
    own = [r for r in records if r.attrs["record"].removesuffix("_repeat") in chosen]
    hidden, seen_steps = tuple(f.key for f in truth.forms), list[DecisionSteps]()
    try:
        d = decide(machine, HiddenRig(machine, truth_plant, truth, own), BUDGET, allow=ALLOW, models=models,
                   shown=seen_steps.append)  # fmt: skip
    except RotorsimError as error:
        return LoopCase(number, hidden, times, (), (), (), (), f"error: {error}", "error")
    steps, known = seen_steps[-1], {f.key for f in candidates(models.twin)}
    tops, truths = zip(*(_of_step(step, hidden, known) for step in steps.steps), strict=True)
    chances = tuple(np.nan if s.expected_of_effects is None else s.expected_of_effects for s in steps.steps)
    made = tuple(s.experiment for s in steps.steps)
    case = LoopCase(number, hidden, times, tops, truths, chances, made, steps.end, d.status)
    if faint and not case.tie:
        return Rejected(number, f"no tie before the first experiment: {tops[0][0]}")
    if not faint or case.decided == 1:
        return case
    best = _best_known(HiddenRig(machine, truth_plant, truth, own), models, hidden, known)
    return case if best >= SURE else Rejected(number, f"{UNBROKEN} {100 * best:.1f} % at most")


def _best_known(rig: HiddenRig, models: CompiledModels, hidden: tuple[str, ...], known: set[str]) -> float:
    """Probability of the hidden effect after the best of the single experiments that show it most."""
    found = options(rig.machine, trials_of(rig.machine, open_records(rig.records), "fit"), ALLOW)
    best = 0.0
    for option in _by_change(rig, found)[:TRIED]:
        with suppress(RotorsimError):
            d = diagnose(rig.machine, [*rig.records, *rig.run(option, 1, lambda: None)], models=models)
            best = max(
                best, _of_step(DecisionStep(option.name, option.minutes, (), d.status, d.odds, 0.0), hidden, known)[1]
            )
    return best


def _by_change(rig: HiddenRig, found: Sequence[ExperimentOption]) -> list[ExperimentOption]:
    """Experiments by falling size of what the hidden effect changes in their lines."""
    points = (rig.truth.point, scaled(rig.truth, 0.0).point)
    rig.twin.assembly  # noqa: B018  (built once, before threads)

    def change(option: ExperimentOption) -> float:
        trial = option.trial(rig.machine)
        with_it, without = (trial.vector(simulate(rig.twin, trial, point)) for point in points)
        return float(np.linalg.norm((with_it - without)[make_layout([trial]).frequency > 0]))  # zeros are calibrated

    with ThreadPoolExecutor(THREADS) as pool:
        sizes = np.array(list(pool.map(change, found)))
    return [found[i] for i in np.argsort(-sizes, kind="stable")]


def _of_step(step: DecisionStep, hidden: tuple[str, ...], known: set[str]) -> tuple[tuple[str, float, bool], float]:
    """The most probable explanation of a step, and the probability of the hidden one."""
    if not step.odds:
        return ("", 0.0, False), 0.0
    target = sorted(class_of(key, known) for key in hidden)
    rights = {name: sorted(class_of(k, known) for k in name.split(" with ")) == target for name in step.odds}
    name = max(step.odds, key=lambda one: step.odds[one])
    return (name, step.odds[name], rights[name]), sum(p for n, p in step.odds.items() if rights[n])


def loop_figures(found: Sequence[LoopCase]) -> Iterator[Figure]:
    """Rates with the bounds that they should meet."""
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
