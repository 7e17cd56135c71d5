"""Input checks: a ShaftError for values that are not positive, not finite or not ascending."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rotorsim.base.errors import RotorsimError


class ShaftError(RotorsimError, ValueError):
    """Raised for an element, a rotor or an analysis with an unusable input; names it, its value and limit."""


def positive(owner: str, **values: float) -> None:
    """Raise ShaftError unless every value is above 0."""
    for name, value in values.items():
        if not value > 0:
            raise ShaftError(f"{owner}: {name} = {value:g} must be positive.", argument=name, value=value)


def finite(owner: str, **values: float) -> None:
    """Raise ShaftError unless every value is a finite number."""
    for name, value in values.items():
        if not np.isfinite(value):
            raise ShaftError(
                f"{owner}: {name} = {value:g} is not a finite number; give one.", argument=name, value=value
            )


def not_negative(owner: str, **values: float) -> None:
    """Raise ShaftError unless every value is 0 or more."""
    for name, value in values.items():
        if not value >= 0:
            raise ShaftError(f"{owner}: {name} = {value:g} must not be negative.", argument=name, value=value)


def grid(owner: str, values: ArrayLike, increasing: bool = True) -> NDArray[np.float64]:
    """The values (n,) as an array; raises ShaftError if they are none, not finite or not `increasing`."""
    array = np.atleast_1d(np.asarray(values, dtype=float))
    if array.ndim != 1 or not array.size:
        raise ShaftError(f"{owner}: shape {np.shape(values)}; give a list of at least one number.")
    if not np.all(np.isfinite(array)):
        bad = int(np.flatnonzero(~np.isfinite(array))[0])
        raise ShaftError(f"{owner}: value {bad} is {array[bad]:g}; give finite numbers only.")
    if increasing and np.any(np.diff(array) <= 0):
        bad = int(np.flatnonzero(np.diff(array) <= 0)[0]) + 1
        raise ShaftError(f"{owner}: value {bad}, {array[bad]:g}, is not above the one before it; sort them, each once.")
    return array
