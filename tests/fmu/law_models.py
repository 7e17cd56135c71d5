"""Test laws that use every feature of a control law, and inputs with every fault."""

import numpy as np

from fmu.linear_units import INPUTS
from rotorsim.control import Law, RunoutTable

TABLE = RunoutTable(2e-6 * np.column_stack([np.cos(np.arange(90) * np.pi / 45), np.sin(np.arange(90) * np.pi / 45)]))

RATED = [-5e5, -1.8e4, 2.4e4, -5.5e5, -110, -7, 7, -75, 3.6e5, -7e4, 6e4, 3.9e5, 5e3, 6e3, 25, 30, -20, 15,
         2e7, 1.1e4, 84, 1.6e7, 9e3, 67.2]  # fmt: skip
"""Parameters of Model 2 with rates of the pins near the rig's."""


def scheduled_law(**settings):
    """A law of three states over 3 x 2 operating points that winds up, saturates, seeks its centre and fades in."""
    rng = np.random.default_rng(4)
    shapes = {"A": (3, 3), "B": (3, 2), "C": (2, 3), "D": (2, 2), "W": (3, 2)}
    matrices = {name: rng.normal(size=(3, 2, *shape)) for name, shape in shapes.items()}
    matrices["A"] *= 0.3
    matrices["B"] *= 1e4
    matrices["D"] *= 2e5
    axes = {"speeds": [0.0, 300.0, 600.0], "pressures": [3e5, 7e5]}
    return Law(
        "trial",
        **matrices,
        **axes,
        **{"refresh": 7, "average": 0.004, "fade": 0.006, "start": 0.002, "limit": 0.6} | settings,
    )


def plausible_law():
    """The scheduled law with limits, and predictors of a mass on a spring, softer at the higher of two speeds."""
    from identification import LinearModel
    from rotorsim.control import Plausibility, Predictors, plausibility_of

    B, C = np.vstack([np.zeros((2, 2)), 2.0 * np.eye(2)]), np.eye(2, 4)
    both = []
    for w in (800.0, 700.0):
        A = np.block([[np.zeros((2, 2)), np.eye(2)], [-(w**2) * np.eye(2), -60.0 * np.eye(2)]])
        both.append(plausibility_of(LinearModel(A, B, C, np.zeros((2, 2)))).predictors)
    stacked = {k: np.concatenate([getattr(one, k) for one in both]) for k in ("A", "B", "C", "gain", "weights")}
    predictors = Predictors(**stacked, speeds=np.array([0.0, 600.0]), pressures=np.array([5e5]))
    limits = Plausibility(
        evidence=3.0, jump=1e-5, range=3e-5, speed=(-100.0, 900.0), speed_jump=200.0, predictors=predictors
    )
    return scheduled_law(average=0.2, fade=0.05, plausibility=limits)


def faulty_inputs(n):
    """Inputs (n,) of a law by name, with a fault of each kind after another."""
    rng, t = np.random.default_rng(0), 2e-4 * np.arange(n)
    x = 2e-6 + 3e-6 * np.sin(800 * t) + 3e-7 * rng.normal(size=n)
    y = -8e-6 + 2e-6 * np.cos(810 * t) + 3e-7 * rng.normal(size=n)
    speed, pressure = np.linspace(100.0, 500.0, n), np.full(n, 5e5)
    speed[0], pressure[40] = 0.0, np.nan
    x[2000:2002] += 5e-5
    x[2500:2900] = x[2500]
    speed[3500:3700] = 0.0
    y[4500:4600] += 5e-5 * np.minimum(np.arange(100) / 12, 1)
    y[6000:6300:3] = np.nan
    x[8000:] += 6e-6 * np.sin(300 * t[8000:]) * np.linspace(1, 4, n - 8000)
    return dict(zip(INPUTS, (x, y, speed, pressure), strict=True))
