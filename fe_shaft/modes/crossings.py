r"""Crossings of the modes with order lines, in either direction, each solved with the pencil at the crossing itself.

.. math:: |\lambda(\Omega)| = n\,|\Omega|

Source: Friswell et al. (2010), section 6.8.

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from fe_shaft.modes.follower import CERTAIN, INDISTINCT, Branch, Family, Followed, Node, overlap
from fe_shaft.modes.pencil import Modes, Pencil
from fe_shaft.modes.subspace import NEAR, predicted, refined, settled

ON_LINE = 1e-9
"""Relative accuracy of a crossing with an order line."""
HALVINGS = 16
"""Halvings of the distance to a place at which a mode is known, before it counts as not certain."""

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
    out: list[Crossing] = []
    lost = found.uncertain
    for number, branch in enumerate(found.branches):
        line = _Line(family, found, branch)
        for order in orders:
            for one in line.crossings(order):
                if not isinstance(one, Crossing):
                    lost.append(one)
                elif found.region.holds(one.modes.values[0]):
                    out.append(replace(one, branch=number))
    return sorted(out, key=lambda c: (c.order, abs(c.at), abs(c.modes.values[0]))), sorted(lost)


@dataclass(frozen=True, eq=False)
class _Line:
    """A branch that can be asked between its nodes."""

    family: Family
    found: Followed
    branch: Branch

    def crossings(self, order: float) -> list[Crossing | Interval]:
        """Crossings with an order line, or the interval where one is not certain."""
        at, s = self.found.values(self.branch)
        points = {float(x): float(abs(v) - order * abs(x)) for x, v in zip(at, s, strict=True)}
        if at[0] < 0 < at[-1]:
            points.setdefault(0.0, 1.0)
        self._look_for_dips(points, order)
        steps = [(a, b) for a, b in pairwise(sorted(points)) if (points[a] > 0) != (points[b] > 0)]
        return [self._root(points, a, b, order) or (a, b) for a, b in steps]

    def _look_for_dips(self, points: dict[float, float], order: float) -> None:
        """Add values where a parabola through three of them comes near the line between them."""
        for _ in range(6):
            xs = sorted(points)
            new = []
            for k in range(1, len(xs) - 1):
                (xa, xb, xc), (ga, gb, gc) = xs[k - 1 : k + 2], (points[x] for x in xs[k - 1 : k + 2])
                if not (ga > 0) == (gb > 0) == (gc > 0) or abs(gb) > min(abs(ga), abs(gc)):
                    continue
                first, second, width = (gb - ga) / (xb - xa), (gc - gb) / (xc - xb), xc - xa
                bend, slope = (second - first) / width, (first * (xc - xb) + second * (xb - xa)) / width
                vertex = -slope / (2 * bend) if bend else 0.0
                lowest = gb + 0.5 * slope * vertex
                if (lowest > 0) != (gb > 0) or abs(lowest) < 0.3 * abs(gb):
                    x = xb + vertex
                    if min(abs(x - other) for other in xs) > 1e-3 * (xc - xa):
                        new.append(x)
            if not new:
                return
            for x in new:
                there = self.at(x)
                if there is not None:
                    points[x] = float(abs(there[1].values[0]) - order * abs(x))

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
    def places(self) -> list[tuple[Node, int]]:
        """Where the mode is known: nodes, and its number among their modes."""
        return [(self.found.nodes[i], k) for i, k in self.branch.places]

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

    def _root(self, points: dict[float, float], a: float, b: float, order: float) -> Crossing | None:
        """Root between two values by Brent's method; None where the mode is not certain on the way."""

        def gap(x: float) -> float:
            if x in points:
                return points[x]
            there = self.at(x)
            return float("nan") if there is None else float(abs(there[1].values[0]) - order * abs(x))

        try:
            x = brentq(gap, a, b, xtol=ON_LINE * max(abs(a), abs(b)), rtol=ON_LINE)
        except ValueError:
            return None
        there = self.at(x)
        if there is None or abs(abs(there[1].values[0]) - order * abs(x)) > 100 * ON_LINE * order * abs(x):
            return None
        return Crossing(0, order, x, (points[b] > points[a]) == (a + b > 0), *there)


def _continued(node: Node, k: int, pencil: Pencil) -> Modes | None:
    """What mode k of a node becomes in another pencil; None where it is not certain."""
    assert node.pencil is not None
    mode, guess = node.modes.take([k]), predicted(pencil, node.modes)
    first = int(overlap(node.pencil, mode, pencil, guess)[0].argmax())
    near = np.abs(guess.values - guess.values[first]) < NEAR * abs(guess.values[first])
    group = settled(pencil, guess.take(near))
    if not len(group.values):
        return None
    alike = overlap(node.pencil, mode, pencil, group)[0]
    best = int(alike.argmax())
    double = np.abs(group.values - group.values[best]) < INDISTINCT * abs(group.values[best])
    return group.take([best]) if alike[double].sum() > CERTAIN else None
