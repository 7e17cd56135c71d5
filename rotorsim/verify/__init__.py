"""Verification of a law on the nonlinear plant against declared criteria: pass or fail."""

from typing import TYPE_CHECKING

from rotorsim.base.public import named
from rotorsim.verify.closed_loop import Criteria, Verification, closed_loop
from rotorsim.verify.safe_speed import SafeSpeed, safe_speed

__all__ = ["Criteria", "SafeSpeed", "Verification", "closed_loop", "safe_speed"]


if not TYPE_CHECKING:
    __getattr__, __dir__ = named(__name__, __all__)
