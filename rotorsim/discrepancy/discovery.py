r"""Laws discovered from data: a force at a place that no effect of the catalogue has, proposed from the residual.

Terms g_k of the motion at a place (`law_terms`), each with a coefficient along x and one along y, are chosen one by
one, together with the calibration's own columns J, about a calibration that has converged,

.. math:: r \approx J\,\delta\theta - \sum_k c_k\,H_{sp}\,\mathcal F\{g_k(q_p, \dot q_p, \Omega, \varphi)\}

until a twentieth of what was beyond the floor stays. Records that are held out choose the place. A further term, at
any place, has to be clearly better. The law becomes effects, in a file of its own, which are compiled into the plant,
fitted as a candidate, and judged as any other.

Cites: brunton_2016.
"""

from __future__ import annotations

import hashlib
import math
import re
import sys
from bisect import bisect
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from importlib.util import module_from_spec, spec_from_file_location
from itertools import product
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.linalg import orth
from scipy.optimize import fmin
from scipy.special import expit

from rotorsim.base.cache import in_cache
from rotorsim.base.files import write_text
from rotorsim.base.rounding import ALIKE, answer
from rotorsim.discrepancy.calibration import FitParameter
from rotorsim.discrepancy.candidates import Form, Screening, screen
from rotorsim.discrepancy.comparison import excess, table
from rotorsim.discrepancy.fit import ParameterFit, prior_rows
from rotorsim.discrepancy.hypotheses import CLEAR, ENOUGH, TIE, Hypothesis
from rotorsim.discrepancy.law_terms import (
    CLEARANCE,
    LIBRARY,
    ORDER_FORCES,
    RELAXATION,
    SLIPPING_SPRING,
    LibraryTerm,
    ObservedPlaces,
    PlaceMotion,
    force_curve,
    law_places,
    off_shaft,
)
from rotorsim.discrepancy.machine_file import IdentifiedEffect, with_unit
from rotorsim.discrepancy.records import MORE_SPEEDS
from rotorsim.discrepancy.stability import PlacedTerm, Stability, forms_of, stability
from rotorsim.discrepancy.trial import ONE_SPEED as WAVER, Trial, one_speed
from rotorsim.discrepancy.twin import Twin
from rotorsim.discrepancy.verdict import SURE, TEMPERATURE, Explanation, probability_of, with_other
from rotorsim.effects import REGISTRY
from rotorsim.effects.base import BETWEEN, HOUSING
from rotorsim.machine import Machine

MOST_TERMS = 3
"""Most terms of a law."""
SHARE = 0.1
"""Step of a coefficient in finite differences, as a share of it."""
FURTHER = "a further term ({})"
"""Name of a law that has further terms at its place."""
NEAR = 100.0
"""Difference of scores within which laws at other places are fitted to the plant too."""
MOST_LAWS = 3
"""Largest number of laws that are fitted to the plant, next to one of fewer terms."""
TWO_AMPLITUDES = 1.5
"""Ratio of the largest and the smallest excitation from which on there are two amplitudes."""
NOT_PERIODIC = (
    "a law is not looked for: the records do not repeat with a period; record a periodic excitation, with whole turns "
    "of the shaft in its period"
)
ONE_SPEED = f"a law is not looked for: all records have one speed; record {MORE_SPEEDS} more speeds"
ONE_AMPLITUDE = (
    "a law is not looked for: all records have one amplitude, at which a force that grows out of proportion is as one "
    "that does not; record the same points with half the excitation, or with a trial weight"
)
"""Notes on records of which no law can be identified."""
OF_FILM = (
    "a further force makes all records together agree clearly better; linear forces that change with speed, "
    "pressure and frequency, with forces at 1X and 2X, do nearly as well, as does an error of the gas film's model: "
    "it is not taken for a law and changes no verdict; record with more excitation, so that the force bends"
)
"""Note on a force that is not known from an error of the film's model."""
NOT_IDENTIFIABLE = (
    "a stiffness, damping, mass or delayed force at a place makes all records together agree clearly better: which of "
    "these it is, and where, these records do not tell, nor from an error of the model's form; record with probes near "
    "the places where such a force may act, at more speeds, or with more excitation"
)
"""Note on a constant linear force that no group of lines shows, or that is late."""
EQUAL = 6.0
"""Credit of equal coefficients along x and y: by chance they agree as closely in one of twenty places."""
SIMPLEX = 0.05
"""First relative change of a number of a shape."""
OF_FORM = 2 * CLEAR
"""Fall of the sum of squares by a late force, or next to a film by any, below that by all linear forces which an error
of the model's form may be, that makes it one. A hidden mass on linear bearings needs `CLEAR`: in records of seven late
forces none was better than stiffness, damping and mass."""
BY_PLANT = 2 * OF_FORM
"""Sum of squares by which a law may be better in the plant than by the linear model, whose film does not bend."""
RIGID = 1e9
"""Resonance [rad/s] of a hidden mass that moves with its foot."""
PRICE = 9.0
"""Fall of the sum of squares that a coefficient has to bring, the logarithm of some ten thousand numbers."""


