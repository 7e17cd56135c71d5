r"""Calibration of a machine: fit parameters as changes of a twin's numbers, and the compiled twins to fit.

A parameter's value adds to one number of the setting, alike at every operating point or as a smooth trend over
pressure or speed.

Keys of numbers: 'effect.table.parameter' adds to that parameter; 'effect.table.amplitude~phase.c' (or .s) adds to
amplitude times cosine (sine) of the phase, so that a fit is linear where the physics is; names of `twin.FACTORS` are
relative changes, 'bearing.i.kx' and '.cx' those of a bearing's compliance and loss (`twin.of_bearing`); DIRECTIONS
shift the data and not the plant.

Parameters of the calibration are never named as a missing effect. The seat gap stays fixed (measured by the stroke of
the piezos): with discharge coefficient and common actuator gain it makes an exact null vector.

Three twins are compiled: the coarse one of the fit, the fine one, and one with the injectors' other law, which is the
orifice where the machine has a loss factor, and the reverse:

.. math:: C_{d1}\,\pi d_p\,g\,\Phi(P_s, P_k) \;\leftrightarrow\; l_f\,(P_s^2 - P_k^2)

Conductances are matched by the flow at rest at `MATCHED_PRESSURE`, so that only the dependence of the flow on the
pressures differs. Sources: Morosi & Santos (2011) for the orifice; Pierart & Santos (2015) for the loss factor.

Cites: morosi_2011, pierart_2015.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import pi, sqrt
from typing import Protocol

import numpy as np

from rotorsim.discrepancy.changes import MAIN, PLANE
from rotorsim.discrepancy.twin import FAILURES, Setting, Twin, of_axis
from rotorsim.effects import REGISTRY, Effect
from rotorsim.effects.base import INJECTOR_FLOW, CalibrationParameter
from rotorsim.machine import Machine
from rotorsim.plant.compose import is_compiled
from rotorsim.plant.simulation import settle

STEPS = 10.0
"""Prior standard deviation of an effect's size in steps; one moves a response by a few tenths of a micrometre."""
REFERENCE_PRESSURE = 0.5e6
"""Gauge pressure [Pa] at which a trend over pressure is zero."""
REFERENCE_SPEED = 2 * np.pi * 100
"""Shaft speed [rad/s] that scales a trend over speed."""
DIRECTIONS = ("offset_x", "offset_y", "mesh", "law")
"""Keys that shift the data and not the plant: the sensors' zeros [m], the solver's mesh and the injectors' law [1]."""
GRID, STEP = (32, 8), 2e-4
"""Film's nodes around and along, and time step [s], of the twin that is fitted."""
FINE_GRID, FINE_STEP = (64, 16), 1e-4
"""Film's nodes around and along, and time step [s], of the twin that shows the discretisation error, all halved: the
error around the film is cross stiffness, which a whirl at half the speed shows many times over."""
MATCHED_PRESSURE = 0.5e6
"""Gauge pressure [Pa] at which both laws give the same flow."""
MATCHED_SPEED = 300.0
"""Shaft speed [rad/s] at which the flows are matched."""
COMPLIANCE_LIMITS = (-3.0, 0.9)
"""Limits of the relative change s of a bearing's compliance: k / (1 - s)."""
LOSS_LIMITS = (-0.99, 15.0)
"""Limits of the relative change of a bearing's loss: its damping can stay the same at every allowed stiffness."""
LOSS_SD = 0.5
"""Prior standard deviation of the relative change of a bearing's loss c / k^2."""
MOST_MATCHES = 6
"""Most corrections of the other law's coefficient until the flows are equal."""
FLOW_STEP = 0.02
"""Step of the flow's relative change in finite differences."""


class Progress(Protocol):
    """Function that is called with each step of the work."""

    def __call__(self, stage: str, most: int = 0) -> None:
        """Note a step of a stage, and the most steps that it takes, 0 where that is not known."""


