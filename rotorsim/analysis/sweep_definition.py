"""Definition of a sweep, checked before anything is computed: its analyses and their quantities, its axes, its cells.

An analysis computes quantities of one machine at one point; it is a frozen dataclass of parameters, as experiments are,
whose result is a few numbers and no record. Where there is none (the film does not carry the rotor, no mode grows) the
quantity is None and `reason` gives the cause in a few words.

An axis is 'PATH=FROM:TO:COUNT', 'PATH=A, B' or, in percent of the machine's value, 'PATH=-10%:+10%:5'. Each analysis is
computed over those axes alone that change it: a lift-off pressure does not depend on the supply pressure.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields as parameters_of
from itertools import product
from math import isfinite
from typing import Any, ClassVar

import numpy as np

from rotorsim.analysis.axes import Field, checked, read_axis, read_field, split_range, with_fields
from rotorsim.analysis.axial import axial_state
from rotorsim.analysis.campbell import highest_speed
from rotorsim.analysis.shaft_motion import largest_response, unbalances_of
from rotorsim.analysis.supply import HIGHEST, lift_off, load_capacity
from rotorsim.analysis.targets import split, value_at
from rotorsim.analysis.whirl_onset import LeastDamped, stability_limit
from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import ConvergenceError, DataError, NoLiftOffError, RotorsimError
from rotorsim.base.units import NUMBER, TO_HZ, TO_MPA, TO_RPM, TO_UM, parse, show
from rotorsim.experiments.experiment import check_parameters, param
from rotorsim.machine.file_text import expanded
from rotorsim.machine.limits import ask_rim_speed
from rotorsim.machine.plausibility import ask_machine
from rotorsim.machine.schema import Machine
from rotorsim.plant.plant import Plant, as_plant

REASON = "reason"
CARRIED, SETTLED = "the film does not carry the rotor", "the equilibrium iteration did not converge"
STABLE = "stable up to"
"""Beginning of the reason of an onset that lies above the highest speed searched."""


class _NotKnownError(RotorsimError):
    """A quantity that was not looked for everywhere."""


@dataclass(frozen=True)
class Analysis(ABC):
    """Base of analyses; raises DataError with one sentence for bad parameters."""

    name: ClassVar[str]
    quantities: ClassVar[tuple[str, ...]]
    """Names of the numbers that it gives, in SI."""
    samples: ClassVar[int] = 0
    """It simulates nothing."""

    def __post_init__(self) -> None:
        check_parameters(self)

    @abstractmethod
    def values(self, plant: Plant) -> dict[str, float]:
        """Its quantities of a machine [SI], NaN where there is none; raises NoLiftOffError, ConvergenceError."""

    def missing(self, plant: Plant) -> str:
        """Reason why a quantity is NaN although the film carries."""
        return "not defined here"

    def run(self, plant: Plant) -> dict[str, Any]:
        """Quantities as numbers or None, with the `reason` where one is None."""
        try:
            found = self.values(plant)
        except NoLiftOffError:
            return dict.fromkeys(self.quantities) | {REASON: CARRIED}
        except ConvergenceError:
            return dict.fromkeys(self.quantities) | {REASON: SETTLED}
        except _NotKnownError as error:
            return dict.fromkeys(self.quantities) | {REASON: str(error)}
        plain = {name: value if isfinite(value) else None for name, value in found.items()}
        return plain | ({REASON: self.missing(plant)} if None in plain.values() else {})


@dataclass(frozen=True)
class LiftOff(Analysis):
    """Least gauge supply pressure at which the film carries the rotor."""

    name: ClassVar[str] = "lift_off"
    quantities: ClassVar[tuple[str, ...]] = ("lift_off",)
    speed: float = param("rad/s", "Shaft speed.", 0.0, low=0)

    def values(self, plant: Plant) -> dict[str, float]:
        """Lift-off pressure [Pa, gauge]."""
        return {"lift_off": float(lift_off(plant, [self.speed])[0])}

    def missing(self, plant: Plant) -> str:
        """No pressure was enough."""
        return f"not carried up to {HIGHEST * TO_MPA:g} MPa"


@dataclass(frozen=True)
class Onset(Analysis):
    """Whirl onset: lowest speed at which a mode of film and rotor loses its damping."""

    name: ClassVar[str] = "onset"
    quantities: ClassVar[tuple[str, ...]] = ("onset",)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)
    highest_speed: float | None = param("rad/s", "Highest speed searched.", None, above=0)

    def values(self, plant: Plant) -> dict[str, float]:
        """Onset speed [rad/s]."""
        onset, _, looked = stability_limit(plant, self.pressure, self.highest_speed or highest_speed(plant))
        if not looked:
            raise _NotKnownError("not known: the number of modes is not proven at every speed")
        return {"onset": onset}

    def missing(self, plant: Plant) -> str:
        """No mode grew."""
        return f"{STABLE} {(self.highest_speed or highest_speed(plant)) * TO_RPM:.6g} rpm"


@dataclass(frozen=True)
class AtPoint(Analysis):
    """An analysis at one speed and supply pressure."""

    speed: float = param("rad/s", "Shaft speed.", 0.0, low=0)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)


@dataclass(frozen=True)
class AtEquilibrium(AtPoint):
    """Gas flow, least damping ratio and first natural frequency at an operating point."""

    name: ClassVar[str] = "operating_point"
    quantities: ClassVar[tuple[str, ...]] = ("flow", "damping", "frequency")

    def values(self, plant: Plant) -> dict[str, float]:
        """Mass flow [kg/s] of all injectors, damping ratio, natural frequency [rad/s]."""
        flow = float(plant.equilibrium(self.speed, self.pressure).mass_flow.sum())
        model = plant.linearise(self.speed, self.pressure)
        damping = LeastDamped.up_to(plant, self.pressure, highest_speed(plant)).certain(model)
        frequency = float(model.wn[0]) if model.wn.size else float("nan")
        return {"flow": flow, "damping": damping if np.isfinite(damping) else float("nan"), "frequency": frequency}

    def missing(self, plant: Plant) -> str:
        """Overdamped modes alone, or modes that may be missing."""
        return "no mode oscillates, or one may be missing: their number is not proven"


@dataclass(frozen=True)
class Load(AtPoint):
    """Load capacity at half the clearance, see `load_capacity`."""

    name: ClassVar[str] = "load"
    quantities: ClassVar[tuple[str, ...]] = ("load",)

    def values(self, plant: Plant) -> dict[str, float]:
        """Load [N]."""
        return {"load": load_capacity(plant, self.speed, self.pressure)}


@dataclass(frozen=True)
class Peak(Analysis):
    """Largest unbalance response at the measuring plane over the stable speeds."""

    name: ClassVar[str] = "peak"
    quantities: ClassVar[tuple[str, ...]] = ("peak",)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)
    highest_speed: float | None = param("rad/s", "Highest speed searched.", None, above=0)

    def values(self, plant: Plant) -> dict[str, float]:
        """Amplitude [m, 0-pk], of the machine's unbalance or, without one, that of grade G 2.5."""
        highest = self.highest_speed or highest_speed(plant)
        unbalances = unbalances_of(plant.machine, highest)
        return {"peak": largest_response(plant, self.pressure, highest, unbalances)[0]}

    def missing(self, plant: Plant) -> str:
        """No stable speed."""
        return "carried and stable at no speed"


