r"""Variants of a law (thesis section 3.2.5): zero DC gain, or a constant reference of its own.

.. math:: K_0(z) = K(z)\, \frac{1 + a}{2} \frac{z - 1}{z - a}

Cites: thesis.
"""

from __future__ import annotations

import numpy as np

from rotorsim.control.errors import DesignError
from rotorsim.control.law import Law


def without_dc(law: Law, corner: float = 5.0) -> Law:
    """The law behind a high-pass of `corner` [Hz]: it leaves the equilibrium where it is, and slow disturbances too.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.without_dc(law, 5.0).order > law.order
    True
    """
    if not 0 < corner < 0.25 / law.Ts:
        raise DesignError(f"zero-dc: corner = {corner} Hz; give more than 0 and less than {0.25 / law.Ts:g} Hz")
    a = float(np.exp(-2 * np.pi * corner * law.Ts))
    level = (1 + a) / 2
    s, p, n = law.A.shape[:3]
    eye = np.broadcast_to(np.eye(2), (s, p, 2, 2))
    # the filter: f+ = a f + (1 - a) y, y' = level (y - f)
    zero = np.zeros((s, p, 2, n))
    A = np.block([[law.A, -level * law.B], [zero, a * eye]])
    B = np.concatenate([level * law.B, (1 - a) * eye], axis=2)
    C = np.concatenate([law.C, -level * law.D], axis=3)
    W = np.concatenate([law.W, np.zeros((s, p, 2, 2))], axis=2)
    about = law.about | {"zero_dc": corner}
    return law.with_(name=f"{law.name}_zero_dc", A=A, B=B, C=C, D=level * law.D, W=W, about=about)


def biased(law: Law, volts: tuple[float, float]) -> Law:
    """The law with a constant reference [V], which comes in with it.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.control.biased(law, (0.5, 0.0)).bias
    (0.5, 0.0)
    """
    return law.with_(name=f"{law.name}_biased", bias=(float(volts[0]), float(volts[1])))