@dataclass(frozen=True)
class FitParameter:
    """Fit parameter: key, finite-difference step, prior standard deviation, limits of the change."""

    key: str
    step: float
    sd: float = 1e300
    low: float = -1e300
    high: float = 1e300
    trend: str = ""
    usual: float = 0.0
    """Prior standard deviation of an effect's size in the odds; `STEPS` steps where none is stated."""
    plane: float | None = None
    """Plane [m] of the probes whose readings alone it changes, `MAIN` for the machine file's; None for all."""

    @property
    def prior_size(self) -> float:
        """Standard deviation of the size of an effect before any record, for the odds."""
        return self.usual or STEPS * self.step

    @property
    def name(self) -> str:
        """Unique name."""
        of_plane = "" if self.plane is None else f" in plane {self.plane:g}"
        return (f"{self.key} x {self.trend}" if self.trend else self.key) + of_plane

    def acts_at(self, known: Mapping[str, float] | None) -> bool:
        """Whether it changes the readings of a record with these `known` changes, of which one is the plane."""
        return self.plane is None or self.plane == (known or {}).get(PLANE, MAIN)

    def share(self, speed: float, pressure: float) -> float:
        """Factor of the parameter's value at an operating point [rad/s], [Pa]; 1 without a trend."""
        if self.trend == "pressure":
            return pressure / REFERENCE_PRESSURE - 1
        if self.trend == "speed":
            return (speed / REFERENCE_SPEED) ** 2 - 0.35
        return 1.0


Values = Mapping[FitParameter, float]
"""Values by fit parameter."""


def contributions(
    values: Values, speed: float, pressure: float, known: Mapping[str, float] | None = None
) -> dict[str, float]:
    """Sum of the changes by key at an operating point, on top of those `known` of a record."""
    out: dict[str, float] = dict(known or {})
    for parameter, value in values.items():
        if not parameter.acts_at(known):
            continue
        out[parameter.key] = out.get(parameter.key, 0.0) + value * parameter.share(speed, pressure)
    return out


def setting(twin: Twin, sums: Mapping[str, float], fixed: Mapping[str, float] | None = None) -> dict[str, float]:
    """Absolute values for `Twin.run` from changes; `fixed` values are absolute and applied first."""
    out: dict[str, float] = dict(fixed or {})
    turned: dict[tuple[str, str, str], complex] = {}
    for key, change in sums.items():
        if key in DIRECTIONS:
            continue
        if "~" in key:
            path, part = key[:-2], key[-1]
            owner, _, pair = path.rpartition(".")
            amplitude, _, phase = pair.partition("~")
            index = (owner, amplitude, phase)
            turned[index] = turned.get(index, 0) + change * (1 if part == "c" else 1j)
        elif "." in key and not key.startswith("bearing."):
            name, table, parameter = key.split(".")
            out[key] = out.get(key, float(getattr(twin.effect(name, int(table)), parameter))) + change
        else:
            out[key] = out.get(key, 0.0) + change
    for (owner, amplitude, phase), vector in turned.items():
        name, table = owner.split(".")
        own = twin.effect(name, int(table))
        n = out.get(f"{owner}.{amplitude}_lobes", lobes(own, amplitude))
        total = wave(own, amplitude, phase, n) + vector
        out[f"{owner}.{amplitude}"] = float(abs(total))
        out[f"{owner}.{phase}"] = float(np.angle(total)) / n
    return out


def lobes(effect: Effect, amplitude: str) -> float:
    """Number of lobes if the phase of an amplitude is a lobe's position; 1 if it is the phase of a wave."""
    return float(getattr(effect, f"{amplitude}_lobes", 1.0))


def wave(effect: Effect, amplitude: str, phase: str, n: float = 1.0) -> complex:
    """Complex amplitude (cosine + i sine) of a wave from its amplitude and n times its phase."""
    return complex(getattr(effect, amplitude) * np.exp(1j * n * getattr(effect, phase)))


def sd_of_polar(c: float, s: float, V: np.ndarray, base: complex = 0.0) -> tuple[float, float, float, float]:
    """Amplitude, phase and their standard deviations of base + c + i s with covariance V (2, 2) of c, s."""
    z = base + complex(c, s)
    a, phi = abs(z), float(np.angle(z))
    along, across = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
    return a, phi, float(np.sqrt(along @ V @ along)), float(np.sqrt(across @ V @ across) / max(a, 1e-300))


def within(parameters: Iterable[FitParameter], values: np.ndarray) -> np.ndarray:
    """Values (k,) clipped to the limits of the fit parameters."""
    pairs = [(k.low, k.high) for k in parameters]
    return np.clip(values, [p[0] for p in pairs], [p[1] for p in pairs])


