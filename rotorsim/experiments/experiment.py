"""Base of experiments: parameters, start point, duration and inputs of any block of samples; registry, functions.

An experiment is a frozen dataclass. It knows no plant, draws from its `sequence` alone and computes any stretch of its
rows without the ones before, so that hours take no more memory than seconds and the size of the blocks changes nothing.
Its class carries all that follows from the experiment elsewhere: parameters, each declared by a `Quantity`, of which
the options are made; the example of its command, the figures of its page, the numbers of its summary and their rows in
a table. `as_function` makes a function of it, `rotorsim experiment` a command.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import Field, dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.public import Registry, modules_below
from rotorsim.base.quantity import Quantity, check_fields, declared, quantity_of
from rotorsim.base.units import RIG_SAMPLE

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.machine.schema import Machine

LARGEST = 1e15
"""Largest SI value of a parameter without limits of its own: its square is a number still."""


def param(unit: str, doc: str, default: Any, *, low: float = -LARGEST, high: float = LARGEST, **limits: Any) -> Any:
    """A parameter in SI: unit, sentence, default and the limits of its `Quantity`."""
    example = default if isinstance(default, (int, float)) and default else None
    return declared(default, Quantity(unit, doc, low=low, high=high, example=example, **limits))


def sequence() -> Any:
    """The field of an experiment that draws: the number of what it draws."""
    doc = "Number of the random sequence; the seed makes the machine's noise alone."
    return param("1", doc, 0, low=0, high=2**53, multiple=1)


def begin() -> Any:
    """The field of an experiment that can begin on the orbit on which it would be after its start."""
    doc = "Motion at the beginning: the synchronous orbit, or rest at the static equilibrium."
    return param("1", doc, BEGINNINGS[0], choices=BEGINNINGS)


def parameters(experiment: Any) -> Iterator[tuple[Field[Any], Quantity]]:
    """Fields of an experiment (class or instance) that are parameters."""
    for entry in fields(experiment):
        quantity = quantity_of(entry)
        if quantity is not None:
            yield entry, quantity


def check_parameters(experiment: Any) -> None:
    """Make every parameter a plain number or word; raises DataError with one sentence for a bad one.

    Warns Unusual of one far from all that is done.
    """
    from rotorsim.machine.plausibility import ask  # which reads the catalogue of effects: help of commands does without

    for name, sentence in check_fields(experiment):
        raise DataError(f"{name}: {sentence}", argument=name, value=getattr(experiment, name))
    for entry, known in parameters(experiment):
        value = getattr(experiment, entry.name)
        if value is not None and not isinstance(value, str):
            ask(entry.name, value, known.unit)


def ask_speeds(machine: Machine, experiment: Any) -> None:
    """Question the speeds of an experiment at which the machine's rim would be too fast."""
    from rotorsim.machine.limits import ask_rim_speed

    for entry, known in parameters(experiment):
        if known.unit == "rad/s" and getattr(experiment, entry.name) is not None:
            ask_rim_speed(machine, getattr(experiment, entry.name), entry.name)


def fastest(experiment: Any) -> float:
    """Highest speed [rad/s] among the parameters of an experiment."""
    speeds = [getattr(experiment, entry.name) for entry, known in parameters(experiment) if known.unit == "rad/s"]
    return max((speed for speed in speeds if speed is not None), default=0.0)


def attributes(experiment: Any) -> dict[str, Any]:
    """Parameters as attributes of a record, SI; those that are not given are left out."""
    values = {known.attribute or entry.name: getattr(experiment, entry.name) for entry, known in parameters(experiment)}
    return {name: value for name, value in values.items() if value is not None}


Kind = TypeVar("Kind", bound="type[Experiment]")
EXPERIMENTS: Registry[type[Experiment]] = Registry(
    modules_below("rotorsim.experiments.catalogue", Path(__file__).with_name("catalogue"))
)
"""Every experiment by its name."""
LONGEST = 1e6
"""Longest run [s]."""
REFERENCE_LIMIT = 5.0
"""Range of the reference [V]: at either end one pin of a pair is fully in and the other fully out."""
BEGINNINGS = ("orbit", "rest")
"""Motions at the beginning of a run."""
DRIVEN = {"x": (0,), "y": (1,), "both": (0, 1)}
"""Axes that are driven one after the other."""


def reference_range(machine: Machine) -> float:
    """Largest reference [V] of a machine: that of its actuators, at most `REFERENCE_LIMIT`."""
    return REFERENCE_LIMIT if machine.actuators is None else min(machine.actuators.reference_limit, REFERENCE_LIMIT)


