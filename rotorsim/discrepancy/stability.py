r"""Stability of a law: how often random halves of the records choose it.

Half of the points, each with all of its repeats, drawn without replacement, and the other half choose terms and places
anew, one by one, by the largest fall of the sum of squares next to the calibration J. A record adds its own scalar
products,

.. math:: G = \sum_k X_k' X_k, \qquad X = [J, S, r],

so that a half costs a sum and an elimination. The share of halves that choose a law is how firmly the records show it;
what the others choose are its rivals.

Assumes: numbers of the shapes as the law has them, or as they were tried. Source: Meinshausen & Bühlmann (2010), Shah &
Samworth (2013) for complementary halves.

Cites: meinshausen_2010, shah_2013.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rotorsim.base.rounding import answer
from rotorsim.discrepancy.calibration import FitParameter
from rotorsim.discrepancy.candidates import Form, Screening, screen
from rotorsim.discrepancy.fit import ParameterFit, prior_rows
from rotorsim.discrepancy.hypotheses import CLEAR
from rotorsim.discrepancy.law_terms import ObservedPlaces

PAIRS = 25
"""Number of pairs of complementary halves."""
NEARLY = 0.5
"""Share of the fall by a term of the law that another one may lack and still be chosen in its place by a half."""
MOST_RIVALS = 60
"""Most other terms among which a half chooses."""
MOST_OTHERS = 3
"""Most other choices that are stated."""
LEAST_POINTS = 6
"""Smallest number of points that are halved."""
Choice = tuple[tuple[str, str], ...]
"""Names and places of the terms of a law, sorted."""


@dataclass(frozen=True)
class Stability:
    """Number of halves of the records that choose a law, of all, and of those that choose its places.

    others : what other halves choose, with their numbers, the most frequent first
    """

    chosen: int
    at_place: int
    halves: int
    others: tuple[tuple[str, int], ...]

    @property
    def sentence(self) -> str:
        """Numbers of halves that choose the law and its place, and what the others choose."""
        more = "; ".join(f"{name}: {count}" for name, count in self.others)
        others = f"; others choose {more}" if more else ""
        return (
            f"{self.chosen} of {self.halves} random halves of the records choose it, {self.at_place} its place{others}"
        )


@dataclass(frozen=True, eq=False)
class PlacedTerm:
    """A term that a half may choose: its name, place, and whitened responses (n, k) to its coefficients."""

    name: str
    place: str
    columns: np.ndarray


def stability(
    seen: ObservedPlaces, base: ParameterFit, law: Sequence[PlacedTerm], others: Sequence[PlacedTerm], price: float
) -> Stability | None:  # fmt: skip
    """Stability of a law's terms among others; each coefficient has a price. None for too few records."""
    repeated = np.array(seen.comparison.repeated)
    points = np.unique(repeated)
    if len(points) < LEAST_POINTS:
        return None
    terms = _rivals(base, law, others)
    products = _products(seen, base, terms)
    rng, found = np.random.default_rng(0), list[Choice]()
    for _ in range(PAIRS):
        mixed = rng.permutation(points)
        for half in (mixed[: len(mixed) // 2], mixed[len(mixed) // 2 :]):
            own = np.isin(repeated, half)
            picked = _greedy(_view(products[own].sum(axis=0), base, terms), terms, len(law), price)
            found.append(_choice([terms[i] for i in picked]))
    chosen, at = _choice(law), sorted(one.place for one in law)
    rest = Counter(" with ".join(f"{name} of {place}" for name, place in one) for one in found if one != chosen)
    same_place = sum(sorted(place for _, place in one) == at for one in found)
    return Stability(found.count(chosen), same_place, len(found), tuple(rest.most_common(MOST_OTHERS)))


def _choice(terms: Sequence[PlacedTerm]) -> Choice:
    return tuple(sorted((one.name, one.place) for one in terms))


def forms_of(columns: Sequence[np.ndarray]) -> list[Form]:
    """Terms with these columns as forms whose steps make them of size one."""
    return [
        Form("law", f"{i}", tuple(FitParameter(f"law.{i}.{k}", 1 / max(size, 1e-300)) for k in range(c.shape[1])))
        for i, c in enumerate(columns) for size in (float(np.linalg.norm(c, axis=0).max()),)
    ]  # fmt: skip


def _forms(terms: Sequence[PlacedTerm]) -> list[Form]:
    return forms_of([one.columns for one in terms])


def _rivals(
    base: ParameterFit, law: Sequence[PlacedTerm], others: Sequence[PlacedTerm]
) -> list[PlacedTerm]:  # fmt: skip
    """The law's terms, and those others that fall nearly as far in place of one of them, at most `MOST_RIVALS`."""
    near, k = list[tuple[float, PlacedTerm]](), range(len(law))
    for place in dict.fromkeys(one.place for one in others):
        own = [*law, *(one for one in others if one.place == place)]
        view = screen(base, _forms(own), [one.columns for one in own])
        without = [[j for j in k if j != i] for i in k]
        rest = [view.drop(*r)[0] if r else 0.0 for r in without]
        alone = [view.drop(*k)[0] - before for before in rest]
        for i, one in enumerate(own[len(law) :], len(law)):
            short = min(a - view.drop(*r, i)[0] + before for r, before, a in zip(without, rest, alone, strict=True))
            if short < max(NEARLY * min(alone), CLEAR):
                near.append((short, one))
    return [*law, *(one for _, one in sorted(near, key=lambda pair: pair[0])[:MOST_RIVALS])]


def _products(seen: ObservedPlaces, base: ParameterFit, terms: Sequence[PlacedTerm]) -> np.ndarray:
    """Scalar products (records, m, m) of the calibration's columns, those of all terms in their steps, the residual."""
    steps = [one.columns * form.parameters[0].step for one, form in zip(terms, _forms(terms), strict=True)]
    X = np.column_stack([base.J, *steps, base.residual])
    record = seen.comparison.layout.record
    return np.array([X[record == k].T @ X[record == k] for k in range(len(seen.comparison.trials))])


def _view(G: np.ndarray, base: ParameterFit, terms: Sequence[PlacedTerm]) -> Screening:
    """Terms with the calibration eliminated from scalar products (m, m)."""
    p = prior_rows(base.parameters)
    k = len(p)
    H, c = G[:k, :k] + np.diag(p**2), G[:k, k:].copy()
    c[:, -1] -= p**2 * base.vector
    size = np.sqrt(np.maximum(np.diag(H), 1e-300))
    rest = G[k:, k:] - c.T @ (answer(np.linalg.pinv, H / size[:, None] / size, rcond=1e-12) / size[:, None] / size) @ c
    ends = np.cumsum([0] + [one.columns.shape[1] for one in terms])
    where = tuple(slice(int(a), int(b)) for a, b in pairwise(ends))
    raw = np.diag(G)[k:-1]
    return Screening(tuple(_forms(terms)), where, rest[:-1, :-1], rest[:-1, -1], np.zeros(len(raw), bool), raw)


def _greedy(view: Screening, terms: Sequence[PlacedTerm], count: int, price: float) -> tuple[int, ...]:
    """Numbers of terms chosen one by one by the fall of the sum of squares, with a price of each coefficient."""
    chosen = tuple[int, ...]()
    while len(chosen) < count:
        taken = {(terms[k].name, terms[k].place) for k in chosen}
        falls = {i: view.drop(*chosen, i)[0] - price * one.columns.shape[1] for i, one in enumerate(terms)
                 if (one.name, one.place) not in taken}  # fmt: skip
        chosen = (*chosen, max(falls, key=lambda i: (falls[i], -i)))
    return chosen
