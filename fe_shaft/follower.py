r"""Modes over a parameter, followed by their vectors from value to value.

A mode j at one value and a mode k at the next are one where their left and right vectors overlap,

.. math:: P_{jk} = |(y_j^H S_B v_k)(y_k^H S_A v_j)| > 0.7

and steps are halved until that holds for every mode of the region. A branch so begins and ends at the ends of the
range, at a border of the region or where there is no pencil (a film that does not carry); it never jumps.

The pencil may jump, as where a foil's one-sided strip meets its bump. No step is shorter than `JUMP` of the value
there: modes that differ across it have no common branch.

Source: Friswell et al. (2010), section 6.8; the overlap is the modal assurance of Allemang with left vectors.

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe_shaft.pencil import Modes, Pencil, Region, nothing
from fe_shaft.spectrum import SMALL, counted, joined, modes_in, refined

CERTAIN = 0.7
"""Overlap of modes at neighbouring values above which they are one."""
INDISTINCT = 1e-7
"""Relative distance of eigenvalues whose vectors rounding mixes: they are turned into those of the neighbour."""
FINEST = 2e-7
"""Shortest step over the range: a mode that is not certain there ends."""
JUMP = 1e-11
"""Shortest step over the value itself, above its rounding: what changes across it jumps."""
CARRIED = 1e-3
"""Step over the range after which the end of the values that have a pencil is known well enough."""
SHORTEST = 1e-7
"""Shortest step between two pencils in a subspace."""
PARTNER = 0.3
"""Overlap up to which a mode has no partner at the neighbouring value yet."""
COARSEST = 10
"""Fewest steps of the range."""

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
class Followed:
    """Modes in a region over a parameter."""

    region: Region
    nodes: tuple[Node, ...]
    branches: tuple[Branch, ...]

    def values(self, branch: Branch) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
        """Parameter and eigenvalues [rad/s] along a branch, the places beyond borders included."""
        at = np.array([self.nodes[i].at for i, _ in branch.places])
        return at, np.array([self.nodes[i].modes.values[k] for i, k in branch.places])

    @cached_property
    def breaks(self) -> dict[int, list[tuple[int, int]]]:
        """Places at which modes begin or end because they are not certain, by the node before."""
        out: dict[int, list[tuple[int, int]]] = {}
        for branch in self.branches:
            (i, j), (n, k) = branch.places[0], branch.places[-1]
            for before, place, why in ((i - 1, (i, j), branch.begins), (n, (n, k), branch.ends)):
                if why == "not certain":
                    out.setdefault(before, []).append(place)
        return out

    @property
    def uncertain(self) -> list[tuple[float, float]]:
        """Intervals of the parameter at whose ends a mode could not be followed further."""
        return [(self.nodes[i].at, self.nodes[i + 1].at) for i in sorted(self.breaks)]


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

    ahead, nodes, links = values[::-1], [node(values[0], None)], list[dict[int, int]]()
    waiting: list[Node] = []
    while waiting or len(ahead) > 1:
        if not waiting:
            ahead = ahead[:-1]
            waiting.append(node(ahead[-1], nodes[-1].modes))
        here, there = nodes[-1], waiting[-1]
        step = there.at - here.at
        if (here.pencil is None) != (there.pencil is None):
            if step > CARRIED * width and not jumps(here.at, there.at):
                waiting.append(node(0.5 * (here.at + there.at), (here if there.pencil is None else there).modes))
                continue
            one: dict[int, int] = {}
        elif here.pencil is None:
            one = {}
        else:
            here, there, one = _linked(here, there, region, first=len(nodes) == 1)
            late = here.modes.values[len(nodes[-1].modes.values) :]
            if len(nodes) > 1 and nodes[-2].pencil is not None and region.holds(late).any():
                nodes[-2], here, links[-1] = _linked(nodes[-2], here, region, first=False)
            certain = _all_linked(here, there, one, region)
            if not certain and step > FINEST * width and not jumps(here.at, there.at):
                waiting[-1] = there
                nodes[-1] = here
                waiting.append(node(0.5 * (here.at + there.at), here.modes))
                continue
        nodes[-1] = here
        nodes.append(there)
        links.append(one)
        waiting.pop()
    return Followed(region, tuple(nodes), _branches(nodes, links, region))


def jumps(a: float, b: float) -> bool:
    """Whether what changes between two values jumps: they are too near to one another for a step between them."""
    return abs(b - a) <= JUMP * max(abs(a), abs(b))


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
    """Both nodes, with modes outside the region that those of the other one become, and how they continue."""
    assert here.pencil is not None and there.pencil is not None
    alike = _at_once(here, there, region) if here.pencil.size <= SMALL else None
    if alike is not None:
        return here, there, alike
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
    s = there.modes.values
    shared = P @ (np.abs(s - s[:, None]) < INDISTINCT * np.abs(s))  # with all that rounding may mix with a mode
    pairs = [(j, k) for j, k in zip(*_pairs(P), strict=True) if shared[j, k] > CERTAIN]
    pairs = [(j, k) for j, k in pairs if P[j, k] < CERTAIN or P[:, k].argmax() == j]
    return here, there, {int(near[j]): int(k) for j, k in pairs}


def _at_once(here: Node, there: Node, region: Region) -> dict[int, int] | None:
    """Continuations of modes whose overlap is certain as they are; None where one's is not, or two are indistinct.

    All modes of a small pencil are known: none that comes in over the border has to be looked for.
    """
    assert here.pencil is not None and there.pencil is not None
    near = np.flatnonzero(region.wider.holds(here.modes.values))
    if not near.size or _indistinct(here.modes.values) or _indistinct(there.modes.values):
        return None
    P = overlap(here.pencil, here.modes.take(near), there.pencil, there.modes)
    best = P.argmax(axis=1).tolist()
    inside = np.flatnonzero(region.holds(there.modes.values)).tolist()
    if P.max(axis=1).min() < CERTAIN or len(set(best)) < len(best) or not set(inside) <= set(best):
        return None
    return dict(zip(near.tolist(), best, strict=True))


def _indistinct(s: NDArray[np.complex128]) -> bool:
    """Whether rounding mixes the vectors of two eigenvalues."""
    return bool(((np.abs(s - s[:, None]) < INDISTINCT * np.abs(s)).sum(axis=0) > 1).any())


def carried(modes: Modes, pencil: Pencil) -> Modes | None:
    """Modes of a neighbour, continued within their subspace in their order; None where that is not certain."""
    if not len(modes.values):
        return modes
    J, S = modes.left.conj().T @ pencil.times_J(modes.right), modes.left.conj().T @ pencil.times_S(modes.right)
    try:
        there = np.linalg.solve(S, J)
        found = through(np.diag(modes.values), there, np.arange(len(S)), (modes.values, np.eye(len(S))))
        if found is None:
            return None
        values, turn = found
        return Modes(values, modes.right @ turn, modes.left @ np.linalg.inv(S @ turn).conj().T)
    except np.linalg.LinAlgError:
        return None


def through(
    first: NDArray[np.complex128],
    last: NDArray[np.complex128],
    chosen: NDArray[np.intp],
    known: tuple[NDArray[Any], NDArray[Any]] | None = None,
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]] | None:
    """Eigenvalues and vectors of a small matrix, as those of another one become them; None where that is not certain.

    The first matrix is changed into the last one in as many steps as it takes: modes that exchange their vectors over a
    short way, as the two planes of a rotor do near rest, need no more nodes. `chosen` are those of
    ``numpy.linalg.eig(first)``, or of what is `known` in its place, that have to be certain.
    """
    values, turn = known or np.linalg.eig(first)
    back, now, step = np.linalg.inv(turn), 0.0, 1.0
    while now < 1:
        step = min(step, 1 - now)
        new, vectors = np.linalg.eig(last if now + step == 1 else first * (1 - now - step) + last * (now + step))
        inverse = np.linalg.inv(vectors)
        P = np.abs((back @ vectors) * (inverse @ turn).T)
        best = _pairs(P)[1]
        alike = np.abs(new[best][:, None] - new) < INDISTINCT * np.abs(new)
        if np.sum(P * alike, axis=1)[chosen].min() > CERTAIN:
            values, turn, back = new[best], vectors[:, best], inverse[best]
            now, step = now + step, 2 * step
        elif step < SHORTEST:
            return None
        else:
            step /= 2
    return values, turn


def _pairs(P: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and their columns: the largest one of each where they are different, else those with the largest sum."""
    best = P.argmax(axis=1)
    if len(set(best.tolist())) == len(best):
        return np.arange(len(best)), best
    from scipy.optimize import linear_sum_assignment  # slow to import, and no run-up needs it

    rows, columns = linear_sum_assignment(-P)
    return rows, columns


