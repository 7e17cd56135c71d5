"""The candidates: every effect of the catalogue that the twin has, in the forms in which it may be hidden.

A form turns one or a few parameters of an effect and holds others at one of several options (which injector, which
frequency). What the catalogue says about itself suffices to make the forms of an effect of the user's own: parameters
whose neutral value is 0 are turned, one that has a phase together with it; `data.SIZES` only adds sizes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from math import pi

import numpy as np

from rotorsim.discrepancy.knobs import Knob
from rotorsim.discrepancy.twin import Twin
from rotorsim.effects import REGISTRY, Effect
from rotorsim.errors import DataError

TURN = 2 * pi
NO_SOLUTION = 1e-3
"""Lines [m] that stand for a plant without solution."""


@dataclass(frozen=True)
class Form:
    """One way in which an effect may be hidden: knobs to turn, absolute values to hold, its name for people."""

    effect: str
    label: str
    knobs: tuple[Knob, ...]
    fixed: Mapping[str, float] = field(default_factory=dict, hash=False)
    refine: tuple[Knob, ...] = ()
    """Shape parameters that a non-linear fit may turn as well."""

    @property
    def key(self) -> str:
        """What makes it this form: effect and which of its parameters (and injector), without shape options."""
        return self.label.split(" @ ")[0]

    @property
    def names(self) -> set[str]:
        """What a user may call it: the effect, the effect's parameter, and that of one injector."""
        return {self.effect, self.key.split(" of ")[0], self.key}

    def felt(self, columns: np.ndarray) -> bool:
        """Whether sensitivities (n, knobs) [m] say that it changes anything and the plant has a solution with it."""
        moved = np.abs(columns * [k.step for k in self.knobs])
        return bool(np.all(np.isfinite(moved)) and 0 < moved.max() < NO_SOLUTION / 2)


@dataclass(frozen=True)
class Recipe:
    """Sizes of an effect's forms: parameter -> step; `phase` its phase; `options` held values to try in turn."""

    parameter: str
    step: float
    phase: str = ""
    options: tuple[tuple[str, tuple[float, ...]], ...] = ()
    refine: tuple[tuple[str, float], ...] = ()
    signed: bool = True
    """Shape parameters with a step, turned once an option was chosen."""


R = Recipe
RECIPES: dict[str, tuple[Recipe, ...]] = {
    "shaft_bow": (R("bow", 2e-7, "phase"),),
    "runout": (
        R("first", 2e-7, "first_phase"),
        R("second", 2e-7, "second_phase"),
        R("third", 2e-7, "third_phase"),
        R("roughness", 1e-7, signed=False),
    ),
    "coupling": (
        R("second", 1.0, "second_phase", options=(("ellipticity", (1.0, 0.0, -1.0)),)),
        R("third", 1.0, "third_phase", options=(("ellipticity", (1.0, 0.0, -1.0)),)),
    ),
    "crack": (
        R(
            "loss",
            1e4,
            options=(("phase", tuple(k * pi / 4 for k in range(8))),),
            refine=(("phase", 0.1),),
            signed=False,
        ),
    ),
    "ball_bearing": (R("clearance", 5e-7, signed=False),),
    "pedestal": (
        R(
            "mass_ratio",
            2e-3,
            options=(("frequency", tuple(TURN * f for f in (60, 90, 120, 160, 220))),),
            refine=(("frequency", TURN),),
            signed=False,
        ),
    ),
    "internal_damping": (R("time", 1e-5, signed=False),),
    "base_vibration": (
        R("x", 0.05, "phase", options=(("frequency", (TURN * 50, TURN * 60, TURN * 100)),)),
        R("y", 0.05, "phase", options=(("frequency", (TURN * 50, TURN * 60, TURN * 100)),)),
    ),
    "rub": (R("stiffness", 2e4, options=(("gap", (0.0, 5e-6, 1e-5)),), signed=False),),
    "out_of_round": (
        R("sleeve", 3e-7, "sleeve_phase", options=(("sleeve_lobes", (2.0,)),)),
        R("journal", 3e-7, "journal_phase", options=(("journal_lobes", (2.0,)),)),
    ),
    "clearance_growth": (R("growth", 3e-7),),
    "slip": (R("mean_free_path", 6.8e-8, signed=False),),
    "viscosity": (R("rise", 20.0), R("heating", 20.0, signed=False)),
    "weak_injector": (R("blocked", 0.04, signed=False), R("stuck", 0.2, signed=False)),
    "unequal_pressure": (R("deviation", 0.04),),
    "plenum_volume": (R("change", 0.3),),
    "discharge_drift": (R("exponent", 0.04),),
    "supply_droop": (R("droop", 2e8, signed=False),),
    "hysteresis": (R("weight", 5e-8),),
    "creep": (R("gain", 6e-3),),
    "dead_zone": (R("half_width", 1e-7, signed=False),),
    "sensor_gain": (R("x", 0.03), R("y", 0.03), R("cross_x", 0.02), R("cross_y", 0.02)),
    "sensor_lag": (R("time", 5e-5, signed=False),),
    "sensor_delay": (R("delay", 5e-5, signed=False),),
    "torque_ripple": (R("amplitude", 0.05, "phase", options=(("order", (1.0, 2.0)),)),),
    "unbalance": (R("me", 1e-6, "phase"),),
}
"""Steps that change a response by a few tenths of a micrometre, for the effects of the catalogue."""
NOT_CANDIDATES = ("gravity", "contact")
"""Gravity is a load that is known; contact in the film is a state of the machine, and is seen in its channel."""


