"""Campaign plan: machines, experiments and axes with checked values; cases are generated on demand.

A case is a machine, its changes, an experiment and a seed, with a hash of all inputs as its key. Its table [changes]
states what is changed on purpose on the rig for its records, written as in a mapping:

::

    [changes]
    trial_weight = { me = "12 g*mm", phase = "30 deg" }    # or a list; with `position`, another plane than the disc's
    sensor_ring = { angle = "30 deg" }                     # of both probes, from x towards y
    "effects.gas_heating.rise" = "12 K"                    # a new value of the machine file

Each record states it in its attribute `changes`, so that `rotorsim diagnose` takes it into account.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any

import numpy as np

from identification.records.mapping import stated_changes
from rotorsim.base.display import Card, Shown, quote
from rotorsim.base.errors import RotorsimError
from rotorsim.base.input_files import parse_json
from rotorsim.campaign.axes import KINDS, Axis, PlanError, Value, change, make
from rotorsim.discrepancy.changes import RING, WEIGHT, known_changes, with_ring
from rotorsim.experiments.experiment import parameters
from rotorsim.machine import Machine

FORMAT = 1
"""Number in every key, which changes when the same case would be written another way."""
CHANGES = "changes"


@dataclass(frozen=True)
class Case:
    """Case as sent to a worker; `machine` is the hash of the base machine's text, `set` its changed values.

    `changes` is what its record states as changed on purpose, a JSON text; a case without has the key it always had.
    """

    machine: str
    set: tuple[tuple[str, Value], ...]
    kind: str
    parameters: tuple[tuple[str, Value], ...]
    seed: int
    keep: tuple[str, ...] | None
    changes: str = ""

    @property
    def key(self) -> str:
        """Hash of the content, 32 hexadecimal digits."""
        return hashlib.sha256(f"{FORMAT} {self.text}".encode()).hexdigest()[:32]

    @property
    def text(self) -> str:
        """The case as JSON, exact to the last bit."""
        content = {name: value for name, value in vars(self).items() if name != "changes" or value}
        return json.dumps(content, sort_keys=True)

    @classmethod
    def from_text(cls, text: str) -> Case:
        """The case of its JSON."""
        content: dict[str, Any] = parse_json(text)
        pairs = {name: tuple((key, value) for key, value in content[name]) for name in ("set", "parameters")}
        keep = None if content["keep"] is None else tuple(content["keep"])
        return cls(**{**content, **pairs, "keep": keep})


def text_hash(text: str) -> str:
    """Hash of a machine's text, used as its name."""
    return hashlib.sha256(text.encode()).hexdigest()[:32]


@dataclass(frozen=True)
class NumberedCase:
    """Case with its number, experiment name, repeat and axis values in the campaign."""

    number: int
    experiment: str
    repeat: int
    values: dict[str, Value]
    case: Case


@dataclass(frozen=True)
class PlannedExperiment:
    """Experiment of a plan: name, kind, fixed parameters in SI, seed."""

    name: str
    kind: str
    parameters: dict[str, Value]
    seed: int

    def takes(self, axis: Axis) -> bool:
        """Whether an axis changes anything for this experiment."""
        known = {entry.name for entry, _ in parameters(KINDS[self.kind])}
        return axis.target.kind != "parameter" or axis.name in known