@dataclass(frozen=True)
class LawTerm:
    """A term with the numbers of its shape; `one` where its coefficients along x and y are one number.

    place : where it acts, if not at the place of its law
    """

    term: LibraryTerm
    shape: tuple[tuple[str, float], ...] = ()
    one: bool = False
    place: str = ""

    @property
    def searched(self) -> tuple[tuple[str, float], ...]:
        """Numbers of its shape that are not known beforehand."""
        return tuple((key, value) for key, value in self.shape if key != CLEARANCE)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of its coefficients, those along x first."""
        numbers = [f"_{k}" for k in range(1, len(self.term.parts) + 1)] if len(self.term.parts) > 1 else [""]
        axes = ("",) if self.one else ("_x", "_y")
        return tuple(f"{self.term.key}{number}{axis}" for axis in axes for number in numbers)

    def columns(self, seen: ObservedPlaces, place: str) -> np.ndarray:
        """Whitened responses (n, k) to its coefficients at a place."""
        found = seen.columns(self.place or place, self.term, dict(self.shape))
        return found.reshape(len(found), 2, -1).sum(axis=1) if self.one else found


STEADY = tuple(
    LawTerm(term, (("resonance", RIGID), ("damping_ratio", 0.0)) if term.resonates else ())
    for term in LIBRARY if term.constant and (term.memory is None or term.resonates)
)  # fmt: skip
"""Linear forces with constant coefficients, and a mass that is rigid."""


@dataclass(frozen=True, eq=False)
class ProposedLaw:
    """A law at a place: its terms, coefficients of their parts, and the misfit that it leaves.

    cost : sum of squares with priors; held : that of held-out records; left : excess of groups beyond their floor
    moved : change of the calibration that goes with it; sd : standard deviations of the coefficients
    tried : terms and places among which it was chosen
    """

    place: str
    terms: tuple[LawTerm, ...]
    coefficients: np.ndarray
    cost: float
    held: float
    left: float
    moved: np.ndarray
    sd: np.ndarray
    tried: int = 1

    @property
    def priced(self) -> float:
        """Sum of squares that it leaves, and the price of each of its coefficients."""
        return self.cost + PRICE * len(self.coefficients)

    @property
    def total(self) -> float:
        """Priced sum of squares over records to fit and held-out ones."""
        return self.priced + self.held

    @property
    def score(self) -> float:
        """Its total, with the credit of equal coefficients."""
        return self.total - EQUAL * sum(one.one for one in self.terms)

    def probability(self, known: float) -> float:
        """Probability next to the least total that is `known` without it, after its choice among all tried."""
        return float(expit((known - self.total) / (2 * TEMPERATURE) - math.log(self.tried)))

    def columns(self, seen: ObservedPlaces) -> np.ndarray:
        """Whitened responses (n, k) to its coefficients."""
        return np.column_stack([one.columns(seen, self.place) for one in self.terms])

    @property
    def places(self) -> tuple[str, ...]:
        """Places at which its terms act."""
        return tuple(dict.fromkeys(one.place or self.place for one in self.terms))

    def part_at(self, place: str) -> ProposedLaw:
        """Its terms that act at a place."""
        ends = np.cumsum([0, *(len(one.parameters) for one in self.terms)])
        own = [i for i, one in enumerate(self.terms) if (one.place or self.place) == place]
        numbers = [k for i in own for k in range(ends[i], ends[i + 1])]
        terms = tuple(replace(self.terms[i], place="") for i in own)
        return replace(self, place=place, terms=terms, coefficients=self.coefficients[numbers])

    def holds(self, other: ProposedLaw) -> bool:
        """Whether it is another law, at the same places, with further terms."""
        return self.places == other.places and set(self.forms) > set(other.forms)

    @property
    def remembers(self) -> bool:
        """Whether a term has a memory that no effect of the plant has."""
        return any(one.term.memory is not None for one in self.terms)

    @property
    def late(self) -> bool:
        """Whether a term is a late force."""
        return any(one.term.memory is not None and not one.term.resonates for one in self.terms)

    @property
    def constant(self) -> bool:
        """Whether it is a linear force that neither speed nor angle changes, as an error of the model's form is."""
        return self.remembers or all(one.term.constant for one in self.terms)

    @property
    def forms(self) -> tuple[str, ...]:
        """Names of the terms."""
        return tuple(one.term.name for one in self.terms)

    @property
    def names(self) -> str:
        """Terms and place as text."""
        return " with ".join(
            f"{' with '.join(one.term.name for one in self.terms if (one.place or self.place) == place)} of {place}"
            for place in self.places
        )


def propose(
    fit: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit, most: int = MOST_TERMS
) -> list[ProposedLaw]:
    """The best law at each place, by falling score."""
    return [law for law, *_ in _by_place(fit, held, base, most)]


def remembering(fit: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit) -> list[ProposedLaw]:
    """A hidden mass alone, and a spring behind dry friction, each at the places that the records do not tell apart.

    A large mass moves the shaft so much that the linear model proposes other terms with it. A spring whose reach is
    below all that were tried is dry friction.
    """
    mass = tuple(term for term in LIBRARY if term.resonates)
    masses = [replace(solved(fit, held, base, law.place, [replace(one, one=True) for one in law.terms]),
                      tried=law.tried) for law, _ in _by_place(fit, held, base, 1, mass)]  # fmt: skip
    springs = [law for law, _ in _by_place(fit, held, base, 1, (SLIPPING_SPRING,))]
    springs = [law for law in springs if law.terms[0].shape >= _options(fit, law.place, (SLIPPING_SPRING,))[0].shape]
    return [law for laws in (masses, springs) for law in laws if law.score < min(one.score for one in laws) + NEAR]


def _by_place(
    fit: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit, most: int,
    library: Sequence[LibraryTerm] | None = None,
) -> list[tuple[ProposedLaw, ProposedLaw]]:  # fmt: skip
    """The best law at each place and its first term alone, by falling score."""
    found = [_at_place(fit, held, base, place, most, library) for place in fit.motions]
    tried = sum(count for *_, count in found)
    laws = [(replace(law, tried=tried), replace(first, tried=tried)) for law, first, _ in found]
    return sorted(laws, key=lambda pair: pair[0].score)


def _options(fit: ObservedPlaces, place: str, library: Sequence[LibraryTerm] | None = None) -> list[LawTerm]:
    """All terms that may act at a place, with each of their shapes."""
    clearance = next((m.clearance for m in fit.motions[place] or ()), 0.0)
    return [LawTerm(term, tuple(shape.items())) for term in (library or LIBRARY) if clearance or not term.of_film
            for shape in term.options(fit.largest(place), clearance)]  # fmt: skip


