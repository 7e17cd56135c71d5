"""Loop of diagnoses and experiments: the changes that its experiments may make, and its steps.

The steps are kept in a file, so that an interrupted loop resumes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError
from rotorsim.base.files import write_json
from rotorsim.base.input_files import parse_json

if TYPE_CHECKING:
    from rotorsim.machine import Machine

ALLOWED = {
    "speed": "shaft speed, within the machine's range",
    "pressure": "injection pressure",
    "amplitude": "amplitude of the excitation",
    "axis": "excitation of one axis alone; of vectors of one probe, its angle",
    "bias": "constant part of the reference, which biases the pins",
    "step": "steps of the reference, held so that slow effects show",
    "trial-weight": "a known unbalance mounted in a balancing plane",
    "sensor-ring": "the ring of the displacement probes, turned by a stated angle",
    "slow-roll": "slow revolutions, in which the probes read runout",
    "coast-down": "vectors of 1X, 2X, 3X while the shaft slows down at a stated rate",
}
"""Changes that a plan may make from record to record, with their meaning."""
OF_VECTORS = ("speed", "axis", "trial-weight", "sensor-ring", "slow-roll", "coast-down")
"""Changes that a plan can make where all records are vectors of run-ups."""
FILE = "decision.json"
"""Name of the file of a loop's steps."""
VERSION = 1
"""Version of that file's format."""
ENDS = {
    "decided": "decided: one explanation has {sure:.3g} %",
    "budget": "the budget is spent",
    "inseparable": "no allowed experiment separates what is left",
    "no_plan": "no experiment can be planned: there are no odds, or only one explanation could be fitted",
    "no_record": "no record came in time",
    "open": "not ended: the same command continues",
}
"""Sentence on each end of a loop."""
FIRST, OTHERS = "records there are", "more records"
"""Names of steps without an experiment: the first one, and those after records that came by themselves."""


def check_allowed(names: Iterable[str]) -> tuple[str, ...]:
    """The names, each once, all of them for none; raises DataError for one that is unknown."""
    asked = tuple(name for name in dict.fromkeys(names) if name != "all")
    for unknown in (name for name in asked if name not in ALLOWED):
        raise DataError(
            f"--allow: '{unknown}' cannot be changed by a plan; {did_you_mean(unknown, ALLOWED)}",
            argument="allow",
            value=unknown,
        )
    return asked or tuple(ALLOWED)


def obstacles(machine: Machine, vectors: bool = False, one_probe: bool = False) -> dict[str, str]:
    """Reasons why a machine cannot change something, by name.

    `vectors` where all records are vectors of run-ups, `one_probe` where a record has a single displacement probe.
    """
    found: dict[str, str] = {}
    if not machine.injectors or machine.actuators is None:
        found |= dict.fromkeys(("bias", "step"), f"{machine.name} has no injectors with moving pins")
    if not machine.fed:
        found["pressure"] = f"{machine.name} has no injection pressure"
    if not machine.effects.get("unbalance"):
        found["trial-weight"] = f"{machine.name} has no [effects.unbalance] to add a weight to"
    if one_probe:
        found["sensor-ring"] = "the records are of one probe" + (", which 'axis' turns" if vectors else "")
    if vectors:
        others = (name for name in ALLOWED if name not in OF_VECTORS)
        found |= dict.fromkeys(others, "the records are vectors of run-ups, which show no excitation")
    return found


def allowed_here(
    machine: Machine, names: Iterable[str], vectors: bool = False, one_probe: bool = False
) -> tuple[str, ...]:
    """Allowed changes that the machine can make; raises DataError for a named one that it cannot."""
    asked, against = check_allowed(names), obstacles(machine, vectors, one_probe)
    can = tuple(name for name in ALLOWED if name not in against)
    if set(asked) == set(ALLOWED):
        return can
    for name in asked:
        if name in against:
            raise DataError(
                f"--allow: '{name}' cannot be changed, {against[name]}; allow {', '.join(can)}",
                argument="allow",
                value=name,
            )
    return asked


@dataclass(frozen=True)
class DecisionStep:
    """A diagnosis of a loop: the experiment before it with its minutes and files, and the odds after it.

    `experiment` is empty for the first one, and where records came that no experiment was proposed for.

    `expected` is the chance of a decision that the plan had given for the experiment, `expected_of_effects` that if an
    effect is missing; `entropy` [bit] is that of the odds.
    """

    experiment: str
    minutes: float
    records: tuple[str, ...]
    status: str
    odds: Mapping[str, float]
    entropy: float
    expected: float | None = None
    expected_of_effects: float | None = None


