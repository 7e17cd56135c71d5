"""Linear algebra of fits and simulations: an answer in finite numbers, or one error.

Every decomposition of a diagnosis goes through `answer`, so that what LAPACK refuses (numbers that overflow, a singular
matrix, an iteration without end) ends a fit or a run and never a diagnosis.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from rotorsim.base.errors import RotorsimError


class NoAnswerError(RotorsimError):
    """Linear algebra without an answer in finite numbers."""


def answer(function: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Result of a function of linear algebra; raises NoAnswerError where it fails or is not finite."""
    try:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            found = function(*arguments, **options)
    except (np.linalg.LinAlgError, ValueError, OverflowError, ZeroDivisionError) as error:
        raise NoAnswerError(f"linear algebra: {error}") from error
    for part in found if isinstance(found, tuple) else (found,):
        if isinstance(part, (np.ndarray, np.number, float)) and not np.all(np.isfinite(part)):
            raise NoAnswerError("linear algebra: numbers overflow")
    return found
