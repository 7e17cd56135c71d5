r"""Guard of a running law against bad samples: which samples are implausible, what the output does, and its alarms.

The output is held in bad samples and then faded out with the states; it comes back without a jump:

.. math:: u = u_0 \max(0, 1 - \max(0, n - HOLD) / FADE)

in the n-th bad sample in a row, u_0 being the last output before. Where that output may have been wrong itself
(displacement out of range, sensors reversed or swapped) it fades out at once, in equal steps that are no larger than
STEP, the largest that the law has made itself (or LEAST), but in FADE / QUICK samples at least and FADE / SLOW at most.
In good samples after bad ones the output goes linearly from where it was to that of the law, in as many samples as were
bad and one more, FADE + 1 at most, and in no fewer than an earlier return has left. No step of it is larger than that:
where the law has gone on further the output follows it at such steps, after FADE + 1 samples faster and faster.
The clock of the law (start, mean position, fade-in) stands still in bad samples, and of its states as much is left
when it comes back as of the output.

Implausible are jumps, displacements out of range, frozen sensors, lost speed or pressure, and wrong signs. Signs and
order of the sensors are tested by five predictors of the displacement, one for each way in which they may be
connected, H: as they should be, x reversed, y reversed, both reversed, x and y swapped. Each predicts the next sample
from the reference that acts now, which is the law's last output unless another is given, and

.. math:: e = H y - C \hat x, \qquad \hat x^+ = A \hat x + B r + L e, \qquad q = e^T S^{-1} e

and the evidence for another connection is the product of the likelihood ratios of Student's t with NU degrees of
freedom, which a single large error cannot dominate, never below one (Page's cumulative sum):

.. math:: P^+ = \max\left(1, \beta P \frac{\nu + q_0}{\nu + q_j}\right)

where the model holds, with DOUBT, beta, for what the model itself predicts wrongly, and without the ratio as long as
the mean of q_0 over the last LATELY samples or so is below MISSED, twice what it should be: then nothing is to be
explained.

A jump of up to GLITCH samples is held through. What takes longer, a wrong connection, and more than OFTEN returns from
bad samples within some 100 suspend the law: it fades out, and tries to come back after PAUSE samples, after twice as
many each time it fails soon.

Cites: astrom_1997, page_1954.
"""

import math

import numpy as np

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
UNSTEADY, ANGLE = 12.0, 13.0
"""Alarm codes, from CONNECTION on one for each wrong connection of the sensors; their sentences are in `SENTENCES`."""
WOUND = 1e9
"""Shaft angle [rad] that no encoder counts to: a month at 3600 rpm."""
_HELD = "the output is held, fades out within 105 samples and comes back with the samples"
_TRIES = "the output fades out and the law tries to come back after 0.1 s at 5 kHz, later each time it fails"
SENTENCES = {
    SENSOR: f"the measured displacement is not a number: {_HELD}; check the sensors",
    POINT: f"speed or pressure, over which the law is scheduled, is not a number: {_HELD}; check its measurement",
    ANGLE: f"the shaft angle, over which the law takes runout off, is not a number: {_HELD}; check the encoder",
    OVERFLOW: "the law's own states overflowed and start again from rest: it is unstable; design it again",
    JUMP: f"the measured displacement jumped further than a rotor moves in a sample: {_TRIES}; check the sensors",
    STUCK: f"a sensor has shown one and the same value for long: {_HELD}; check the sensors",
    POINT_FAR: "speed or pressure, over which the law is scheduled, jumped or left its limits: "
    f"{_HELD}; check its measurement",
    RANGE: "the measured displacement is out of its range about the centre: the output fades out within 40 "
    "samples and comes back with the samples; check the sensors",
    **{
        CONNECTION + k: f"{way}, as the model the law was designed on shows: {_TRIES}; check the wiring"
        for k, way in enumerate(
            (
                "the sensor of x is reversed",
                "the sensor of y is reversed",
                "both sensors are reversed",
                "the sensors of x and y are swapped",
            )
        )
    },
    UNSTEADY: f"samples are missing or implausible again and again: {_TRIES}; check the sensors",
}
"""Sentence of each alarm code; code 0 is no alarm."""


