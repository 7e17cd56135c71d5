"""What can go wrong with a campaign; one sentence each: thing, value, limit, way out."""

from __future__ import annotations

from rotorsim.errors import RotorsimError


class PlanError(RotorsimError):
    """A plan that cannot be read or does not describe a campaign."""


class StoreError(RotorsimError):
    """A store that is in use, of another plan, damaged, or cannot be written."""


class ClusterError(RotorsimError):
    """Workers that cannot be reached, are lost or do not match."""
