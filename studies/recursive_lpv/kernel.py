r"""Samples of the recursive LPV estimate: vetting, state-variable filters, auxiliary model, Kalman step, guards.

With time in units of 1/omega_0, displacements in units of the scale and ' for derivatives filtered by 1/(s + lambda)^4,

.. math:: y''' = A_2(q) y'' + A_1(q) y' + A_0(q) y + B_0(q) u + B_1(q) u' + c(q) + \sum_{k \le H} (a_k(q) \cos k\theta
          + b_k(q) \sin k\theta)

.. math:: e = y''' - \Theta^T \varphi, \quad \varphi = (y'', y', y, u, \ldots) \otimes \psi(q)

.. math:: \Theta \leftarrow \Theta + g e^T / S, \quad g = P z, \quad S = \sigma^2 + z^T g, \quad
          P \leftarrow P - g g^T / S + Q

z is phi with the displacement of an auxiliary model, which no noise of the sensors enters, in place of the measured
one: with phi itself noise would bias the damping (refined instrumental variables in the symmetric form, Young 2011,
chapters 7 and 8; Garnier and Wang 2008, chapter 4). P and Q are those of a random walk with a variance for each
coefficient. Where one would pass a bound it is taken as measured there: the others move along what the data leave open.

Cites: young_2011, garnier_2008.
"""

import math

import numpy as np

from identification.local.simulation import kernel

UPDATED, BETWEEN, SETTLING, SKIPPED, IDLE, REFUSED = range(6)
"""Outcomes of a sample: update, between two updates, filters settle, skipped, no excitation, update refused."""
SAMPLES, GAP, REPEATED, COOLING, WEIGHED = range(5)
"""Counters: samples, since the last good one, since it repeats, until the filters have settled, errors weighed."""
ANGLE, BEND, SIGMA2, SPEED, PRESSURE, MEAN, POWER, LOWEST, HIGHEST, NUMBERS = 0, 1, 2, 3, 4, 5, 7, 9, 11, 13
"""Running numbers: angle [rad], usual second difference, variance of the error, operating point, filtered references'
means (2) and mean squares about them (2), lowest and highest speed and pressure of updates (2 each); how many."""
TS, STEP, LAMBDA, GATE, INPUT, MARGIN, SLOW, FAST = range(8)
"""Settings: sampling time [s] and in units of time, corner of the filters, second difference of an
outlier in usual ones, least reference [V], least decay of poles, rates of running numbers per sample."""
STRIDE, SETTLE, STANDING, LONGEST, WARM = range(5)
"""Whole settings: samples between updates, that filters settle in, that a displacement may repeat, of outliers in a row
before they count as signal, errors weighed before the first update."""
Y, AUXILIARY, U, WAVES = 0, 2, 4, 6
"""First of the filters of displacement, auxiliary displacement, reference and harmonics."""
SHARES = 3
"""An update that would make the model unstable is tried whole, by a half and by a quarter."""
LARGEST = 1e4
"""Displacement of the auxiliary model, in units of the scale, at which it starts anew."""


@kernel()
def vetted(u, y, speed, pressure, past, count, real, rule, limit):
    """Whether a sample may be used: numbers that are finite, no displacement that stands still, no outlier."""
    if not (math.isfinite(speed) and math.isfinite(pressure) and math.isfinite(u[0] + u[1] + y[0] + y[1])):
        return False
    same = y[0] == past[0, 0] and y[1] == past[0, 1]
    count[REPEATED] = count[REPEATED] + 1 if same else 0
    if count[REPEATED] >= limit[STANDING]:
        return False
    bend = max(abs(y[0] - 2 * past[0, 0] + past[1, 0]), abs(y[1] - 2 * past[0, 1] + past[1, 1]))
    if count[SAMPLES] > limit[SETTLE] and count[GAP] < limit[LONGEST] and bend > rule[GATE] * real[BEND]:
        return False
    if count[GAP] >= limit[LONGEST]:  # no outliers: it moves more than before
        real[BEND] = max(real[BEND], bend)
    elif count[GAP] == 0 and count[SAMPLES] > 1:
        real[BEND] += max(rule[FAST], 1.0 / count[SAMPLES]) * (bend - real[BEND])
    return True


