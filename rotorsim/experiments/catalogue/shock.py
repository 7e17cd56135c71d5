r"""Shock of the base: a half sine of its acceleration, or a table of it over time.

.. math:: M\ddot q + \dots = f - M\,1\,a(t), \qquad a(t) = A \sin(\pi t/T), \quad 0 \le t \le T

q is the displacement against the base, 1 the motion of all nodes with it: the forces act on the whole mass, of shaft,
discs, point masses and housings. An acceleration is held during a sample, which gets the mean over it, so that the
change of the base's velocity is exact whatever the duration. Between the rows of a table the acceleration is straight.

Probes that measure against the ground, or on a housing, read the motion of the base too.

Cites: friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from identification.readers.csv import read_csv
from rotorsim.base.errors import DataError, ReadError
from rotorsim.base.units import parse
from rotorsim.experiments.experiment import PointExperiment, begin, pair, param, register
from rotorsim.experiments.functions import as_function

if TYPE_CHECKING:
    import xarray as xr


UNITS = {"time": "s", "x": "m/s^2", "y": "m/s^2"}
"""Columns of a table of accelerations, and the units in which they are taken."""


@register
@dataclass(frozen=True)
class Shock(PointExperiment):
    """A shock of the base: a half sine of its acceleration, or a table.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.experiments.Shock(speed=300.0, pressure=0.5e6, peak=50.0, rest=0.1).samples
    1055
    """

    name: ClassVar[str] = "shock"
    shakes: ClassVar[bool] = True
    example: ClassVar[str] = "--peak '50 m/s^2' --width '11 ms' --angle '90 deg'"
    figures: ClassVar[tuple[str, ...]] = ("excitation", "against_time", "spectra")
    peak: float = param("m/s^2", "Largest acceleration of the half sine.", 50.0, above=0, high=1e9)
    width: float = param("s", "Duration of the half sine.", 11e-3, low=1e-9, high=1e3)
    angle: float = param("rad", "Direction of the acceleration: 0 is x, 90 deg is y.", np.pi / 2)
    lead: float = param("s", "Time before the shock.", 0.1, low=0, samples=True)
    rest: float = param("s", "Time after the shock.", 1.0, low=0, samples=True)
    begin: str = begin()
    history: ArrayLike | str | Path | None = None
    """Rows (n, 3) of time [s] and accelerations x, y [m/s^2] in place of the half sine, or a CSV file of them."""

    def check(self) -> None:
        """Read the table, and refuse it next to a half sine."""
        if self.history is None:
            return
        given = [name for name in ("peak", "width", "angle") if getattr(self, name) != getattr(Shock, name)]
        if given:
            raise DataError(
                f"{given[0]}: is of the half sine, which the table in history replaces; leave it out",
                argument=given[0],
                value=getattr(self, given[0]),
            )
        rows = read_history(self.history) if isinstance(self.history, str | Path) else self.history
        object.__setattr__(self, "history", checked_history(rows))

    @property
    def length(self) -> float:
        """Duration [s] of the shock."""
        return self.width if self.history is None else float(np.asarray(self.history)[-1, 0])

    @property
    def samples(self) -> int:
        """Length in samples."""
        return self.samples_in(self.lead) + ceil(self.length / self.Ts - 1e-9) + self.samples_in(self.rest)

    def attrs(self) -> dict[str, Any]:
        """Name and parameters; those of the half sine where it acts."""
        known = super().attrs()
        return known if self.history is None else {k: v for k, v in known.items() if k not in HALF_SINE}

    def rows(self, first: int, count: int) -> np.ndarray:
        """Input rows (count, 6) of a stretch, in the columns of the force the mean acceleration of the base."""
        rows = self.held(count)
        rows[:, 4:6] = np.diff(self.base_motion((first + np.arange(count + 1)) * self.Ts)[1], axis=0) / self.Ts
        return rows

    def base_motion(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Displacement [m] and velocity [m/s] (n, 2) of the base at times (n,) [s]."""
        since = np.clip(time - self.lead, 0.0, self.length)
        if self.history is None:
            rate = np.pi / self.width
            direction = np.round([np.cos(self.angle), np.sin(self.angle)], 15)  # nothing along x at 90 deg
            reached = self.peak / rate * direction
            place = (since - np.sin(rate * since) / rate)[:, None] * reached
            velocity = (1 - np.cos(rate * since))[:, None] * reached
        else:
            place, velocity = integrals(np.asarray(self.history), since)
        return place + np.maximum(time - self.lead - self.length, 0.0)[:, None] * velocity, velocity

    @classmethod
    def findings(cls, record: xr.Dataset) -> dict[str, Any]:
        """Change of the base's velocity [m/s] and its largest acceleration over a sample [m/s^2], along x and y."""
        a, time = record["base_acceleration"].values, record["time"].values
        change = a.sum(axis=0) * (time[-1] - time[0]) / (len(time) - 1)
        return {"base": {"velocity_m_s": change.tolist(), "peak_m_s2": np.abs(a).max(axis=0).tolist()}}

    @classmethod
    def table(cls, summary: dict[str, Any]) -> list[tuple[str, str]]:
        """Rows of the base's motion."""
        found = summary["base"]
        return [
            ("Base x, y: peak acceleration", pair(found["peak_m_s2"], "m/s^2")),
            ("Base x, y: change of velocity", pair(found["velocity_m_s"], "m/s")),
        ]


