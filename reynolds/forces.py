r"""Friction torque of the film on the journal.

.. math:: M = \int R \left(\frac{\mu U}{h} + \frac{h}{2}\,\partial_y p\right) \mathrm dA

against the rotation: Couette drag plus the pressure-driven part. Source: Hamrock (2004), section 8.5.
"""

from __future__ import annotations

import numpy as np

from reynolds.grid import Layout, cells
from reynolds.workspace import FilmModel


def friction_torque(model: FilmModel, layout: Layout, w: np.ndarray, speed: float) -> float:
    """Friction torque [N m] at shaft speed `speed` [rad/s]; positive brakes a positive speed."""
    grid = model.grid
    p, h = w[layout.p + cells(layout)], w[layout.h + cells(layout)]
    weight = w[layout.weight + cells(layout)]
    slope = (np.roll(p, -1, axis=0) - np.roll(p, 1, axis=0)) / (2 * grid.dy)
    shear = model.gas.viscosity * speed * grid.radius / h + 0.5 * h * slope
    inside = float(np.sum(shear * weight)) * (2 if grid.half else 1)
    # the edges carry half a cell of Couette drag on either side
    edge_h = w[layout.h + layout.first + np.arange(layout.n_theta) * layout.stride + layout.n_rows]
    edges = float(np.sum(model.gas.viscosity * speed * grid.radius / edge_h))
    return grid.radius * grid.dy * grid.dz * (inside + edges)
