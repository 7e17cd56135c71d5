r"""Third-order form of a model of six states, and back.

.. math:: y''' = A_2 y'' + A_1 y' + A_0 y + B_0 u + B_1 u', \qquad
          A = \begin{bmatrix} 0 & I & 0\\ 0 & 0 & I\\ A_0 & A_1 & A_2 \end{bmatrix},\;
          B = \begin{bmatrix} 0\\ B_1\\ B_0 + A_2 B_1 \end{bmatrix}

Model 3 has it exactly, with B_1 = 0: its lags make the reference act on the third derivative first. B_1 stands for what
is behind the first lag, such as a second pole of the actuators.

Cites: garnier_2008.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identification.errors import ModelError
from identification.local.models import LinearModel

OWN = 11
"""Regressors without harmonics: y'', y', y, u and u' of both axes, and a constant."""
ABRUPT = 1e-6
"""Most that a reference may do to the displacement's first derivative, as a share of what it does to the third."""
WORST = 1e10
"""Largest condition of displacements and their derivatives as coordinates of the state."""


def without_dead_times(model: LinearModel) -> LinearModel:
    """Model 3 with dead times in six states, its lags longer by them; any other model as it is."""
    A, B = model.A, model.B
    if A.shape != (8, 8) or B.shape[1] != 2 or np.any(A[6:, :6]) or not np.array_equal(B[6:], np.eye(2)):
        return model
    P, R = np.diag(-A[4:6, 4:6]), np.diag(-A[6:, 6:])
    if not (np.all(P > 0) and np.all(R > 0) and np.allclose(A[4:6, 6:], 2 * np.diag(P * R))):
        return model
    lag = np.diag(1 / (1 / P + 2 / R))
    short, into = A[:6, :6].copy(), np.zeros((6, 2))
    short[4:, 4:], into[4:] = -lag, lag
    return replace(model, A=short, B=into, C=model.C[:, :6])


def coefficients_of(model: LinearModel, omega: float, scale: float) -> np.ndarray:
    """A_2, A_1, A_0, B_0 and B_1 (2, 10) of a model, in units of time 1/omega and of displacement `scale` [m].

    Raises
    ------
    ModelError
        If the model is sampled, has not six states (or eight, of Model 3 with dead times, which join its lags), two
        references and two displacements, or its displacements and their first two derivatives are no coordinates of
        its state, or its reference acts on the first.
    """
    model = without_dead_times(model)
    if model.Ts or model.A.shape != (6, 6) or model.B.shape[1] != 2 or model.C.shape[0] != 2 or np.any(model.D):
        raise ModelError(
            f"recursive.start: {model.order} states, Ts = {model.Ts:g} s; give a continuous model of six states, two "
            "references in, two displacements out, D = 0, such as Model 3"
        )
    A, B, C = model.A / omega, model.B / omega, model.C / scale
    seen = np.vstack([C, C @ A, C @ A @ A])
    size = np.maximum(np.linalg.norm(seen, axis=0), 1e-300)
    if not np.linalg.cond(seen / size) < WORST:
        raise ModelError("recursive.start: a state of the model does not show in the displacements; take Model 3")
    if np.linalg.norm(C @ B) > ABRUPT * np.linalg.norm(C @ A @ A @ B):
        raise ModelError("recursive.start: a step of the reference moves the rotor at a jump; take Model 3")
    rows = np.linalg.solve((seen / size).T, (C @ A @ A @ A / size).T).T
    first = C @ A @ B
    return np.hstack([rows[:, 4:], rows[:, 2:4], rows[:, :2], C @ A @ A @ B - rows[:, 4:] @ first, first])


def model_of(
    rows: np.ndarray, omega: float, scale: float, speed: float, pressure: float, extrapolated: bool
) -> LinearModel:
    """Model of `coefficients_of` at an operating point [rad/s], [Pa]."""
    A, B, C = np.zeros((6, 6)), np.zeros((6, 2)), np.zeros((2, 6))
    A[:4, 2:], C[:, :2] = np.eye(4), np.eye(2)
    A[4:] = np.hstack([rows[:, 4:6] * omega**3, rows[:, 2:4] * omega**2, rows[:, :2] * omega])
    B[2:4] = rows[:, 8:10] * omega**2 * scale
    B[4:] = rows[:, 6:8] * omega**3 * scale + A[4:, 4:] @ B[2:4]
    return LinearModel(A, B, C, np.zeros((2, 2)), speed=speed, pressure=pressure, extrapolated=extrapolated)