@kernel()
def waves_at(angle, waves):
    """cos and sin of the harmonics of the angle, in turn."""
    for k in range(len(waves) // 2):
        waves[2 * k] = math.cos((k + 1) * angle)
        waves[2 * k + 1] = math.sin((k + 1) * angle)


@kernel()
def basis_at(speed, pressure, exponents, middle, half, psi):
    """Monomials (t,) of the scaled operating point."""
    v, p = (speed - middle[0]) / half[0], (pressure - middle[1]) / half[1]
    for j in range(len(psi)):
        psi[j] = v ** exponents[j, 0] * p ** exponents[j, 1]


@kernel()
def at_point(theta, psi, A):
    """Coefficients A (2, r) at an operating point of theta (r t, 2), t neighbours each."""
    t = len(psi)
    for i in range(A.shape[1]):
        for axis in range(2):
            value = 0.0
            for j in range(t):
                value += theta[i * t + j, axis] * psi[j]
            A[axis, i] = value


@kernel()
def decaying(A, margin):
    """Whether the roots of det(s^3 - A_2 s^2 - A_1 s - A_0) lie left of -margin (Routh); A (2, r) begins with these."""
    p, d, above, below = np.zeros((2, 2, 4)), np.zeros(8), np.zeros(5), np.zeros(5)
    for i in range(2):
        for j in range(2):  # coefficients of powers of s + margin
            c0, c1, c2, c3, h = -A[i, 4 + j], -A[i, 2 + j], -A[i, j], 1.0 if i == j else 0.0, -margin
            p[i, j, 0], p[i, j, 1] = c0 + h * (c1 + h * (c2 + h * c3)), c1 + h * (2 * c2 + 3 * h * c3)
            p[i, j, 2], p[i, j, 3] = c2 + 3 * h * c3, c3
    for i in range(4):
        for j in range(4):
            d[i + j] += p[0, 0, i] * p[1, 1, j] - p[0, 1, i] * p[1, 0, j]
    for k in range(4):
        above[k], below[k] = d[6 - 2 * k], d[5 - 2 * k] if k < 3 else 0.0
    for _ in range(6):
        if not below[0] > 0:
            return False
        ratio = above[0] / below[0]
        for k in range(4):
            following = above[k + 1] - ratio * below[k + 1]
            above[k], below[k] = below[k], following
    return True


@kernel()
def slope(A, x, u, waves, out):
    """Time derivative of the auxiliary model's state (y, y', y'') (6,)."""
    second = (x[4] + A[0, 8] * u[0] + A[0, 9] * u[1], x[5] + A[1, 8] * u[0] + A[1, 9] * u[1])
    for axis in range(2):
        out[axis], out[2 + axis] = x[2 + axis], second[axis]
        value = A[axis, 6] * u[0] + A[axis, 7] * u[1] + A[axis, 10]
        for j in range(2):
            value += A[axis, j] * second[j] + A[axis, 2 + j] * x[2 + j] + A[axis, 4 + j] * x[j]
        for k in range(len(waves)):
            value += A[axis, 11 + k] * waves[k]
        out[4 + axis] = value


@kernel()
def auxiliary(A, x, u, waves, h, room):
    """Take the auxiliary model one sample on (Runge and Kutta); u is held, waves (3, 2 H) at begin, middle and end."""
    k1, k2, k3, k4, moved = room[0], room[1], room[2], room[3], room[4]
    slope(A, x, u, waves[0], k1)
    for i in range(6):
        moved[i] = x[i] + 0.5 * h * k1[i]
    slope(A, moved, u, waves[1], k2)
    for i in range(6):
        moved[i] = x[i] + 0.5 * h * k2[i]
    slope(A, moved, u, waves[1], k3)
    for i in range(6):
        moved[i] = x[i] + h * k3[i]
    slope(A, moved, u, waves[2], k4)
    for i in range(6):
        x[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i])


