"""Base of physical effects: a frozen dataclass of parameters, a port and one kernel.

An effect file holds the equation and its source, a dataclass whose fields are made by `param`
(unit, bounds, NEUTRAL default, a sentence) and one kernel with its port's signature:

``force``     ``(t, angle, speed, acceleration, p) -> (fx, fy)``  force [N] on the shaft at the effect's
              `position`, at time t [s]; with ``influence = "mass"`` the pair is an acceleration [m/s^2] of the
              whole shaft, with ``influence = "bow"`` the deflection [m] the unloaded shaft has between its bearings,
              with "housing" the force is on the housing of the bearing at `position`, with "between" between both.
              `angle` [rad] stays within one turn, so only whole orders of it are continuous.
              Of a force that jumps at the start of a sample, `onset`, with the same arguments, is the jump there.
``random_force`` ``(w, state, seed, sample, speed, p)``  moves its `states` in w[state:] on by a sample, once a sample,
              with random numbers of the seed and the sample; `between`, ``(w, state, share, p) -> (fx, fy)``, is the
              force [N] on the shaft at `position` after a share of the sample.
``motion``    ``(t, angle, speed, x, y, vx, vy, p) -> (fx, fy)``  force [N] on the shaft at `position` that depends on
              the displacement [m] and velocity [m/s] there; met implicitly by the step.
              Of a force that turns the shaft, `braking`, with these arguments alone, is the torque [N m] along z.
              A force that remembers the motion has `states`, and its kernel ``w, state, h, dx, dy`` before these
              arguments: its states at the start of a step are w[state:], 0 at a run's start, and h [s] and dx, dy [m]
              are time and displacement since then (h = 0 for the linear model's tangent); `keep`, with the same
              arguments, writes those at the step's end. It is not `steady`: an equilibrium is without it.
``contact``   ``(clearance, reach, nx, ny, curvature, vx, vy, surface_speed, p) -> (fx, fy, kxx, kxy, kyx, kyy)``
              force on the journal of a gas bearing and its negative derivative after the displacement, at each place
              where the gap is smallest: distance [m] of the sleeve from its centre there, reach of the journal [m]
              towards it, direction and the second derivative [m] of the gap after the angle.
``film``      ``(t, angle, speed, theta, p) -> (height, slope)``  what the gap has more at `theta` [rad]: at the middle
              of the film [m] and per length z along the shaft [1].
``gas``       ``(t, speed, p) -> (factor, path)``  factor on the viscosity and mean free path [m] at ambient pressure.
``heat``      ``(w, state, rate, power, flow, p)``  moves the rises [K] of gas, journal and sleeve in w[state:] on by
              a sample of 1/rate [s], to where they rest for rate 0, for a friction `power` [W] and a mass flow
              [kg/s]; `warmed`, ``(w, state, p) -> (height, factor)``, is what the gap has more then [m], and the
              factor on the viscosity.
``injector``  ``(t, k, opening, supply, p) -> (opening, supply)``  seat opening [1] and supply pressure [Pa, absolute]
              of injector k (from 0).
``plenum``    ``(k, p) -> factor``  on the volume of plenum k.
``reference`` ``(w, state, number, sample, x, y, p) -> (x, y)``  references [V] along x and y that pin `number` (from 1)
              gets, once a sample; its own `states` of each pin follow each other from w[state:], 0 at a run's start.
``amplifier`` ``(number, p) -> factor``  on the time constant of the amplifier of pin `number` (from 1).
``supply``    ``(w, state, h, supply, flow, p) -> (start, end)``  pressure [Pa, absolute] behind the supply at start and
              end of a sample of h [s], for a mass flow [kg/s].
``actuator``  ``(w, old, new, h, volt, stroke, p) -> stroke``  stroke [m] of a piezo stack at `volt`, after a substep of
              h [s]; reads its `states` at w[old], writes them at w[new]. Chained in the machine file's order.
``sensor``    ``(w, reading, state, seed, sample, p)``  changes the readings in w[reading:] in place: disc x, y [m],
              shaft angle [rad], speed [rad/s], gauge pressure [Pa], angle of the probes' ring [rad]; once a sample.
              Chained in the machine file's order; its own `states` are w[state:], 0 at the start of a run.
``pin_sensor`` ``(number, h, before, start, end, seen, p) -> seen``  signal [m] that the loop of pin `number` (from 1)
              reads after h [s] in which the pin went straight from `start` to `end` and the signal began as `before`;
              `seen` is that of a perfect sensor, `end`, or of the table before; h is 0 where a pin has just jumped.
              `reading_noise`, ``(number, seed, sample, p) -> noise``, is what a recorded reading has more [m].
``drive``     ``(w, state, seed, sample, speed, p) -> speed``  speed [rad/s] that the drive reaches at the end of a
              sample where `speed` is set; not called while the drive is off. Its own `states` are w[state:].
``torque``    ``(t, angle, speed, p) -> torque``  torque [N m] on the shaft besides the drive's.
``support``   ``(p) -> (omega, zeta, gain)``  a resonance [rad/s, 1] under the film's sleeve; gain [kg^-1/2] is its
              displacement per modal coordinate.
``rotating``  ``(p) -> time``  ratio [s] of damping to stiffness of the shaft in the frame that turns with it.

`p` is the record of the effect's own parameters in SI units, and of what `derived` adds; an index below zero
counts from the end of its axis, as in Python. At its neutral values an effect leaves every bit of a trajectory as it is
without it.

An effect has its own data for a diagnosis: forms in which it may be missing, parameters that are calibrated, its role.
Effects of installed packages are loaded by their entry points: whoever installs a package chose to run it. Nothing that
a machine file or a record names is ever imported.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, ClassVar, Self, TypeVar, dataclass_transform

import numpy as np

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import MachineFileError, PackageLeftOut
from rotorsim.base.public import Registry, modules_below
from rotorsim.base.quantity import UNLIMITED, Quantity, declared, quantities, quantity_of

PORTS = (
    "force", "random_force", "motion", "contact", "film", "gas", "heat", "injector", "plenum", "supply", "reference",
    "amplifier", "actuator", "sensor", "pin_sensor", "drive", "torque", "support", "rotating",
)  # fmt: skip
"""Places where an effect acts; the head of this file has the signature of each port's kernel."""
FILM_PORTS = (
    "contact", "film", "gas", "heat", "injector", "plenum", "supply", "reference", "amplifier", "actuator",
    "pin_sensor", "support",
)  # fmt: skip
"""Ports of the gas film and what feeds it: without a film these effects have nothing to act on."""

