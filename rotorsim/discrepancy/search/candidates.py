"""Candidate effects of a diagnosis, in all forms in which they may be missing.

A form turns one or a few parameters of an effect and holds others at one of several options (which injector, which
frequency). Each effect declares its forms itself (`rotorsim.effects.diagnosis`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.base.quantity import quantities
from rotorsim.base.sentences import closest
from rotorsim.discrepancy.fit.parameters import FitParameter
from rotorsim.discrepancy.twin.twin import Twin
from rotorsim.effects import REGISTRY
from rotorsim.effects.diagnosis import CandidateForm

NO_SOLUTION = 1e-3
"""Lines [m] that stand for a plant without solution."""


@dataclass(frozen=True)
class Form:
    """Form in which an effect may be missing: fit parameters, fixed values, label."""

    effect: str
    label: str
    parameters: tuple[FitParameter, ...]
    fixed: Mapping[str, float] = field(default_factory=dict, hash=False)
    refine: tuple[FitParameter, ...] = ()
    """Shape parameters that a non-linear fit may turn as well."""
    axes_only: bool = False
    """Whether it is known for sensors along x and y alone."""

    @property
    def key(self) -> str:
        """Key of the form: effect and its parameter (and injector), without shape options."""
        return self.label.split(" @ ")[0]

    @property
    def names(self) -> set[str]:
        """Names that select it: the effect, the effect's parameter, and that of one injector."""
        return {self.effect, self.key.split(" of ")[0], self.key}

    def has_response(self, columns: np.ndarray) -> bool:
        """Whether the sensitivities (n, k) [m] are finite, so the plant has a solution, and not all zero."""
        moved = np.abs(columns * [k.step for k in self.parameters])
        return bool(np.all(np.isfinite(moved)) and 0 < moved.max() < NO_SOLUTION / 2)


def candidates(twin: Twin, effects: Iterable[str] | None = None) -> tuple[Form, ...]:
    """Forms of all effects, or of those named ('runout', 'runout.amplitude_2x'), sorted by label.

    Raises DataError for one that this machine cannot have.
    """
    forms: list[Form] = []
    for name in sorted(n for n in twin.slots if REGISTRY[n].role not in ("known", "set")):
        forms += [f for form in REGISTRY[name].candidate_forms(twin.machine) for f in _forms(twin, name, form)]
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
        close = closest(unknown, known)
        hint = f"did you mean '{close}'? Or choose among" if close else "choose among"
        raise DataError(f"--effect: '{unknown}' cannot be a candidate in {machine}; {hint} {among}")
    return asked


def _forms(twin: Twin, name: str, recipe: CandidateForm) -> list[Form]:
    """A form of an effect for every film, option and injector; the first place belongs to the calibration if any."""
    effect, machine = REGISTRY[name], twin.machine
    place = effect.places > 1 and bool(effect.calibration_of(machine))
    options: list[dict[str, float]] = [{}]
    for parameter, values in recipe.options:
        options = [{**o, parameter: v} for o in options for v in values]
    forms = []
    for table in range(twin.slots[name] + place, len(twin.equipped[0].effects[name]), effect.places):
        of, pinned = _about(twin, name, table)
        if recipe.pinned and not pinned:
            continue
        for k in _injectors(twin, name, table):
            for option in options:
                fixed = {f"{name}.{table}.{p}": v for p, v in option.items()}
                if k:
                    fixed[f"{name}.{table}.injector"] = k
                label = f"{name}.{recipe.parameter}" + (f" of injector {k:.0f}" if k else "") + of
                shape = ", ".join(f"{p} {v:.4g}" for p, v in option.items() if len(_values(recipe, p)) > 1)
                parameters, refine = _fit_parameters(twin, name, table, recipe), _refine(name, table, recipe, option)
                forms.append(
                    Form(name, f"{label} @ {shape}" if shape else label, parameters, fixed, refine, recipe.axes_only)
                )
    return forms


def _about(twin: Twin, name: str, table: int) -> tuple[str, bool]:
    """What names the film of a table, where there are several, and whether injectors with pins feed it."""
    bearing = getattr(twin.effect(name, table), "bearing", None)
    if bearing is None or len(twin.machine.films) < 2:
        return "", twin.machine.pinned_film is not None
    return f" of {twin.machine.bearing_names[int(bearing)]}", twin.machine.film_at(bearing) == twin.machine.pinned_film


def _injectors(twin: Twin, name: str, table: int) -> list[float]:
    """Numbers of the injectors that a table can be about, from 1; 0 for an effect that is about none."""
    if "injector" not in {f.name for f in fields(REGISTRY[name])}:
        return [0.0]
    return [float(k + 1) for k in range(twin.machine.injector_count(twin.effect(name, table)))]


def _values(recipe: CandidateForm, parameter: str) -> tuple[float, ...]:
    return next((v for p, v in recipe.options if p == parameter), ())


def _fit_parameters(twin: Twin, name: str, table: int, recipe: CandidateForm) -> tuple[FitParameter, ...]:
    usual = _prior(name, recipe)
    if recipe.phase:
        stem = f"{name}.{table}.{recipe.parameter}~{recipe.phase}"
        return tuple(FitParameter(f"{stem}.{part}", recipe.step, usual=usual) for part in "cs")
    base = float(getattr(twin.effect(name, table), recipe.parameter))
    bounds = quantities(REGISTRY[name])[recipe.parameter].bounds
    low, high = bounds[0] - base, bounds[1] - base
    if not recipe.signed:
        low = max(low, 0.0 if base == 0 else low)
    return (FitParameter(f"{name}.{table}.{recipe.parameter}", recipe.step, low=low, high=high, usual=usual),)


def _prior(name: str, recipe: CandidateForm) -> float:
    """Stated prior standard deviation of a size, 0 for none; raises DataError where only 0 would be possible."""
    if recipe.step > 0 and (recipe.prior is None or 0 < recipe.prior < np.inf):
        return float(recipe.prior or 0.0)
    what = "step" if not recipe.step > 0 else "prior"
    raise DataError(
        f"{name}.{recipe.parameter}: its {what} is {getattr(recipe, what):g}, so that nothing but 0 is possible; give "
        f"CandidateForm a {what} above 0"
    )


def _refine(name: str, table: int, recipe: CandidateForm, option: Mapping[str, float]) -> tuple[FitParameter, ...]:
    """Shape parameters within their bounds, as changes of what the option holds; angles may go round."""
    known, found = quantities(REGISTRY[name]), []
    for p, step in recipe.refine:
        low, high = known[p].bounds
        around = known[p].unit == "rad"
        base = 0.0 if around else option.get(p, float(getattr(REGISTRY[name](), p)))
        more = high - low if around else 0.0
        found.append(FitParameter(f"{name}.{table}.{p}", step, low=low - base - more, high=high - base + more))
    return tuple(found)
