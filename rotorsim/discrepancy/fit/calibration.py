"""Calibration parameters fitted before the search: machine constants, smooth trends, sensor zeros.

These are never named. The seat gap stays fixed (measured by the stroke of the piezos): with discharge coefficient and
common actuator gain it makes an exact null vector.
"""

from __future__ import annotations

from rotorsim.discrepancy.fit.parameters import FitParameter
from rotorsim.discrepancy.twin.twin import Twin
from rotorsim.effects import REGISTRY
from rotorsim.effects.diagnosis import INJECTOR_FLOW, CalibrationParameter
from rotorsim.machine.bearings import LinearBearing


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


MESH = FitParameter("mesh", 1.0, 0.5)
"""Direction of the solver's error, which is corrected for: what is left of it is within half of it."""
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
    """Calibration parameters of linear bearings (compliance, loss) and of the shaft (damping, stiffness)."""
    parameters = [
        FitParameter("shaft_damping", 0.1, 0.5, -0.9, 5.0),
        FitParameter("shaft_stiffness", 3e-4, 0.03, -0.3, 0.3),
    ]
    for i, bearing in enumerate(twin.machine.bearings):
        if not isinstance(bearing, LinearBearing):
            continue
        for axis in "xy":
            if bearing.kxx > 0:
                parameters.append(FitParameter(f"bearing.{i}.k{axis}", 0.02, 0.3, -3.0, 0.9))
            if bearing.cxx > 0:
                parameters.append(FitParameter(f"bearing.{i}.c{axis}", 0.1, 0.5, -0.9, 5.0))
    return parameters