ROLES = {
    "candidate": "may be what a machine file lacks",
    "scatter": "scatters readings: left out of the simulated means, part of the noise floor",
    "known": "a load, a limit or an instrument that is known: never looked for",
    "set": "is set on purpose, for single records too, as these state: never looked for",
    "asymmetric": "breaks the symmetry of the film, which is another plant: only on request",
}
"""Roles of an effect in a diagnosis."""
INJECTOR_FLOW = "injector_flow"
"""`scales` of a parameter whose value is the relative change of the flow of all injectors."""


@dataclass(frozen=True)
class CandidateForm:
    """A form in which an effect may be missing: one parameter, with its phase, is fitted and others are held.

    parameter, phase : names of parameters; no phase where it has none
    step : change [SI] that moves a response by a few tenths of a micrometre
    options : parameters that are held, with the values to try in turn
    refine : shape parameters with a step, fitted too once an option was chosen
    signed : whether the change may be negative
    signature : forms of one signature are indistinguishable in every record of a rig
    resembles : what would look the same but is not in the catalogue
    with_weight : forms that make nearly the same response in a rotor with a weight share this name
    from_value : parameter and value; a form that is found with at least that much of it may be another one of them
    same_as : form whose force it nearly makes where a parameter is in an interval: its key, the parameter, both ends
    axes_only : known for sensors along x and y alone
    alone_of : forms of the same kind of force share this name and are not combined
    pinned : known for injectors with pins alone
    prior : standard deviation [SI] that the size is taken to have before any record; ten steps where none is stated
    """

    parameter: str
    step: float
    phase: str = ""
    options: tuple[tuple[str, tuple[float, ...]], ...] = ()
    refine: tuple[tuple[str, float], ...] = ()
    signed: bool = True
    signature: str = ""
    resembles: str = ""
    with_weight: str = ""
    from_value: tuple[str, float] = ("", math.inf)
    same_as: tuple[str, str, float, float] | None = None
    axes_only: bool = False
    alone_of: str = ""
    pinned: bool = False
    prior: float | None = None


@dataclass(frozen=True)
class CalibrationParameter:
    """A parameter that every diagnosis calibrates before it looks for anything.

    step, sd : of finite differences, and standard deviation before the fit [SI]
    low, high : limits of the change [SI]
    phase : its phase, for a parameter that is an amplitude
    trend : step and standard deviation of its trends over pressure and speed
    film_only : in machines with a gas film only
    scales : `INJECTOR_FLOW`, or nothing
    place : which of the effect's own tables it is of
    """

    parameter: str
    step: float
    sd: float
    low: float = -1e300
    high: float = 1e300
    phase: str = ""
    trend: tuple[float, float] | None = None
    film_only: bool = True
    scales: str = ""
    place: int = 0