@dataclass(frozen=True)
class DecisionSteps:
    """All steps of a loop so far; `asked` holds the options it was begun with."""

    asked: Mapping[str, Any]
    steps: tuple[DecisionStep, ...] = ()
    end: str = "open"
    pending: Mapping[str, Any] = field(default_factory=dict)
    """The experiment that comes next; with its records once it was made. Without a name: other records that came."""
    first: tuple[str, ...] = ()
    """Files that were there before the first experiment."""

    @property
    def spent(self) -> float:
        """Minutes of rig time."""
        return sum(step.minutes for step in self.steps) + (self.pending["minutes"] if self.made else 0.0)

    @property
    def made(self) -> bool:
        """Whether the experiment that comes next was made, and not diagnosed yet."""
        return bool(self.pending.get("records"))

    @property
    def records(self) -> list[str]:
        """Files of all experiments of the loop."""
        return [path for step in self.steps for path in step.records] + list(self.pending.get("records", ()))

    @property
    def sentence(self) -> str:
        """Sentence on the end of the loop."""
        sure = 100 * float(self.asked.get("sure", 0.95))
        made = sum(bool(step.experiment) for step in self.steps)
        count = f"{made} experiment{'' if made == 1 else 's'}"
        return f"{ENDS[self.end].format(sure=sure)}; {count}, {self.spent:.0f} min of rig time."

    @property
    def names(self) -> list[str]:
        """Experiment before each step, or records without one."""
        return [step.experiment or (OTHERS if number else FIRST) for number, step in enumerate(self.steps)]

    def with_new(self, files: Sequence[str]) -> DecisionSteps:
        """Steps with new files: records of the experiment that was proposed before, else other records."""
        if not files:
            return self
        ahead = self.pending or {"experiment": "", "minutes": 0.0}
        return replace(self, pending={**ahead, "records": (*ahead.get("records", ()), *files)})

    def with_step(self, step: DecisionStep) -> DecisionSteps:
        """Steps with a further one."""
        return replace(self, steps=(*self.steps, step), pending={})

    def write(self, folder: Path) -> None:
        """Write the steps into the folder of the loop, whole or not at all; raises WriteError."""
        write_json(folder / FILE, {"version": VERSION, **asdict(self)}, indent=2, default=float)

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and text, for JSON."""
        return {
            "end": self.end,
            "sentence": self.sentence,
            "minutes": self.spent,
            "steps": list(map(asdict, self.steps)),
        }

    def table(self) -> str:
        """Odds after each step, as text."""
        names = dict.fromkeys(n for step in self.steps for n, p in step.odds.items() if p >= 0.01)
        rows = [["step", "experiment", "min", "bit", *names]]
        for number, (step, before) in enumerate(zip(self.steps, self.names, strict=True)):
            odds = [f"{100 * step.odds.get(name, 0.0):.0f} %" for name in names]
            rows.append([f"{number}", before, f"{step.minutes:.0f}", f"{step.entropy:.2f}", *odds])
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        return "\n".join("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in rows)


def read_steps(folder: Path, asked: Mapping[str, Any]) -> DecisionSteps:
    """Steps of a loop in a folder, none for a new one; raises DataError for a loop that was begun otherwise."""
    path = folder / FILE
    if not path.exists():
        return DecisionSteps(dict(asked))
    try:
        table = parse_json(path.read_text(encoding="utf-8-sig"))
        if table.pop("version") != VERSION:
            raise ValueError("version")
        steps = tuple(DecisionStep(**(row | {"records": tuple(row["records"])})) for row in table.pop("steps"))
        found = DecisionSteps(**(table | {"first": tuple(table["first"])}), steps=steps)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise DataError(
            f"{path}: does not hold the steps of a loop; give another folder, or replace it by force",
            argument="out",
            value=str(folder),
        ) from error
    differs = [name for name in asked if asked[name] != found.asked.get(name)]
    if differs:
        raise DataError(
            f"{path}: is of a loop with {differs[0]} = {found.asked.get(differs[0])}, not {asked[differs[0]]}; give "
            "another folder, or begin anew by force",
            argument=differs[0],
            value=asked[differs[0]],
        )
    missing = [name for step in found.steps for name in step.records if not Path(name).exists()]
    if missing:
        raise DataError(
            f"{missing[0]}: is a record of the loop in {path} and is gone; bring it back, or begin anew by force",
            argument="records",
            value=missing[0],
        )
    waiting = tuple(name for name in found.pending.get("records", ()) if Path(name).exists())
    return replace(found, pending={**found.pending, "records": waiting}) if found.pending else found