@kernel()
def filter_on(F, early, late, x, before, now):
    """Take a filter's state x (4,) one sample on; its input runs straight, or is held where `late` is zero."""
    a, b, c, d = x[0], x[1], x[2], x[3]
    for r in range(4):
        x[r] = F[r, 0] * a + F[r, 1] * b + F[r, 2] * c + F[r, 3] * d + early[r] * before + late[r] * now


@kernel()
def filters_on(F, inputs, f, u, y, waves, before, now):
    """Advance the filters by one sample: displacements from y (2, 2), old and new, and of the model, u held."""
    for axis in range(2):
        filter_on(F, inputs[0], inputs[1], f[Y + axis], y[1, axis], y[0, axis])
        filter_on(F, inputs[0], inputs[1], f[AUXILIARY + axis], before[axis], now[axis])
        filter_on(F, inputs[2], inputs[3], f[U + axis], u[axis], 0.0)
    for k in range(waves.shape[1]):
        filter_on(F, inputs[0], inputs[1], f[WAVES + k], waves[0, k], waves[2, k])


@kernel()
def excited(f, real, rule):
    """Whether either filtered reference moves enough."""
    moves = False
    for axis in range(2):
        now = f[U + axis, 0] * rule[LAMBDA] ** 4
        real[MEAN + axis] += rule[SLOW] * (now - real[MEAN + axis])
        real[POWER + axis] += rule[FAST] * ((now - real[MEAN + axis]) ** 2 - real[POWER + axis])
        moves = moves or real[POWER + axis] > rule[INPUT] ** 2
    return moves


