"""Unbalance from measured 1X vectors: influence coefficients, a physical model, and correction weights."""

from typing import TYPE_CHECKING

from rotorsim.balance.conditions import Conditions, Plane, Reading, read_conditions
from rotorsim.balance.unbalance import (
    Assessment,
    Correction,
    Estimate,
    Influence,
    LeftOut,
    assess,
    correction,
    estimate,
    fit_influence,
    fit_physical,
    leave_one_out,
)
from rotorsim.base.public import named

__all__ = [
    "Assessment",
    "Conditions",
    "Correction",
    "Estimate",
    "Influence",
    "LeftOut",
    "Plane",
    "Reading",
    "assess",
    "correction",
    "estimate",
    "fit_influence",
    "fit_physical",
    "leave_one_out",
    "read_conditions",
]


if not TYPE_CHECKING:
    __getattr__, __dir__ = named(__name__, __all__)
