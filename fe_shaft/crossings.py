r"""Crossings of the modes with order lines, each solved with the pencil at the crossing itself, and onset of growth.

.. math:: |\lambda(\Omega)| = n\,|\Omega|

They are met in either direction (Friswell et al. 2010, section 6.8).

Growth begins where the least damping ratio of all modes loses its sign first.
Damping may be lost and come back between two values. A step is halved as long as tangents of damping ratios at both
ends lead below zero at the other one, as they do where a damping ratio dips.

Cites: friswell_2010.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise
from math import nan

import numpy as np
from numpy.typing import NDArray

from fe_shaft.follower import CERTAIN, INDISTINCT, Branch, Family, Followed, Node, follow, jumps, overlap
from fe_shaft.pencil import Modes, Pencil
from fe_shaft.spectrum import NEAR, SMALL, everything, predicted, refined, settled, tracked
from rotorsim.base.rounding import DAMPED, falls_below_zero

LAST_STEP = 1e-12
"""Square of the last step to a crossing over the crossing and the width around it: the next one is below 1e-9."""
STEPS = 50
"""Steps to a crossing, after which it counts as not certain."""
HALVINGS = 16
"""Halvings of the distance to a place at which a mode is known, before it counts as not certain."""

LEAST_WIDTH = 1e-6
"""Relative width of an interval that is not halved: two crossings closer to one another are not certain."""

TIMES_AGAIN = 4
"""Times that a step in which a crossing is open is followed again more closely."""

Interval = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Crossing:
    """A mode on an order line: the parameter there, whether |s| leaves the line upwards, the mode with its vectors."""

    branch: int
    order: float
    at: float
    upward: bool
    pencil: Pencil
    modes: Modes


def crossings(
    family: Family, found: Followed, orders: Sequence[float] = (1.0, 2.0, 3.0)
) -> tuple[list[Crossing], list[Interval]]:
    """Crossings of \\|s\\| with order times \\|parameter\\| along every branch, by order and parameter.

    The second list holds the intervals in which a crossing, or a mode that may cross, stays uncertain.
    """
    family = cache(family)
    out, lost, lines = list[Crossing](), list[Interval](), _Lines(family, found)
    for order in orders:
        some, left_over = _crossed(lines, order, TIMES_AGAIN)
        out, lost = out + some, lost + left_over
    return sorted(out, key=lambda c: (c.order, abs(c.at), abs(c.modes.values[0]))), sorted(set(lost))


@dataclass(frozen=True, eq=False)
class _Lines:
    """All branches."""

    family: Family
    found: Followed

    @cached_property
    def every(self) -> list[_Line]:
        """One for each branch."""
        return [_Line(self.family, self.found, branch, self._slopes) for branch in self.found.branches]

    @cached_property
    def _slopes(self) -> Callable[[int, int], NDArray[np.float64]]:
        """Derivatives of \\|s\\| (modes,) at a node, as the pencil changes on the way to another node."""

        @cache
        def slopes(i: int, j: int) -> NDArray[np.float64]:
            here, there = self.found.nodes[i], self.found.nodes[j]
            assert there.pencil is not None
            s = here.modes.values
            return np.real(s.conj() * rates(here.modes, there.pencil)) / (np.abs(s) * (there.at - here.at))

        return slopes

    @cached_property
    def closer(self) -> Callable[[int], _Lines]:
        """The branches between a node and the next one, followed more closely."""

        @cache
        def between(i: int) -> _Lines:
            ends, hints = self.found.nodes[i : i + 2], np.abs(self.found.nodes[i].modes.values).tolist()
            return _Lines(self.family, follow(self.family, [n.at for n in ends], self.found.region, hints))

        return between


def _crossed(lines: _Lines, order: float, again: int) -> tuple[list[Crossing], list[Interval]]:
    """Crossings with one order line and what is left open; steps with an open interval are followed more closely."""
    found = lines.found
    every = [(b, one) for b, line in enumerate(lines.every) for one in line.crossings(order)]
    out = [replace(one, branch=b) for b, one in every if isinstance(one, Crossing)]
    out = [one for one in out if found.region.holds(one.modes.values[0])]
    lost = [one for _, one in every if not isinstance(one, Crossing)]
    at, left_over = [node.at for node in found.nodes], []
    steps = {bisect_right(at, 0.5 * (a + b)) - 1 for a, b in lost}
    for i in sorted(steps.union(i for i in found.breaks if _break_is_open(found, i, order))):
        if not again or jumps(at[i], at[i + 1]):
            left_over.append((at[i], at[i + 1]))
            continue
        closer = lines.closer(i)
        inner, open_ones = _crossed(closer, order, again - 1)
        out = [one for one in out if not at[i] < one.at < at[i + 1]]
        out += [replace(one, branch=_named(closer.found, one.branch, found, i)) for one in inner]
        left_over += open_ones
    return out, left_over


def _break_is_open(found: Followed, i: int, order: float) -> bool:
    """Whether modes that end and begin between two nodes may cross a line: not at a jump where all lie on one side."""
    places = [(found.nodes[j].at, found.nodes[j].modes.values[k]) for j, k in found.breaks[i]]
    sides = {bool(abs(s) < order * abs(at)) for at, s in places}
    return len(sides) > 1 or not jumps(found.nodes[i].at, found.nodes[i + 1].at)


def _named(closer: Followed, branch: int, found: Followed, i: int) -> int:
    """The branch that one of those between nodes i and i + 1 belongs to."""
    at, s = closer.values(closer.branches[branch])
    place, value = (i, s[0]) if at[0] == found.nodes[i].at else (i + 1, s[-1])
    there = [(abs(found.nodes[j].modes.values[k] - value), b)
             for b, one in enumerate(found.branches) for j, k in one.places if j == place]  # fmt: skip
    return min(there)[1] if there else 0


@dataclass(frozen=True, eq=False)
class _Place:
    """A branch's mode where it is known."""

    at: float
    pencil: Pencil
    mode: Modes

    @property
    def size(self) -> float:
        """\\|s\\| [rad/s]."""
        return float(abs(self.mode.values[0]))

    def rate(self, other: _Place) -> complex:
        """Derivative of s here, as the pencil changes on the way to another place."""
        return complex(rates(self.mode, other.pencil)[0] / (other.at - self.at))

    def slope(self, other: _Place) -> float:
        """Derivative of \\|s\\|, the same way."""
        s = self.mode.values[0]
        return float((s.conjugate() * self.rate(other)).real / abs(s))