TURN = 6.283185307179586
"""A whole turn [rad]."""


def param(
    unit: str,
    default: float | None = 0.0,
    bounds: tuple[float, float] = (-UNLIMITED, UNLIMITED),
    doc: str = "",
    whole: bool = False,
) -> Any:
    """A parameter in SI: its unit as pint reads it, neutral default, closed bounds, one sentence; `whole`: a count.

    Examples
    --------
    >>> import rotorsim as rs
    >>> tension = rs.effects.param("N", bounds=(0.0, 1e4), doc="Mean pull.")
    >>> tension.default
    0.0
    """
    low, high = (bound if abs(bound) < UNLIMITED else None for bound in bounds)
    example = default or (1.0 if unit == "1" and bounds[1] > 1 else None)
    return declared(default, Quantity(unit, doc, low=low, high=high, multiple=int(whole), example=example))


@dataclass(frozen=True)
class Effect:
    """Base of every effect; `register` makes its class a frozen dataclass.

    Examples
    --------
    >>> import rotorsim as rs
    >>> issubclass(rs.effects.REGISTRY["unbalance"], rs.effects.Effect)
    True
    >>> rs.effects.REGISTRY["unbalance"](me=1e-5).port
    'force'
    """

    name: ClassVar[str]
    """Name of its table in the machine file: the kernel's, unless the class has another."""
    port: ClassVar[str]
    kernel: ClassVar[Callable[..., Any]]
    foundation: ClassVar[Callable[..., Any] | None] = None
    """Kernel (t, p) -> (x, y, vx, vy, ax, ay): motion of the foundation [m, m/s, m/s^2] that goes with its force."""
    keep: ClassVar[Callable[..., Any] | None] = None
    """Kernel of the port `motion` that moves the states of a force on to the end of a step."""
    onset: ClassVar[Callable[..., Any] | None] = None
    """Kernel of the port `force` for a force that jumps at the start of a sample."""
    between: ClassVar[Callable[..., Any] | None] = None
    """Kernel of the port `random_force` for the force within a sample."""
    warmed: ClassVar[Callable[..., Any] | None] = None
    """Kernel of the port `heat` for what follows from the temperatures."""
    braking: ClassVar[Callable[..., Any] | None] = None
    """Kernel of the port `motion` for the torque of its force about the shaft's axis."""
    reading_noise: ClassVar[Callable[..., Any] | None] = None
    """Kernel of the port `pin_sensor` for the noise of a recorded reading."""
    place: ClassVar[str]
    """Place where it acts when `position` is not given: 'disc' (the first), 'film', 'bearing' (the first linear one) or
    'start' (the left shaft end). Where it is not given: 'film' for the ports of the gas film, else 'disc'."""
    influence: ClassVar[str] = "node"
    """Motion on which it acts: one of `INFLUENCES`."""
    steady: ClassVar[bool] = False
    """Whether its force is constant in time, so that an equilibrium includes it."""
    states: ClassVar[int] = 0
    """Own states (of each actuator or pin, for the ports `actuator` and `reference`)."""
    single: ClassVar[bool] = False
    """Whether a machine has it at most once."""
    extra: ClassVar[tuple[str, ...]] = ()
    """Names of the numbers that `derived` adds to the kernel's record, and 'residual' for the static compliance [m/N]
    that the modes left out have where the effect acts, which the plant knows."""
    begins_chain: ClassVar[bool] = False
    """Whether it acts before all others of its port, wherever the machine file has it."""
    ends_chain: ClassVar[bool] = False
    """Whether it comes after all others of its port."""
    memory: ClassVar[str] = "long"
    """Memory of its states, if it has any: 'short' (the beginning of a record), 'mean' (longer, unless the
    excitation has no mean) or 'long'."""
    role: ClassVar[str] = "candidate"
    """Role in a diagnosis: one of `ROLES`."""
    forms: ClassVar[tuple[CandidateForm, ...]] = ()
    """Forms in which a diagnosis looks for it; where there are none they follow from its parameters."""
    calibration: ClassVar[tuple[CalibrationParameter, ...]] = ()
    """Parameters that a diagnosis calibrates."""
    cites: ClassVar[tuple[str, ...]] = ()
    """Keys of its sources in `rotorsim/base/references.bib`; a user's own may write the whole reference."""
    random_part: ClassVar[str] = ""
    """Parameter that is the size of a random error, if it has one."""
    places: ClassVar[int] = 1
    """Number of places in which a diagnosis needs it at once."""

    def __new__(cls, *values: Any, **named: Any) -> Self:
        """Refuse a parameter that it does not have; raises MachineFileError."""
        known = {entry.name for entry in fields(cls)}
        if unknown := [name for name in named if name not in known]:
            path = f"effects.{cls.name}.{unknown[0]}"
            text = f"{path}: unknown field; {did_you_mean(unknown[0], sorted(known))}"
            raise MachineFileError(text, argument=path, value=named[unknown[0]])
        return super().__new__(cls)

    def __post_init__(self) -> None:
        """Read text with units as SI; raises MachineFileError for what is no finite number."""
        for entry in fields(self):
            known, value = quantity_of(entry), getattr(self, entry.name)
            absent = value is None and entry.default is None
            if known is None or absent or (isinstance(value, (float, int)) and math.isfinite(value)):
                continue
            try:
                object.__setattr__(self, entry.name, known.check(value))
            except ValueError as error:
                path = f"effects.{self.name}.{entry.name}"
                raise MachineFileError(f"{path}: {error}", argument=path, value=value) from error

    @property
    def symmetric(self) -> bool:
        """Whether the film stays symmetric about its midplane at these parameters."""
        return True

    @classmethod
    def neutral(cls, machine: Any, place: int) -> Self:
        """A neutral one for a diagnosis of `machine`, at the first place (0) or the next."""
        return cls()

    @classmethod
    def candidate_forms(cls, machine: Any) -> tuple[CandidateForm, ...]:
        """Forms in which a diagnosis of `machine` looks for it."""
        return cls.forms or forms_of_parameters(cls)

    @classmethod
    def calibration_of(cls, machine: Any) -> tuple[CalibrationParameter, ...]:
        """Parameters that a diagnosis of `machine` calibrates."""
        return cls.calibration

    def scatter(self, readings: np.ndarray, rng: np.random.Generator) -> np.ndarray | None:
        """Displacement readings (n, 2) [m] with its scatter drawn from `rng`, not from the plant; None: it has none."""
        return None

    def derived(self, machine: Any) -> dict[str, float]:
        """Numbers that the kernel needs of the machine, one for every name in `extra`."""
        return {}

    def problems(self, machine: Any) -> dict[str, str]:
        """Why these parameters do not fit the machine: parameter ('' for the effect itself) -> sentence."""
        return {}