def _all_linked(here: Node, there: Node, one: dict[int, int], region: Region) -> bool:
    inside = set(np.flatnonzero(region.holds(here.modes.values)).tolist())
    after = set(np.flatnonzero(region.holds(there.modes.values)).tolist())
    return inside <= set(one) and after <= set(one.values())


def _with_partners(node: Node, other: Node, region: Region) -> Node:
    """The node with what the modes of the other one become here, if that is not among its modes yet."""
    assert node.pencil is not None and other.pencil is not None
    inside = other.modes.take(region.holds(other.modes.values))
    alone = overlap(other.pencil, inside, node.pencil, node.modes).max(axis=1, initial=0.0) < PARTNER
    if not alone.any():
        return node
    known, more = node.modes, refined(node.pencil, inside.take(alone))
    found = joined(node.pencil, known, more)
    if known.proven:
        return replace(node, modes=replace(found, missing=known.missing, quotient=known.quotient))
    return replace(node, modes=counted(node.pencil, found, region, known))


def _turned(node: Node, other: Node) -> Node:
    """The node with the vectors of indistinct eigenvalues turned into those of the other one."""
    assert node.pencil is not None and other.pencil is not None
    s, right, left = node.modes.values, node.modes.right.copy(), node.modes.left.copy()
    alike = np.abs(s - s[:, None]) < INDISTINCT * np.abs(s[:, None])
    if alike.sum() <= len(s):
        return node
    free = list(range(len(s)))
    while free:
        group = [k for k in free if alike[free[0], k]]
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