@dataclass(frozen=True, repr=False)
class Plan(Shown):
    """Campaign plan; frozen, and identical on every computer that reads the same texts."""

    name: str
    description: str
    text: str
    machines: dict[str, str]
    set: tuple[tuple[str, Value], ...]
    entries: tuple[PlannedExperiment, ...]
    axes: tuple[Axis, ...]
    repeats: int
    different_seeds: bool
    keep: tuple[str, ...] | None
    summary: tuple[str, ...]
    time_limit: float
    changes: str = ""

    def card(self) -> Card:
        """Cases, machines, experiments, axes and repeats."""
        rows = [
            ("machines", ", ".join(self.machines)),
            ("experiments", ", ".join(entry.name for entry in self.entries)),
            ("axes", ", ".join(f"{axis.name} ({len(axis.values)})" for axis in self.axes) or "none"),
            ("repeats", f"{self.repeats}"),
            ("time limit", f"{self.time_limit:g} s a case"),
        ]
        return Card(f"Plan {self.name}: {len(self)} cases", rows)

    def __len__(self) -> int:
        return sum(self._sizes)

    @cached_property
    def _sizes(self) -> tuple[int, ...]:
        return tuple(
            prod(len(steps[0].values) for steps in self._steps[entry.name]) * self.repeats for entry in self.entries
        )

    def axes_of(self, entry: PlannedExperiment) -> tuple[Axis, ...]:
        """The axes that change an experiment."""
        return self._taken[entry.name]

    @cached_property
    def _taken(self) -> dict[str, tuple[Axis, ...]]:
        return {entry.name: tuple(axis for axis in self.axes if entry.takes(axis)) for entry in self.entries}

    @cached_property
    def _steps(self) -> dict[str, list[tuple[Axis, ...]]]:
        return {entry.name: self._steps_of(entry) for entry in self.entries}

    def _steps_of(self, entry: PlannedExperiment) -> list[tuple[Axis, ...]]:
        """Axes that step together; the machine's outermost, so that a worker meets one machine many times."""
        own = self.axes_of(entry)
        latin = tuple(axis for axis in own if axis.latin)
        groups = [(axis,) for axis in own if not axis.latin] + ([latin] if latin else [])
        return sorted(groups, key=lambda group: all(a.target.kind in ("parameter", "seed") for a in group))

    def cases(self) -> Iterator[NumberedCase]:
        """Every case in its order."""
        return (self.case(number) for number in range(len(self)))

    def case(self, number: int) -> NumberedCase:
        """The case of a number from 0, without the ones before it."""
        rest = number
        for entry, size in zip(self.entries, self._sizes, strict=True):
            if rest < size:
                return self._case(number, entry, *divmod(rest, self.repeats))
            rest -= size
        raise IndexError(number)

    def _case(self, number: int, entry: PlannedExperiment, point: int, repeat: int) -> NumberedCase:
        values: dict[str, Value] = {}
        for group in reversed(self._steps[entry.name]):
            point, at = divmod(point, len(group[0].values))
            values |= {axis.name: axis.values[at] for axis in group}
        values = {axis.name: values[axis.name] for axis in self.axes if axis.name in values}
        chosen = {axis.name: values[axis.name] for axis in self.axes_of(entry) if axis.target.kind == "parameter"}
        paths = [(a.name, a.target.written(values[a.name])) for a in self.axes if a.target.kind == "path"]
        case = Case(
            self._hashes[str(values.get("machine", next(iter(self.machines))))],
            (*self.set, *paths),
            entry.kind,
            tuple(sorted((entry.parameters | chosen).items())),
            self._seed(entry, values, repeat),
            self.keep,
            self.changes,
        )
        return NumberedCase(number, entry.name, repeat, values, case)

    @cached_property
    def _hashes(self) -> dict[str, str]:
        return {name: text_hash(text) for name, text in self.machines.items()}

    def _seed(self, entry: PlannedExperiment, values: Mapping[str, Value], repeat: int) -> int:
        seed = int(values.get("seed", entry.seed))
        if not self.different_seeds:
            return seed + repeat
        place = json.dumps([seed, entry.name, sorted(values.items()), repeat])
        return int.from_bytes(hashlib.sha256(place.encode()).digest()[:6], "big")  # every digit fits a double

    @cached_property
    def content(self) -> dict[str, Any]:
        """Everything that the cases depend on, by dotted names: what two plans must share to use one store."""
        settings: dict[str, Any] = {f"machine {name}": text for name, text in self.machines.items()}
        settings |= {f"set.{path}": value for path, value in self.set}
        settings |= {"changes": self.changes} if self.changes else {}
        for entry in self.entries:
            settings |= {f"experiments.{entry.name}.{name}": value for name, value in entry.parameters.items()}
            settings |= {f"experiments.{entry.name}.kind": entry.kind, f"experiments.{entry.name}.seed": entry.seed}
        settings |= {f"axes.{axis.name}": list(axis.values) for axis in self.axes}
        settings |= {"repeats": self.repeats, "seeds": "different" if self.different_seeds else "same"}
        return settings | {"keep": "all" if self.keep is None else list(self.keep), "summary": list(self.summary)}

    @cached_property
    def digest(self) -> str:
        """Hash of the content."""
        return text_hash(json.dumps(self.content, sort_keys=True))

    def seconds(self) -> float:
        """Simulated time [s] of all cases, as the first case of each experiment has it; a run may end earlier."""
        total, first = 0.0, 0
        for size in self._sizes:
            case = self.case(first).case
            Ts = self._machine_of(case).sampling_time
            total += size * make(case.kind, dict(case.parameters), Ts).samples * Ts
            first += size
        return total

    def _machine_of(self, case: Case) -> Machine:
        """Machine of a case."""
        text = next(text for text in self.machines.values() if text_hash(text) == case.machine)
        machine = Machine.from_text(text)
        for path, value in case.set:
            machine = machine.replace(path, value)
        return with_changes(machine, case.changes)


