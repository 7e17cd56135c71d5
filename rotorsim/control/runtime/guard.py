r"""Guard against bad samples: output held and then faded out with the states, bumpless return.

.. math:: u = u_0 \max(0, 1 - \max(0, n - HOLD) / FADE)

in the n-th bad sample in a row, u_0 being the last output before. Where that output may have been wrong itself
(displacement out of range, sensors reversed or swapped) it fades out at once, in equal steps that are no larger than
STEP, the largest that the law has made itself (or LEAST), but in FADE / QUICK samples at least and FADE / SLOW at most.
In good samples after bad ones the output goes linearly from where it was to that of the law, in as many samples as were
bad and one more, FADE + 1 at most, and in no fewer than an earlier return has left. No step of it is larger than that:
where the law has gone on further the output follows it at such steps, after FADE + 1 samples faster and faster.
The clock of the law (start, mean position, fade-in) stands still in bad samples, and of its states as much is left
when it comes back as of the output.

Cites: astrom_1997.
"""

from __future__ import annotations

import math

from reynolds.jit import inlined, kernel

HOLD = 5.0
"""Bad samples through which the last output is held: 1 ms at 5 kHz."""
FADE = 100.0
"""Samples in which it then fades out, and in which it comes back at most: 20 ms at 5 kHz."""
QUICK, SLOW = 10.0, 2.5
"""Largest and smallest factor by which an output that may be wrong fades out faster than one that is held."""
LEAST = 0.05
"""Step [V] that counts as usual even of a law that has not made one: from 5 V to nothing in FADE samples."""
FARTHEST = 1e3
"""Displacement [m] that no sensor shows; it would take seconds to leave the states of a law."""
OK, SENSOR, POINT, OVERFLOW, JUMP, STUCK, POINT_FAR, RANGE, CONNECTION = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0
UNSTEADY = 12.0
"""Alarm codes, from CONNECTION on one for each wrong connection of the sensors; their sentences are in `alarm`."""
OUT, BEGIN, BAD, BACK, SPAN, ALARM, LAST, LOST, STEP, SIZE = 0, 2, 4, 5, 6, 7, 8, 9, 10, 11
"""Offsets: last output (2), output from which it fades or returns (2), bad samples in a row, samples until the law acts
fully again (negative while the output still follows it), of how many (0: it does); alarm code now, last alarm code,
number of bad samples since the start; largest step of an output [V] while the law acted fully,
not that with which it began."""


@inlined
def fault_in(L, measured_x, measured_y, speed, pressure):
    """Alarm code for what a law is given; speed and pressure count where it is scheduled over them."""
    if not (abs(measured_x) < FARTHEST and abs(measured_y) < FARTHEST):
        return SENSOR
    if L.speeds > 1 and not math.isfinite(speed):
        return POINT
    if L.pressures > 1 and not math.isfinite(pressure):
        return POINT
    return OK


@inlined
def overflow(w, L):
    """Alarm code for the states of a law; those of an unstable one that has overflowed start again from rest."""
    total = 0.0
    for k in range(L.n):
        total += 0.0 * w[L.x + k]
    if total == 0.0:
        return OK
    for k in range(L.n):
        w[L.x + k] = 0.0
    return OVERFLOW


@inlined
def pace(w, g):
    """Factor by which an output that may be wrong fades out faster."""
    most = max(abs(w[g + BEGIN]), abs(w[g + BEGIN + 1]))
    usual = FADE * max(w[g + STEP], LEAST)
    return QUICK if QUICK * most <= usual else max(usual / most, SLOW)


@inlined
def left(w, g):
    """Part of the output that is left, and of the states where the law comes back."""
    return max(1.0 - max(w[g + BAD] - HOLD, 0.0) / FADE, 0.0)


@inlined
def hold(w, g, fault, out):
    """A bad sample: `out` (2,) [V] is the last output, later a part of it; at once where that may be wrong itself."""
    if w[g + BAD] == 0.0:
        w[g + BEGIN], w[g + BEGIN + 1] = w[g + OUT], w[g + OUT + 1]
    if w[g + BAD] < HOLD and fault >= RANGE:
        w[g + BAD] = HOLD
    w[g + BAD] += pace(w, g) if fault >= RANGE else 1.0
    w[g + LOST] += 1.0
    w[g + ALARM] = w[g + LAST] = fault
    part = left(w, g)
    for axis in range(2):
        out[axis] = w[g + OUT + axis] = part * w[g + BEGIN + axis]


@inlined
def come_back(w, g, out):
    """A sample on the way back: `out` (2,) [V], the law's, becomes a mean of it and the output then, within a step."""
    w[g + BACK] -= 1.0
    part = max(w[g + BACK], 0.0) / w[g + SPAN]
    late = max(w[g + SPAN] - w[g + BACK] - FADE - 1.0, 0.0)
    most = max(w[g + STEP], LEAST) * (1.0 + late / QUICK)
    behind = False
    for axis in range(2):
        to, last = out[axis] + part * (w[g + BEGIN + axis] - out[axis]), w[g + OUT + axis]
        out[axis] = min(max(to, last - most), last + most)
        behind = behind or out[axis] != to
    if w[g + BACK] <= 0.0 and not behind:
        w[g + SPAN], w[g + ALARM] = 0.0, OK


@inlined
def resume(w, g, out):
    """A good sample: `out` (2,) [V], the law's, and after bad ones on the way from the output then to it."""
    if w[g + BAD] > 0.0:
        w[g + BEGIN], w[g + BEGIN + 1] = w[g + OUT], w[g + OUT + 1]
        w[g + SPAN] = w[g + BACK] = max(min(w[g + BAD], FADE) + 1.0, w[g + BACK])
        w[g + BAD] = 0.0
    if w[g + SPAN] > 0.0:
        come_back(w, g, out)
    elif w[g + OUT] != 0.0 or w[g + OUT + 1] != 0.0:
        w[g + STEP] = max(w[g + STEP], abs(out[0] - w[g + OUT]), abs(out[1] - w[g + OUT + 1]))
    w[g + OUT], w[g + OUT + 1] = out[0], out[1]


@kernel
def guard(w, fault, out):
    """The same for a law outside this folder: `w` (SIZE,) is its guard's memory, `out` (2,) what it would give."""
    if fault == OK:
        resume(w, 0, out)
    else:
        hold(w, 0, fault, out)
