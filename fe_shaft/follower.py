r"""Modes over a parameter, followed by their vectors from value to value, and their crossings with order lines.

A mode j at one value and a mode k at the next are one where their left and right vectors overlap,

.. math:: P_{jk} = |(y_j^H S_B v_k)(y_k^H S_A v_j)| > 0.7

and steps are halved until that holds for every mode of the region. A branch so begins and ends at the ends of the
range, at a border of the region or where there is no pencil (a film that does not carry); it never jumps. A crossing
of :math:`|\lambda|` with an order line is a root that is solved with the pencil at the crossing itself.

Source: Friswell et al. (2010), section 6.8; the overlap is the modal assurance of Allemang with left vectors.

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from fe_shaft.spectrum import NEAR, Modes, Pencil, Region, joined, modes_in, nothing, predicted, refined, settled

CERTAIN = 0.7
"""Overlap of modes at neighbouring values above which they are one."""
INDISTINCT = 1e-7
"""Relative distance of eigenvalues whose vectors rounding mixes: they are turned into those of the neighbour."""
FINEST = 2e-7
"""Shortest step over the range: a mode that is not certain there ends."""
CARRIED = 1e-3
"""Step over the range after which the end of the values that have a pencil is known well enough."""
SHORTEST = 1e-7
"""Shortest step between two pencils in a subspace."""
PARTNER = 0.3
"""Overlap up to which a mode has no partner at the neighbouring value yet."""
COARSEST = 10
"""Fewest steps of the range."""
ON_LINE = 1e-10
"""Relative accuracy of a crossing with an order line."""

Family = Callable[[float], Pencil | None]


@dataclass(frozen=True, eq=False)
class Node:
    """A value of the parameter with its pencil and modes; None without a pencil."""

    at: float
    pencil: Pencil | None
    modes: Modes


@dataclass(frozen=True, eq=False)
class Branch:
    """One mode over the nodes: `places` are (node, mode) in turn; why it begins and ends.

    A branch that crosses a border of the region has one place beyond it.
    """

    places: tuple[tuple[int, int], ...]
    begins: str
    ends: str


@dataclass(frozen=True, eq=False)
class Crossing:
    """A mode on an order line: the parameter there, whether |s| leaves the line upwards, the mode with its vectors."""

    branch: int
    order: float
    at: float
    upward: bool
    pencil: Pencil
    modes: Modes


@dataclass(frozen=True, eq=False)
class Followed:
    """Modes in a region over a parameter."""

    region: Region
    nodes: tuple[Node, ...]
    branches: tuple[Branch, ...]

    def values(self, branch: Branch) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
        """Parameter and eigenvalues [rad/s] along a branch, the places beyond borders included."""
        at = np.array([self.nodes[i].at for i, _ in branch.places])
        return at, np.array([self.nodes[i].modes.values[k] for i, k in branch.places])

    def missing(self, at: float) -> float:
        """Modes of the region that are not found at a value; NaN where that is not known."""
        return next((n.modes.missing for n in self.nodes if n.at == at), float("nan"))


def follow(family: Family, values: Sequence[float], region: Region, hints: Sequence[float] = ()) -> Followed:
    """Every mode of the region over the values (n,), ascending, of a parameter.

    Parameters
    ----------
    family : callable
        Pencil at a value; None where there is none.
    values : sequence of float
        Values that become nodes; more are added between them as needed.
    region : Region
    hints : sequence of float
        Frequencies [rad/s] around which modes are expected.
    """
    values = filled(values)
    width = (values[-1] - values[0]) or 1.0

    def node(at: float, seed: Modes | None) -> Node:
        pencil = family(at)
        if pencil is None:
            return Node(at, None, nothing(0))
        fits = seed is not None and len(seed.values) and seed.right.shape[0] == pencil.size
        return Node(at, pencil, modes_in(pencil, region, hints, seed if fits else None))

    ahead, nodes, links = values[::-1], [node(values[0], None)], []
    waiting: list[Node] = []
    while waiting or len(ahead) > 1:
        if not waiting:
            ahead = ahead[:-1]
            waiting.append(node(ahead[-1], nodes[-1].modes))
        here, there = nodes[-1], waiting[-1]
        step = there.at - here.at
        if (here.pencil is None) != (there.pencil is None):
            if step > CARRIED * width:
                waiting.append(node(0.5 * (here.at + there.at), (here if there.pencil is None else there).modes))
                continue
            one: dict[int, int] = {}
        elif here.pencil is None:
            one = {}
        else:
            here, there, one = _linked(here, there, region, first=len(nodes) == 1)
            certain = _all_linked(here, there, one, region)
            if not certain and step > FINEST * width:
                waiting[-1] = there
                nodes[-1] = here
                waiting.append(node(0.5 * (here.at + there.at), here.modes))
                continue
        nodes[-1] = here
        nodes.append(there)
        links.append(one)
        waiting.pop()
    return Followed(region, tuple(nodes), _branches(nodes, links, region))


def filled(values: Sequence[float]) -> list[float]:
    """The values (n,) with more between those that are further apart than a tenth of the range."""
    at = [float(v) for v in values]
    out = at[:1]
    for a, b in pairwise(at):
        count = int(np.ceil((b - a) / (at[-1] - at[0]) * COARSEST - 1e-9))
        out += [a + (b - a) * k / count for k in range(1, count)] + [b]
    return out


def overlap(a: Pencil, of_a: Modes, b: Pencil, of_b: Modes) -> NDArray[np.float64]:
    """P (modes of a, modes of b)."""
    there = of_a.left.conj().T @ b.times_S(of_b.right)
    back = of_b.left.conj().T @ a.times_S(of_a.right)
    return np.asarray(np.abs(there * back.T))


def _linked(here: Node, there: Node, region: Region, first: bool) -> tuple[Node, Node, dict[int, int]]:
    """Both nodes, with modes outside the region that those of the other one become, and which mode goes on as which."""
    assert here.pencil is not None and there.pencil is not None
    here = _with_partners(here, there, region)
    there = _with_partners(there, here, region)
    there = _turned(there, here)
    if first:
        here = _turned(here, there)
    near = np.flatnonzero(region.wider.holds(here.modes.values))
    assert there.pencil is not None
    ahead = carried(here.modes.take(near), there.pencil)
    if ahead is None or not len(near) or not len(there.modes.values):
        return here, there, {}
    P = overlap(there.pencil, ahead, there.pencil, there.modes)
    best = P.argmax(axis=1)
    pairs = [(j, int(k)) for j, k in enumerate(best) if P[j, k] > CERTAIN and P[:, k].argmax() == j]
    return here, there, {int(near[j]): k for j, k in pairs}


def carried(modes: Modes, pencil: Pencil) -> Modes | None:
    """What the modes of a neighbour become in their own subspace, in their order; None where that is not certain."""
    if not len(modes.values):
        return modes
    J, S = modes.left.conj().T @ pencil.times_J(modes.right), modes.left.conj().T @ pencil.times_S(modes.right)
    try:
        there = np.linalg.solve(S, J)
        found = through(np.diag(modes.values), there, np.arange(len(S)))
        if found is None:
            return None
        values, turn = found
        return Modes(values, modes.right @ turn, modes.left @ np.linalg.inv(S @ turn).conj().T)
    except np.linalg.LinAlgError:
        return None


def through(
    first: NDArray[np.complex128], last: NDArray[np.complex128], chosen: NDArray[np.intp]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]] | None:
    """Eigenvalues and vectors of a small matrix, as those of another one become them; None where that is not certain.

    The first matrix is changed into the last one in as many steps as it takes: modes that exchange their vectors over a
    short way, as the two planes of a rotor do near rest, need no more nodes. `chosen` are those of
    ``numpy.linalg.eig(first)`` that have to be certain.
    """
    values, turn = np.linalg.eig(first)
    back, now, step = np.linalg.inv(turn), 0.0, 1.0
    while now < 1:
        step = min(step, 1 - now)
        new, vectors = np.linalg.eig(first * (1 - now - step) + last * (now + step))
        inverse = np.linalg.inv(vectors)
        P = np.abs((back @ vectors) * (inverse @ turn).T)
        best = _assigned(P)
        alike = np.abs(new[best][:, None] - new) < INDISTINCT * np.abs(new)
        if np.sum(P * alike, axis=1)[chosen].min() > CERTAIN:
            values, turn, back = new[best], vectors[:, best], inverse[best]
            now, step = now + step, 2 * step
        elif step < SHORTEST:
            return None
        else:
            step /= 2
    return values, turn


def _assigned(P: NDArray[np.float64]) -> NDArray[np.intp]:
    """Column of each row: the largest one where they are different, else those with the largest sum."""
    best = P.argmax(axis=1)
    if len(set(best.tolist())) == len(best):
        return best
    from scipy.optimize import linear_sum_assignment  # slow to import, and no run-up needs it

    return np.asarray(linear_sum_assignment(-P)[1])


def _all_linked(here: Node, there: Node, one: dict[int, int], region: Region) -> bool:
    inside = set(np.flatnonzero(region.holds(here.modes.values)).tolist())
    after = set(np.flatnonzero(region.holds(there.modes.values)).tolist())
    return inside <= set(one) and after <= set(one.values())


def _with_partners(node: Node, other: Node, region: Region) -> Node:
    """The node with what the modes of the other one become here, if that is not among its modes yet."""
    assert node.pencil is not None and other.pencil is not None
    P = overlap(other.pencil, other.modes, node.pencil, node.modes)
    alone = region.holds(other.modes.values) & ((P.max(axis=1) if P.shape[1] else np.zeros(len(P))) < PARTNER)
    if not alone.any():
        return node
    more = refined(node.pencil, other.modes.take(alone))
    missing = node.modes.missing
    return replace(node, modes=replace(joined(node.pencil, node.modes, more), missing=missing))


def _turned(node: Node, other: Node) -> Node:
    """The node with the vectors of indistinct eigenvalues turned into those of the other one."""
    assert node.pencil is not None and other.pencil is not None
    s, right, left = node.modes.values, node.modes.right.copy(), node.modes.left.copy()
    free = list(range(len(s)))
    while free:
        group = [k for k in free if abs(s[k] - s[free[0]]) < INDISTINCT * abs(s[free[0]])]
        free = [k for k in free if k not in group]
        if len(group) < 2:
            continue
        there = other.modes.left.conj().T @ node.pencil.times_S(right[:, group])
        back = left[:, group].conj().T @ other.pencil.times_S(other.modes.right)
        share = np.abs(np.sum(there * back.T, axis=1))
        chosen = np.sort(np.argsort(share)[::-1][: len(group)])
        if len(chosen) < len(group) or share[chosen].min() < CERTAIN:
            continue
        turn = np.linalg.inv(there[chosen])
        right[:, group], left[:, group] = right[:, group] @ turn, left[:, group] @ np.linalg.inv(turn).conj().T
    return replace(node, modes=replace(node.modes, right=right, left=left))


def _branches(nodes: list[Node], links: list[dict[int, int]], region: Region) -> tuple[Branch, ...]:
    """Branches by the node at which they begin, then by modulus."""
    inside = [region.holds(n.modes.values) if len(n.modes.values) else np.zeros(0, bool) for n in nodes]
    back = [{}, *({k: j for j, k in one.items()} for one in links)]
    out = []
    for i in range(len(nodes)):
        for k in np.flatnonzero(inside[i]).tolist():
            before = back[i].get(k)
            if before is not None and inside[i - 1][before]:
                continue
            places, begins = [(i, k)], "first value"
            if i:
                begins = _why(nodes[i - 1], before, region)
                places = ([(i - 1, before)] if before is not None else []) + places
            ends = "last value"
            for step in range(i, len(links)):
                onward = links[step].get(places[-1][1])
                if onward is None or not inside[step + 1][onward]:
                    ends = _why(nodes[step + 1], onward, region)
                    places += [] if onward is None else [(step + 1, onward)]
                    break
                places.append((step + 1, onward))
            out.append(Branch(tuple(places), begins, ends))
    return tuple(out)


def _why(node: Node, mode: int | None, region: Region) -> str:
    if node.pencil is None:
        return "not carried"
    return "not certain" if mode is None else region.border(complex(node.modes.values[mode]))


def crossings(family: Family, found: Followed, orders: Sequence[float] = (1.0, 2.0, 3.0)) -> list[Crossing]:
    """Crossings of \\|s\\| with order times \\|parameter\\| along every branch, by order and parameter."""
    out = []
    for number, branch in enumerate(found.branches):
        line = _Line(family, found, branch)
        for order in orders:
            out += [replace(c, branch=number) for c in line.crossings(order) if found.region.holds(c.modes.values[0])]
    return sorted(out, key=lambda c: (c.order, abs(c.at), abs(c.modes.values[0])))


@dataclass(frozen=True, eq=False)
class _Line:
    """A branch that can be asked between its nodes."""

    family: Family
    found: Followed
    branch: Branch

    def crossings(self, order: float) -> list[Crossing]:
        at, s = self.found.values(self.branch)
        points = {float(x): float(abs(v) - order * abs(x)) for x, v in zip(at, s, strict=True)}
        if at[0] < 0 < at[-1]:
            points.setdefault(0.0, 1.0)
        self._look_for_dips(points, order)
        out = []
        for a, b in pairwise(sorted(points)):
            if (points[a] > 0) != (points[b] > 0) and points[a] != points[b]:
                crossing = self._root(points, a, b, order)
                out += [] if crossing is None else [crossing]
        return out

    def _look_for_dips(self, points: dict[float, float], order: float) -> None:
        """Add values where a parabola through three of them comes near the line between them."""
        for _ in range(6):
            xs = sorted(points)
            new = []
            for k in range(1, len(xs) - 1):
                (xa, xb, xc), (ga, gb, gc) = xs[k - 1 : k + 2], (points[x] for x in xs[k - 1 : k + 2])
                if not (ga > 0) == (gb > 0) == (gc > 0) or abs(gb) > min(abs(ga), abs(gc)):
                    continue
                curve = np.polyfit([xa - xb, 0.0, xc - xb], [ga, gb, gc], 2)
                vertex = -curve[1] / (2 * curve[0]) if curve[0] else 0.0
                lowest = np.polyval(curve, vertex)
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