@dataclass(frozen=True)
class FilmEffect(Effect):
    """Base of the effects in gas films: of one, or of all.

    Examples
    --------
    >>> import rotorsim as rs
    >>> machine = rs.load_machine("dtu_gas_bearing").replace("effects.slip.mean_free_path", "68 nm")
    >>> isinstance(machine.effects["slip"][0], rs.effects.FilmEffect), machine.effects["slip"][0].bearing
    (True, None)
    """

    bearing: float | None = param(
        "1", default=None, bounds=(0.0, 63.0), whole=True,
        doc="Index among the bearings, from 0, of the film that it is about; all films when not given.",
    )  # fmt: skip


@dataclass(frozen=True)
class SampledEffect(Effect):
    """Base of the effects whose kernels need the time between two samples: `p.interval` [s].

    Examples
    --------
    >>> import rotorsim as rs
    >>> machine = rs.load_machine("dtu_gas_bearing")
    >>> rs.effects.REGISTRY["sensor_lag"](time=1e-3).derived(machine)
    {'interval': 0.0002}
    """

    extra = ("interval",)

    def derived(self, machine: Any) -> dict[str, float]:
        """The machine's sampling time [s]."""
        return {"interval": machine.sampling_time}


HOUSING, BETWEEN = OFF_SHAFT = ("housing", "between")
"""Motions besides the shaft's: that of a bearing's housing, and that of the shaft against it."""
INFLUENCES = ("node", "mass", "bow", *OFF_SHAFT)
"""Motions on which an effect acts: a place's, the whole shaft's, a bow's, a housing's or the shaft's against it."""
WHERE = ("position", "bearing")
"""Parameters that place an effect, which its kernel does not see."""
SHIPPED = modules_below(__package__, Path(__file__).parent)
"""Modules of the shipped effects by name."""
del SHIPPED["base"]
REGISTRY: Registry[type[Effect]] = Registry(SHIPPED)
"""Every known effect by its name; `register` adds one."""
E = TypeVar("E", bound=Effect)


