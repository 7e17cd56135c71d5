"""Diagnosis data of an effect: forms in which it may be missing, parameters that a calibration fits, its role."""

from __future__ import annotations

import math
from dataclasses import dataclass

ROLES = {
    "candidate": "may be what a machine file lacks",
    "scatter": "scatters readings: left out of the simulated means, part of the noise floor",
    "known": "a load or a limit that is known: never looked for",
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
