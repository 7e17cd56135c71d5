r"""One sample of a scheduled discrete law: interpolation, saturation, anti-windup.

.. math:: v = C x + D (y - y_c), \quad u = sat(f (v + b)), \quad x^+ = A x + B (y - y_c) + W (sat(v + b) - v - b)

The matrices are interpolated bilinearly in the table at every refresh; outside the table its edge holds. f rises from 0
to 1 while the law fades in. W is the anti-windup gain. y is what was measured, less the runout of the sensors at the
shaft angle where the law has a table of it, by straight lines between its points. A sample that is not a number does
not reach the equation, see `rotorsim.control.guard`.

Cites: astrom_1997.
"""

import math
from typing import NamedTuple

from reynolds.jit import inlined, kernel
from rotorsim.control.guard import (
    AT,
    BAD,
    COUNT,
    FRESH,
    KNOWN,
    LIMITS,
    POINT,
    REFRESHED,
    SIZE,
    STATE,
    WAYS,
    fault_in,
    hold,
    implausible,
    left,
    overflow,
    resume,
)

TURN = 2.0 * math.pi
"""One turn [rad]."""


@inlined
def cell_of(axis, first, count, value):
    """Index of the cell of a grid that holds a value, for the interpolation weight of its upper end."""
    k = 0
    while k < count - 2 and value >= axis[first + k + 1]:
        k += 1
    return k


@inlined
def weight_of(axis, first, count, k, value):
    """Weight of the upper end of cell k; 0 to 1, also beyond the grid."""
    if count < 2:
        return 0.0
    low, high = axis[first + k], axis[first + k + 1]
    share = (value - low) / (high - low)
    share = share if share > 0.0 else 0.0  # of NaN too
    return share if share < 1.0 else 1.0


@inlined
def interpolate(w, to, table, first, block, axes, at, speeds, pressures, speed, pressure):
    """Write the block of an operating point to w[to:], of a table that begins at `first` and its axes at `at`."""
    i = cell_of(axes, at, speeds, speed)
    j = cell_of(axes, at + speeds, pressures, pressure)
    a = weight_of(axes, at, speeds, i, speed)
    b = weight_of(axes, at + speeds, pressures, j, pressure)
    right = block if pressures > 1 else 0
    down = block * pressures if speeds > 1 else 0
    here = first + (i * pressures + j) * block
    w00, w01, w10, w11 = (1 - a) * (1 - b), (1 - a) * b, a * (1 - b), a * b
    for k in range(block):
        w[to + k] = (
            w00 * table[here + k]
            + w01 * table[here + right + k]
            + w10 * table[here + down + k]
            + w11 * table[here + down + right + k]
        )


@kernel
def refresh(w, table, axes, L, speed, pressure):
    """Write the block of the operating point to the front of the memory w."""
    interpolate(w, 0, table, 0, L.block, axes, 0, L.speeds, L.pressures, speed, pressure)


@inlined
def refresh_predictors(w, table, axes, L, speed, pressure):
    """The same of the predictors, at the last plausible speed and pressure if they are known."""
    if w[L.seen + KNOWN] > 0.0:
        speed = w[L.seen + AT]
    if w[L.seen + KNOWN + 1] > 0.0:
        pressure = w[L.seen + AT + 1]
    first, at = L.checks + FIRST_BLOCK, L.speeds + L.pressures
    interpolate(w, L.pblock, table, first, L.psize, axes, at, L.pspeeds, L.ppressures, speed, pressure)


@inlined
def clip(value, limit):
    """The value within +- limit."""
    return min(max(value, -limit), limit)


@inlined
def answer(w, table, axes, L, S, measured_x, measured_y, speed, pressure, out):
    """The law's equation for one sample of finite numbers."""
    count = w[L.done]
    w[L.done] = count + 1.0
    if count % S.refresh == 0.0:
        refresh(w, table, axes, L, speed, pressure)
    since = count - S.start
    if since < S.average:
        if since >= 0.0:
            w[L.sums] += measured_x
            w[L.sums + 1] += measured_y
            w[L.centre] = w[L.sums] / (since + 1.0)
            w[L.centre + 1] = w[L.sums + 1] / (since + 1.0)
        out[0] = 0.0
        out[1] = 0.0
        return
    y0, y1 = measured_x - w[L.centre], measured_y - w[L.centre + 1]
    n = L.n
    v0 = w[L.D] * y0 + w[L.D + 1] * y1 + S.bias_x
    v1 = w[L.D + 2] * y0 + w[L.D + 3] * y1 + S.bias_y
    for k in range(n):
        v0 += w[L.C + k] * w[L.x + k]
        v1 += w[L.C + n + k] * w[L.x + k]
    lost0, lost1 = clip(v0, S.limit) - v0, clip(v1, S.limit) - v1
    for i in range(n):
        total = w[L.B + 2 * i] * y0 + w[L.B + 2 * i + 1] * y1
        total += w[L.W + 2 * i] * lost0 + w[L.W + 2 * i + 1] * lost1
        row = i * n
        for k in range(n):
            total += w[row + k] * w[L.x + k]
        w[L.new + i] = total
    for i in range(n):
        w[L.x + i] = w[L.new + i]
    fade = 1.0
    if since - S.average < S.fade:
        fade = (since - S.average) / S.fade
    out[0] = clip(fade * v0, S.limit)
    out[1] = clip(fade * v1, S.limit)