def candidates(twin: Twin, effects: Iterable[str] | None = None) -> tuple[Form, ...]:
    """Forms of every effect (or of those named, as 'runout' or 'runout.second') that can be hidden, sorted by label.

    Raises DataError for one that this machine cannot have.
    """
    forms: list[Form] = []
    for name in sorted(set(twin.slots) - set(NOT_CANDIDATES)):
        forms += [f for recipe in RECIPES.get(name) or own_recipes(REGISTRY[name]) for f in _forms(twin, name, recipe)]
    if effects is not None:
        asked = _known(effects, forms, twin.machine.name)
        forms = [f for f in forms if f.names & asked]
    return tuple(sorted(forms, key=lambda f: f.label))


def _known(effects: Iterable[str], forms: Iterable[Form], machine: str) -> set[str]:
    """The names given, all of them those of forms."""
    asked, known = set(effects), set().union(*(f.names for f in forms))
    for unknown in sorted(asked - known):
        own = sorted(n for n in known if n.startswith(unknown.partition(".")[0] + "."))
        among = ", ".join(own or sorted(n for n in known if "." not in n))
        raise DataError(f"effects: '{unknown}' cannot be a candidate in {machine}; choose among {among}")
    return asked


def own_recipes(effect: type[Effect]) -> tuple[Recipe, ...]:
    """Recipes of an effect that is not in the catalogue, from its parameters alone."""
    numbers = [f for f in fields(effect) if f.name != "position" and f.default == 0.0]
    phases = {f.name for f in numbers if f.metadata.get("unit") == "rad" and f.name.endswith("phase")}
    found = []
    for f in numbers:
        if f.name in phases:
            continue
        low, high = f.metadata["bounds"]
        phase = next((p for p in (f"{f.name}_phase", "phase") if p in phases), "")
        size = min(abs(high), abs(low) or abs(high))
        found.append(Recipe(f.name, 1e-3 * size if size < 1e299 else 1e-3, phase, signed=low < 0))
    return tuple(found)


def _forms(twin: Twin, name: str, recipe: Recipe) -> list[Form]:
    """A recipe for every option, injector and table."""
    table = twin.slots[name] + (1 if name in ("plenum_volume", "unbalance") else 0)
    if name == "unbalance" and twin.machine.film is None:
        return []
    injectors: list[float] = [0.0]
    names = {f.name for f in fields(REGISTRY[name])}
    if "injector" in names:
        injectors = [float(k + 1) for k in range(len(twin.machine.injectors))]
    options: list[dict[str, float]] = [{}]
    for parameter, values in recipe.options:
        options = [{**o, parameter: v} for o in options for v in values]
    forms = []
    for k in injectors:
        for option in options:
            fixed = {f"{name}.{table}.{p}": v for p, v in option.items()}
            if k:
                fixed[f"{name}.{table}.injector"] = k
            label = f"{name}.{recipe.parameter}" + (f" of injector {k:.0f}" if k else "")
            shape = ", ".join(f"{p} {v:.4g}" for p, v in option.items() if len(_values(recipe, p)) > 1)
            knobs, refine = _knobs(twin, name, table, recipe), _refine(name, table, recipe)
            forms.append(Form(name, f"{label} @ {shape}" if shape else label, knobs, fixed, refine))
    return forms


def _values(recipe: Recipe, parameter: str) -> tuple[float, ...]:
    return next((v for p, v in recipe.options if p == parameter), ())


def _knobs(twin: Twin, name: str, table: int, recipe: Recipe) -> tuple[Knob, ...]:
    if recipe.phase:
        stem = f"{name}.{table}.{recipe.parameter}~{recipe.phase}"
        return tuple(Knob(f"{stem}.{part}", recipe.step) for part in "cs")
    base = float(getattr(twin.effect(name, table), recipe.parameter))
    bounds = next(f.metadata["bounds"] for f in fields(REGISTRY[name]) if f.name == recipe.parameter)
    low, high = bounds[0] - base, bounds[1] - base
    if not recipe.signed:
        low = max(low, 0.0 if base == 0 else low)
    return (Knob(f"{name}.{table}.{recipe.parameter}", recipe.step, low=low, high=high),)


def _refine(name: str, table: int, recipe: Recipe) -> tuple[Knob, ...]:
    bounds = {f.name: f.metadata["bounds"] for f in fields(REGISTRY[name])}
    wide = {p: (max(bounds[p][1] - bounds[p][0], 1e-300)) for p, _ in recipe.refine}
    return tuple(Knob(f"{name}.{table}.{p}", step, low=-wide[p], high=wide[p]) for p, step in recipe.refine)
