"""Test law that uses every feature of a control law."""

import numpy as np

from rotorsim.control import Law


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
