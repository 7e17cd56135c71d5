"""Memory layout of a running law."""

from __future__ import annotations

from typing import NamedTuple

from rotorsim.control.runtime.guard import SIZE


class Layout(NamedTuple):
    """Offsets, in doubles.

    A block of the table holds A (n, n), B (n, 2), C (2, n), D (2, 2) and the anti-windup gain W (n, 2), row by row.
    The memory holds the block in use, the state x (n), its next value, the centre (2) [m], sums (2) of what was
    measured while it is sought, the number of samples `done`, and what `guard` keeps.
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


def make_layout(n: int, speeds: int, pressures: int) -> Layout:
    """Layout of a law of order n scheduled over `speeds` x `pressures` operating points."""
    B = n * n
    C = B + 2 * n
    D = C + 2 * n
    W = D + 4
    block = W + 2 * n
    x = block
    new = x + n
    centre = new + n
    guard = centre + 5
    return Layout(n, speeds, pressures, B, C, D, W, block, x, new, centre, centre + 2, centre + 4, guard, guard + SIZE)
