"""Errors of campaigns: one sentence with plan or store, value, limit and remedy."""

from __future__ import annotations

from rotorsim.base.errors import RotorsimError


class PlanError(RotorsimError):
    """Raised for a plan that cannot be read or does not describe a campaign."""


class StoreError(RotorsimError):
    """Raised for a store that is in use, of another plan, damaged, or cannot be written."""


class ClusterError(RotorsimError):
    """Raised for workers that cannot be reached, are lost or do not match."""


class StorageError(RotorsimError):
    """Raised for a record that cannot be stored; its case stays pending."""