@dataclass(frozen=True)
class Axial(AtPoint):
    """Axial equilibrium and mode of the rotor between its thrust bearings."""

    name: ClassVar[str] = "axial"
    quantities: ClassVar[tuple[str, ...]] = (
        "thrust_gap", "thrust_flow", "thrust_power", "axial_stiffness", "axial_frequency", "axial_damping",
    )  # fmt: skip

    def values(self, plant: Plant) -> dict[str, float]:
        """Least gap [m], flow [kg/s], friction power [W], stiffness at rest [N/m], frequency [rad/s], damping ratio."""
        found = axial_state(plant.machine, self.speed, self.pressure)
        sums = (sum(getattr(f, name) for f in found.films) for name in ("flow", "power", "static_stiffness"))
        numbers = (found.least_gap, *sums, found.wn, found.zeta)
        return dict(zip(self.quantities, numbers, strict=True))


ANALYSES: dict[str, type[Analysis]] = {kind.name: kind for kind in (LiftOff, Onset, AtEquilibrium, Load, Peak, Axial)}
"""Every analysis by its name."""


@dataclass(frozen=True)
class SweepQuantity:
    """A quantity: SI unit, unit and factor for tables and charts, `best` 'highest' or 'lowest', meaning."""

    name: str
    unit: str
    shown: str
    factor: float
    best: str
    meaning: str

    @property
    def kind(self) -> type[Analysis]:
        """The analysis that gives it."""
        return next(kind for kind in ANALYSES.values() if self.name in kind.quantities)

    @property
    def heading(self) -> str:
        """Name and unit, as in a table's head."""
        return f"{self.name} [{self.shown}]"


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        SweepQuantity("lift_off", "Pa", "MPa", TO_MPA, "lowest", "lift-off pressure, gauge"),
        SweepQuantity("onset", "rad/s", "rpm", TO_RPM, "highest", "whirl onset"),
        SweepQuantity("load", "N", "N", 1.0, "highest", "load capacity at half the clearance"),
        SweepQuantity("flow", "kg/s", "mg/s", 1e6, "lowest", "gas flow of all injectors"),
        SweepQuantity("damping", "1", "1", 1.0, "highest", "least damping ratio"),
        SweepQuantity("frequency", "rad/s", "Hz", TO_HZ, "highest", "first natural frequency"),
        SweepQuantity("peak", "m", "um 0-pk", TO_UM, "lowest", "largest unbalance response"),
        SweepQuantity("thrust_gap", "m", "um", TO_UM, "highest", "least gap of the thrust bearings"),
        SweepQuantity("thrust_flow", "kg/s", "mg/s", 1e6, "lowest", "flow from the thrust bearings"),
        SweepQuantity("thrust_power", "W", "W", 1.0, "lowest", "friction power of the thrust bearings"),
        SweepQuantity("axial_stiffness", "N/m", "MN/m", 1e-6, "highest", "axial stiffness at rest"),
        SweepQuantity("axial_frequency", "rad/s", "Hz", TO_HZ, "highest", "natural frequency of the axial mode"),
        SweepQuantity("axial_damping", "1", "1", 1.0, "highest", "damping ratio of the axial mode"),
    )
}
"""Every quantity of a sweep by its name."""
NEEDS_FILM, NEEDS_SUPPLY = ("onset", "load"), ("lift_off", "flow")
WHAT = ("lift_off", "onset", "flow")
"""Default quantities."""