def calibration(twin: Twin, points: int = 6) -> tuple[FitParameter, ...]:
    """Fit parameters of a machine's calibration; trends only with at least four operating points."""
    machine = twin.machine
    parameters = [FitParameter("offset_x", 1e-7, 5e-5), FitParameter("offset_y", 1e-7, 5e-5)]
    parameters += [k for name, p in _declared(twin, film_only=False) for k in _fit_parameters(twin, name, p)]
    if machine.film is None:
        parameters += linear(twin)
    else:
        parameters += gas(twin)
        if points >= 4:
            parameters += trends(twin)
    return tuple(parameters)


SHEAR = FitParameter("shaft_shear", 0.1, 0.5, -1.0, 1.0)
"""Relative change of the shaft's softening by shear, which stands next to a law: a shaft with -1 does not shear."""
MESH = FitParameter("mesh", 1.0, 0.5)
"""Direction of the solver's error, which is corrected for; half of it may remain. Halved nodes and steps show three
quarters of an error of second order and half of one of first order: more than all of it once more is not believed."""
LAW = FitParameter("law", 1.0, 0.1)
"""Direction from one injector law to the other."""


def gas(twin: Twin) -> list[FitParameter]:
    """Calibration parameters of film, injectors, actuators and ball bearing."""
    parameters = [FitParameter("shaft_damping", 0.1, 0.3, -0.9, 3.0)]
    for name, p in _declared(twin, film_only=True):
        parameters += _fit_parameters(twin, name, p)
        if p.scales == INJECTOR_FLOW:
            parameters += [FitParameter("curtain_discharge", 0.03, 0.10, -0.5, 0.5)]
    if twin.machine.injectors:
        parameters += [
            FitParameter("actuator_x", 0.02, 0.05, -0.5, 0.5),
            FitParameter("actuator_y", 0.02, 0.05, -0.5, 0.5),
        ]
    return parameters


def trends(twin: Twin) -> list[FitParameter]:
    """Smooth trends of stiffness, damping and gain over pressure and speed, as fit parameters."""
    declared = [(k, p.trend) for name, p in _declared(twin, film_only=True) if p.trend for k in _keys(twin, name, p)]
    return [FitParameter(key, step, sd, trend=trend) for trend in ("pressure", "speed") for key, (step, sd) in declared]


def flow_key(twin: Twin) -> str:
    """Key of the parameter that scales the flow of all injectors; empty if there is none."""
    declared = _declared(twin, film_only=True)
    return next((_keys(twin, name, p)[0] for name, p in declared if p.scales == INJECTOR_FLOW), "")


def _declared(twin: Twin, film_only: bool) -> list[tuple[str, CalibrationParameter]]:
    """Effect and parameter, for all that effects of the twin declare."""
    effects = [effect for name, effect in REGISTRY.items() if name in twin.slots]
    return [(e.name, p) for e in effects for p in e.calibration_of(twin.machine) if p.film_only == film_only]


def _keys(twin: Twin, name: str, parameter: CalibrationParameter) -> list[str]:
    """Keys of a parameter, one for each film that it is about."""
    first, last = twin.slots[name] + parameter.place, len(twin.equipped[0].effects[name])
    return [f"{name}.{k}.{parameter.parameter}" for k in range(first, last, REGISTRY[name].places)]


def _fit_parameters(twin: Twin, name: str, p: CalibrationParameter) -> list[FitParameter]:
    """One number, or the cosine and sine parts of an amplitude with a phase."""
    keys = _keys(twin, name, p)
    if p.phase:
        keys = [f"{key}~{p.phase}.{part}" for key in keys for part in "cs"]
    return [FitParameter(key, p.step, p.sd, p.low, p.high) for key in keys]


def linear(twin: Twin) -> list[FitParameter]:
    """Calibration parameters of bearings without a film (compliance, loss) and of the shaft (damping, stiffness)."""
    parameters = [
        FitParameter("shaft_damping", 0.1, 0.5, -0.9, 5.0),
        FitParameter("shaft_stiffness", 3e-4, 0.03, -0.3, 0.3),
    ]
    for i, bearing in enumerate(twin.machine.bearings):
        for axis in "xy":
            k, c = of_axis(bearing, axis)
            if k.size and (k > 0).all():
                parameters.append(FitParameter(f"bearing.{i}.k{axis}", 0.02, 0.3, *COMPLIANCE_LIMITS))
            if c.size and (c > 0).all():
                parameters.append(FitParameter(f"bearing.{i}.c{axis}", 0.1, LOSS_SD, *LOSS_LIMITS))
    return parameters


