"""Candidates of a diagnosis: forms in which an effect may be missing, their classes, screening, and which are alike.

A form turns one or a few parameters of an effect and holds others at one of several options (which injector, which
frequency). Each effect declares its forms and their signatures itself (`rotorsim.effects.base`).

No campaign of a rig distinguishes forms of equal signature, and a diagnosis names their class. The classes were derived
from the equations: a bow of the shaft and a runout at 1X both add a constant vector that turns with the shaft; delay
and lag of a sensor differ at the second order in frequency times time; the flow through a choked seat is its area times
the pressure; of two sensors' gains only the ratio shows next to gains of the actuators. Others are beyond any record's
resolution.

The alias matrix shows which effects a campaign cannot distinguish, and what survives re-calibration: signatures of a
machine at its nominal point under a campaign's inputs (its own, or the standard one), with the calibration projected
out. Two effects whose signatures make a cosine above 0.95 are aliases.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import combinations, pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from identification import make_record
from rotorsim.base.display import closest
from rotorsim.base.errors import DataError, NoAnswerError
from rotorsim.base.quantity import quantities
from rotorsim.base.rounding import answer
from rotorsim.base.units import show
from rotorsim.discrepancy.calibration import GRID, STEP, FitParameter, ParameterPoint, Progress, calibration
from rotorsim.discrepancy.comparison import SensitivityColumns, TwinComparison
from rotorsim.discrepancy.fit import ParameterFit, prior_rows, singular_directions
from rotorsim.discrepancy.records import make_trial, make_trials, open_records
from rotorsim.discrepancy.trial import Trial
from rotorsim.discrepancy.twin import NO_SOLUTION, Twin
from rotorsim.effects import REGISTRY, Effect
from rotorsim.effects.base import CandidateForm
from rotorsim.machine import Machine, load_machine
from rotorsim.machine.bearings import LinearBearing, TableBearing

ONE_PLACE = 1e-6
"""Distance [m] within which two forces act at one place."""
ALIAS = 0.95
"""Cosine of two signatures above which their effects are aliases."""
NOISE = 5e-9
"""Floor [m] of a line where no record gives one."""


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
    shaped: bool = False
    """Whether its shape is turned even where a first fit leaves little of the misfit."""

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
    """Names that were asked for; raises DataError for one that no form has."""
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
    several = {parameter for parameter, values in recipe.options if len(values) > 1}
    options: list[dict[str, float]] = [{}]
    for parameter, values in recipe.options:
        options = [{**o, parameter: v} for o in options for v in values]
    forms = []
    for table in range(twin.slots[name] + place, len(twin.equipped[0].effects[name]), effect.places):
        of, pinned = _about(twin, name, table)
        if recipe.pinned and not pinned:
            continue
        for k, (position, where) in product(_injectors(twin, name, table), force_places(machine, effect, recipe)):
            for option in options:
                fixed = {f"{name}.{table}.{p}": v for p, v in option.items()}
                if k:
                    fixed[f"{name}.{table}.injector"] = k
                if position is not None:
                    fixed[f"{name}.{table}.position"] = position
                label = f"{name}.{recipe.parameter}" + (f" of injector {k:.0f}" if k else "") + of + where
                shape = ", ".join(f"{p} {v:.4g}" for p, v in option.items() if p in several)
                parameters, refine = _fit_parameters(twin, name, table, recipe), _refine(name, table, recipe, option)
                forms.append(
                    Form(name, f"{label} @ {shape}" if shape else label, parameters, fixed, refine, recipe.axes_only)
                )
    return forms


def force_places(machine: Machine, effect: type[Effect], recipe: CandidateForm) -> list[tuple[float | None, str]]:
    """Positions [m] at which a force of an effect may act, and how a key names them; (None, '') for the only one.

    Each disc, or each end of the shaft for what acts there, and where the machine file has such an effect; and each
    support, unless it is a property of the shaft itself.
    """
    if (
        effect.port not in ("force", "motion")
        or effect.influence != "node"
        or "position" not in {f.name for f in fields(effect)}
        or effect.calibration_of(machine)
    ):
        return [(None, "")]
    shaft, discs = machine.shaft, [d.position for d in machine.discs]
    own = [shaft.start, shaft.end] if effect.place == "start" else discs
    own = [*own, *(e.position for e in machine.effects.get(effect.name, ()) if e.position is not None)]  # type: ignore
    if effect.place == "start" and len(discs) < 2 and len(own) == 2:
        own = own[:1]
    places = list(dict.fromkeys(round(z, 9) for z in own))
    supports = [round(b.position, 9) for b in machine.bearings if isinstance(b, (LinearBearing, TableBearing))]
    if effect.port != "motion" or recipe.with_weight:
        supports = []
    named: list[tuple[float | None, str]] = [(z, f" of {_place_name(machine, z)}") for z in places]
    if len(places) < 2:
        usual = [shaft.start] if effect.place == "start" else discs[:1]
        moved = [z for z in places if not usual or abs(z - usual[0]) > ONE_PLACE]
        named = [(moved[0] if moved else None, "")]
    others = [z for z in dict.fromkeys(supports) if z not in places]
    return named + [(z, f" of {_place_name(machine, z)}") for z in others]


def _place_name(machine: Machine, z: float) -> str:
    """A place on the shaft as text."""
    for name, disc in zip(machine.disc_names, machine.discs, strict=True):
        if abs(disc.position - z) < ONE_PLACE:
            return name
    for name, bearing in zip(machine.bearings_in_words, machine.bearings, strict=True):
        if abs(bearing.position - z) < ONE_PLACE:
            return name
    ends = {"the left end": machine.shaft.start, "the right end": machine.shaft.end}
    return next((name for name, end in ends.items() if abs(end - z) < ONE_PLACE), f"the shaft at {1e3 * z:.6g} mm")


def _about(twin: Twin, name: str, table: int) -> tuple[str, bool]:
    """Suffix that names the film of a table where there are several, and whether injectors with pins feed it."""
    bearing = getattr(twin.effect(name, table), "bearing", None)
    if bearing is None or len(twin.machine.films) < 2:
        return "", twin.machine.pinned_film is not None
    return f" of {twin.machine.bearing_names[int(bearing)]}", twin.machine.film_at(bearing) == twin.machine.pinned_film


def _injectors(twin: Twin, name: str, table: int) -> list[float]:
    """Numbers of the injectors that a table can be about, from 1; 0 for all of their pins, or an effect about none."""
    if "injector" not in {f.name for f in fields(REGISTRY[name])}:
        return [0.0]
    if REGISTRY[name].port in ("reference", "amplifier"):
        return [float(k) for k in range(len(twin.machine.injectors) + 1)]
    return [float(k + 1) for k in range(twin.machine.injector_count(twin.effect(name, table)))]


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


def class_of(key: str, known: Iterable[str]) -> tuple[str, ...]:
    """Keys ('effect.parameter') among `known` that cannot be distinguished from `key`, itself included."""
    signature, place = _signature(key)
    if not signature:
        return (key,)
    return tuple(sorted(k for k in {*known} if _signature(k) == (signature, place)))


def alike_by_weight(key: str, found: Mapping[str, float], known: Iterable[str]) -> tuple[str, ...]:
    """Keys among `known` that respond nearly as `key` does in a rotor with a weight, itself included.

    `found` holds the values of its effect's parameters. A shaft of unequal stiffness (asymmetric, cracked) that the
    weight bends by s makes a force of s times half the difference that turns forward at 2X, as a coupling may; the
    probes of one plane distinguish them by little more than their places along the shaft.
    """
    form = _form(key)
    if form is None or not form.with_weight or found.get(form.from_value[0], 0.0) < form.from_value[1]:
        return (key,)
    same = {k for k in known if (other := _form(k)) is not None and other.with_weight == form.with_weight}
    return tuple(sorted(same | {key}))


def counterpart(key: str) -> tuple[str, str, float, float] | None:
    """Form whose force a form makes where a parameter is in an interval: key, parameter and ends; None for none.

    A force of an injector has a counterpart of this injector alone.
    """
    form, place = _form(key), key.partition(" of ")[2]
    if form is None or form.same_as is None:
        return None
    other, parameter, low, high = form.same_as
    if "injector" not in {f.name for f in fields(REGISTRY[other.partition(".")[0]])}:
        return form.same_as
    return (f"{other} of {place}", parameter, low, high) if place.startswith("injector ") else None


def same_class(a: str, b: str) -> bool:
    """Whether two keys are of one class: together they can be any size of each, one against the other."""
    signature, _ = _signature(a)
    return bool(signature) and _signature(a) == _signature(b)


def of_one_force(a: str, b: str) -> bool:
    """Whether two keys are forms of one kind of force, of which a diagnosis names one alone."""
    first, second = _form(a), _form(b)
    return first is not None and second is not None and first.alone_of == second.alone_of != ""


def resembles(key: str) -> str:
    """Cause outside the catalogue with the same signature; empty if there is none."""
    form = _form(key)
    return form.resembles if form is not None else ""


def signature_of(key: str) -> str:
    """Common property of the forms of its class, in words; empty where it is distinguishable."""
    return _signature(key)[0]


def _signature(key: str) -> tuple[str, str]:
    """Signature of a form, and the injector that it is of."""
    form = _form(key)
    return (form.signature, key.partition(" of ")[2]) if form is not None else ("", "")


def _form(key: str) -> CandidateForm | None:
    name, _, parameter = key.partition(" of ")[0].partition(".")
    forms = REGISTRY[name].forms if name in REGISTRY else ()
    return next((f for f in forms if f.parameter == parameter), None)


def apart(forms: Sequence[Form]) -> bool:
    """Whether all forms are of different effects, classes and kinds of force."""
    return not any(
        a.effect == b.effect or same_class(a.key, b.key) or of_one_force(a.key, b.key)
        for a, b in combinations(forms, 2)
    )


def distinct(sets: Iterable[tuple[Form, ...]], most: int) -> list[tuple[Form, ...]]:
    """The first sets with different keys."""
    out: dict[tuple[str, ...], tuple[Form, ...]] = {}
    for forms in sets:
        out.setdefault(tuple(sorted(f.key for f in forms)), forms)
        if len(out) >= most:
            break
    return list(out.values())


def prior_sizes(forms: Iterable[Form]) -> dict[str, str]:
    """Standard deviation of every candidate's size before any record, by key of its form without its place."""
    found = {}
    for form in forms:
        first = form.parameters[0]
        found[form.key.partition(" of ")[0]] = show(float(f"{first.prior_size:.3g}"), unit_of(form))
    return found