@dataclass(frozen=True, eq=False)
class _Line:
    """A branch that can be asked between its nodes."""

    family: Family
    found: Followed
    branch: Branch
    slopes: Callable[[int, int], NDArray[np.float64]]

    def crossings(self, order: float) -> list[Crossing | Interval]:
        """Crossings with an order line, or the interval where one is not certain."""
        count, out = self._table.shape[1], list[Crossing | Interval]()
        for k in self._open(order):
            a, b = self._known(k), self._known(k + 1)
            around = (self._known(k - 1) if k else b, self._known(k + 2) if k + 2 < count else a)
            for i, place, others in ((k, a, (around[0], b)), (k + 1, b, (a, around[1]))):
                self._slopes.update(((place, other), self._table[2 + j, i]) for j, other in enumerate(others))
            halves = [a, self._place(0.0), b] if a.at < 0 < b.at else [a, b]
            for one, two in pairwise(halves):
                out += [(a.at, b.at)] if one is None or two is None else self._within(one, two, order, around)
        return out

    def _open(self, order: float) -> list[int]:
        """Places between which and the next one a crossing is not excluded by what `_within` asks first."""
        at, size, back, ahead = self._table
        width, mean = np.diff(at), np.diff(size) / np.diff(at)
        bend = np.max([np.abs(slope - mean) for slope in (back[:-1], back[1:], ahead[:-1], ahead[1:])], axis=0)
        gaps = size - order * np.abs(at)
        crosses, turn = (gaps[:-1] > 0) != (gaps[1:] > 0), order * np.sign(at[:-1] + at[1:])
        clear = (bend < np.abs(mean - turn)) | (bend * width < np.minimum(np.abs(gaps[:-1]), np.abs(gaps[1:])))
        return np.flatnonzero(crosses | ~clear | (at[:-1] < 0) & (at[1:] > 0)).tolist()

    @cached_property
    def _table(self) -> NDArray[np.float64]:
        """Parameter, \\|s\\| and its derivatives towards the place before and the next one (4, places)."""
        nodes = [(i, k) for i, k in self.branch.places if self.found.nodes[i].pencil is not None]
        at, s = self.found.values(Branch(tuple(nodes), "", ""))
        if len(nodes) < 2:
            return np.stack([at, np.abs(s), 0.0 * at, 0.0 * at])
        back = np.array([self.slopes(i, i - 1)[k] for i, k in nodes[1:]])
        ahead = np.array([self.slopes(i, i + 1)[k] for i, k in nodes[:-1]])
        return np.array([at, np.abs(s), [*ahead[:1], *back], [*ahead, *back[-1:]]])

    def _within(self, a: _Place, b: _Place, order: float, around: tuple[_Place, _Place]) -> list[Crossing | Interval]:
        """Crossings between two places.

        The slopes at both, towards each other and towards the places around them, tell how far the mode may deviate
        from the straight line between; an interval in which that leaves a crossing open is halved.
        """
        width, turn = b.at - a.at, order * float(np.sign(a.at + b.at))
        mean = (b.size - a.size) / width
        bend = max(abs(self._slope(p, q) - mean) for p, q in ((a, b), (b, a), (a, around[0]), (b, around[1])))
        gaps = a.size - order * abs(a.at), b.size - order * abs(b.at)
        crosses = (gaps[0] > 0) != (gaps[1] > 0)
        clear = bend < abs(mean - turn) or (not crosses and bend * width < min(map(abs, gaps)))
        if clear or jumps(a.at, b.at):
            return [self._root(a, b, order) or (a.at, b.at)] if crosses else []
        middle = self._place(0.5 * (a.at + b.at)) if width > LEAST_WIDTH * max(abs(a.at), abs(b.at)) else None
        if middle is None:
            return [(a.at, b.at)]
        return self._within(a, middle, order, (b, b)) + self._within(middle, b, order, (a, a))

    @cached_property
    def _known(self) -> Callable[[int], _Place]:
        every = [(n, n.pencil, k) for n, k in self._nodes if n.pencil is not None]

        @cache
        def known(number: int) -> _Place:
            node, pencil, k = every[number]
            return _Place(node.at, pencil, node.modes.take([k]))

        return known

    @cached_property
    def _slopes(self) -> dict[tuple[_Place, _Place], float]:
        return {}

    def _slope(self, place: _Place, other: _Place) -> float:
        if (place, other) not in self._slopes:
            self._slopes[place, other] = place.slope(other)
        return self._slopes[place, other]

    @cached_property
    def _place(self) -> Callable[[float], _Place | None]:
        @cache
        def place(x: float) -> _Place | None:
            there = self.at(x)
            return None if there is None else _Place(x, *there)

        return place

    def at(self, x: float) -> tuple[Pencil, Modes] | None:
        """The branch's mode at a value between its nodes; None where it is not certain.

        Where it is not certain from the nearest place at which the mode is known, places in between are added.
        """
        pencil = self.family(x)
        if pencil is None:
            return None
        for _ in range(HALVINGS):
            node, k = min(self.places, key=lambda place: abs(place[0].at - x))
            mode = _continued(node, k, pencil)
            if mode is not None:
                return pencil, mode
            between = self._between(node, k, x)
            if between is None:
                return None
            self.places.append(between)
        return None

    @cached_property
    def _nodes(self) -> list[tuple[Node, int]]:
        """The branch's nodes, and its number among their modes."""
        return [(self.found.nodes[i], k) for i, k in self.branch.places]

    @cached_property
    def places(self) -> list[tuple[Node, int]]:
        """Places at which the mode is known."""
        return list(self._nodes)

    def _between(self, node: Node, k: int, x: float) -> tuple[Node, int] | None:
        """The mode half-way to x, or nearer to the node where it is not certain there."""
        assert node.pencil is not None
        for _ in range(HALVINGS):
            x = 0.5 * (node.at + x)
            pencil = self.family(x)
            if pencil is None:
                return None
            modes = refined(pencil, node.modes)
            alike = overlap(node.pencil, node.modes.take([k]), pencil, modes)[0]
            if alike.size and alike.max() > CERTAIN:
                return Node(x, pencil, modes), int(alike.argmax())
        return None

    def _root(self, a: _Place, b: _Place, order: float) -> Crossing | None:
        """The root between two places; None where the mode is not certain on the way.

        The inverse of the gap is interpolated through the places with their derivatives, at the end as close to the
        root as ends of the interval are to each other, squared: there the mode is what its derivative makes of it.
        Where the pencil jumps, a natural frequency may jump over the line: the side that is nearer to it counts.
        """

        def gap(place: _Place) -> float:
            return place.size - order * abs(place.at)

        turn, upward = order * float(np.sign(a.at + b.at)), (gap(b) > gap(a)) == (a.at + b.at > 0)
        low, high, places, close = a, b, [a, b], LAST_STEP * (b.at - a.at) * max(abs(a.at), abs(b.at))
        for _ in range(STEPS):
            rates = [self._derivative(one, [other for other in places if other is not one]) - turn for one in places]
            x = _zero([gap(one) for one in places], [one.at for one in places], rates)
            here = places[-1]
            if jumps(low.at, high.at):
                side = min(low, high, key=lambda one: abs(gap(one)))
                return Crossing(0, order, side.at, upward, side.pencil, side.mode)
            if len(places) > 2 and (x - here.at) ** 2 < close:
                s = here.mode.values + (x - here.at) * here.rate(high if here is low else low)
                return Crossing(0, order, x, upward, here.pencil, replace(here.mode, values=s))
            new = self._place(x if low.at < x < high.at else 0.5 * (low.at + high.at))
            if new is None:
                return None
            left = (gap(new) > 0) == (gap(low) > 0)
            places = [low, high, new]
            low, high = (new, high) if left else (low, new)
        return None

    def _derivative(self, place: _Place, others: list[_Place]) -> float:
        """Derivative of \\|s\\| at a place out of the slopes towards one or two others."""
        if len(others) == 1:
            return self._slope(place, others[0])
        (d, slope), (e, other) = ((one.at - place.at, self._slope(place, one)) for one in others)
        return slope if e == d else (e * slope - d * other) / (e - d)


