"""Errors about data: one sentence with variable or file, value, limit and remedy."""

from __future__ import annotations

from rotorsim.base.errors import RotorsimError


class SchemaError(RotorsimError, ValueError):
    """Raised for a record that does not fit the schema; the message names variable, problem and way out."""


class ReadError(RotorsimError, ValueError):
    """Raised for a file or a mapping that cannot be read; the message names file, place and way out."""


class UnfitError(SchemaError):
    """Raised for a record, or a set of records, that fits the schema but not the identification asked for."""


class ModelError(RotorsimError, ValueError):
    """Raised for a model that cannot be read, converted or made; the message names what, why and the way out."""
