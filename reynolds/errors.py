"""Error of gas films."""

from rotorsim.base.errors import RotorsimError


class FilmError(RotorsimError, ValueError):
    """Raised for a film that cannot be computed, or its input; the message states where and why."""
