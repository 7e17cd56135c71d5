"""Settings of a live rig: numbers within their limits, positions of switches, a slider for each parameter of an effect.

A parameter is changed while the plant runs: it is written into the parameter record with all that follows from it.
"""

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from math import prod
from typing import Any

from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.base.quantity import Quantity, quantities
from rotorsim.base.units import RPM, dimension
from rotorsim.effects import FILM_PORTS, REGISTRY, Effect
from rotorsim.effects.base import WHERE
from rotorsim.machine import Machine
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.calls import Call
from rotorsim.plant.kernels.injectors import TABLE, blend
from rotorsim.plant.kernels.modal_rotor import build_support
from rotorsim.plant.locations import OF_PINS

HUGE = 1e300


@dataclass(frozen=True)
class Control:
    """Numeric control in SI with limits; displayed as value / `scale` in the unit `shown`."""

    key: str
    label: str
    shown: str
    scale: float
    low: float
    high: float
    neutral: float
    whole: bool = False
    doc: str = ""
    power: int = 3
    """Wide ranges are spread over a slider by this power, so that small values have room."""

    def clamp(self, value: Any) -> tuple[float, str]:
        """The nearest value [SI] within the limits, and a sentence if that is another one; raises DataError."""
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < HUGE:
            raise DataError(f"{self.key}: {str(value)[:40]!r} is not a number; give one from {self.limits}")
        inside = min(max(float(value), self.low), self.high)
        if self.whole:
            inside = float(round(inside))
        if abs(inside - value) <= 1e-9 * max(abs(self.low), abs(self.high)):
            return inside, ""
        if self.low <= value <= self.high:
            return inside, f"{self.label}: {self.read(value)} is not whole, set to {self.read(inside)}"
        return inside, f"{self.label}: {self.read(value)} is beyond {self.limits}, set to {self.read(inside)}"

    def read(self, value: float) -> str:
        """A value as text in its display unit."""
        return f"{value / self.scale:.6g} {self.shown}".strip()

    @property
    def limits(self) -> str:
        """Both limits as text in their display unit."""
        return f"{self.read(self.low)} to {self.read(self.high)}"

    def place(self, value: float) -> float:
        """Position of a slider from -1 (or 0) to 1 for a value; its zero is the neutral value."""
        away = value - self.neutral
        reach = self.high - self.neutral if away >= 0 else self.neutral - self.low
        return math.copysign((abs(away) / reach) ** (1 / self.power), away) if reach > 0 else 0.0

    def value(self, place: float) -> float:
        """The value [SI] for a slider's place: three digits, for reading."""
        reach = self.high - self.neutral if place >= 0 else self.neutral - self.low
        away = math.copysign(abs(place) ** self.power * reach, place)
        return float(f"{(self.neutral + away) / self.scale:.3g}") * self.scale


def control_of(key: str, quantity: Quantity, neutral: float = 0.0, shown: str = "", power: int = 3) -> Control:
    """Control of a quantity with both limits, displayed in the unit `shown`, by default the largest in use."""
    kind, (low, high) = dimension(quantity.unit), quantity.bounds
    unit = shown or (kind.people[-1] if kind.people else "")
    scale = float(kind.factors[unit]) if unit else 1.0
    label = key.rpartition(".")[2].replace("_", " ")
    inside = min(max(neutral, low), high)
    return Control(key, label, unit, scale, low, high, inside, bool(quantity.multiple), quantity.doc, power)


OFF, P_LAW, PAUSE = "off", "P", "pause"
SWITCHES: dict[str, tuple[str, ...]] = {
    "drive": ("speed", "torque", "coast"),
    "sense": ("forward", "backward"),
    "noise": ("on", "off"),
    "pace": ("pause", "0.1x", "1x", "fastest"),
}
"""Positions of every switch but `controller`, whose positions are off, P and the laws that were given."""
BEARING = "bearing"
"""Switch of a machine with several films: whose journal and pressure are drawn."""
START = {"drive": "speed", "sense": "forward", "noise": "on", "pace": "1x", "controller": OFF}
HIGHEST = 30_000 * RPM
"""Highest speed [rad/s] that can be set on a machine whose file states none; a drive takes 3 s to it."""
TORQUE = Quantity("N*m", "Drive torque, in the sense that is set.", low=0.0, high=5.0)
IMPULSE = Quantity("N*s", "Impulse of a hammer's hit on the disc, five samples long.", low=0.0, high=0.2)
PRESSURE = Quantity("Pa", "Gauge pressure.", low=0.0, high=1e6)
PACES = {"pause": 0.0, "0.1x": 0.1, "1x": 1.0, "fastest": float("inf")}


