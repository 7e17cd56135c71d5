r"""Common state basis for black-box models of neighbouring operating points (SMILE, De Caigny et al. 2011).

.. math:: T_i = O_i^+ O_{ref}, \qquad A_i' = T_i^{-1} A_i T_i,\; B_i' = T_i^{-1} B_i,\; C_i' = C_i T_i

with observability matrices O over as many samples as there are states. The thesis left this way (section 2.5): elements
of such matrices amplify the error of each local model, and surfaces through them miss the local behaviour.

Cites: decaigny_2011, thesis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identification.local.models import LinearModel

STRIDE = 5
"""Samples between block rows of the observability matrices."""


def observability(model: LinearModel) -> np.ndarray:
    """C, C A^s, C A^2s ... (4 n blocks) of a sampled model."""
    power, blocks = np.linalg.matrix_power(model.A, STRIDE), [model.C]
    for _ in range(4 * model.order - 1):
        blocks.append(blocks[-1] @ power)
    return np.vstack(blocks)


def coherent_basis(models: Sequence[LinearModel]) -> list[LinearModel]:
    """The same sampled models, all in the basis that comes closest to that of the middle one.

    Examples
    --------
    >>> import rotorsim as rs
    >>> local = [lpv.at(speed, 0.5e6).discrete(2e-4) for speed in (200.0, 300.0, 400.0)]
    >>> len(rs.identification.coherent_basis(local))
    3
    """
    wanted = observability(models[len(models) // 2])
    found = []
    for model in models:
        T = np.linalg.lstsq(observability(model), wanted, rcond=None)[0]
        inverse = np.linalg.inv(T)
        found.append(replace(model, A=inverse @ model.A @ T, B=inverse @ model.B, C=model.C @ T))
    return found
