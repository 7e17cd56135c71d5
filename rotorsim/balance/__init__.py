"""Unbalance from measured 1X vectors: influence coefficients, a physical model, and correction weights."""

from rotorsim.balance.conditions import Conditions, Plane, Reading, read_conditions
from rotorsim.balance.correction import Correction, correction
from rotorsim.balance.influence import Estimate, Influence, LeftOut, estimate, fit_influence, leave_one_out
from rotorsim.balance.physical import fit_physical

__all__ = [
    "Conditions",
    "Correction",
    "Estimate",
    "Influence",
    "LeftOut",
    "Plane",
    "Reading",
    "correction",
    "estimate",
    "fit_influence",
    "fit_physical",
    "leave_one_out",
    "read_conditions",
]