def read_quantities(what: str | tuple[str, ...] | list[str], machine: Machine) -> tuple[SweepQuantity, ...]:
    """Quantities of their names, with commas between or in a sequence; raises DataError for an unknown one.

    A machine without a film, or without a supply, has not all of them.
    """
    names = what.split(",") if isinstance(what, str) else list(what)
    names = [name.strip() for name in names if name.strip()]
    if not names:
        raise DataError(f"--what: no quantity is named; choose from {', '.join(QUANTITIES)}")
    for name in names:
        if name not in QUANTITIES:
            raise DataError(f"--what: '{name}' is not a quantity; {did_you_mean(name, QUANTITIES)}")
        if name in NEEDS_FILM and machine.film is None:
            raise DataError(f"--what: {name} needs a gas film, and {machine.name} has none; leave it out")
        if QUANTITIES[name].kind is Axial and not machine.thrust_bearings:
            raise DataError(f"--what: {name} needs thrust bearings, and {machine.name} has none; leave it out")
        if name in NEEDS_SUPPLY and not machine.fed:
            raise DataError(f"--what: {name} needs injectors or orifices, and {machine.name} has none; leave it out")
    return tuple(QUANTITIES[name] for name in dict.fromkeys(names))


POINTS = {"speed": "rad/s", "pressure": "Pa"}
"""Axes that are no values of the machine, with their units."""
EXAMPLES = {"speed": "'speed=0 rpm:30000 rpm:5'", "pressure": "'pressure=0.3 MPa:0.7 MPa:5'"}
PERCENT = re.compile(rf"({NUMBER})\s*%", re.ASCII)
MOST = 100_000
"""Largest number of cells in a sweep."""
Over = Mapping[str, Any] | Sequence[str]