shock = as_function(Shock)
HALF_SINE = ("peak", "width", "angle")
"""Parameters that a table replaces."""


def read_history(path: str | Path) -> np.ndarray:
    """Rows (n, 3) of a CSV file with the columns time, x and y, each with its unit; raises DataError."""
    try:
        columns = {column.name.lower(): column for column in read_csv(Path(path)).columns}
    except (ReadError, OSError) as error:
        raise DataError(f"history: {path}: {error}", argument="history", value=str(path)) from error
    for name in UNITS:
        column = columns.get(name)
        fault = "is missing" if column is None else column.fault or ("" if column.unit else "has no unit")
        if fault:
            raise DataError(
                f"history: {path}: column '{name}' {fault}; write e.g. 'time [s], x [m/s^2], y [m/s^2]' as its heading",
                argument="history",
                value=str(path),
            )
    try:
        factors = [parse(f"1 {columns[name].unit}", unit) for name, unit in UNITS.items()]
    except ValueError as error:
        raise DataError(f"history: {path}: {error}", argument="history", value=str(path)) from error
    return np.column_stack([columns[name].values for name in UNITS]) * factors


def checked_history(given: ArrayLike) -> np.ndarray:
    """Rows (n, 3) of times, which begin at 0 and ascend, and accelerations; raises DataError."""
    try:
        rows = np.array(given, float)
    except (TypeError, ValueError) as error:
        raise DataError(f"history: {error}; give rows of time, x and y", argument="history") from error
    if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) < 2:
        raise DataError(
            f"history: shape {rows.shape}, expected (n, 3), two rows or more of time, x and y",
            argument="history",
            value=rows.shape,
        )
    if not np.isfinite(rows).all():
        raise DataError("history: holds NaN or infinite values; check it", argument="history", value=np.nan)
    wrong = np.flatnonzero(np.diff(rows[:, 0], prepend=-1.0) <= 0) if rows[0, 0] == 0 else np.zeros(1, int)
    if wrong.size:
        time = float(rows[wrong[0], 0])
        raise DataError(
            f"history: {time:g} s in row {wrong[0] + 1}: times begin at 0 and ascend", argument="history", value=time
        )
    return rows


def integrals(rows: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity (n, 2) at times (n,) from accelerations that are straight between the rows (k, 3)."""
    t, a = rows[:, 0], rows[:, 1:]
    h = np.diff(t)[:, None]
    slope = np.diff(a, axis=0) / h
    v = np.vstack([np.zeros(2), np.cumsum(h * (a[1:] + a[:-1]) / 2, axis=0)])
    x = np.vstack([np.zeros(2), np.cumsum(h * (v[:-1] + h * (a[:-1] / 2 + h * slope / 6)), axis=0)])
    k = np.clip(np.searchsorted(t, time, side="right") - 1, 0, len(t) - 2)
    s = (time - t[k])[:, None]
    return x[k] + s * (v[k] + s * (a[k] / 2 + s * slope[k] / 6)), v[k] + s * (a[k] + s * slope[k] / 2)