def unit_of(form: Form) -> str:
    """SI unit of a form's size."""
    return quantities(REGISTRY[form.effect])[form.parameters[0].key.split(".")[2].partition("~")[0]].unit


def acting_at(forms: Iterable[Form]) -> dict[str, float]:
    """Coordinates z [m] by key, of the forces that act there or of the probes that are read there; not of other forms.

    Probes of the machine file's own plane are no others.
    """
    found = {}
    for form in forms:
        own = form.parameters[0]
        z = form.fixed.get(f"{form.effect}.{own.key.split('.')[1]}.position", own.plane)
        if z is not None and np.isfinite(z):
            found[form.key] = z
    return found


@dataclass(frozen=True, eq=False)
class Screening:
    """Forms with projected sensitivities, projected residual r (n + k,), and their scalar products."""

    forms: tuple[Form, ...]
    where: tuple[slice, ...]
    gram: np.ndarray
    products: np.ndarray
    one_sided: np.ndarray
    raw: np.ndarray

    def drop(self, *numbers: int) -> tuple[float, np.ndarray]:
        """Fall of the sum of squares by a set of forms together, and the values of their parameters there."""
        columns = np.concatenate([np.arange(*self.where[i].indices(len(self.products))) for i in numbers])
        G, b = self.gram[np.ix_(columns, columns)], self.products[columns]
        # a column that the calibration imitates to a thousandth, or two that cancel, do not explain anything
        weak = np.diag(G) < 1e-5 * self.raw[columns]
        G = G + np.diag(np.where(weak, 1e300, 1e-9 * np.diag(G)))
        scale = np.sqrt(np.maximum(np.diag(G), 1e-300))
        try:
            if len(columns) > 1 and answer(np.linalg.cond, G / scale[:, None] / scale) > 1e4:
                return 0.0, np.zeros(len(columns))
            values = answer(np.linalg.solve, G, b)
        except NoAnswerError:
            return 0.0, np.zeros(len(columns))
        if np.any(self.one_sided[columns] & (values < 0)):
            return 0.0, np.zeros(len(columns))
        return float(b @ values), values

    def likeness(self, i: int, j: int) -> float:
        """Largest cosine between what two forms can add to the data after re-calibration."""
        a, b = self.where[i], self.where[j]
        A, B = self.gram[a, a], self.gram[b, b]
        floor_a, floor_b = 1e-12 * np.trace(A) + 1e-300, 1e-12 * np.trace(B) + 1e-300
        La = answer(np.linalg.cholesky, A + floor_a * np.eye(len(A)))
        Lb = answer(np.linalg.cholesky, B + floor_b * np.eye(len(B)))
        middle = answer(np.linalg.solve, La, answer(np.linalg.solve, Lb, self.gram[a, b].T).T)
        return float(min(answer(np.linalg.svd, middle, compute_uv=False).max(), 1.0))

    def survives(self, i: int) -> float:
        """Share of a form's signature that re-calibration cannot imitate."""
        own = self.where[i]
        return float(np.sqrt(np.trace(self.gram[own, own]) / max(self.raw[own].sum(), 1e-300)))

    def size(self, i: int) -> float:
        """Norm of a form's projected signature for one step of its parameters."""
        return float(np.sqrt(np.trace(self.gram[self.where[i], self.where[i]])))

    def seen_from(self, fall: float) -> dict[str, float]:
        """Sizes [SI] from which forms make the sum of squares fall by `fall`, by key without place.

        In the phase that shows least, at the place that shows least, with the option that shows most; infinite where
        re-calibration imitates the form to a thousandth.
        """
        best: dict[str, float] = {}
        for i, form in enumerate(self.forms):
            G, raw = self.gram[self.where[i], self.where[i]], self.raw[self.where[i]]
            least = float(answer(np.linalg.eigvalsh, G)[0])
            shown = least > 1e-6 * float(raw.max())
            size = form.parameters[0].step * np.sqrt(fall / least) if shown else np.inf
            best[form.key] = min(best.get(form.key, np.inf), float(size))
        found: dict[str, float] = {}
        for key, size in best.items():
            short = key.partition(" of ")[0]
            found[short] = max(found.get(short, 0.0), size)
        return found