def read_over(over: Over, machine: Machine) -> tuple[Field, ...]:
    """Axes of texts 'PATH=VALUES', or of values by path; raises DataError or MachineFileError."""
    if not over:
        raise DataError("over: no axis is given; write e.g. 'bearings.0.clearance=15 um:25 um:5'")
    texts = over
    if isinstance(over, Mapping):
        texts = [f"{path}={v if isinstance(v, str) else ', '.join(map(str, v))}" for path, v in over.items()]
    fields = tuple(_axis(text, machine) for text in texts)
    names = [field.path for field in fields]
    for name in names:
        if names.count(name) > 1:
            raise DataError(f"--over: {name} is given twice; write all its values in one axis")
    cells = int(np.prod([float(len(field.values)) for field in fields]))
    if cells > MOST:
        raise DataError(f"--over: {cells} cells are above the limit of {MOST}; take fewer points per axis")
    return fields


def _axis(text: str, machine: Machine) -> Field:
    path, _, values = (part.strip() for part in text.partition("="))
    if values and path in POINTS:
        return _point_axis(path, values)
    if "%" in values:
        return _percent(path, values, machine)
    field = read_field(text)
    _check_axis(field, machine)
    return field


def _point_axis(path: str, values: str) -> Field:
    if "%" in values:
        raise DataError(f"--over: {path} is no value of the machine; give values with units, e.g. {EXAMPLES[path]}")
    read_axis(path, values, POINTS[path])
    field = read_field(f"{path}={values}")
    if parse(field.values[0], POINTS[path]) < 0:
        raise DataError(f"--over {path}: '{field.values[0]}' is below 0; start at 0 or above")
    return field


def _percent(path: str, values: str, machine: Machine) -> Field:
    ends, count = split_range("over", values)
    found = [PERCENT.fullmatch(end) for end in ends]
    if None in found:
        raise DataError(f"--over: '{values}' mixes percent with other numbers; write e.g. '-10%:+10%:5'")
    shares = [float(match[1]) / 100 for match in found if match]
    shares = np.linspace(shares[0], shares[1], count).tolist() if count else shares
    own = {split(path, value_at(machine.text, one)) for one in expanded(machine.text, path)}
    if len(own) != 1:
        raise DataError(f"--over: {path} has different values in this machine; give values with units, not percent")
    number, unit = own.pop()
    grid = checked(f"--over {path}", [number * (1 + share) for share in shares])
    field = Field(path, tuple(f"{v:.12g} {unit}" if unit else float(v) for v in grid), tuple(map(float, grid)), unit)
    _check_axis(field, machine)
    return field


def _check_axis(field: Field, machine: Machine) -> None:
    """Raise for a path that leads nowhere, or an end that the machine does not take."""
    if "." not in field.path:
        names = [*POINTS, *(name for name in type(machine).model_fields if name not in POINTS)]
        raise DataError(f"--over: '{field.path}' is not a path to a value; {did_you_mean(field.path, names)}")
    for value in (field.values[0], field.values[-1]):
        machine.replace(field.path, value)