def _screened(base: ParameterFit, columns: Sequence[np.ndarray]) -> Screening:
    """Terms by their columns, projected off the calibration."""
    return screen(base, forms_of(columns), columns)


def _next(
    view: Screening, chosen: Sequence[int], options: Sequence[LawTerm], terms: Sequence[LawTerm], first: int = 0
) -> int:
    """Number of the option that lowers the sum of squares most next to terms, with the price of its coefficients.

    In the view the terms are the `chosen` ones, and the options follow from the `first` on. Next to a force that bends
    no term remembers linearly: the motion that it remembers bends too.
    """
    taken = {name for one in terms for name in (one.term.name, *dict(one.shape))}
    bends = not all(one.term.constant for one in terms)
    drops = {i: view.drop(*chosen, first + i)[0] - PRICE * len(one.parameters) for i, one in enumerate(options)
             if not (taken & {one.term.name, *dict(one.shape)} or (bends and one.term.memory))}  # fmt: skip
    return max(drops, key=lambda i: (drops[i], -i))


def _at_place(
    fit: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit, place: str, most: int,
    library: Sequence[LibraryTerm] | None = None,
) -> tuple[ProposedLaw, ProposedLaw, int]:  # fmt: skip
    """The best law at a place, its first term alone, and the number of terms that were tried."""
    options = _options(fit, place, library)
    view = _screened(base, [one.columns(fit, place) for one in options])
    chosen, found = tuple[int, ...](), list[ProposedLaw]()
    nothing = excess(table(fit.comparison, fit.residual))
    while len(chosen) < most:
        before = found[-1].terms if found else ()
        chosen = (*chosen, _next(view, chosen, options, before))
        terms = _shaped(fit, base, place, [*before, options[chosen[-1]]])
        proposal = solved(fit, held, base, place, terms)
        if found and proposal.score > found[-1].score - _beyond_form(found[-1], base):
            break
        found.append(proposal)
        if proposal.left <= (1 - ENOUGH) * nothing:
            break
    return _with_equal(found[-1], fit, held, base), found[0], len(options)


def stability_of(
    law: ProposedLaw, laws: Sequence[ProposedLaw], fit: ObservedPlaces, base: ParameterFit
) -> Stability | None:  # fmt: skip
    """Count the random halves of the records that choose a law among all terms at all places, other laws' too."""

    def terms(one: ProposedLaw) -> list[PlacedTerm]:
        return [PlacedTerm(t.term.name, t.place or one.place, t.columns(fit, one.place)) for t in one.terms]

    others = [term for other in laws if other is not law for term in terms(other)]
    others += [PlacedTerm(one.term.name, place, one.columns(fit, place))
               for place in fit.motions for one in _options(fit, place)]  # fmt: skip
    return stability(fit, base, terms(law), others, PRICE)


def _with_equal(
    law: ProposedLaw, fit: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit
) -> ProposedLaw:  # fmt: skip
    """A law with one coefficient for x and y wherever that is better."""
    for i, one in enumerate(law.terms):
        merged = [*law.terms[:i], replace(one, one=True), *law.terms[i + 1 :]]
        alike = solved(fit, held, base, law.place, merged)
        law = replace(alike, tried=law.tried) if alike.score < law.score else law
    return law


def extended(
    law: ProposedLaw, fit: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit
) -> ProposedLaw:  # fmt: skip
    """A law with further terms at any place, as long as each makes it clearly better.

    None of them is constant, as what an error of the model's form adds, or has a memory.
    """
    options = [
        replace(one, place="" if place == law.place else place)
        for place in fit.motions for one in _options(fit, place) if not (one.term.constant or one.term.memory)
    ]  # fmt: skip
    columns = [one.columns(fit, law.place) for one in options]
    while len(law.terms) < MOST_TERMS:
        own = [one.columns(fit, law.place) for one in law.terms]
        view, k = _screened(base, [*own, *columns]), len(own)
        further = options[_next(view, range(k), options, law.terms, k)]
        terms = _shaped(fit, base, law.place, [*law.terms, further])
        more = replace(solved(fit, held, base, law.place, terms), tried=law.tried + len(options))
        if more.score > law.score - _beyond_form(law, base):
            break
        law = more
    return _with_equal(_without_idle(law, fit, held, base), fit, held, base)


def _beyond_form(law: ProposedLaw, base: ParameterFit) -> float:
    """Difference of scores from which on a further term is more than what the form of a law may leave.

    A friction that gives way at another velocity than the library's leaves a share of its own response, which a dead
    band at another bearing takes up.
    """
    return max(CLEAR, TIE * (base.cost - law.cost))


def _without_idle(
    law: ProposedLaw, fit: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit
) -> ProposedLaw:  # fmt: skip
    """A law without the terms that do not make it clearly better."""
    while len(law.terms) > 1:
        fewer = [solved(fit, held, base, law.place, [*law.terms[:i], *law.terms[i + 1 :]])
                 for i in range(len(law.terms))]  # fmt: skip
        best = min(fewer, key=lambda p: p.score)
        if best.score > law.score + CLEAR:
            break
        law = replace(best, tried=law.tried)
    return law


