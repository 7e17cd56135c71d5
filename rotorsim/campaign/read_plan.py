"""Plans from names, files and texts: names resolved, units converted, extreme values checked before the run."""

from collections.abc import Callable, Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from identification import VARIABLES
from rotorsim.base.display import neither, quote
from rotorsim.base.errors import RotorsimError
from rotorsim.base.input_files import instead
from rotorsim.base.units import parse
from rotorsim.campaign.axes import (
    KINDS,
    NAME,
    Axis,
    AxisTable,
    AxisTarget,
    LatinLimits,
    LatinTable,
    PlanError,
    PlanTable,
    Value,
    change,
    draw,
    find_experiment,
    find_target,
    is_analysis,
    make,
    parse_plan,
    quantity_at,
    read_axis,
    read_parameters,
    read_plan,
    read_seed,
    read_table,
    unknown,
)
from rotorsim.campaign.plan import Plan, PlannedExperiment, changed_paths, changes_text, with_changes
from rotorsim.experiments.experiment import ask_speeds, fastest
from rotorsim.machine import Machine, machine_text, shipped_machines
from rotorsim.machine.limits import check_speed
from rotorsim.machine.plausibility import ask_machine


def shipped_plans() -> tuple[str, ...]:
    """Names of the plans that come with rotorsim.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.campaign.shipped_plans()
    ('thesis',)
    """
    folder = files("rotorsim.campaign") / "plans"
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def load_plan(name_or_path: str | Path) -> Plan:
    """Shipped plan by name or plan file by path; machine files are searched in the same folder.

    Raises
    ------
    PlanError
        One sentence that names the field, the value and the way out.

    Examples
    --------
    >>> import rotorsim as rs
    >>> len(rs.campaign.load_plan("thesis")) > 0
    True
    """
    name = str(name_or_path)
    if name in shipped_plans():
        text = (files("rotorsim.campaign") / "plans" / f"{name}.toml").read_text(encoding="utf-8")
        return make_plan(text)
    if not Path(name).exists():
        raise PlanError(neither(name, "a shipped plan", shipped_plans()), argument="plan", value=name)
    try:
        return make_plan(read_plan(Path(name)), Path(name).parent)
    except PlanError as error:
        ours = instead(name, "a plan", "a plan of a campaign")
        raise PlanError(f"{name}: {ours}; give a plan" if ours else f"{name}: {error}") from error


MOST_CASES = 10_000_000
FILM_PRESSURE = "film_pressure"
"""Snapshots of the film's pressure in a record."""

Look = Callable[[str], str]


def make_plan(text: str, folder: Path = Path(), machines: Mapping[str, str] | None = None) -> Plan:
    """Plan from its text; machine files are read relative to `folder`, or taken from `machines` by name."""
    table = parse_plan(text)

    def look(name: str) -> str:
        if machines is not None:
            return machines[name]
        return machine_text(name if name in shipped_machines() else folder / name)

    names = _machine_names(table)
    loaded = {name: _machine(name, look, table.set) for name in names}
    first = next(iter(loaded.values()))
    entries = tuple(_entries(table))
    for entry in entries:
        if is_analysis(entry.kind) and table.keep:
            raise PlanError(f"keep: {entry.name} is an analysis without a record; write keep = []")
    if not 1 <= table.repeats <= MOST_CASES:
        raise PlanError(f"repeats: {table.repeats} is not from 1 to {MOST_CASES}; give e.g. 3")
    axes = tuple(_axes(table, first, entries))
    plan = Plan(
        _name(table.name, "name"), table.description, text, {name: m.text for name, m in loaded.items()},
        tuple(table.set.items()), entries, axes, table.repeats, table.seeds == "different",
        _keep(table), _summary(table.summary), _time_limit(table.time_limit), changes_text(table.changes),
    )  # fmt: skip
    if len(plan) > MOST_CASES:
        raise PlanError(f"axes: {len(plan)} cases are above the limit of {MOST_CASES}; make the grid coarser")
    check_corners(plan, loaded)
    return plan


def _machine_names(table: PlanTable) -> tuple[str, ...]:
    axis = table.axes.get("machine")
    if axis is None:
        if table.machine is None:
            raise PlanError("machine: missing; write e.g. machine = 'dtu_gas_bearing'")
        return (table.machine,)
    if table.machine is not None:
        raise PlanError("machine: is given and is an axis too; leave one of them out")
    names = read_table(AxisTable, axis, "axes.machine").list
    if not names or not all(isinstance(name, str) for name in names):
        raise PlanError("axes.machine: is not a list of machines; write e.g. list = ['dtu_gas_bearing']")
    return names


def _machine(name: str, look: Look, changes: Mapping[str, Value]) -> Machine:
    try:
        machine = Machine.from_text(look(name))
    except RotorsimError as error:
        raise PlanError(f"machine {quote(name)}: {str(error).splitlines()[0]}") from error
    ask_machine(machine)
    base = Machine.from_text(machine.text)
    for path, value in changes.items():
        quantity_at(machine, path, f"set.{path}")
        machine = change(machine, path, value, f"set.{path}")
    return base


def _entries(table: PlanTable) -> list[PlannedExperiment]:
    if bool(table.experiment) == bool(table.experiments):
        problem = "is missing" if not table.experiment else "and experiments are both there"
        raise PlanError(
            f"experiment: {problem}; write [experiment] with kind = 'prbs', or [experiments.NAME] for several"
        )
    tables = {str(table.experiment.get("kind", "")): table.experiment} if table.experiment else table.experiments
    return [_entry(name, rest, bool(table.experiment), table.seed) for name, rest in tables.items()]


