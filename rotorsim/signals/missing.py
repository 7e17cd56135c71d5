"""Error raised when a record lacks the signals, length or operating condition that an analysis needs."""

from __future__ import annotations

from rotorsim.base.errors import RotorsimError


class MissingError(RotorsimError):
    """Raised where a record holds nothing for a figure; the message is a sentence for the reader of the report."""


def need(held: bool, sentence: str) -> None:
    """Raise MissingError with the sentence unless `held`."""
    if not held:
        raise MissingError(sentence)