def differences(there: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Differences of a store's plan (`there`) from the `wanted` plan, as sentences."""
    return [
        sentence
        for name in [*there, *(key for key in wanted if key not in there)]
        if there.get(name) != wanted.get(name)
        for sentence in _sentences(name, there.get(name), wanted.get(name))
    ]


def _sentences(name: str, there: Any, wanted: Any) -> Iterator[str]:
    if there is None or wanted is None:
        yield f"{name} {'is only in this plan' if there is None else 'is only in the store'}"
    elif name.startswith("machine "):
        yield from _lines(name, there, wanted)
    elif isinstance(there, list) and isinstance(wanted, list) and len(there) != len(wanted):
        yield f"{name}: {len(there)} values there, {len(wanted)} here"
    elif isinstance(there, list) and isinstance(wanted, list):
        first = next(i for i, (a, b) in enumerate(zip(there, wanted, strict=True)) if a != b)
        yield f"{name}: {quote(there[first])} there, {quote(wanted[first])} here"
    else:
        yield f"{name}: {quote(there)} there, {quote(wanted)} here"


def _lines(name: str, there: str, wanted: str) -> Iterator[str]:
    """Lines of a machine's text that are not the same."""
    old, new = set(there.splitlines()), set(wanted.splitlines())
    gone = [line for line in there.splitlines() if line not in new]
    come = [line for line in wanted.splitlines() if line not in old]
    yield f"{name}: {'; '.join(gone[:2]) or 'nothing'} there, {'; '.join(come[:2]) or 'nothing'} here"


def changes_text(table: Mapping[str, Any]) -> str:
    """The attribute `changes` of a record, JSON in SI; empty without changes; raises PlanError."""
    try:
        return stated_changes(dict(table)).get(CHANGES, "")
    except RotorsimError as error:
        raise PlanError(str(error)) from error


def changed_paths(table: Mapping[str, Any]) -> set[str]:
    """Names in a table [changes], and the paths of the machine file whose values the sensor ring in it takes over."""
    ring = table.get(RING)
    return {*table, *(f"effects.{RING}.{key}" for key in (ring if isinstance(ring, Mapping) else ()))}


def with_changes(machine: Machine, text: str) -> Machine:
    """The machine as it is changed for a record; trial weights add to its unbalance as vectors; raises PlanError."""
    if not text:
        return machine
    table = parse_json(text)
    try:
        known_changes(machine, table, CHANGES)
    except RotorsimError as error:
        raise PlanError(str(error).splitlines()[0]) from error
    weights, ring = table.pop(WEIGHT, []), table.pop(RING, None)
    for path, value in table.items():
        machine = change(machine, path, value, CHANGES)
    if ring is not None:
        machine = with_ring(machine, ring["angle"])
    return _weighted(machine, weights)


def _weighted(machine: Machine, weights: list[dict[str, float]]) -> Machine:
    """The machine with trial weights in the planes of its unbalance."""
    sums = known_changes(machine, {WEIGHT: weights}, CHANGES)
    values: dict[str, float] = {}
    for number, own in enumerate(machine.effects.get("unbalance", ())):
        key = f"unbalance.{number}.me~phase"
        weight = complex(sums.get(f"{key}.c", 0.0), sums.get(f"{key}.s", 0.0))
        if weight:
            whole = own.me * np.exp(1j * own.phase) + weight  # type: ignore[attr-defined]
            here = f"effects.unbalance.{number}"
            values |= {f"{here}.me": float(abs(whole)), f"{here}.phase": float(np.angle(whole))}
    return machine.with_(values)