def screen(base: ParameterFit, forms: Sequence[Form], columns: Sequence[np.ndarray]) -> Screening:
    """Project sensitivities [(n, m) each, per unit parameter] off a fit's Jacobian; columns scaled to steps."""
    p = prior_rows(base.parameters)
    A = np.vstack([base.J, np.diag(p)])
    size = np.linalg.norm(A, axis=0)
    U, s, _ = answer(np.linalg.svd, A / np.where(size > 0, size, 1.0), full_matrices=False)
    Q = U[:, s > 1e-9 * s[0]]
    steps = [np.array([k.step for k in f.parameters]) for f in forms]
    S = np.concatenate([c * d for c, d in zip(columns, steps, strict=True)], axis=1)
    raw = np.sum(S**2, axis=0)
    r = np.concatenate([base.residual, -p * base.vector])
    S = np.vstack([S, np.zeros((len(p), S.shape[1]))])
    S = S - Q @ (Q.T @ S)
    r = r - Q @ (Q.T @ r)
    ends = np.cumsum([0] + [c.shape[1] for c in columns])
    where = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
    one_sided = np.array([k.low == 0.0 for f in forms for k in f.parameters])
    return Screening(tuple(forms), where, S.T @ S, S.T @ r, one_sided, raw)


@dataclass(frozen=True, eq=False)
class AliasMatrix:
    """Effect names, cosines of signatures (k, k), surviving fractions, steps that make a chi-square of 50."""

    names: tuple[str, ...]
    likeness: np.ndarray
    survives: np.ndarray
    detectable: np.ndarray
    null: list[dict[str, float]]

    def aliases(self) -> list[tuple[str, ...]]:
        """Classes of effects that are alike, exact ones joined to those measured."""
        left, out = set(self.names), []
        for i, name in enumerate(self.names):
            if name not in left:
                continue
            near = {self.names[j] for j in np.flatnonzero(self.likeness[i] > ALIAS)} | set(class_of(name, self.names))
            near &= left | {name}
            left -= near
            if len(near) > 1:
                out.append(tuple(sorted(near)))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Plain lists of names, cosines, shares and classes, for JSON."""
        return {
            "names": list(self.names), "likeness": self.likeness.round(4).tolist(),
            "survives": self.survives.round(5).tolist(), "detectable_steps": self.detectable.tolist(),
            "aliases": [list(a) for a in self.aliases()], "null_vectors": self.null,
        }  # fmt: skip


def standard_trials(machine: Machine) -> list[Trial]:
    """Inputs of the standard campaign's records for the fit, without measured data."""
    from rotorsim.discrepancy.experiments import (
        campaign,  # the catalogue of experiments, which a diagnosis does not need
    )

    trials = []
    for planned in campaign(machine):
        if planned.role != "fit" or planned.name.endswith("repeat"):
            continue
        rows = planned.experiment.rows(0, planned.experiment.samples)
        values = {"disc_measured": np.zeros((len(rows), 2)), "speed": rows[:, 0], "pressure": rows[:, 1],
                  "disc_force": rows[:, 4:6]}  # fmt: skip
        if machine.film is not None:
            values["reference"] = rows[:, 2:4]
        record = make_record(np.arange(len(rows)) * 2e-4, values, {"role": "fit", "record": planned.name})
        trials.append(make_trial(record, "fit", planned.name))
    return trials


