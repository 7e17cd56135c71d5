"""Errors of designs and laws: one sentence with thing, value, limit and remedy."""

from __future__ import annotations

from rotorsim.base.errors import RotorsimError


class DesignError(RotorsimError):
    """Raised for a specification that no controller meets or a model that a design cannot use; names the limit."""


class LawError(RotorsimError):
    """Raised for a control law that cannot be read, or does not fit the plant it is to run on."""