OUT, BEGIN, BAD, BACK, SPAN, ALARM, LAST, LOST, STEP, SIZE = 0, 2, 4, 5, 6, 7, 8, 9, 10, 11
"""Offsets: last output (2), output from which it fades or returns (2), bad samples in a row, samples until the law acts
fully again (negative while the output still follows it), of how many (0: it does); alarm code now, last alarm code,
number of bad samples since the start; largest step of an output [V] while the law acted fully,
not that with which it began."""


@inlined
def fault_in(L, measured_x, measured_y, speed, pressure, angle):
    """Alarm code for what a law is given; speed and pressure count where it is scheduled over them.

    The shaft angle counts where the law has a runout table.
    """
    if not (abs(measured_x) < FARTHEST and abs(measured_y) < FARTHEST):
        return SENSOR
    if L.speeds > 1 and not math.isfinite(speed):
        return POINT
    if L.pressures > 1 and not math.isfinite(pressure):
        return POINT
    if L.angles > 0 and not abs(angle) < WOUND:
        return ANGLE
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
    wrong = RANGE <= fault < ANGLE
    if w[g + BAD] < HOLD and wrong:
        w[g + BAD] = HOLD
    w[g + BAD] += pace(w, g) if wrong else 1.0
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


NU, DOUBT, MISSED, LATELY = 3.0, 0.95, 4.0, 50.0
"""q_0 is 2 on average where the model holds. Runs of the rig without faults, at 6000 rpm and 0.3 MPa where the orbit is
largest, reach an evidence of 10^2.5 in 8 s with this DOUBT, and 10^9 with 0.98."""
WAYS = 5
"""Ways in which two sensors may be connected."""
GLITCH = 3.0
"""Jumped samples in a row that are held through."""
ACCEPTED = 50.0
"""Samples after which a speed or pressure that has jumped is taken for true; never zero, which a lost signal reads."""
OFTEN, FORGOTTEN = 6.0, 0.99
"""Returns from bad samples that are too many, and what is left of their number after each sample."""
ARMED = 100.0
"""Samples at the start that show whether a channel has noise; only of one that has can a constant be a fault."""
PAUSE, MOST, SETTLED = 500.0, 16000.0, 5000.0
"""Samples of the first pause (0.1 s at 5 kHz), of the longest, and after which a new alarm is not the old one."""
REFRESHED = 50.0
"""Samples between readings of the predictors' table."""
LIMITS = (
    "jump", "range", "stuck", "speed_low", "speed_high", "speed_jump", "pressure_low", "pressure_high",
    "pressure_jump", "evidence", "model_speed_low", "model_speed_high", "model_pressure_low", "model_pressure_high",
)  # fmt: skip
"""Order of the limits at the front of their part of the table; see `rotorsim.control.plausibility.Plausibility`."""
T_JUMP, T_RANGE, T_STUCK, T_SPEED, T_PRESSURE, T_EVIDENCE, T_MODEL = 0, 1, 2, 3, 6, 9, 10
SEEN, GOOD, SAME, CHANGED, AT, COUNT, FRESH, AWAY = 0, 2, 4, 6, 8, 10, 11, 12
REST, REASON, LENGTH, SINCE, RETURNS, KNOWN, OTHER, HELD, STATE = 13, 14, 15, 16, 17, 18, 20, 22, 24
"""Offsets in the memory: last sample (2), last without a jump (2), repeats (2), changes at the start (2), speed and
pressure (2), samples, whether the last was finite, jumped samples in a row; samples left of a pause, its alarm code,
its length, good samples since then; number of returns lately; whether speed and pressure are known (2), another value
of them (2) and for how many samples it has stood (2)."""


@inlined
def suspend(w, m, fault):
    """Begin a pause; returns the fault."""
    again = w[m + LENGTH] > 0.0 and w[m + SINCE] < SETTLED
    w[m + LENGTH] = min(2.0 * w[m + LENGTH], MOST) if again else PAUSE
    w[m + REST], w[m + REASON], w[m + SINCE], w[m + AWAY] = w[m + LENGTH], fault, 0.0, 0.0
    return fault