def rates(modes: Modes, pencil: Pencil) -> NDArray[np.complex128]:
    """First change (k,) of the eigenvalues of modes (k) towards another pencil."""
    change = pencil.times_J(modes.right) - pencil.times_S(modes.right) * modes.values
    return np.asarray(np.sum(modes.left.conj() * change, axis=0))


def _zero(values: list[float], at: list[float], rates: list[float]) -> float:
    """Root of a monotonous function by Hermite's interpolation of its inverse; NaN where two values are the same."""
    z = [one for one in values for _ in range(2)]
    x, weight = at[0], -z[0]
    try:
        slant = [(b - a) / (w - v) for (a, b), (v, w) in zip(pairwise(at), pairwise(values), strict=True)]
        column = [one for pair in zip([1 / rate for rate in rates], [*slant, 0.0], strict=True) for one in pair][:-1]
        for k in range(1, len(z)):
            x, weight = x + weight * column[0], -weight * z[k]
            column = [(q - p) / (z[i + k + 1] - z[i]) for i, (p, q) in enumerate(pairwise(column))]
    except ZeroDivisionError:
        return nan
    return x


def _continued(node: Node, k: int, pencil: Pencil) -> Modes | None:
    """Mode k of a node, continued into another pencil; None where it is not certain."""
    assert node.pencil is not None
    mode = node.modes.take([k])
    if pencil.size <= SMALL:
        one, _ = tracked(pencil, predicted(pencil, mode))
        if len(one.values) and overlap(node.pencil, mode, pencil, one).item() > CERTAIN:
            return one
        return _alike(node.pencil, mode, pencil, everything(pencil))
    guess = predicted(pencil, node.modes)
    first = int(overlap(node.pencil, mode, pencil, guess)[0].argmax())
    near = np.abs(guess.values - guess.values[first]) < NEAR * abs(guess.values[first])
    group = settled(pencil, guess.take(near))
    return _alike(node.pencil, mode, pencil, group) if len(group.values) else None