def _shaped(fit: ObservedPlaces, base: ParameterFit, place: str, terms: Sequence[LawTerm]) -> Sequence[LawTerm]:
    """Terms with the numbers of their shapes between those that were tried."""
    start = [value for one in terms for _, value in one.searched]
    if not start:
        return terms
    p = prior_rows(base.parameters)
    size = np.sqrt(np.sum(fit.J**2, axis=0) + p**2)
    size[size == 0] = 1.0
    J, g0 = fit.J / size, (fit.J.T @ fit.residual - p**2 * base.vector) / size
    H = J.T @ J + np.diag((p / size) ** 2)

    def at(x: np.ndarray) -> list[LawTerm]:
        values = iter(np.exp(x) * start)
        new = [{key: float(next(values)) for key, _ in one.searched} for one in terms]
        return [replace(one, shape=tuple((dict(one.shape) | own).items())) for one, own in zip(terms, new, strict=True)]

    def rise(x: np.ndarray) -> float:
        S = np.column_stack([one.columns(fit, place) for one in at(x)])
        S = S / np.maximum(np.linalg.norm(S, axis=0), 1e-300)
        cross, g = J.T @ S, np.concatenate([g0, S.T @ fit.residual])
        return -float(g @ answer(np.linalg.lstsq, np.block([[H, cross], [cross.T, S.T @ S]]), g, rcond=1e-12)[0])

    simplex = SIMPLEX * np.eye(len(start) + 1)[:, 1:]
    found = fmin(rise, np.zeros(len(start)), xtol=1e-3, ftol=0.5, maxfun=30 * len(start), disp=False,
                 initial_simplex=simplex)  # fmt: skip
    return at(np.asarray(found))


