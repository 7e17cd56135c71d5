"""Run-ups of a known parameter-varying system: Model 3 whose modes move with speed and pressure, and cross."""

import numpy as np

import identification as idn
from identification.local.simulation import respond

TS = 2e-4
KRPM = 1000 * np.pi / 30
TOP = 20 * KRPM
"""Highest speed [rad/s]."""
STRETCH = 50
"""Samples through which the operating point is taken as constant."""


def matrices(speed, pressure=5e5, detune=1.0):
    """A, B, C and the input of forces (6, 2) at an operating point; `detune` multiplies the frequencies."""
    s, p = speed / TOP, (pressure - 5e5) / 2e5
    w = 2 * np.pi * detune * np.array([118 + 30 * s + 12 * s * s + 6 * p, 124 - 25 * s + 5 * s * s + 8 * p])
    zeta = np.array([0.07 - 0.035 * s - 0.01 * p, 0.05 + 0.02 * s - 0.005 * p])
    A, B, force = np.zeros((6, 6)), np.zeros((6, 2)), np.zeros((6, 2))
    A[:2, 2:4], force[2:4] = np.eye(2), np.eye(2)
    A[2:4, :2] = -np.array([[w[0] ** 2, 3e4 * s], [-4e4 * s, w[1] ** 2]])
    A[2:4, 2:4] = -np.array([[2 * zeta[0] * w[0], 40 * s], [-40 * s, 2 * zeta[1] * w[1]]])
    A[2:4, 4:] = [[2.1 + 0.3 * s, 0.2 * s], [-0.2 * s, 2.4 - 0.3 * s]]
    lags = np.diag([900 + 200 * s, 800.0])
    A[4:, 4:], B[4:] = -lags, lags
    return A, B, np.eye(2, 6), force


def frozen(speed, pressure=5e5, detune=1.0):
    A, B, C, _ = matrices(speed, pressure, detune)
    return idn.LinearModel(A, B, C, np.zeros((2, 2)), speed=speed, pressure=pressure)


def deviations(model, wanted):
    """Relative errors of natural frequencies and damping ratios (2,), pole by nearest pole: order changes where they
    cross."""
    found, true = (m.wn * np.exp(1j * np.arccos(-m.zeta)) for m in (model, wanted))
    order = min(((0, 1), (1, 0)), key=lambda pair: np.abs(found[list(pair)] - true).sum())
    found = found[list(order)]
    return np.abs(found) / np.abs(true) - 1, found.real / np.abs(found) / wanted.zeta * -1 - 1


def runup(seconds=30.0, quiet=(0.0, 0.4), pressures=None, detune=None, top=TOP, noise=0.5e-6, eccentricity=2e-6):
    """time, u [V], y [m], speed [rad/s], pressure [Pa] of a run-up from rest; PRBS but for `quiet` [s].

    The imbalance response passes both resonances, the equilibrium moves with speed. detune: function of time.
    """
    rng, n = np.random.default_rng(0), round(seconds / TS)
    t = np.arange(n) * TS
    speed = np.clip((t - 1) / (seconds - 2), 0, 1) * top
    pressure = np.full(n, 5e5) if pressures is None else pressures(t)
    u = np.repeat(2.0 * rng.integers(0, 2, (-(-n // 25), 2)) - 1, 25, axis=0)[:n]
    u[(t >= quiet[0]) & (t < quiet[1])] = 0
    angle, y, x = np.cumsum(speed) * TS, np.empty((n, 2)), np.zeros(6)
    pull = eccentricity * speed[:, None] ** 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    for first in range(0, n, STRETCH):
        at, middle = slice(first, first + STRETCH), min(first + STRETCH // 2, n - 1)
        A, B, C, force = matrices(speed[middle], pressure[middle], 1.0 if detune is None else detune(t[middle]))
        model = idn.LinearModel(A, np.hstack([B, force]), C, np.zeros((2, 4))).discrete(TS)
        w = np.hstack([u[at], pull[at]])
        states = respond(model.A, model.B, np.eye(6), np.zeros((6, 4)), x, w)
        y[at], x = states @ C.T, model.A @ states[-1] + model.B @ w[-1]
    y += np.column_stack([5e-6 * speed / TOP, -3e-6 * (speed / TOP) ** 2])
    return t, u, y + noise * rng.normal(size=y.shape), speed, pressure


def as_record(t, u, y, speed, pressure):
    return idn.from_arrays(t, u, y, speed=speed, pressure=pressure)