@inlined
def lost(w, table, m, k, limits, value):
    """Whether speed (k = 0) or pressure (1) is out of its limits or has jumped; none that is not finite."""
    if not abs(value) < math.inf:
        return False
    inside = table[limits] <= value <= table[limits + 1]
    near = w[m + KNOWN + k] == 0.0 or abs(value - w[m + AT + k]) <= table[limits + 2]
    if inside and not near and value != 0.0:
        again = abs(value - w[m + OTHER + k]) <= table[limits + 2]
        w[m + HELD + k] = w[m + HELD + k] + 1.0 if again else 1.0
        w[m + OTHER + k] = value
        near = w[m + HELD + k] > ACCEPTED
    else:
        w[m + HELD + k] = 0.0
    if inside and near:
        w[m + AT + k], w[m + KNOWN + k], w[m + HELD + k] = value, 1.0, 0.0
    return not (inside and near)


@inlined
def modelled(w, table, L):
    """Whether the last plausible speed and pressure lie where the predictors' model holds."""
    first, m = L.checks + T_MODEL, L.seen
    speed, pressure = w[m + AT], w[m + AT + 1]
    return table[first] <= speed <= table[first + 1] and table[first + 2] <= pressure <= table[first + 3]


@inlined
def count_repeats(w, m, k, value):
    """Repeats of a channel (k) and, at the start, its changes."""
    if w[m + COUNT] > 0.0 and value == w[m + SEEN + k]:
        w[m + SAME + k] += 1.0
    else:
        w[m + SAME + k] = 0.0
        if w[m + COUNT] < ARMED:
            w[m + CHANGED + k] += 1.0
    w[m + SEEN + k] = value


@inlined
def connection(w, table, L, m):
    """Fault of a connection for which there is enough evidence, or OK."""
    found, most = OK, table[L.checks + T_EVIDENCE]
    for j in range(1, WAYS):
        if w[L.evidence + j] > most:
            found, most = CONNECTION + j - 1.0, w[L.evidence + j]
    if found != OK:
        return suspend(w, m, found)
    return OK


@inlined
def connected(j, k, x, y):
    """Channel k of the displacement if the sensors are connected in way j."""
    if j == 4:
        return y if k == 0 else x
    reversed_ = (j == 1 and k == 0) or (j == 2 and k == 1) or j == 3
    value = x if k == 0 else y
    return -value if reversed_ else value


@inlined
def start_predictors(w, L, x, y):
    """States at rest where the displacement [um] is; no evidence, and q_0 small lately (the first number of it)."""
    n = L.pn
    for j in range(WAYS):
        for i in range(n):
            w[L.px + j * n + i] = 0.0
        w[L.px + j * n + n - 2] = connected(j, 0, x, y)
        w[L.px + j * n + n - 1] = connected(j, 1, x, y)
        w[L.evidence + j] = 1.0


@inlined
def predictor(w, L, j, x, y, u0, u1):
    """Advance predictor j by the displacement [um] and the reference [V]; returns q."""
    n, at, b = L.pn, L.px + j * L.pn, L.pblock
    e0, e1 = connected(j, 0, x, y), connected(j, 1, x, y)
    for k in range(n):
        e0 -= w[b + L.pC + k] * w[at + k]
        e1 -= w[b + L.pC + n + k] * w[at + k]
    for i in range(n):
        total = w[b + L.pB + 2 * i] * u0 + w[b + L.pB + 2 * i + 1] * u1
        total += w[b + L.pL + 2 * i] * e0 + w[b + L.pL + 2 * i + 1] * e1
        for k in range(n):
            total += w[b + i * n + k] * w[at + k]
        w[L.pnew + i] = total
    for i in range(n):
        w[at + i] = w[L.pnew + i]
    return w[b + L.pS] * e0 * e0 + 2.0 * w[b + L.pS + 1] * e0 * e1 + w[b + L.pS + 2] * e1 * e1