def _least_squares(
    fit: ObservedPlaces, base: ParameterFit, columns: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Scaled least-squares problem A x = b for the calibration's change and coefficients of columns, and the scales."""
    p, S = prior_rows(base.parameters), np.column_stack(columns)
    A = np.block([[fit.J, S], [np.diag(p), np.zeros((len(p), S.shape[1]))]])
    size = np.linalg.norm(A, axis=0)
    size[size == 0] = 1.0
    return A / size, np.concatenate([fit.residual, -p * base.vector]), size


def solved(
    fit: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit, place: str, terms: Sequence[LawTerm]
) -> ProposedLaw:  # fmt: skip
    """Coefficients of terms together with the calibration's change, by least squares."""
    columns = [one.columns(fit, place) for one in terms]
    A, b, size = _least_squares(fit, base, columns)
    scaled = answer(np.linalg.lstsq, A, b, rcond=1e-9)[0]
    x, k = scaled / size, len(base.parameters)
    after = fit.residual - fit.J @ x[:k] - np.column_stack(columns) @ x[k:]
    misfit = 0.0
    if held is not None:
        there = np.column_stack([one.columns(held, place) for one in terms])
        left = held.residual - held.J @ x[:k] - there @ x[k:]
        misfit = float(left @ left)
    sd = np.sqrt(np.maximum(np.diag(answer(np.linalg.pinv, A.T @ A)), 0.0)) / size
    cost = float(np.sum((b - A @ scaled) ** 2))
    left_over = excess(table(fit.comparison, after))
    return ProposedLaw(place, tuple(terms), x[k:], cost, misfit, left_over, x[:k], sd[k:])


ACTS = {"": "", HOUSING: ", on the housing of the bearing", BETWEEN: ", between the bearing's housing and the shaft"}
"""Further words on the place of a law, by what moves there."""
SLIPPING = ";\nslipping(x, reach) is the stretch of a spring that follows x up to the reach, where its foot slips"
SLIDER = '''

@inlined
def slipping(stretch, reach):
    """Stretch [m] of a spring whose foot slips, by dry friction, at a reach [m]."""
    return min(max(stretch, -reach), reach)
'''
"""Further text of the module of a spring behind dry friction: a part of its law, and a function."""


def named(
    proposal: ProposedLaw, machine: Machine, sd: dict[str, float] | None = None
) -> tuple[str, str]:  # fmt: skip
    """Name of a law as an effect of a machine, which no other law has, and its module."""
    places, moving = law_places(machine), off_shaft(machine)
    own = hashlib.sha256(written(proposal, places, "law", sd, moving).encode()).hexdigest()[:12]
    return (name := f"law_{own}"), written(proposal, places, name, sd, moving)


def effects_of(proposal: ProposedLaw, name: str) -> dict[str, str]:
    """Names of the effects of a law by the place at which each acts."""
    return {place: name if not i else f"{name}_{i + 1}" for i, place in enumerate(proposal.places)}


def written(
    proposal: ProposedLaw, places: Mapping[str, float], name: str, sd: dict[str, float] | None = None,
    moving: Mapping[str, str] = MappingProxyType({}),
) -> str:  # fmt: skip
    """Module of a law as an effect at each of its places [m]: equations, units and, where known, standard deviations.

    The module is run, so that nothing of a machine file but numbers stands in it: its place is a coordinate, and what
    is `moving` there where that is not the shaft.
    """
    effects = effects_of(proposal, name)
    parts = [(places[place], proposal.part_at(place), own) for place, own in effects.items()]
    at = {own: moving.get(place, "") for place, own in effects.items()}
    slips = any(one.term.slips for one in proposal.terms)
    head = "\n\n".join(
        f"{1e3 * z:.6g} mm along the shaft{ACTS[at[own]]}:\n\n    F_x = {x} [N]\n    F_y = {y} [N]"
        for z, part, own in parts for x, y in ((one.replace("p.", "") for one in _equations(part)),)
    )  # fmt: skip
    tables = "\n\n".join(_table(part, z, own, sd or {}) for z, part, own in parts)
    return (
        f'''"""Law discovered from records: a force on the rotor.

{head}

of displacement x, y [m] and velocity vx, vy [m/s] there, speed [rad/s] and angle [rad] of the shaft{SLIPPING * slips}.
The machine file takes what follows, and is loaded after this module was imported:

{tables}
"""

import math

from reynolds.jit import inlined
from rotorsim.effects import Effect, param, register
'''
        + SLIDER * slips
        + "".join(_effect(part, own, z, at[own]) for z, part, own in parts)
    )


def _equations(part: ProposedLaw) -> tuple[str, ...]:
    """Force along x and y of the terms at a place, in the names of a kernel."""
    found = []
    for axis in (0, 1):
        sums = []
        for one in part.terms:
            n = len(one.term.parts)
            own = one.parameters if one.one else one.parameters[axis * n : (axis + 1) * n]
            pairs = zip(own, one.term.parts, strict=True)
            sums += [f"p.{parameter} * ({along(expression, axis)})" for parameter, expression in pairs]
        found.append(f"-({' + '.join(sums)})")
    return tuple(found)


def _table(part: ProposedLaw, position: float, name: str, sd: Mapping[str, float]) -> str:
    """Table of a machine file with the effect at a place."""
    values = dict(zip((p for one in part.terms for p in one.parameters), part.coefficients, strict=True))
    values |= {key: value for one in part.terms for key, value in one.shape}
    spread = {key: f"  # +- {own:.2g}" for key, own in sd.items() if own}
    rows = [f'    position = "{float(position)!r} m"']
    rows += [f'    {key} = "{value:.6g} {units_of(part)[key]}"{spread.get(key, "")}' for key, value in values.items()]
    return "\n".join([f"    [[effects.{name}]]", *rows])


def _effect(part: ProposedLaw, name: str, z: float, what: str) -> str:
    """Kernel and class of the effect at a place [m], of what moves there where that is not the shaft."""
    fields = []
    for one in part.terms:
        for parameter in one.parameters:
            fields.append(f'    {parameter}: float = param("{one.term.unit}", doc="Coefficient of the law.")')
        for key, value in one.shape:
            unit = next(unit for known, unit, _ in one.term.shape if known == key)
            given = f'"{unit}", default={float(value)!r}, bounds=(0.0, 1.0), doc="Its {key}."'
            fields.append(f"    {key}: float = param({given})")
    slips = any(one.term.slips for one in part.terms)
    steady = not (slips or any(one.term.turns for one in part.terms))
    given, force, keep = "t, angle, speed, x, y, vx, vy, p", ", ".join(_equations(part)), ""
    own = f'\n    influence = "{what}"' if what else ""
    if slips:
        given, stretches = f"w, state, h, dx, dy, {given}", ("w[state] + dx", "w[state + 1] + dy")
        for axis, stretch in zip("xy", stretches, strict=True):
            force = force.replace(f"slipping({axis},", f"slipping({stretch},")
        own += f'\n    keep, states, memory = {name}_keep, 2, "short"'
        keep = f'''

@inlined
def {name}_keep({given}):
    """Stretch [m] along x and y at the end of a step."""
    w[state], w[state + 1] = {", ".join(f"slipping({stretch}, p.reach)" for stretch in stretches)}
'''
    return f'''

@inlined
def {name}({given}):
    """The law: [N]."""
    return {force}
{keep}

@register
class {"".join(word.title() for word in name.split("_"))}(Effect):
    """Law discovered from records."""

    port, kernel, steady = "motion", {name}, {steady}{own}
{chr(10).join(fields)}
    position: float | None = param("m", default={float(z) if what else None}, doc="Where it acts along the shaft.")
'''


def along(part: str, axis: int) -> str:
    """An expression of LIBRARY for one axis in the names of a kernel."""
    names = ("x", "y", "vx", "vy", "1.0") if axis == 0 else ("y", "x", "vy", "vx", "-1.0")
    known = dict(zip(("u", "w", "du", "dw", "s"), names, strict=True))
    return re.sub(r"\b(u|w|du|dw|s)\b", lambda found: known[found[0]], part)


def units_of(law: ProposedLaw) -> dict[str, str]:
    """Units of the coefficients and of the numbers of the shapes."""
    units = {key: one.term.unit for one in law.terms for key in one.parameters}
    return units | {key: unit for one in law.terms for key, unit, _ in one.term.shape}


@dataclass(frozen=True, eq=False)
class DiscoveredLaw:
    """A law that the records show at a place: its equations, coefficients with standard deviations, and evidence.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.diagnose("two_discs.toml", "records").discovered  # doctest: +SKIP
    >>> found.place, found.law, found.terms["cubic"]  # doctest: +SKIP
    ('the bearing right', 'F_x = -(cubic * (x * x * x)) ...', (5.8e13, 2e12))
    """

    name: str
    place: str
    position: float
    """Coordinate along the shaft [m] at which it acts."""
    law: str
    """Equations of the force along x and y [N], with units and intervals of all numbers."""
    terms: dict[str, tuple[float, float]]
    """Coefficients and numbers of their shapes with standard deviations [SI]."""
    units: dict[str, str]
    kinds: tuple[str, ...]
    """Names of its terms in the library."""
    source: str
    """Module of the effect, which `register` makes known."""
    file: str
    """Path of the module, which no other result has."""
    probability: float
    near: tuple[str, ...] = ()
    """Laws at other places and further terms that these records do not exclude."""
    tied: tuple[str, ...] = ()
    """Other places of the same terms, where its own has less than 95 % next to them."""
    places: tuple[tuple[str, float], ...] = ()
    """Place and its coordinate [m] of each of `kinds`; those of the law for none."""
    growth: float = 0.0
    """Force at twice the motion over that at the motion of the records; 0 where it is not known."""
    power: float = 0.0
    """Mean power [W] that it feeds into the largest motion of the records; negative where it takes it."""
    curve: dict[str, np.ndarray] = field(default_factory=dict)
    """Moments of the records: displacement and velocity (n, 2) there, force (n, 2) measured and of the law, and the
    standard deviation of the latter."""
    chosen: Stability | None = None
    """Halves of the records that choose it, and what the others choose."""
    bearing: dict[str, Any] = field(default_factory=dict)
    """The bearing of a machine file that a hidden mass is; empty for other laws."""

    def sizes(self) -> Iterator[tuple[str, str, str]]:
        """Number, value and standard deviation in display units; no standard deviation where it was held."""
        for key, (value, sd) in self.terms.items():
            yield key, with_unit(value, self.units[key], 4), with_unit(sd, self.units[key], 2) if sd else ""

    @property
    def sentence(self) -> str:
        """Law and place with all numbers in one sentence."""
        sizes = ", ".join(f"{key} = {value}{f' +- {sd}' if sd else ''}" for key, value, sd in self.sizes())
        at = [place for place, _ in self.places] or [self.place] * len(self.kinds)
        where = {place: [k for k, own in zip(self.kinds, at, strict=True) if own == place] for place in at}
        parts = " and ".join(f"{' with '.join(own)} at {place}" for place, own in where.items())
        tied = f" or {' or '.join(self.tied)}, which these records do not tell apart" if self.tied else ""
        same = {f"{' with '.join(self.kinds)} of {place}" for place in self.tied}
        near = [name for name in self.near if name not in same]
        others = f" (these records do not exclude {'; '.join(near)})" if near else ""
        return f"{parts}{tied}{others}, {sizes}"

    @property
    def refuted_by(self) -> str:
        """Sentence on the energy of the law, where it feeds any, its growth, and what refutes it."""
        feeds = f"it feeds {self.power:.2g} W into the motion; " if self.power > 0 else ""
        grows = f"{feeds}its force is {self.growth:.2g} times as large at twice the motion, and " if self.growth else ""
        return f"{grows}the law is refuted where it leaves more than the floor."

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers and text, for JSON."""
        sizes = {key: {"value": value, "sd": sd, "unit": self.units[key]} for key, (value, sd) in self.terms.items()}
        return {
            "place": self.place, "position": self.position, "kinds": list(self.kinds), "law": self.law,
            "places": [list(one) for one in self.places],
            "terms": sizes, "power": self.power, "refuted_by": self.refuted_by, "probability": self.probability,
            "not_excluded": list(self.near), "tied": list(self.tied),
            **({"bearing": self.bearing} if self.bearing else {}),
            **({} if self.chosen is None else {"stability": asdict(self.chosen)}),
        }  # fmt: skip


def force_of(law: ProposedLaw, m: PlaceMotion) -> np.ndarray:
    """Force (2, n) [N] of a law without a memory along a motion."""
    force, coefficients = np.zeros(m.displacement.shape), iter(law.coefficients)
    for one in law.terms:
        sizes = [next(coefficients) for _ in one.parameters]
        for k, (axis, part) in enumerate(product((0, 1), one.term.parts)):
            force[axis] += sizes[k % len(sizes)] * m.force(part, axis, dict(one.shape))
    return force


def fed_power(law: ProposedLaw, m: PlaceMotion) -> float:
    """Mean power [W] that a law without a memory feeds into a motion; negative where it takes it."""
    work = force_of(law, m) * m.velocity
    return 0.0 if abs(work.sum()) < ALIKE * np.abs(work).sum() else float(np.mean(np.sum(work, axis=0)))


def spread_of(law: ProposedLaw, m: PlaceMotion, sd: Mapping[str, float]) -> np.ndarray:
    """Standard deviation (2, n) [N] of a force without a memory by those of the law's numbers, taken one by one."""
    keys, c = [key for one in law.terms for key in one.parameters], law.coefficients
    moved = [replace(law, coefficients=c + sd.get(key, 0.0) * unit)
             for key, unit in zip(keys, np.eye(len(c)), strict=True)]  # fmt: skip
    for i, one in enumerate(law.terms):
        for name, _ in one.shape:
            shape = tuple((key, value + sd.get(key, 0.0) * (key == name)) for key, value in one.shape)
            moved.append(replace(law, terms=(*law.terms[:i], replace(one, shape=shape), *law.terms[i + 1 :])))
    force = force_of(law, m)
    return np.sqrt(sum((force_of(one, m) - force) ** 2 for one in moved))


def discovered(
    proposal: ProposedLaw, found: IdentifiedEffect, probability: float, near: Sequence[str], seen: ObservedPlaces,
    left: np.ndarray, chosen: Stability | None,
) -> DiscoveredLaw:  # fmt: skip
    """The law of a proposal as the plant's fit has it, which leaves this of the records to fit (n,) [m].

    `chosen` is how often random halves of the records choose it.
    """

    def along(m: PlaceMotion) -> tuple[np.ndarray, np.ndarray]:
        own = fitted.part_at(first)
        return force_of(own, m), spread_of(own, m, sd)

    known = {key: value for one in proposal.terms for key, value in one.shape}
    terms = {key: (found.parameters.get(key, known.get(key, 0.0)), found.sd.get(key, 0.0)) for one in proposal.terms
             for key in (*one.parameters, *(name for name, _ in one.shape))}  # fmt: skip
    sizes = np.array([terms[key][0] for one in proposal.terms for key in one.parameters])
    fitted = replace(proposal, coefficients=sizes, terms=tuple(
        replace(one, shape=tuple((key, terms[key][0]) for key, _ in one.shape)) for one in proposal.terms))  # fmt: skip
    at, sd = law_places(seen.comparison.twin.machine), {key: sd for key, (_, sd) in terms.items()}
    name, text = named(fitted, seen.comparison.twin.machine, sd)
    path = in_cache("laws") / f"{name}.py"
    write_text(path, text)
    first = fitted.places[0]
    growth, powers = 0.0, []
    for place in fitted.places:
        part = fitted.part_at(place)
        largest = max(seen.motions[place], key=lambda m: float(np.abs(m.displacement).max()))
        twice = replace(largest, displacement=2 * largest.displacement, velocity=2 * largest.velocity)
        powers.append(fed_power(part, largest))
        growth = growth or float(np.linalg.norm(force_of(part, twice)) / np.linalg.norm(force_of(part, largest)))
    return DiscoveredLaw(
        name, first, at[first], text.split('"""')[1], terms, units_of(proposal), proposal.forms, text,
        str(path), probability, tuple(near), () if probability >= SURE else tied(proposal, near),
        tuple((place, at[place]) for place in _places_of(proposal)), growth, sum(powers),
        force_curve(seen, first, left, along), chosen,
    )  # fmt: skip


def not_excluded(law: ProposedLaw, laws: Sequence[ProposedLaw], names: Sequence[str]) -> list[str]:
    """Explanations of these names next to a law: those of `laws` that hold it are its further terms."""
    more = {one.names: FURTHER.format(" with ".join(term for term in one.forms if term not in law.forms))
            for one in laws if one.holds(law)}  # fmt: skip
    return [more.get(name, name) for name in names]


def tied(law: ProposedLaw, near: Sequence[str]) -> tuple[str, ...]:
    """Places at which laws that are not excluded have all terms of a law at one place."""
    own = law.names.removesuffix(law.place)
    found = [name.removeprefix(own) for name in near if name.startswith(own)]
    return tuple(place for place in found if " with " not in place) if len(law.places) == 1 else ()


def _places_of(law: ProposedLaw) -> tuple[str, ...]:
    """Place of each term."""
    return tuple(one.place or law.place for one in law.terms)


def laws_of(
    seen: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit, film: bool = False
) -> list[ProposedLaw]:  # fmt: skip
    """The best laws at the places that the records do not tell apart by the linear model, the best one first.

    A law at several places has to be clearly better than the best one at one place. One of several terms at a place
    comes with fewer of them too: the plant may not bear out what the linear model adds. Next to a `film`, whose own
    force bends with the motion, each of its terms comes alone.
    """
    found = _near_laws(seen, held, base)
    several = film and not found[0].remembers and len(found[0].terms) > 1
    terms = [replace(one, one=False) for one in found[0].terms] if several else []
    own = [solved(seen, held, base, one.place or found[0].place, [replace(one, place="")]) for one in terms]
    alone = [replace(_with_equal(law, seen, held, base), tried=found[0].tried) for law in own]
    return [*found, *(law for law in alone if law.names not in {one.names for one in found})]


def _near_laws(seen: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit) -> list[ProposedLaw]:
    """The laws of `laws_of` by the linear model."""
    found = _by_place(seen, held, base, MOST_TERMS)
    best = found[0][0]
    if best.remembers:
        near = [law for law, _ in found if law.score < best.score + NEAR and law.remembers]
        return near[:MOST_LAWS]
    near = [law for law, _ in found if law.score < best.score + NEAR and not law.remembers]
    alone = sorted((extended(law, seen, held, base) for law in near), key=lambda p: p.score)
    # where one term at a place is not enough, each place's first one begins
    firsts = [first for _, first in found if not first.constant] if len(best.terms) > 1 else []
    begun = sorted((extended(first, seen, held, base) for first in firsts), key=lambda p: p.score)
    several = [law for law in (*begun, *alone) if len(law.places) > 1]
    single = [law for law in alone if len(law.places) == 1]
    least = min((law.score for law in single or near), default=math.inf)
    most = min((law for law in single or near), key=lambda p: p.score, default=None)
    if several and min(law.score for law in several) < least - (CLEAR if most is None else _beyond_form(most, base)):
        first = min(several, key=lambda p: p.score)
        moved = [one for one in _moved(first, seen, held, base) if one.score < first.score + NEAR]
        return [first, *sorted(moved, key=lambda p: p.score)][:MOST_LAWS]
    chosen = (single or near)[:MOST_LAWS]
    fewer = [own for pair in found for own in pair
             if own.place == chosen[0].place and len(own.terms) < len(chosen[0].terms)]  # fmt: skip
    return [*chosen, *(_with_equal(own, seen, held, base) for own in fewer[:1])]


def promised_fall(laws: Sequence[ProposedLaw], seen: ObservedPlaces, fit: ParameterFit) -> float:
    """Largest fall of the priced sum of squares that terms of laws promise next to a fit, by the linear model."""
    columns = [law.columns(seen) for law in laws]
    view = _screened(fit, columns)
    return max(view.drop(i)[0] - PRICE * own.shape[1] for i, own in enumerate(columns))


def _moved(
    law: ProposedLaw, fit: ObservedPlaces, held: ObservedPlaces | None, base: ParameterFit
) -> list[ProposedLaw]:  # fmt: skip
    """The law with one of its terms at another place, each of both."""
    return [
        replace(solved(fit, held, base, law.place, terms), tried=law.tried)
        for i, one in enumerate(law.terms) for place in fit.motions if place != (one.place or law.place)
        for terms in ([*law.terms[:i], replace(one, place="" if place == law.place else place), *law.terms[i + 1 :]],)
    ]  # fmt: skip


def beyond_steady(law: ProposedLaw, seen: ObservedPlaces, base: ParameterFit) -> bool:
    """Whether a hidden mass or a late force explains clearly more than stiffness, damping and mass do at any place."""
    if not any(one.term.memory is not None for one in law.terms):
        return False
    least = OF_FORM if law.late else CLEAR
    return min(solved(seen, None, base, place, STEADY).cost for place in seen.motions) - law.cost > least


def beyond_film(law: ProposedLaw, seen: ObservedPlaces, base: ParameterFit, cost: float) -> bool:
    """Whether a law, with this sum of squares, explains clearly more than errors of gas films' models may.

    It has to explain more than linear forces at any one place do that change with powers of the speed, too. A late
    force is never a law.
    """
    changing = [LawTerm(term) for term in LIBRARY if term.linear and not (term.constant or term.memory)]
    forces = [*STEADY, *changing, *(LawTerm(term) for term in ORDER_FORCES)]
    least = [_left_by_films(seen, base), *(solved(seen, None, base, place, forces).cost for place in seen.motions)]
    return not law.late and min(least) - cost > OF_FORM


def _left_by_films(seen: ObservedPlaces, base: ParameterFit) -> float:
    """Sum of squares that errors of gas films' models leave, which are linear in the motion while it is small.

    At all films together act all constant forces, with coefficients of their own at each speed and pressure, and
    relaxations, whose coefficients do not change; at all places forces at 1X and 2X: the displacement of a journal from
    the middle of its film hardly moves. Coefficients of a speed and pressure are eliminated by their own records.
    """
    films = [place for place, own in seen.motions.items() if own[0].clearance]
    orders = [LawTerm(term) for term in ORDER_FORCES]
    steady = np.column_stack([one.columns(seen, place) for place in seen.motions
                              for one in (*orders, *(STEADY if place in films else ()))])  # fmt: skip
    relaxing = [LawTerm(RELAXATION, tuple(shape.items())) for shape in RELAXATION.options(1.0)]
    A, b, _ = _least_squares(seen, base, [one.columns(seen, place) for place in films for one in relaxing])
    trials = seen.comparison.trials
    points = list(zip(_levels([t.speed for t in trials]), _levels([t.pressure for t in trials]), strict=True))
    for point in set(points):
        own = np.flatnonzero(np.array([p == point for p in points])[seen.comparison.layout.record])
        size = np.linalg.norm(steady[own], axis=0)
        Q = answer(orth, steady[own][:, size > 0] / size[size > 0], rcond=1e-9)
        A[own] -= Q @ (Q.T @ A[own])
        b[own] -= Q @ (Q.T @ b[own])
    return float(np.sum((b - A @ answer(np.linalg.lstsq, A, b, rcond=1e-9)[0]) ** 2))


def _levels(values: Sequence[float]) -> list[int]:
    """Number of each value's level, where those that a drive's waver may make of one share it."""
    starts = list[float]()
    for value in sorted(values):
        if not starts or value - starts[-1] > WAVER * abs(value):
            starts.append(value)
    return [bisect(starts, value) for value in values]


def cannot_tell(trials: Sequence[Trial]) -> str:
    """Sentence on what records lack of which a law could be identified; empty where nothing is missing."""
    if any(t.orders or not (t.periodic or t.turning) for t in trials):
        return NOT_PERIODIC
    if one_speed(trials):
        return ONE_SPEED
    sizes, weights = [t.amplitude for t in trials], {tuple(sorted(t.stated_changes.items())) for t in trials}
    return ONE_AMPLITUDE if max(sizes) < TWO_AMPLITUDES * min(sizes) and len(weights) < 2 else ""


def with_rival(
    odds: Sequence[Explanation], laws: Sequence[Hypothesis], rival: Hypothesis | None,
    behind: Callable[[Hypothesis], float],
) -> tuple[Explanation, ...]:  # fmt: skip
    """Odds of laws in which the best effects of the catalogue stand too, by how far a law is `behind` their total."""
    known = [law for law in laws if probability_of(law.keys, odds) > 0]
    if rival is None or not known:
        return tuple(odds)
    best = max(known, key=lambda law: probability_of(law.keys, odds))
    other = Explanation(rival.keys, False, 0.0, 0.0, True)
    return with_other(odds, best.keys, other, behind(best))


def priced(one: Hypothesis) -> float:
    """Sum of squares of effects as they were fitted, and the price of each of their coefficients."""
    return one.fit.cost + PRICE * sum(len(form.parameters) for form in one.forms)


def after_choice(odds: Sequence[Explanation], keys: Sequence[str], tried: int) -> tuple[Explanation, ...]:
    """Odds after the price of having chosen laws among so many terms and places."""
    shares = [e.probability / (tried if set(e.effects) & set(keys) else 1) for e in odds]
    whole = sum(shares)
    return tuple(replace(e, probability=share / whole) for e, share in zip(odds, shares, strict=True))


@contextmanager
def candidate_laws(proposals: Sequence[ProposedLaw], twin: Twin) -> Iterator[tuple[Form, ...]]:
    """Forms of laws as candidates; their effects are known within the context alone."""
    places, names, forms = law_places(twin.machine), list[str](), list[Form]()
    try:
        for proposal in proposals:
            name, text = named(proposal, twin.machine)
            names += effects_of(proposal, name).values()
            load(text)
            forms.append(form_of(proposal, places, name))
        yield tuple(forms)
    finally:
        for name in names:
            REGISTRY.pop(name, None)


def load(text: str) -> None:
    """Import a module of an effect from its text, which is kept in the cache under its hash."""
    name = f"law_{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    path = in_cache("laws") / f"{name}.py"
    write_text(path, text)
    spec = spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    sys.modules[name] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules[name])


def form_of(proposal: ProposedLaw, places: Mapping[str, float], name: str) -> Form:
    """A law as a candidate: all coefficients are fitted from the first on, the numbers of its shapes after them."""
    own, owners = effects_of(proposal, name), dict[str, str]()
    for one, place in zip(proposal.terms, _places_of(proposal), strict=True):
        owners |= dict.fromkeys((*one.parameters, *(key for key, _ in one.shape)), own[place])
    sizes = zip((p for one in proposal.terms for p in one.parameters), proposal.coefficients, strict=True)
    parameters = tuple(FitParameter(f"{owners[key]}.0.{key}", SHARE * abs(value), usual=abs(value))
                       for key, value in sizes)  # fmt: skip
    shapes = tuple(FitParameter(f"{owners[key]}.0.{key}", SHARE * value, low=-0.9 * value, high=value)
                   for one in proposal.terms for key, value in one.searched)  # fmt: skip
    fixed = {f"{effect}.0.position": places[place] for place, effect in own.items()}
    return Form(own[proposal.places[0]], proposal.names, parameters, fixed, shapes, shaped=bool(shapes))
