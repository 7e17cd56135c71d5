"""Memory layout of a running law."""

from __future__ import annotations

from typing import NamedTuple

from rotorsim.control.runtime.guard import SIZE
from rotorsim.control.runtime.plausibility import LIMITS, STATE, WAYS


class LawLayout(NamedTuple):
    """Offsets, in doubles.

    A block of the table holds A (n, n), B (n, 2), C (2, n), D (2, 2) and the anti-windup gain W (n, 2), row by row.
    The memory holds the block in use, the state x (n), its next value, the centre (2) [m], sums (2) of what was
    measured while it is sought, the number of samples `done`, and what `guard` keeps. `checks` is where the limits of
    `plausibility` stand in the table, -1 without; its predictors' table follows them and its axes those of the law: a
    block of A (pn, pn), B (pn, 2), C (2, pn), gain L (pn, 2) and the weights S (3) of its errors. Their memory follows,
    last whether a law was given the reference that acts, and which (2) [V].
    """

    n: int
    speeds: int
    pressures: int
    B: int
    C: int
    D: int
    W: int
    block: int
    x: int
    new: int
    centre: int
    sums: int
    done: int
    guard: int
    size: int
    checks: int = -1
    seen: int = 0
    pn: int = 0
    pspeeds: int = 1
    ppressures: int = 1
    pB: int = 0
    pC: int = 0
    pL: int = 0
    pS: int = 0
    psize: int = 0
    pblock: int = 0
    px: int = 0
    pnew: int = 0
    evidence: int = 0
    applied: int = 0


def make_layout(n: int, speeds: int, pressures: int, predictors: tuple[int, int, int] | None = None) -> LawLayout:
    """Layout of a law of order n scheduled over `speeds` x `pressures` operating points.

    `predictors`: order, speeds and pressures of those of its plausibility checks, order 0 for limits alone; None for a
    law that checks for finite numbers only.
    """
    B = n * n
    C = B + 2 * n
    D = C + 2 * n
    W = D + 4
    block = W + 2 * n
    x = block
    new = x + n
    centre = new + n
    guard = centre + 5
    seen = guard + SIZE
    bare = LawLayout(n, speeds, pressures, B, C, D, W, block, x, new, centre, centre + 2, centre + 4, guard, seen)
    return bare if predictors is None else _with_checks(bare, *predictors)


def _with_checks(L: LawLayout, n: int, speeds: int, pressures: int) -> LawLayout:
    """The layout with that of the plausibility checks behind it."""
    B = n * n
    C, gain, S = B + 2 * n, B + 4 * n, B + 6 * n
    psize = S + 3 if n else 0
    block = L.size + STATE
    px = block + psize
    pnew = px + WAYS * n
    evidence = pnew + n
    applied = evidence + WAYS
    return L._replace(
        checks=L.block * L.speeds * L.pressures, seen=L.size, pn=n, pspeeds=speeds, ppressures=pressures, pB=B, pC=C,
        pL=gain, pS=S, psize=psize, pblock=block, px=px, pnew=pnew, evidence=evidence, applied=applied,
        size=applied + 3,
    )  # fmt: skip


FIRST_BLOCK = len(LIMITS)
"""Offset of the predictors' table behind `checks`."""
