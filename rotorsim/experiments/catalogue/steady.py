"""Steady running at constant speed and supply pressure: without excitation, or with references and forces as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rotorsim.base.errors import DataError
from rotorsim.experiments.experiment import REFERENCE_LIMIT, PointExperiment, begin, param, register
from rotorsim.experiments.functions import as_function


@register
@dataclass(frozen=True)
class Steady(PointExperiment):
    """Steady running at constant speed and supply pressure.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Steady(speed=300.0, pressure=0.5e6, duration=0.1).samples
    500
    """

    name: ClassVar[str] = "steady"
    example: ClassVar[str] = "--speed '3000 rpm' --pressure '0.3 MPa' --duration '10 s'"
    figures: ClassVar[tuple[str, ...]] = ("spectra", "filtered_orbits", "waterfall", "against_time")
    duration: float = param("s", "Length of the record.", 10.0, above=0, samples=True)
    begin: str = begin()

    @property
    def samples(self) -> int:
        """Length in samples."""
        return self.samples_in(self.duration)

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        return self.held(count)


steady = as_function(Steady)


@dataclass(frozen=True, eq=False)
class Given(PointExperiment):
    """Reference [V] and disc force [N], (n, 2) over the samples; one of them may be None. Held in memory.

    Examples
    --------
    >>> import rotorsim as rs
    >>> force = np.zeros((500, 2))
    >>> force[100:105, 0] = 20.0  # N along x for 1 ms
    >>> rs.run(plant, rs.experiments.Given(pressure=0.5e6, disc_force=force)).sizes["time"]
    500
    """

    name: ClassVar[str] = "given"
    reference: ArrayLike | None = None
    disc_force: ArrayLike | None = None

    def check(self) -> None:
        """Make both arrays and refuse what does not fit."""
        for name in ("reference", "disc_force"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _pairs(name, value))
        sizes = {len(value) for value in self._columns().values()}
        if len(sizes) != 1 or sizes == {0}:
            raise DataError("given: reference and disc_force are both missing, empty or of unlike lengths; give (n, 2)")
        if self.reference is not None and np.abs(self.reference).max() > REFERENCE_LIMIT:
            worst = float(np.abs(self.reference).max())
            raise DataError(f"reference: reaches {worst:g} V; keep it within {REFERENCE_LIMIT:g} V")

    def _columns(self) -> dict[int, Any]:
        given = {2: self.reference, 4: self.disc_force}
        return {column: value for column, value in given.items() if value is not None}

    @property
    def samples(self) -> int:
        """Length in samples."""
        return len(next(iter(self._columns().values())))

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch."""
        rows = self.held(count)
        for column, value in self._columns().items():
            rows[:, column : column + 2] = value[first : first + count]
        return rows


def _pairs(name: str, value: ArrayLike) -> np.ndarray:
    """The array as floats (n, 2); raises DataError."""
    pairs = np.array(value, float)
    if pairs.ndim != 2 or pairs.shape[1] != 2:
        raise DataError(f"{name}: shape {pairs.shape}, expected (n, 2) with one row per sample")
    if not np.all(np.isfinite(pairs)):
        raise DataError(f"{name}: holds NaN or infinite values; check the signal")
    return pairs