@dataclass_transform(frozen_default=True)
def register(effect: type[E]) -> type[E]:
    """Make the class a frozen dataclass and known under its `name` (a decorator, also for a user's own module).

    Raises ValueError for a class without kernel or port, for a port or an influence that does not exist, for the name
    of another, and for a force of the motion that has states without `keep`, or the reverse, or is steady with them.

    Examples
    --------
    >>> import rotorsim as rs
    >>> from reynolds.jit import inlined
    >>> belt = inlined(lambda t, angle, speed, acceleration, p: (0.0, p.tension))
    >>> class Belt(rs.effects.Effect):
    ...     name, port, kernel = "belt", "force", belt
    ...     tension: float = rs.effects.param("N", bounds=(0.0, 1e4), doc="Mean pull.")
    >>> known = rs.effects.register(Belt)
    >>> rs.effects.REGISTRY.pop("belt")(tension=20.0)  # and forget it
    Belt(tension=20.0)
    """
    for needed in ("kernel", "port"):
        if not hasattr(effect, needed):
            raise ValueError(f"effect {effect.__name__}: has no {needed}; set it in the class, {needed} = ...")
    if "name" not in vars(effect):
        effect.name = effect.kernel.__name__
    for field, known in (("port", PORTS), ("influence", INFLUENCES)):
        if (own := getattr(effect, field)) not in known:
            raise ValueError(f"effect {effect.name}: {field} {own!r} is none of {', '.join(known)}")
    if effect.port == "motion" and (bool(effect.states) is (effect.keep is None) or (effect.states and effect.steady)):
        raise ValueError(
            f"effect {effect.name}: a force with states has a kernel keep and is not steady; set all three"
        )
    other = REGISTRY.get(effect.name, effect)
    if (other.__module__, other.__qualname__) != (effect.__module__, effect.__qualname__):  # not itself imported again
        where = f"{other.__module__}.{other.__qualname__}"
        raise ValueError(f"effect {effect.name}: is the name of {where}; give {effect.__qualname__} another name")
    if not hasattr(effect, "place"):
        effect.place = "film" if effect.port in FILM_PORTS and effect.port != "actuator" else "disc"
    REGISTRY[effect.name] = effect if "__dataclass_params__" in vars(effect) else dataclass(frozen=True)(effect)
    return effect


def forms_of_parameters(effect: type[Effect]) -> tuple[CandidateForm, ...]:
    """Forms from the parameters alone: each that is neutral at 0, with its phase, by a thousandth of its bound."""
    known = quantities(effect)
    numbers = [f.name for f in fields(effect) if f.name not in WHERE and f.default == 0.0]
    phases = {name for name in numbers if known[name].unit == "rad" and name.endswith("phase")}
    found = []
    for name in (n for n in numbers if n not in phases):
        low, high = known[name].bounds
        phase = next((p for p in (f"{name}_phase", "phase") if p in phases), "")
        size = min(abs(high), abs(low) or abs(high))
        found.append(CandidateForm(name, 1e-3 * size if size < 1e299 else 1e-3, phase, signed=low < 0))
    return tuple(found)


def numeric_fields(effect: type[Effect]) -> tuple[str, ...]:
    """Names of the numbers in the kernel's record: parameters (all but where it acts) and what is derived.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.effects.numeric_fields(rs.effects.REGISTRY["unbalance"])
    ('me', 'phase')
    """
    return (*(f.name for f in fields(effect) if f.name not in WHERE), *effect.extra)


LEFT_OUT: dict[str, str] = {}
"""Why the package of an effect could not be loaded, by the name of its entry point."""


def registry() -> Registry[type[Effect]]:
    """Every effect by name, with those of installed packages."""
    while points := _waiting():
        load_installed(points.pop())
    return REGISTRY


@cache
def _waiting() -> list[EntryPoint]:
    """Entry points that are not loaded yet; whoever loads one takes it away."""
    return sorted(entry_points(group="rotorsim.effects"), reverse=True)


def load_installed(point: EntryPoint) -> None:
    """Import the module of an entry point, which registers its effects.

    One that fails, such as a package written for another version, is a warning: everything else works without it, and
    a machine file that has its effect is answered with the package and the reason.
    """
    try:
        point.load()
    except Exception as error:  # whatever foreign code raises when it is imported
        package = point.dist.name if point.dist else point.module
        text = str(error).partition(" (")[0] if isinstance(error, ImportError) else str(error)  # without the file
        reason = f"{type(error).__name__}: {text}".splitlines()[0]
        LEFT_OUT[point.name] = f"its package {package} could not be loaded ({reason}); update or uninstall it"
        warnings.warn(
            f"effect '{point.name}' of the package {package} is left out ({reason}); update or uninstall the package",
            PackageLeftOut,
            stacklevel=2,
        )