@dataclass(frozen=True)
class Experiment(ABC):
    """Base of every experiment; raises DataError with one sentence for bad parameters.

    Its times are whole samples of `Ts` [s]; a run takes it at the sampling time of its machine.

    Examples
    --------
    >>> import rotorsim as rs
    >>> kind = rs.experiments.EXPERIMENTS["steady"]
    >>> issubclass(kind, rs.experiments.Experiment), kind(speed=300.0, duration=0.1).initial()
    (True, (300.0, 300000.0))
    """

    name: ClassVar[str]
    drives_reference: ClassVar[bool] = False
    """Whether it needs actuators."""
    shakes: ClassVar[bool] = False
    """Whether its last two columns are accelerations of the base [m/s^2], not forces on the disc."""
    swept: ClassVar[bool] = False
    """Whether it sweeps the speed, so that its summary has resonances over the speed."""
    example: ClassVar[str] = ""
    """Options of the example in the help of its command."""
    python: ClassVar[str] = ""
    """Call in Python that does the same as `example`, where the values of the options do not make it."""
    figures: ClassVar[tuple[str, ...]] = ()
    """Sections of its page, by their names in `rotorsim.report`; a section that cannot be made states the reason."""
    page: ClassVar[str] = ""
    """Name of the page that its command writes; NAME.html where it is empty."""
    Ts: float = field(default=RIG_SAMPLE, kw_only=True, repr=False)
    """Sampling time [s]."""

    def __post_init__(self) -> None:
        check_parameters(self)
        self.check()
        if self.samples * self.Ts > LONGEST:
            days = self.samples * self.Ts / 86400
            raise DataError(f"{self.name}: would last {days:.3g} days; make it shorter than {LONGEST:g} s")

    def check(self) -> None:
        """Refuse parameters that do not go together."""
        return

    def sampled(self, Ts: float) -> Self:
        """The experiment at a sampling time [s]; raises DataError for times that are not whole samples of it."""
        return self if Ts == self.Ts else replace(self, Ts=Ts)

    def samples_in(self, seconds: float) -> int:
        """Samples in a time [s] that was checked to be a whole number of them."""
        return round(seconds / self.Ts)

    @property
    @abstractmethod
    def samples(self) -> int:
        """Length in samples; the longest one if it can end earlier."""

    @abstractmethod
    def initial(self) -> tuple[float, float]:
        """Speed [rad/s] and gauge pressure [Pa] of the equilibrium it starts from."""

    @abstractmethod
    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) from sample `first` on, as `Simulation.advance` takes them."""

    def base_motion(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement [m] and velocity [m/s] (n, 2) of the base at times (n,) [s]: it rests unless it shakes."""
        return np.zeros((len(time), 2)), np.zeros((len(time), 2))

    def end(self, speed: np.ndarray) -> int | None:
        """Samples to keep of a stretch with these true speeds (n,) [rad/s] if the experiment ends in it."""
        return None

    @classmethod
    def findings(cls, record: xr.Dataset) -> dict[str, Any]:
        """Numbers of a record that this experiment is made for, ready for JSON, besides those that all have."""
        return {}

    @classmethod
    def table(cls, summary: dict[str, Any]) -> list[tuple[str, str]]:
        """Rows of the findings in a printed table: label and value with unit."""
        return []

    def attrs(self) -> dict[str, Any]:
        """Name and parameters for a record's attributes, SI."""
        return {"experiment": self.name, **attributes(self)}


@dataclass(frozen=True)
class PointExperiment(Experiment):
    """An experiment at constant speed and supply pressure."""

    speed: float = param("rad/s", "Shaft speed.", 0.0, low=0)
    pressure: float = param("Pa", "Injection pressure, gauge.", 0.3e6, low=0)

    def initial(self) -> tuple[float, float]:
        """Speed [rad/s] and gauge pressure [Pa] of the equilibrium it starts from."""
        return self.speed, self.pressure

    def held(self, count: int) -> np.ndarray:
        """Rows (count, 6) of constant speed and pressure without reference and force."""
        rows = np.zeros((count, 6))
        rows[:, 0], rows[:, 1] = self.speed, self.pressure
        return rows


def register(kind: Kind) -> Kind:
    """Decorator of a dataclass: list the experiment under its name."""
    EXPERIMENTS[kind.name] = kind
    return kind


def pair(values: list[float], unit: str) -> str:
    """Text of two numbers with their unit."""
    return f"{values[0]:.3g}, {values[1]:.3g} {unit}"


def generator(sequence: int, *key: int) -> np.random.Generator:
    """Random numbers of one place of one experiment, the same whatever was drawn elsewhere."""
    return np.random.default_rng([sequence, *key])


def check_seed(seed: Any) -> int:
    """The seed as an int; raises DataError."""
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or not 0 <= seed < 2**53:
        raise DataError(
            f"seed = {seed}: must be a whole number from 0 to 2^53 - 1; give e.g. 0", argument="seed", value=seed
        )
    return int(seed)