def _alike(before: Pencil, mode: Modes, pencil: Pencil, group: Modes) -> Modes | None:
    """The mode among others that one of a neighbouring pencil becomes; None where it is not certain."""
    alike = overlap(before, mode, pencil, group)[0]
    best = int(alike.argmax())
    double = np.abs(group.values - group.values[best]) < INDISTINCT * abs(group.values[best])
    return group.take([best]) if alike[double].sum() > CERTAIN else None


MOST_HALVINGS = 8
"""Halvings of a step in which damping may be lost and come back."""
NEARBY = 1e-5
"""Small step over that between two values: of a derivative, and behind an onset where growth may not oscillate."""


@dataclass(frozen=True, eq=False)
class ModesAt:
    """A value of the parameter: least damping ratio and its frequency [rad/s], the modes' ratios (k,) and their slopes.

    The least is (-1, 0) of growth without oscillation; `slopes` are derivatives (k,) on the side of another value.
    """

    at: float
    least: tuple[float, float]
    zeta: NDArray[np.float64]
    slopes: Callable[[float], NDArray[np.float64]]


def first_loss(
    place: Callable[[float], ModesAt],
    known: Sequence[ModesAt],
    least: Callable[[float], tuple[float, float]] | None = None,
    **tolerances: float,
) -> tuple[tuple[float, float] | None, bool]:
    """Lowest value at which a mode grows, and its frequency [rad/s], between known ascending places; None without one.

    And whether each step up to there was decided: not where a tangent is unknown, or where halving found no end.
    `least` is that of a place where no more is asked, `tolerances` are those of Brent's method, xtol and rtol.
    """
    if _grows(known[0]):
        return (known[0].at, known[0].least[1]), True
    decided, least_at = True, least or (lambda v: place(v).least)
    for a, b in pairwise(known):
        end, sure = (b, True) if _grows(b) else _dip(place, a, b, MOST_HALVINGS)
        decided &= sure
        if end is not None:
            onset = falls_below_zero(lambda v: min(least_at(v)[0], 1.0) + DAMPED, a.at, end.at, **tolerances)
            behind = min(onset + NEARBY * (end.at - a.at), end.at)
            diverges = end.least[1] == 0 and least_at(behind)[1] == 0
            return (onset, 0.0 if diverges else least_at(onset)[1]), decided
    return None, decided


def _grows(place: ModesAt) -> bool:
    return place.least[0] < -DAMPED


def _dip(place: Callable[[float], ModesAt], a: ModesAt, b: ModesAt, halvings: int) -> tuple[ModesAt | None, bool]:
    """A value between two at which a mode grows, None where no two tangents lead below zero; whether it is decided."""
    ahead, back = (
        (one.zeta + (other.at - one.at) * one.slopes(other.at)).min(initial=np.inf) for one, other in ((a, b), (b, a))
    )
    if ahead >= -DAMPED or back >= -DAMPED:
        return None, True
    if not halvings or np.isnan(ahead + back):
        return None, False
    middle = place(0.5 * (a.at + b.at))
    if _grows(middle):
        return middle, True
    first, sure = _dip(place, a, middle, halvings - 1)
    if first is not None:
        return first, sure
    second, too = _dip(place, middle, b, halvings - 1)
    return second, sure and too