def switches(machine: Machine) -> dict[str, tuple[str, ...]]:
    """Positions of the switches of a machine, but `controller`."""
    return SWITCHES | ({BEARING: machine.film_names} if len(machine.films) > 1 else {})


def driven_axes(machine: Machine) -> str:
    """Axes whose reference drives a pin."""
    return "".join(axis for axis in "xy" if any(i.reference.endswith(axis) for i in machine.injectors))


def operating(machine: Machine) -> dict[str, Control]:
    """Operating controls by key."""
    limit = 5.0 if machine.actuators is None else machine.actuators.reference_limit
    highest = machine.drive.highest_speed or HIGHEST
    speed = Quantity("rad/s", "Speed the drive holds.", low=0.0, high=highest)
    acceleration = Quantity("rad/s^2", "Limit of the drive.", low=RPM, high=highest / 3)
    found = [
        control_of("speed", speed, power=1),
        control_of("acceleration", acceleration, 500 * RPM * highest / HIGHEST),
        control_of("torque", TORQUE, power=1),
        control_of("impulse", IMPULSE, 0.01 * min(machine.mass, 1.0)),
    ]
    if machine.injectors or any(film.orifices for film in machine.films):
        found.append(control_of("pressure", PRESSURE, 0.3e6, "MPa", power=1))
    reference = Quantity("V", "Constant.", low=-limit, high=limit)
    found += [control_of(f"reference_{axis}", reference, power=1) for axis in driven_axes(machine)]
    return {control.key: control for control in found}


READ_IN = {"m": "um", "s": "ms", "Pa": "kPa", "N*m": "N*m", "N/m": "MN/m"}
"""Units of sliders that differ from the largest one of machine files."""


def equip(machine: Machine) -> Machine:
    """Machine with every effect that can act on it; those missing in the file are neutral."""
    missing = [n for n in sorted(REGISTRY) if n not in machine.effects]
    acting = [n for n in sorted(missing, key=lambda n: REGISTRY[n].ends_chain) if _acts(REGISTRY[n], machine)]
    try:
        machine = machine.with_({f"effects.{name}": {} for name in acting})
    except MachineFileError:  # some have no place on this machine
        for name in acting:
            with suppress(MachineFileError):
                machine = machine.with_({f"effects.{name}": {}})
    return machine.with_({"grid.symmetry": "none"}) if machine.film is not None else machine


def _acts(effect: type[Effect], machine: Machine) -> bool:
    """True if an effect has something to act on, as far as the checks of a machine file leave that open."""
    if machine.film is None and effect.port in FILM_PORTS:
        return False
    return bool(machine.injectors) or effect.port not in ("injector", "plenum", "supply", *OF_PINS)


def sliders(machine: Machine) -> dict[str, Control]:
    """Controls of all effect parameters of an equipped machine, by 'effect.parameter' (first table)."""
    found = {}
    for name in sorted(machine.effects):
        effect = machine.effects[name][0]
        for parameter, quantity in quantities(effect).items():
            if parameter in WHERE or quantity.low is None or quantity.high is None:
                continue
            if parameter == "injector":
                quantity = replace(quantity, high=float(len(machine.injectors)))
            neutral, key = float(getattr(type(effect)(), parameter)), f"{name}.{parameter}"
            found[key] = control_of(key, quantity, neutral, READ_IN.get(quantity.unit, ""))
    return found


def with_value(machine: Machine, key: str, value: float) -> Machine:
    """An equipped machine with a parameter [SI] of an effect's first table changed.

    Raises DataError with one sentence that names the slider, if the value does not fit.
    """
    name, _, parameter = key.partition(".")
    try:
        return machine.with_({f"effects.{name}.0.{parameter}": value})
    except MachineFileError as error:
        path, colon, sentence = error.problems[0].partition(": ")
        raise DataError(f"{path.removeprefix('effects.').replace('.0', '', 1)}{colon}{sentence}") from error


