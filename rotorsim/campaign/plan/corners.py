"""Check of a plan's extreme values before the run: ends of every axis, one at a time and all together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from rotorsim.base.errors import RotorsimError
from rotorsim.campaign.errors import PlanError
from rotorsim.campaign.plan.kinds import is_analysis, make
from rotorsim.campaign.plan.known_changes import with_changes
from rotorsim.campaign.plan.plan import Entry, Plan
from rotorsim.campaign.plan.plan_file import Value
from rotorsim.campaign.plan.targets import change
from rotorsim.experiments.parameters import ask_speeds, fastest
from rotorsim.machine import Machine
from rotorsim.machine.numerics import check_speed
from rotorsim.machine.plausibility import ask_machine

MOST_WORDS = 50
"""Values tried of an axis of words or whole numbers, which have no ends."""


def check_corners(plan: Plan, machines: Mapping[str, Machine]) -> None:
    """Raise PlanError for an extreme value that the machine or an experiment does not accept."""
    changed = {name: _changed(plan, machine) for name, machine in machines.items()}
    for entry in plan.entries:
        for where, values in _corners(plan, entry):
            _check_experiment(entry, changed, values, where)
    for path, _ in plan.set:
        _check_machines(plan, machines, {}, f"set.{path}")
    for axis in plan.axes:
        if axis.target.kind == "path":
            ends = axis.values[:MOST_WORDS] if not axis.target.numeric else {min(axis.values), max(axis.values)}
            for value in ends:
                _check_machines(plan, machines, {axis.name: axis.target.written(value)}, f"axes.{axis.name}")


def _corners(plan: Plan, entry: Entry) -> Iterator[tuple[str, dict[str, Value]]]:
    """Parameters of an experiment at the ends of each of its axes, the others at their first value."""
    own = [axis for axis in plan.axes_of(entry) if axis.target.kind == "parameter"]
    first = {axis.name: axis.values[0] for axis in own}
    if not own:
        yield f"experiments.{entry.name}", first
    for axis in own:
        for value in axis.values if len(axis.values) <= MOST_WORDS else (min(axis.values), max(axis.values)):
            yield f"axes.{axis.name}", first | {axis.name: value}


def _check_experiment(entry: Entry, machines: Mapping[str, Machine], values: Mapping[str, Value], where: str) -> None:
    for machine in machines.values():
        try:
            experiment = make(entry.kind, entry.parameters | dict(values), machine.sampling_time)
            if not is_analysis(entry.kind):
                check_speed(machine, fastest(experiment))
        except RotorsimError as error:
            raise PlanError(f"{where}: {error}") from error
        ask_speeds(machine, experiment)


def _changed(plan: Plan, machine: Machine) -> Machine:
    """A machine as the plan sets and changes it."""
    for path, value in plan.set:
        machine = change(machine, path, value, f"set.{path}")
    return with_changes(machine, plan.changes)


def _check_machines(plan: Plan, machines: Mapping[str, Machine], values: Mapping[str, Value], where: str) -> None:
    for machine in machines.values():
        for path, value in (*plan.set, *values.items()):
            machine = change(machine, path, value, where)
        ask_machine(with_changes(machine, plan.changes))
