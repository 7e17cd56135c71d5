"""Diagonal scaling of a plant's states (balancing) for better conditioning."""

from __future__ import annotations

import numpy as np

from rotorsim.control.designs.mixed import Generalised
from rotorsim.control.numerics.systems import equalising


def balance(plants: list[Generalised]) -> np.ndarray:
    """One diagonal scaling (n,) that equalises rows and columns of the largest entries over all plants."""
    return equalising(np.max([np.abs(_whole(P)) for P in plants], axis=0), plants[0].order)


def _whole(P: Generalised) -> np.ndarray:
    inputs, outputs = np.hstack([P.B1, P.B2]), np.vstack([P.C1, P.C2])
    return np.block([[P.A, inputs], [outputs, np.zeros((outputs.shape[0], inputs.shape[1]))]])


def rescaled(P: Generalised, T: np.ndarray) -> Generalised:
    """The plant in the states T x."""
    return P._replace(A=P.A * T[:, None] / T, B1=P.B1 * T[:, None], B2=P.B2 * T[:, None], C1=P.C1 / T, C2=P.C2 / T)


def balanced(P: Generalised) -> Generalised:
    """The plant in states scaled by powers of two, which round nothing."""
    return rescaled(P, 2.0 ** np.round(np.log2(balance([P]))))
