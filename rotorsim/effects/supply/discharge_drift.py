r"""Drift of the injectors' discharge: changed coefficient, and exponent over the pin opening.

.. math:: \sigma \;\to\; (1 + \delta)\,\sigma\,\sigma^{\,n}

sigma is the seat's opening, open / fully open; n bends the flow of a half-open seat away from proportionality, as wear
and the laminar losses of a narrow gap do. Source: Pierart & Santos (2015) for the loss factor; all injectors alike.
"""

from reynolds.jit import inlined
from rotorsim.effects.base import INJECTOR_FLOW, CalibrationParameter, CandidateForm, FilmEffect, param, register


@inlined
def discharge_drift(t, k, opening, supply, p):
    """Opening [1] and supply pressure [Pa] of injector k."""
    bent = opening if p.exponent == 0.0 else opening * opening**p.exponent
    return bent * (1.0 + p.drift), supply


@register
class DischargeDrift(FilmEffect):
    """Drift of discharge coefficient and loss exponent."""

    port = "injector"
    kernel = discharge_drift
    cites = ("pierart_2015",)
    single = True
    forms = (CandidateForm("exponent", 0.04, pinned=True),)
    calibration = (CalibrationParameter("drift", 0.02, 0.10, -0.5, 0.5, trend=(0.02, 0.015), scales=INJECTOR_FLOW),)
    drift: float = param("1", bounds=(-0.9, 2.0), doc="Relative change of the discharge coefficient or loss factor.")
    exponent: float = param("1", bounds=(-0.9, 3.0), doc="What is added to the exponent of the opening.")