def alias_matrix(
    machine: Machine | str | Path,
    records: Iterable[Any] | None = None,
    mapping: Any = None,
    progress: Progress = lambda stage, most=0: None,
) -> AliasMatrix:
    """Alias matrix of a machine for the inputs of records or of the standard campaign.

    Examples
    --------
    >>> import rotorsim as rs
    >>> matrix = rs.discrepancy.alias_matrix("dtu_gas_bearing")  # doctest: +SKIP
    """
    machine = machine if isinstance(machine, Machine) else load_machine(machine)
    trials = standard_trials(machine)
    if records is not None:
        trials = [t for t in make_trials(machine, open_records(records, mapping), None) if t.role == "fit"]
    comparison = TwinComparison(Twin(machine, GRID, STEP), trials)
    comparison.sigma = np.full_like(comparison.measured, NOISE)
    parameters = calibration(comparison.twin, len(trials))
    start = ParameterPoint()
    J = SensitivityColumns(comparison).columns(start, parameters, lambda: progress("calibrate")) / NOISE
    base = ParameterFit(parameters, start, np.zeros(len(J)), J, 0.0)
    forms, S, store = [], [], SensitivityColumns(comparison)
    for form in candidates(comparison.twin):
        progress("screen")
        own = store.columns(start.holding(form.fixed), form.parameters)
        if form.has_response(own):
            forms.append(form)
            S.append(own / NOISE)
    view = screen(base, forms, S)
    best: dict[str, int] = {}
    for i, form in enumerate(forms):
        if form.key not in best or view.size(i) > view.size(best[form.key]):
            best[form.key] = i
    chosen = sorted(best.items())
    seen = [(k, i) for k, i in chosen if view.size(i) > 0]
    likeness = np.array([[view.likeness(i, j) for _, j in seen] for _, i in seen])
    size = np.array([view.size(i) for _, i in seen])
    free = [i for i, k in enumerate(parameters) if not k.trend]
    null = singular_directions(J[:, free], [parameters[i] for i in free])
    survives = np.array([view.survives(i) for _, i in seen])
    return AliasMatrix(tuple(k for k, _ in seen), likeness, survives, np.sqrt(50) / size, null)


def markdown(matrix: AliasMatrix) -> str:
    """Alias matrix as a Markdown table: every effect with its nearest alias, and the classes.

    Examples
    --------
    >>> import rotorsim as rs
    >>> text = rs.discrepancy.markdown(rs.discrepancy.alias_matrix("dtu_gas_bearing"))  # doctest: +SKIP
    """
    rows = ["| effect | survives re-calibration | like it (cosine) | also |", "|---|---|---|---|"]
    for i, name in enumerate(matrix.names):
        others = np.argsort(-matrix.likeness[i])
        near = [f"{matrix.names[j]} ({matrix.likeness[i, j]:.2f})" for j in others if j != i][:3]
        rows.append(f"| {name} | {100 * matrix.survives[i]:.3g} % | {', '.join(near)} | {resembles(name)} |")
    classes = [f"- {', '.join(a)}" for a in matrix.aliases()]
    lines = ["", "Indistinguishable in this campaign:", *(classes or ["- none"])]
    for null in matrix.null:
        lines += ["", "Null vector of the calibration: " + ", ".join(f"{v:+.2f} {k}" for k, v in null.items())]
    return "\n".join([*rows, *lines])
