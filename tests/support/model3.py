"""Simulated identification data: Model 3 near the rig's values, PRBS on both axes, white noise."""

from functools import cache

import numpy as np
from scipy.signal import lfilter

import identification as idn
from identification.local.greybox import STRUCTURES
from identification.local.models import LinearModel

TRUTH = np.array(
    [-5.0e5, -1.8e4, 2.4e4, -5.5e5, -110.0, -7.0, 7.0, -75.0, 1.6, -0.3, 0.26, 1.7, 900.0, 800.0]
)  # fmt: skip
TS = 2e-4
DELAYED = np.r_[TRUTH, 2 / 4e-4, 2 / 8e-4]
"""The same behind dead times of 0.4 and 0.8 ms, as the fit takes them."""


def model(theta=TRUTH, kind="3"):
    return LinearModel(*STRUCTURES[kind].matrices(np.asarray(theta, float)))


def prbs(rng, n, hold=25, rest=2000):
    u = np.repeat(2.0 * rng.integers(0, 2, (-(-n // hold), 2)) - 1, hold, axis=0)[:n]
    u[:rest] = 0
    return u


def record(seed=0, seconds=10.0, noise=0.5e-6, theta=TRUTH, speed=0.0, pressure=3e5, kind="3", u=None, **more):
    rng = np.random.default_rng(seed)
    n = round(seconds / TS)
    u = prbs(rng, n) if u is None else u
    y = model(theta, kind).simulate(u, TS) + 2e-6
    return idn.from_arrays(
        np.arange(n) * TS, u, y + noise * rng.normal(size=y.shape), speed=speed, pressure=pressure, **more
    )


@cache
def looped_model3(seed, gain, corner=1000.0, noise=0.5e-6, n=10000, most=np.inf, colour=0.0):
    """Reference, external reference and displacement (n, 2) of Model 3 under a proportional law behind a low-pass."""
    rng = np.random.default_rng(seed)
    external, e = prbs(rng, n), noise * rng.normal(size=(n, 2))
    e = lfilter([(1 - colour**2) ** 0.5], [1, -colour], e, axis=0) if colour else e
    sampled = model().discrete(TS)
    keep = np.exp(-2 * np.pi * corner * TS)
    x, fed = np.zeros(len(sampled.A)), np.zeros(2)
    u, y = np.zeros((n, 2)), np.zeros((n, 2))
    for k in range(n):
        u[k], y[k] = np.minimum(np.maximum(external[k] + fed, -most), most), sampled.C @ x + e[k]
        fed = keep * fed + (1 - keep) * gain * y[k]
        x = sampled.A @ x + sampled.B @ u[k]
    for array in (u, external, y):  # the next caller is given the same
        array.setflags(write=False)
    return u, external, y


def made(u, y, **more):
    return idn.from_arrays(np.arange(len(u)) * TS, u, y + 2e-6, speed=0.0, pressure=3e5, **more)