@inlined
def predict(w, L, x, y, acting):
    """Advance all predictors by a displacement [m] and the reference [V] that acts while it is measured."""
    u0, u1 = w[L.guard + OUT], w[L.guard + OUT + 1]
    if w[L.applied] > 0.0:
        u0, u1 = w[L.applied + 1], w[L.applied + 2]
    x, y = 1e6 * x, 1e6 * y
    if w[L.evidence] == 0.0:
        start_predictors(w, L, x, y)
    first = predictor(w, L, 0, x, y, u0, u1)
    w[L.evidence] += (first - w[L.evidence]) / LATELY
    for j in range(1, WAYS):
        q = predictor(w, L, j, x, y, u0, u1)
        ratio = (NU + first) / (NU + q) if w[L.evidence] > MISSED else 1.0
        w[L.evidence + j] = max(DOUBT * w[L.evidence + j] * ratio, 1.0) if acting else 1.0


@inlined
def displacement(w, table, L, m, measured_x, measured_y, x, y, centred):
    """Fault of a finite displacement, or OK; predictors are advanced, and begin again where it has jumped."""
    limits = L.checks
    count_repeats(w, m, 0, measured_x)
    count_repeats(w, m, 1, measured_y)
    w[m + COUNT] += 1.0
    away = max(abs(x - w[m + GOOD]), abs(y - w[m + GOOD + 1]))
    paused = w[m + REST] > 0.0
    jumped = w[m + FRESH] > 0.0 and away > table[limits + T_JUMP]
    if jumped:
        w[L.evidence] = 0.0
    if jumped and not paused:
        w[m + AWAY] += 1.0
        return JUMP if w[m + AWAY] <= GLITCH else suspend(w, m, JUMP)
    w[m + AWAY], w[m + FRESH] = 0.0, 1.0
    w[m + GOOD], w[m + GOOD + 1] = x, y
    if L.pn > 0:
        predict(w, L, x, y, centred and w[L.guard + BAD] == 0.0 and modelled(w, table, L))
    if paused:
        w[m + REST] -= 1.0
        return w[m + REASON]
    far = max(abs(x - w[L.centre]), abs(y - w[L.centre + 1]))
    if centred and far > table[limits + T_RANGE]:
        return RANGE
    for k in range(2):
        if w[m + SAME + k] >= table[limits + T_STUCK] and w[m + CHANGED + k] > 0.5 * ARMED:
            return STUCK
    return connection(w, table, L, m)


@inlined
def implausible(w, table, L, measured_x, measured_y, x, y, speed, pressure, centred):
    """Alarm code for what a law is given, all finite, or OK; `centred` where its centre is known.

    x, y: what was measured less the runout.
    """
    m = L.seen
    far = lost(w, table, m, 0, L.checks + T_SPEED, speed)
    far = lost(w, table, m, 1, L.checks + T_PRESSURE, pressure) or far
    fault = displacement(w, table, L, m, measured_x, measured_y, x, y, centred)
    if fault == OK and far:
        fault = POINT_FAR
    if fault == OK:
        w[m + SINCE] += 1.0
        fault = unsteady(w, L, m)
    return fault


@inlined
def unsteady(w, L, m):
    """Fault of a good sample after which samples have been bad too often, or OK."""
    w[m + RETURNS] *= FORGOTTEN
    if w[L.guard + BAD] > 0.0:
        w[m + RETURNS] += 1.0
        if w[m + RETURNS] > OFTEN:
            w[m + RETURNS] = 0.0
            return suspend(w, m, UNSTEADY)
    return OK


class Guarded:
    """Base of laws whose `memory` holds the guard's at `guard_at`: their alarms."""

    memory: np.ndarray

    @property
    def guard_at(self) -> int:
        """Place of the guard's memory in the law's."""
        return 0

    @property
    def alarm_code(self) -> int:
        """0 as long as the law acts fully; see `SENTENCES` for the others."""
        return int(self.memory[self.guard_at + ALARM])

    @property
    def alarm(self) -> str | None:
        """Why the law does not act fully now, as a sentence; None as long as it does."""
        return SENTENCES.get(self.alarm_code)

    @property
    def bad_samples(self) -> int:
        """Number of bad samples since the last reset."""
        return int(self.memory[self.guard_at + LOST])

    @property
    def past_alarms(self) -> str:
        """Bad samples since the last reset, as a sentence; empty if there were none."""
        last = SENTENCES.get(self.memory[self.guard_at + LAST])
        return f"{self.bad_samples} bad samples; the last: {last}" if self.bad_samples else ""