@dataclass(frozen=True)
class SweepDefinition:
    """Definition of a sweep: machine, axes, quantities, and the point where speed and pressure are not axes."""

    machine: Machine
    fields: tuple[Field, ...]
    quantities: tuple[SweepQuantity, ...]
    speed: float
    pressure: float
    highest: float

    @property
    def kinds(self) -> tuple[type[Analysis], ...]:
        """Analyses that give the quantities."""
        return tuple(dict.fromkeys(quantity.kind for quantity in self.quantities))

    def axes_of(self, kind: type[Analysis]) -> tuple[Field, ...]:
        """The axes that change an analysis."""
        known = {entry.name for entry in parameters_of(kind)}
        return tuple(field for field in self.fields if field.path not in POINTS or field.path in known)

    def fixed(self, kind: type[Analysis]) -> dict[str, float]:
        """Parameters [SI] of an analysis that are not axes."""
        values = {"speed": self.speed, "pressure": self.pressure, "highest_speed": self.highest}
        axes = {field.path for field in self.fields}
        return {e.name: values[e.name] for e in parameters_of(kind) if e.name in values and e.name not in axes}

    def cells(self) -> Iterator[tuple[type[Analysis], tuple[int, ...]]]:
        """Every analysis with the place of each of its cells, machine by machine."""
        for kind in self.kinds:
            for place in product(*(range(len(field.values)) for field in self.axes_of(kind))):
                yield kind, place

    def case(self, kind: type[Analysis], place: tuple[int, ...]) -> tuple[Analysis, list[tuple[str, Any]]]:
        """Analysis of a cell, and the machine's values there by path."""
        chosen = {f.path: f.values[k] for f, k in zip(self.axes_of(kind), place, strict=True)}
        point = {name: parse(chosen.pop(name), unit) for name, unit in POINTS.items() if name in chosen}
        return kind(**self.fixed(kind), **point), list(chosen.items())


def make_sweep(
    machine: Plant | Machine | str,
    over: Over,
    what: str | tuple[str, ...] | list[str] = WHAT,
    speed: float | str = 0.0,
    pressure: float | str = 0.5e6,
    highest_speed: float | str | None = None,
) -> SweepDefinition:
    """A sweep, checked before anything is computed; see `sweep`."""
    plant = as_plant(machine)
    ask_machine(plant.machine)
    fields = read_over(over, plant.machine)
    quantities = read_quantities(what, plant.machine)
    top = highest_of(plant) if highest_speed is None else _si("highest_speed", highest_speed, "rad/s")
    found = SweepDefinition(
        plant.machine, fields, quantities, _si("speed", speed, "rad/s"), _si("pressure", pressure, "Pa"), top
    )
    _check(found)
    return found


def highest_of(plant: Plant) -> float:
    """Highest speed [rad/s] of onset and peak, rounded to three digits, when none is given."""
    return parse(f"{highest_speed(plant) * TO_RPM:.3g} rpm", "rad/s")


def _si(name: str, value: float | str, unit: str) -> float:
    try:
        number = float(parse(value, unit)) if isinstance(value, str) else float(value)
    except ValueError as error:
        raise DataError(f"{name}: {error}") from error
    if not 0 <= number < float("inf") or (name == "highest_speed" and not number):
        raise DataError(f"{name}: '{show(number, unit)}' is out of range; give a number from 0 to what the shaft holds")
    return number


def _check(sweep: SweepDefinition) -> None:
    """Refuse axes that change nothing; question unusual corners."""
    used = {field.path for kind in sweep.kinds for field in sweep.axes_of(kind)}
    for field in sweep.fields:
        if field.path not in used:
            names = ", ".join(quantity.name for quantity in sweep.quantities)
            raise DataError(f"--over: {field.path} does not change {names}; leave the axis out or add a quantity")
    own = [field for field in sweep.fields if field.path not in POINTS]
    for end in (0, -1):
        machine = with_fields(sweep.machine, own, [field.values[end] for field in own])
        ask_machine(machine)
    speeds = [parse(f.values[-1], "rad/s") for f in sweep.fields if f.path == "speed"]
    for speed in (sweep.speed, sweep.highest, *speeds):
        ask_rim_speed(sweep.machine, speed, "speed")