class RigSettings:
    """Values by key: operating numbers, 'effect.parameter', switches; `revision` counts changes."""

    def __init__(self, machine: Machine, laws: tuple[str, ...]) -> None:
        self.operating = operating(machine)
        self.sliders = sliders(machine)
        self.switches = switches(machine) | {"controller": laws}
        self.numbers = {key: control.neutral for key, control in self.operating.items()}
        self.numbers |= {key: _present(machine, key) for key in self.sliders}
        self.file = {key: self.numbers[key] for key in self.sliders}
        self.positions = START | {key: self.switches[key][0] for key in (BEARING,) if key in self.switches}
        self.revision = 0

    def control(self, key: str) -> Control:
        """The control of a number; raises DataError."""
        found = self.operating.get(key) or self.sliders.get(key)
        if found is None:
            raise DataError(f"{str(key)[:60]!r}: is not a setting of this rig")
        return found

    def number(self, key: str, value: Any) -> tuple[float, str]:
        """The value that a number can take, and the message if it is not the one asked for; raises DataError."""
        return self.control(key).clamp(value)

    def keep(self, key: str, value: float | str) -> None:
        """Write down a value that has been checked."""
        if isinstance(value, str):
            self.positions[key] = value
        else:
            self.numbers[key] = value
        self.revision += 1

    def position(self, key: str, value: Any) -> str:
        """A switch's position; raises DataError."""
        if key not in self.switches or value not in self.switches[key]:
            known = ", ".join(self.switches.get(key, ())) or "none: there is no such switch"
            raise DataError(f"{str(key)[:40]}: {str(value)[:40]!r} is none of its positions; they are {known}")
        return str(value)

    def everything(self) -> dict[str, float | str]:
        """Numbers in SI and positions of switches, by key."""
        return {**self.numbers, **self.positions}


def _present(machine: Machine, key: str) -> float:
    name, _, parameter = key.partition(".")
    return float(getattr(machine.effects[name][0], parameter))


def write_effect(a: Assembly, record: str, effect: Effect, parameter: str) -> None:
    """Write an effect's parameter and its derived numbers into the parameter record."""
    row = a.record[record]
    for name, value in ({parameter: getattr(effect, parameter)} | effect.derived(a.machine)).items():
        row[name] = value


def update_derived(a: Assembly, w: Any) -> None:
    """Recompute the numbers derived from parameters: supports, plena, rotor matrix."""
    for call in a.calls:
        if call.effect.port == "support":
            dof = a.rotor.n_machine + 2 * call.order
            _pure(build_support)(w, a.rotor, call.film or 0, dof, *_values(a, call))
    for f, film in enumerate(a.films):
        plena = [c for c in a.calls if c.effect.port == "plenum" and c.film in (None, f)]
        capacity = a.film_part(w, f)[a.film.capacity :]
        for k in range(len(film.injectors)):
            factor = prod(_values(a, c, k) for c in plena)
            capacity[k] = a.P.capacity[f * a.film.n_inj + k] * factor
    amplifiers = [c for c in a.calls if c.effect.port == "amplifier"]
    pins = [k for k in range(a.rig.n_inj) if a.P.pinned[k]] if a.rig.driven else []
    for k in pins:
        lag = a.P.amplifier_lag[k] * prod(_values(a, c, a.P.pinned[k]) for c in amplifiers)
        at = a.rig.table + TABLE * k
        w[at : at + 2] = _pure(blend)(a.P.sample / a.rig.substeps, lag)[:2]
    w[a.rotor.matrix_step] = 0.0


def _values(a: Assembly, call: Call, *arguments: Any) -> Any:
    """Values of an effect's kernel with its parameters."""
    return _pure(type(call.effect).kernel)(*arguments, getattr(a.P, call.record))


def _pure(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """The Python of a kernel: once in a while it is quicker than compiling."""
    return getattr(kernel, "py_func", kernel)