@dataclass(frozen=True)
class ParameterPoint:
    """Point in parameter space: values of fit parameters, and fixed absolute values."""

    values: Mapping[FitParameter, float] = field(default_factory=dict, hash=False)
    fixed: Mapping[str, float] = field(default_factory=dict, hash=False)

    def moved(self, parameters: Sequence[FitParameter], changes: np.ndarray) -> ParameterPoint:
        """Point with changes added to parameters."""
        new = dict(self.values)
        for parameter, change in zip(parameters, changes, strict=True):
            new[parameter] = new.get(parameter, 0.0) + float(change)
        return replace(self, values=new)

    def setting(
        self, twin: Twin, speed: float = 0.0, pressure: float = 0.0, known: Mapping[str, float] | None = None
    ) -> dict[str, float]:
        """Absolute values for `Twin.run` at an operating point [rad/s], [Pa], with the changes `known` of a record."""
        return setting(twin, contributions(self.values, speed, pressure, known), self.fixed)

    def holding(self, fixed: Mapping[str, float]) -> ParameterPoint:
        """Point with further numbers held."""
        return replace(self, fixed={**self.fixed, **fixed})


@dataclass(frozen=True)
class CompiledModels:
    """Compiled twins of a machine: the coarse one for the fit and the fine one for its discretisation error.

    Examples
    --------
    >>> import rotorsim as rs
    >>> models = rs.discrepancy.CompiledModels.of(machine)  # doctest: +SKIP
    >>> found = [rs.diagnose(machine, [file], models=models) for file in ("1.nc", "2.nc")]  # doctest: +SKIP
    """

    twin: Twin
    fine: Twin | None
    law: tuple[Twin, Mapping[FitParameter, float]] | None = None
    """The twin with the injectors' other law, and the changes that match its flow."""

    @classmethod
    def of(
        cls, machine: Machine, effects: Iterable[str] | None = None, progress: Progress = lambda stage, most=0: None
    ) -> CompiledModels:
        """Compile the twins of a machine with all effects of the catalogue, or these, as candidates."""
        only = None if effects is None else tuple(sorted(set(effects)))
        fine_grid = GRID if machine.film is None else FINE_GRID
        twin = Twin(machine, GRID, STEP, only=only)
        if not is_compiled(twin.assembly.module):
            progress("compile")
        return cls(twin, Twin(machine, fine_grid, FINE_STEP, only=only), other_law(twin))


def other_law(twin: Twin) -> tuple[Twin, dict[FitParameter, float]] | None:
    """Twin with the alternative injector law and the drift that matches the flow; None if there is none."""
    machine = twin.machine
    key = flow_key(twin)
    if not machine.injectors or not key:
        return None
    other = replace(twin, machine=exchanged(machine)).with_candidates()  # it shows the calibration alone
    try:
        return other, {FitParameter(key, FLOW_STEP): _drift(twin, other, key)}
    except FAILURES:
        return None


def exchanged(machine: Machine) -> Machine:
    """Machine with the alternative injector law and a matching coefficient."""
    common = machine.injection
    assert common is not None
    high = MATCHED_PRESSURE + machine.gas.ambient_pressure
    # a choked seat against half the pressure behind it
    choked = 0.6847 / sqrt(machine.gas.R * machine.gas.temperature) * pi * common.pin_diameter
    each = choked * common.seat_gap / (0.75 * high)
    if common.law == "orifice":
        size = (common.pin_discharge or 0.0) * each
        return machine.with_({"injection.loss_factor": float(f"{size:.6g}"), "injection.law": "loss_factor"})
    return machine.with_({"injection.pin_discharge": (common.loss_factor or 0.0) / each, "injection.law": "orifice"})


def _drift(twin: Twin, other: Twin, key: str) -> float:
    """Drift of the other law's coefficient at which the flows at rest are equal."""
    wanted, drift = _flow(twin, {}), 0.0
    for _ in range(MOST_MATCHES):
        found = _flow(other, {key: drift} if drift else {})
        if abs(found / wanted - 1) < 1e-4:
            break
        drift = (1 + drift) * wanted / found - 1
    return drift


def _flow(twin: Twin, setting: Setting) -> float:
    """Mass flow [kg/s] of all injectors at rest."""
    a = twin.set(setting)
    w = settle(a, MATCHED_SPEED, MATCHED_PRESSURE)
    first = a.film.film_flow
    return float(sum(a.film_part(w, k)[first : first + a.film.n_inj].sum() for k in range(len(a.films))))
