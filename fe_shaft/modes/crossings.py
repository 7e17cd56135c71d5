r"""Crossings of the modes with order lines, in either direction, each solved with the pencil at the crossing itself.

.. math:: |\lambda(\Omega)| = n\,|\Omega|

Source: Friswell et al. (2010), section 6.8.

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.optimize import brentq

from fe_shaft.modes.follower import CERTAIN, Branch, Family, Followed, overlap
from fe_shaft.modes.pencil import Modes, Pencil
from fe_shaft.modes.subspace import NEAR, predicted, settled

ON_LINE = 1e-9
"""Relative accuracy of a crossing with an order line."""

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
        """The branch's mode at a value between its nodes; None where it is not certain."""
        pencil = self.family(x)
        if pencil is None:
            return None
        places = sorted(self.branch.places, key=lambda p: abs(self.found.nodes[p[0]].at - x))[:2]
        for i, k in places:
            node = self.found.nodes[i]
            assert node.pencil is not None
            guess = predicted(pencil, node.modes)
            alike = overlap(node.pencil, node.modes.take([k]), pencil, guess)[0]
            first = int(alike.argmax())
            near = np.abs(guess.values - guess.values[first]) < NEAR * abs(guess.values[first])
            group = settled(pencil, guess.take(near))
            if not len(group.values):
                continue
            alike = overlap(node.pencil, node.modes.take([k]), pencil, group)[0]
            if alike.max() > 0.5 * CERTAIN:
                return pencil, group.take([int(alike.argmax())])
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
        return None if there is None else Crossing(0, order, x, (points[b] > points[a]) == (a + b > 0), *there)