def _entry(name: str, table: Mapping[str, Any], alone: bool, seed: int) -> PlannedExperiment:
    where = "experiment" if alone else f"experiments.{name}"
    if not isinstance(table, Mapping):
        raise PlanError(f"{where}: {quote(table)} is not a table; write kind and parameters below [{where}]")
    rest = dict(table)
    kind = find_experiment(rest.pop("kind", ""), where)
    own = read_seed(rest.pop("seed", seed), f"{where}.seed")
    given = read_parameters(kind, rest, where)
    return PlannedExperiment(_name(name, where), kind.name, given, own)


def _axes(table: PlanTable, machine: Machine, entries: tuple[PlannedExperiment, ...]) -> list[Axis]:
    kinds = {entry.name: KINDS[entry.kind] for entry in entries}
    read: dict[str, Axis | LatinLimits] = {}
    for name, rest in table.axes.items():
        target = find_target(name, machine, kinds)
        _check_single(target, table, entries)
        read[name] = read_axis(target, read_table(AxisTable, rest, f"axes.{name}"))
    limits = [axis for axis in read.values() if isinstance(axis, LatinLimits)]
    latin = None if table.latin is None else read_table(LatinTable, table.latin, "latin")
    drawn = {axis.name: axis for axis in draw(limits, latin)}
    return [drawn[name] if isinstance(axis, LatinLimits) else axis for name, axis in read.items()]


def _check_single(target: AxisTarget, table: PlanTable, entries: tuple[PlannedExperiment, ...]) -> None:
    """Refuse what an axis and the rest of the plan both decide."""
    for place, values in (("set", set(table.set)), ("changes", changed_paths(table.changes))):
        if target.kind == "path" and target.name in values:
            raise PlanError(f"axes.{target.name}: is given below [{place}] too; leave one of them out")
    for entry in entries:
        if target.kind == "parameter" and target.name in entry.parameters:
            raise PlanError(f"axes.{target.name}: experiment {entry.name} gives {target.name} too; leave one out")
    if target.kind == "seed" and table.repeats > 1 and table.seeds == "same":
        raise PlanError("axes.seed: repeats give seeds too; leave one of them out or write seeds = 'different'")


def _name(text: str, where: str) -> str:
    if not NAME.fullmatch(text):
        raise PlanError(
            f"{where}: {quote(text)} is not a valid name; use up to 64 letters, digits, spaces, '_', '-', '.'"
        )
    return text


def _keep(table: PlanTable) -> tuple[str, ...] | None:
    if table.keep == "all":
        return None
    for name in table.keep:
        if name not in VARIABLES and name != FILM_PRESSURE:
            raise PlanError(f"keep: {quote(name)} is an {unknown(name, [*VARIABLES, FILM_PRESSURE], 'variable')}")
    return tuple(sorted(set(table.keep)))


def _summary(names: tuple[str, ...]) -> tuple[str, ...]:
    if not names:
        return ()
    from rotorsim.campaign.summaries import SUMMARIES  # brings scipy.signal and xarray, two thirds of a second

    for name in names:
        if name not in SUMMARIES:
            raise PlanError(f"summary: {quote(name)} is an {unknown(name, SUMMARIES, 'summary')}")
    return tuple(dict.fromkeys(names))


def _time_limit(text: str) -> float:
    try:
        limit = float(parse(text, "s"))
    except ValueError as error:
        raise PlanError(f"time_limit: {error}") from error
    if not 0 < limit <= 1e7:
        raise PlanError(f"time_limit: {quote(text)} is not above 0 and at most 115 days; write e.g. '10 min'")
    return limit


MOST_WORDS = 50
"""Largest number of values that are tried of an axis of words or whole numbers, which has no ends."""


def check_corners(plan: Plan, machines: Mapping[str, Machine]) -> None:
    """Raise PlanError for an extreme value that the machine or an experiment does not accept."""
    changed = {name: _changed(plan, machine, {}, "set") for name, machine in machines.items()}
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


def _corners(plan: Plan, entry: PlannedExperiment) -> Iterator[tuple[str, dict[str, Value]]]:
    """Parameters of an experiment at the ends of each of its axes, the others at their first value."""
    own = [axis for axis in plan.axes_of(entry) if axis.target.kind == "parameter"]
    first = {axis.name: axis.values[0] for axis in own}
    if not own:
        yield f"experiments.{entry.name}", first
    for axis in own:
        for value in axis.values if len(axis.values) <= MOST_WORDS else (min(axis.values), max(axis.values)):
            yield f"axes.{axis.name}", first | {axis.name: value}


def _check_experiment(
    entry: PlannedExperiment, machines: Mapping[str, Machine], values: Mapping[str, Value], where: str
) -> None:
    for machine in machines.values():
        try:
            experiment = make(entry.kind, entry.parameters | dict(values), machine.sampling_time)
            if not is_analysis(entry.kind):
                check_speed(machine, fastest(experiment))
        except RotorsimError as error:
            raise PlanError(f"{where}: {error}") from error
        ask_speeds(machine, experiment)


def _changed(plan: Plan, machine: Machine, values: Mapping[str, Value], where: str) -> Machine:
    """A machine as the plan sets and changes it, with further values by their path."""
    for path, value in plan.set:
        machine = change(machine, path, value, f"set.{path}")
    for path, value in values.items():
        machine = change(machine, path, value, where)
    return with_changes(machine, plan.changes)


def _check_machines(plan: Plan, machines: Mapping[str, Machine], values: Mapping[str, Value], where: str) -> None:
    for machine in machines.values():
        ask_machine(_changed(plan, machine, values, where))