@kernel()
def regressors(f, psi, first, constant, out):
    """phi (r t,) of filter states f (6 + 2 H, 4); `first` is the displacement's filter."""
    t = len(psi)
    for i in range(5 + len(f)):
        if i < 6:
            value = f[first + i % 2, 2 - i // 2]
        elif i < 10:
            value = f[U + i % 2, (i - 6) // 2]
        else:
            value = constant if i == 10 else f[WAVES + i - 11, 0]
        for j in range(t):
            out[i * t + j] = value * psi[j]


@kernel()
def gain(P, z, sigma2, g):
    """Write g = P z; return S = sigma^2 + z' g."""
    S = sigma2
    for i in range(len(z)):
        value = 0.0
        for j in range(len(z)):
            value += P[i, j] * z[j]
        g[i] = value
        S += z[i] * value
    return S


@kernel()
def bounded(P, low, high, new):
    """Coefficients that pass a bound are put there, and the others moved with them as P relates them."""
    for i in range(len(new)):
        off = min(max(new[i], low[i]), high[i]) - new[i]
        if off != 0:
            for j in range(len(new)):
                new[j] += P[j, i] / P[i, i] * off
    for i in range(len(new)):
        new[i] = min(max(new[i], low[i]), high[i])


@kernel()
def stepped(theta, P, box, psi, e, g, S, margin, A, new):
    """Move theta within its bounds by the step, or less of it where the model would be unstable; whether it moved."""
    share = 1.0
    for _ in range(SHARES):
        for axis in range(2):
            for i in range(len(g)):
                new[i, axis] = theta[i, axis] + share * g[i] / S * e[axis]
            bounded(P, box[0, :, axis], box[1, :, axis], new[:, axis])
        at_point(new, psi, A)
        if decaying(A, margin):
            theta[:] = new
            return True
        share *= 0.5
    return False


@kernel()
def shrink(P, g, S, walk):
    """P - g g'/S, then the random walk walk[0] of each coefficient as long as its variance is below walk[1]."""
    for i in range(len(g)):
        for j in range(i):
            P[i, j] -= g[i] * g[j] / S
            P[j, i] = P[i, j]
        P[i, i] = max(P[i, i] - g[i] * g[i] / S, 1e-9 * walk[1, i])
        P[i, i] = max(P[i, i], min(P[i, i] + walk[0, i], walk[1, i]))


@kernel()
def learned(f, psi, theta, P, walk, box, real, count, rule, limit, work, new, A):
    """Update of the coefficients by the filtered signals; what became of it."""
    phi, z, g, e = work[0], work[1], work[2], np.empty(2)
    constant = 1.0 / rule[LAMBDA] ** 4
    regressors(f, psi, Y, constant, phi)
    regressors(f, psi, AUXILIARY, constant, z)
    for axis in range(2):
        e[axis] = f[Y + axis, 3]
        for i in range(len(phi)):
            e[axis] -= theta[i, axis] * phi[i]
    count[WEIGHED] += 1
    rate = max(rule[FAST] * limit[STRIDE], 1.0 / count[WEIGHED])
    real[SIGMA2] += rate * (0.5 * (e[0] * e[0] + e[1] * e[1]) - real[SIGMA2])
    if count[WEIGHED] < limit[WARM]:
        return SETTLING
    S = gain(P, z, real[SIGMA2], g)
    if not 0.5 * real[SIGMA2] < S:  # rounding has made P indefinite
        P[:] = np.diag(walk[1])
        return REFUSED
    if not stepped(theta, P, box, psi, e, g, S, rule[MARGIN], A, new):
        return REFUSED
    shrink(P, g, S, walk)
    return UPDATED


@kernel()
def advance(u, y, speed, pressure, F, inputs, exponents, middle, half, rule, limit, walk, box,
            f, x, theta, P, past, waves, real, count, status):  # fmt: skip
    """Take samples u [V], y in units of the scale (k, 2), speed [rad/s] and pressure [Pa] (k,) in.

    past (3, 2) is the last displacement, that before it and the last reference; status (k,) is written.
    """
    n, t = len(theta), len(exponents)
    A, room, psi = np.empty((2, n // t)), np.empty((5, 6)), np.empty(t)
    work, new, before, seen = np.empty((3, n)), np.empty((n, 2)), np.empty(2), np.empty((2, 2))
    for k in range(len(u)):
        good = vetted(u[k], y[k], speed[k], pressure[k], past, count, real, rule, limit)
        omega = speed[k] if math.isfinite(speed[k]) else real[SPEED]
        turned = rule[TS] * 0.5 * (omega if count[SAMPLES] == 0 else real[SPEED]) + rule[TS] * 0.5 * omega
        real[SPEED], real[PRESSURE] = omega, pressure[k] if math.isfinite(pressure[k]) else real[PRESSURE]
        waves[0] = waves[2]
        waves_at(real[ANGLE] + 0.5 * turned, waves[1])
        real[ANGLE] = (real[ANGLE] + turned) % (2 * math.pi)
        waves_at(real[ANGLE], waves[2])
        seen[1] = past[0]
        seen[0] = y[k] if good or count[SAMPLES] == 0 else past[0]
        past[1] = past[0]
        past[0] = seen[0]
        basis_at(real[SPEED], real[PRESSURE], exponents, middle, half, psi)
        at_point(theta, psi, A)
        before[:] = x[:2]
        auxiliary(A, x, past[2], waves, rule[STEP], room)
        if not abs(x[0]) + abs(x[1]) < LARGEST:
            x[:] = 0.0
            x[:2] = seen[0]
            count[COOLING] = limit[SETTLE]
        filters_on(F, inputs, f, past[2], seen, waves, before, x[:2])
        for axis in range(2):
            past[2, axis] = u[k, axis] if math.isfinite(u[k, axis]) else past[2, axis]
        count[SAMPLES] += 1
        moves = excited(f, real, rule)
        if good:
            if count[GAP] >= limit[STANDING]:
                count[COOLING] = limit[SETTLE]
            count[GAP] = 0
        else:
            count[GAP] += 1
            status[k] = SKIPPED
            continue
        if count[COOLING] > 0:
            count[COOLING] -= 1
            status[k] = SETTLING
        elif count[SAMPLES] % limit[STRIDE]:
            status[k] = BETWEEN
        elif not moves:
            status[k] = IDLE
        else:
            status[k] = learned(f, psi, theta, P, walk, box, real, count, rule, limit, work, new, A)
            if status[k] == UPDATED:
                for i in range(2):
                    real[LOWEST + i] = min(real[LOWEST + i], real[SPEED + i])
                    real[HIGHEST + i] = max(real[HIGHEST + i], real[SPEED + i])
