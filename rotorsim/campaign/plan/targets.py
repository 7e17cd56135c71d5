"""Targets of an axis: a machine value by its path, an experiment parameter, the seed or the machine."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.quantity import Quantity, quantities
from rotorsim.base.unit_table import dimension
from rotorsim.base.units import Suggest, parse, show
from rotorsim.campaign.errors import PlanError
from rotorsim.campaign.plan.kinds import KINDS, Kind
from rotorsim.campaign.plan.plan_file import Value, unknown
from rotorsim.effects import REGISTRY, Effect
from rotorsim.experiments.experiment import check_seed
from rotorsim.machine import Machine
from rotorsim.machine.file_text import ANY, declarations
from rotorsim.machine.part import Part


@dataclass(frozen=True)
class Target:
    """Target of an axis; `kind` is 'path', 'parameter', 'seed' or 'machine'; no `unit` for text values.

    `sample` is the sampling time [s] of a time of whole samples, 0 for anything else.
    """

    kind: str
    name: str
    unit: str | None = None
    whole: bool = False
    sample: float = 0.0
    suggest: Suggest | None = field(default=None, compare=False, repr=False)

    def read(self, value: Any, where: str) -> Value:
        """SI value, whole number or word from the plan's text; raises PlanError."""
        if self.kind == "seed":
            return _seed(value, where)
        if self.unit is None:
            if isinstance(value, str):
                return value
            raise PlanError(f"{where}: {value!r} is not text; write it in quotes")
        try:
            number = parse(value, self.unit, self.suggest)
        except ValueError as error:
            raise PlanError(f"{where}: {error}") from error
        return int(number) if self.whole and number == int(number) else number

    def neat(self, number: float) -> float:
        """An SI value near another that is short to write in people's unit; a time in whole samples."""
        if self.sample:
            number = round(number / self.sample) * self.sample
        kind = dimension(self.unit or "1")
        if not kind.people:
            return float(f"{number:.12g}")
        unit = kind.people[-1]
        return parse(f"{number / float(kind.factors[unit]):.12g} {unit}", self.unit or "1")

    def written(self, value: Value) -> Value:
        """A value as a machine file has it."""
        if self.unit is None or self.unit == "1" or isinstance(value, str):
            return value
        return show(value, self.unit)

    @property
    def numeric(self) -> bool:
        """Whether values lie on a scale, so that there are others between two of them."""
        return self.unit is not None and not self.whole


def _seed(value: Any, where: str) -> int:
    try:
        return check_seed(value)
    except DataError as error:
        raise PlanError(f"{where}: {error}") from error


def find_target(name: str, machine: Machine, kinds: Mapping[str, Kind]) -> Target:
    """Target of an axis by its name; raises PlanError if there is none."""
    if name in ("seed", "machine"):
        return Target(name, name, whole=name == "seed")
    known = {own: quantity for kind in kinds.values() for own, quantity in quantities(kind).items()}
    if name in known:
        return _target("parameter", name, known[name], machine.sampling_time)
    if "." in name:
        return _target("path", name, quantity_at(machine, name, f"axes.{name}"))
    raise PlanError(
        f"axes.{name}: {unknown(name, [*known, 'seed', 'machine'], 'axis')}; a path of the machine has dots"
    )


def _target(kind: str, name: str, quantity: Quantity | None, Ts: float = 0.0) -> Target:
    if quantity is None or quantity.choices:
        return Target(kind, name)
    sample = Ts if quantity.samples else 0.0
    return Target(kind, name, quantity.unit, bool(quantity.multiple), sample, quantity.suggestion)


def quantity_at(machine: Machine, path: str, where: str) -> Quantity | None:
    """Declaration of a machine value, None for text; raises PlanError if the path leads to no value."""
    here: Any = machine
    *tables, last = path.split(".")
    for key, after in zip(tables, [*tables[1:], last], strict=True):
        here = _below(here, key, where, after)
    names = _names(here)
    if last not in names:
        raise PlanError(f"{where}: {unknown(last, sorted(names), 'value')}")
    if not isinstance(names[last], (Quantity, type(None))):
        raise PlanError(f"{where}: holds several values; name one of them")
    return names[last]


def _below(here: Any, key: str, where: str, after: str | None = None) -> Any:
    if isinstance(here, tuple):
        if key == ANY and here:
            return next((one for one in here if after is None or hasattr(one, after)), here[0])
        if key.isdecimal() and int(key) < len(here):
            return here[int(key)]
        if len(here) == 1:
            return _below(here[0], key, where)
        raise PlanError(f"{where}: '{key}' is none of {len(here)} entries, counted from 0; give its number")
    if isinstance(here, dict):
        if key not in here and key not in REGISTRY:
            raise PlanError(f"{where}: {unknown(key, sorted(REGISTRY), 'effect')}")
        return here.get(key) or REGISTRY[key]
    if isinstance(here, type) and key == "0":  # an effect that the machine has not got yet
        return here
    value = getattr(here, key, None) if isinstance(here, Part) and key in type(here).model_fields else None
    if value is None:
        raise PlanError(f"{where}: {unknown(key, sorted(_names(here)), 'table')}")
    return value


def _names(here: Any) -> dict[str, Any]:
    """Values below a part or an effect with their unit and limits; a table stands for itself."""
    if isinstance(here, tuple) and len(here) == 1:
        here = here[0]
    kind = here if isinstance(here, type) else type(here)
    if not issubclass(kind, (Part, Effect)):
        return {}
    found: dict[str, Any] = {name: quantity for name, (quantity, _) in declarations(kind).items()}
    if isinstance(here, Part):
        found |= {name: value for name in found if isinstance(value := getattr(here, name), (Part, tuple, dict))}
    return found


def read_parameters(kind: Kind, table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """SI values of an experiment's parameters from a plan's table; raises PlanError."""
    known = quantities(kind)
    values = {}
    for name, value in table.items():
        if name not in known:
            raise PlanError(f"{where}.{name}: {unknown(name, known, f'parameter of {kind.name}')}")
        try:
            values[name] = known[name].parse(value)
        except ValueError as error:
            raise PlanError(f"{where}.{name}: {error}") from error
    return values


def find_experiment(name: Any, where: str) -> Kind:
    """Kind of experiment by name; raises PlanError for an unknown one."""
    known = {key: kind for key, kind in KINDS.items() if key != "controlled"}
    if name not in known:
        raise PlanError(f"{where}.kind: {unknown(str(name), known, 'experiment')}")
    return known[name]


def change(machine: Machine, path: str, value: Value, where: str) -> Machine:
    """Machine with one value changed; the error names the plan's field."""
    try:
        return machine.replace(path, value)
    except MachineFileError as error:
        raise PlanError(f"{where}: {error.problems[0]}") from error
