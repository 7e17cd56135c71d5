"""Operating map: equilibrium, modes, gains and film coefficients over speed, pressure and machine fields."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.analysis import labels
from rotorsim.analysis.axes import MOST, Field, checked
from rotorsim.analysis.point import AT, MODES, numbers
from rotorsim.analysis.safe_region import surroundings
from rotorsim.analysis.varied import with_fields
from rotorsim.base.errors import DataError
from rotorsim.base.interrupt import finishing
from rotorsim.base.processes import spread
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant

if TYPE_CHECKING:
    import xarray as xr

WORTH = 60
"""Points that make one more process worth its start."""
Row = tuple[list[dict[str, np.ndarray]], np.ndarray, np.ndarray]
"""Points of one pressure of one machine, critical speeds (k, 4) around them, branches of modes (b, speeds, 3)."""


def operating_map(
    plant: Plant,
    speeds: Sequence[float] | np.ndarray,
    pressures: Sequence[float] | np.ndarray,
    fields: Sequence[Field] = (),
    frequencies: Sequence[float] | None = None,
    workers: int | None = 1,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Equilibrium, modes, gains, delays and film coefficients over the grid.

    Parameters
    ----------
    speeds, pressures : (n_speed,) [rad/s], (n_pressure,) [Pa, gauge]
        Ascending.
    fields : sequence of Field
        Further axes: fields of the machine file.
    frequencies : (n_at,), optional
        Whirl frequencies of K and C [rad/s]; else 0 and those of the two lowest modes.
    workers : int or None
        Processes; None for as many as pay.
    progress : callable, optional
        Called with (points done, points in all).

    Returns
    -------
    Dataset over (fields..., pressure, speed); NaN and `lifted` = 0 where the film does not carry the rotor. Critical
    speeds, `critical_speed` and more (fields..., pressure, critical), are those within 15 % of the speeds. After an
    interrupt `ended` is "interrupted" and `done` is 0 where nothing was computed; before the first row of points an
    interrupt is raised as KeyboardInterrupt.

    Raises
    ------
    DataError
        If a grid is empty, not finite, not ascending or too large, or a pressure is below vacuum.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.operating_map(plant, [0.0, 300.0], [0.5e6], workers=1)
    >>> found["wn"].sizes["speed"]
    2
    """
    speeds, pressures = checked("map: speeds [rad/s]", speeds), checked("map: pressures [Pa]", pressures)
    _check(plant, pressures, frequencies)
    shape = (*(len(f.values) for f in fields), len(pressures), len(speeds))
    if np.prod(shape) > MOST:
        raise DataError(f"map: {np.prod(shape)} points; at most {MOST} are computed, take a coarser grid")
    machines = [with_fields(plant.machine, fields, values) for values in product(*(f.values for f in fields))]
    jobs = [(m.text, speeds, p, frequencies) for m in machines for p in pressures]
    total, done, ended = int(np.prod(shape)), 0, "complete"
    rows: dict[int, Row] = {}
    try:
        for number, row in spread(_row, jobs, useful(workers, total)):
            rows[number] = row
            done += len(row[0])
            if progress:
                progress(done, total)
    except KeyboardInterrupt:
        if not rows:
            raise
        finishing()
        ended = "interrupted"
    tables = _tables(rows, len(jobs), shape)
    every = [rows.get(number) for number in range(len(jobs))]
    critical = _padded([None if row is None else row[1] for row in every], shape)
    branches = _padded([None if row is None else row[2] for row in every], shape)
    at = AT if frequencies is None else _names(frequencies)
    coords = labels.coordinates(fields, speeds, pressures, at, plant.machine.film_names)
    return labels.label(
        tables, critical, branches, coords, fields, plant.provenance() | {"kind": "map", "ended": ended}
    )


def useful(workers: int | None, points: int) -> int:
    """Processes for a number of points: all cores when None, but none that would not pay for its start."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(workers or cores, points // WORTH))


def _check(plant: Plant, pressures: np.ndarray, frequencies: Sequence[float] | None) -> None:
    plant.machine.gas.absolute(float(pressures[0]))
    if frequencies is not None and (not len(frequencies) or not np.all(np.isfinite(frequencies))):
        raise DataError("map: the whirl frequencies are empty or not finite; give numbers in rad/s")


@lru_cache(maxsize=2)
def _plant(text: str) -> Plant:
    return Plant(Machine.from_text(text))


def _row(text: str, speeds: np.ndarray, pressure: float, frequencies: Sequence[float] | None) -> Row:
    """The points of one pressure of one machine, and the critical speeds around them."""
    plant = _plant(text)
    found = surroundings(plant, speeds, float(pressure))
    rows = []
    for k, speed in enumerate(speeds.tolist()):
        row = numbers(plant, speed, float(pressure), frequencies, found.models.get(speed))
        if row["lifted"]:
            row |= {"zeta_least": np.array(found.zeta_least[k]), "looked": np.array(found.looked[k])}
        rows.append(row)
    return rows, found.critical, found.branches


def _names(frequencies: Sequence[float]) -> tuple[str, ...]:
    return tuple(f"{f / (2 * np.pi):.6g} Hz" for f in frequencies)


def _tables(rows: dict[int, Row], n_jobs: int, shape: tuple[int, ...]) -> dict[str, np.ndarray]:
    """Arrays (*shape, ...) of everything that any point has, NaN where a point has it not."""
    sizes = {key: value.shape for row, *_ in rows.values() for point in row for key, value in point.items()}
    tables = {key: np.full((n_jobs, shape[-1], *size), np.nan) for key, size in sizes.items()}
    done = np.zeros((n_jobs, shape[-1]))
    for number, (row, *_) in rows.items():
        done[number] = 1.0
        for k, point in enumerate(row):
            for key, value in point.items():
                tables[key][number, k] = value
    return {key: table.reshape(*shape, *table.shape[2:]) for key, table in (tables | {"done": done}).items()}


def _padded(rows: list[np.ndarray | None], shape: tuple[int, ...]) -> np.ndarray:
    """Lists (k, ...) of every pressure as one array (*shape without the speeds, k, ...), NaN where one is shorter."""
    known = [row for row in rows if row is not None]
    table = np.full((len(rows), max(map(len, known)), *known[0].shape[1:]), np.nan)
    for line, row in zip(table, rows, strict=True):
        if row is not None:
            line[: len(row)] = row
    return table.reshape(*shape[:-1], *table.shape[1:])


__all__ = ["MODES", "operating_map"]