@inlined
def fade_states(w, L):
    """Scale the states as the output has faded: they are old, and after a wrong connection wrong."""
    part = left(w, L.guard)
    for k in range(L.n):
        w[L.x + k] *= part


@inlined
def runout_at(table, L, axis, angle):
    """Runout [m] of a sensor at a shaft angle [rad]; 0 without a table."""
    if L.angles == 0:
        return 0.0
    turns = angle / TURN
    place = (turns - math.floor(turns)) * L.angles
    k = int(place)
    share = place - k
    low, high = k % L.angles, (k + 1) % L.angles
    return (1.0 - share) * table[L.runout + 2 * low + axis] + share * table[L.runout + 2 * high + axis]


@kernel
def step(w, table, axes, L, S, measured_x, measured_y, speed, pressure, angle, out):
    """One sample: `out` (2,) [V] from the measured disc [m], speed [rad/s], gauge pressure [Pa], shaft angle [rad].

    S: settings, see `rotorsim.control.law.LawSettings`. Bad samples are held out of the law's states. The angle counts
    where the law has a runout table.
    """
    fault = fault_in(L, measured_x, measured_y, speed, pressure, angle)
    x, y = measured_x, measured_y
    if L.angles > 0 and fault == 0.0:
        x -= runout_at(table, L, 0, angle)
        y -= runout_at(table, L, 1, angle)
    if L.checks >= 0:
        fault = check(w, table, axes, L, S, fault, measured_x, measured_y, x, y, speed, pressure)
    if fault == 0.0:
        if w[L.guard + BAD] > 0.0:
            fade_states(w, L)
        answer(w, table, axes, L, S, x, y, speed, pressure, out)
        fault = overflow(w, L)
    if fault == 0.0:
        resume(w, L.guard, out)
    else:
        hold(w, L.guard, fault, out)


@inlined
def check(w, table, axes, L, S, fault, measured_x, measured_y, x, y, speed, pressure):
    """Alarm code of a sample with finite numbers (0) or not; x, y: what was measured less the runout."""
    m = L.seen
    if fault != 0.0:
        w[m + FRESH] = w[L.evidence] = w[L.applied] = 0.0
        if fault == POINT:
            w[m + KNOWN] = w[m + KNOWN + 1] = 0.0
        return fault
    if L.pn > 0 and w[m + COUNT] % REFRESHED == 0.0:
        refresh_predictors(w, table, axes, L, speed, pressure)
    centred = w[L.done] >= S.start + S.average
    fault = implausible(w, table, L, measured_x, measured_y, x, y, speed, pressure, centred)
    w[L.applied] = 0.0
    return fault


@kernel
def steps(w, table, axes, L, S, measured, speed, pressure, out):
    """All samples of the pairs in `measured` (2 n,), into `out` (2 n,), of a law without runout table.

    Speed and pressure are constant.
    """
    pair = out[:2]
    for k in range(measured.shape[0] // 2):
        pair = out[2 * k : 2 * k + 2]
        step(w, table, axes, L, S, measured[2 * k], measured[2 * k + 1], speed, pressure, 0.0, pair)


class LawLayout(NamedTuple):
    """Offsets, in doubles.

    A block of the table holds A (n, n), B (n, 2), C (2, n), D (2, 2) and the anti-windup gain W (n, 2), row by row.
    The memory holds the block in use, the state x (n), its next value, the centre (2) [m], sums (2) of what was
    measured while it is sought, the number of samples `done`, and what `guard` keeps. `checks` is where the limits of
    `plausibility` stand in the table, -1 without; its predictors' table follows them and its axes those of the law: a
    block of A (pn, pn), B (pn, 2), C (2, pn), gain L (pn, 2) and the weights S (3) of its errors. Their memory follows,
    last whether a law was given the reference that acts, and which (2) [V]. The table ends, from `runout` on, with the
    runout of x and y [m] at a number of `angles` of a turn.
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
    runout: int = 0
    angles: int = 0


def make_layout(
    n: int, speeds: int, pressures: int, predictors: tuple[int, int, int] | None = None, angles: int = 0
) -> LawLayout:
    """LawLayout of a law of order n scheduled over `speeds` x `pressures` operating points.

    `predictors`: order, speeds and pressures of those of its plausibility checks, order 0 for limits alone; None for a
    law that checks for finite numbers only. `angles`: those of its runout table, 0 without.
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
    L = bare if predictors is None else _with_checks(bare, *predictors)
    checked = 0 if predictors is None else FIRST_BLOCK + L.psize * L.pspeeds * L.ppressures
    return L._replace(runout=L.block * speeds * pressures + checked, angles=angles) if angles else L


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
