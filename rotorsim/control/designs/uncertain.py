r"""Relative error of a model at the plant's input, in the mixed sensitivity problem and between operating points.

.. math:: u_{plant} = (I + \varepsilon \Delta) u, \quad \|\Delta\|_\infty \le 1, \qquad
          z_\Delta = \frac{\varepsilon}{d} u, \quad u_{plant} = u + d\, w_\Delta

A loop stands every such error while the norm of epsilon T_I is below one, T_I = K G (I - K G)^-1 (small gain). With the
scale d, which is the same at all frequencies, the norm of both blocks together is an upper bound of the structured
singular value: where it is gamma, the weights are met within gamma for errors up to epsilon/gamma.

Cites: doyle_1982, skogestad_2005.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from rotorsim.control.designs.hinf_synthesis import Bounds, bounds
from rotorsim.control.designs.weighted_plant import Generalised
from rotorsim.control.errors import DesignError
from rotorsim.control.plants import Model, axis_modes, design_plant, point_text
from rotorsim.control.systems import System, peak_gain, response

SCALES = (-3.0, 2.0)
"""Decades in which d [V] is sought."""
NEAR = (0.5, 1.5)
"""Frequencies over those of the modes between which models are compared."""


def uncertain(P: Generalised, plant: System, error: float, scale: float) -> Generalised:
    """The generalised plant with an error at the input of `plant`, whose states come first; its block comes first."""
    n, nw, nz = P.order, P.B1.shape[1], P.C1.shape[0]
    B = np.zeros((n, 2))
    B[: plant.order] = scale * plant.B
    return Generalised(
        P.A, np.hstack([B, P.B1]), P.B2, np.vstack([np.zeros((2, n)), P.C1]), P.C2,
        np.block([[np.zeros((2, 2 + nw))], [np.zeros((nz, 2)), P.D11]]),
        np.vstack([error / scale * np.eye(2), P.D12]), np.hstack([np.zeros((2, 2)), P.D21]),
    )  # fmt: skip


def scaled(P: Generalised, plant: System, error: float) -> tuple[Generalised, Bounds, float]:
    """The generalised plant at the scale with the smallest gamma, that gamma and the scale [V]."""

    def gamma(decade: float) -> float:
        return bounds(uncertain(P, plant, error, 10**decade), 1e-4).high

    found = minimize_scalar(gamma, bounds=SCALES, method="bounded", options={"xatol": 0.02})
    made = uncertain(P, plant, error, 10**found.x)
    return made, bounds(made), float(10**found.x)


def uncertain_loop_norm(plant: System, K: System, error: float) -> float:
    """Norm of epsilon T_I of a continuous loop with u = K y: below one it stands the error."""
    A = np.block([[plant.A + plant.B @ K.D @ plant.C, plant.B @ K.C], [K.B @ plant.C, K.A]])
    B = np.vstack([plant.B, np.zeros((K.order, 2))])
    C = np.hstack([K.D @ plant.C, K.C])
    return error * peak_gain(System(A, B, C, np.zeros((2, 2))))


def check_robust(norm: float, error: float) -> None:
    """Raise DesignError unless the norm of epsilon T_I is below one, which proves stability for every such error."""
    if not norm < 1:
        raise DesignError(
            f"hinf.uncertainty = {error:g}: the loop found stands {error / norm:.3g}; an uncertainty that is larger "
            "than what the model knows leaves nothing to control by: allow less, or weights that ask for less"
        )


def uncertainty_between(model: Model, point: tuple[float, float], others: Any, delay: float = 0.0) -> float:
    """Largest relative error at the input, about the modes, of the model at a point as one for others.

    Parameters
    ----------
    model : LpvModel
        Identified model.
    point, others : (speed, pressure) and a sequence of such
        [rad/s], [Pa, gauge].
    delay : float
        Of the loop [s].

    Returns
    -------
    float
        Largest singular value of G^-1 (G_other - G) at 200 frequencies, half the lower to 1.5 times the higher mode.

    Examples
    --------
    >>> import rotorsim as rs
    >>> model = rs.load_model("model.json")
    >>> rs.control.uncertainty_between(model, (300.0, 0.5e6), [(300.0, 0.5e6)])
    0.0
    """
    speed, pressure = point
    here = design_plant(model, speed, pressure, delay)
    modes = axis_modes(here)
    omega = np.linspace(NEAR[0] * modes.min(), NEAR[1] * modes.max(), 200)
    G, worst = response(here, 1j * omega), 0.0
    for w, p in others:
        try:
            off = np.linalg.solve(G, response(design_plant(model, w, p, delay), 1j * omega) - G)
        except np.linalg.LinAlgError as error:
            raise DesignError(f"model: has no inverse about its modes at {point_text(*point)}") from error
        worst = max(worst, float(np.linalg.norm(off, 2, axis=(1, 2)).max()))
    return worst


__all__ = ["check_robust", "scaled", "uncertain", "uncertain_loop_norm", "uncertainty_between"]
