"""Local models of one operating point: Models 3 and 2, validated on a second record."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import identification as idn
from identification.local.goodness import project
from rotorsim.study.pool import Each

if TYPE_CHECKING:
    import xarray as xr

MODELS = ("3", "2")
RECIPE = idn.Prefilter(median=3)
"""The thesis' prefilter: a running median of three. Its Model 3 has no dead time."""
NEAR = (5.0, 1e4)
"""Records are at the same operating point within so many rad/s and Pa."""
Progress = Callable[[], None]


@dataclass(frozen=True, eq=False)
class Local:
    """One operating point.

    found: Models '3' and '2'; validation: their fits (2,) on the second record, empty without one; ceiling (2,): noise
    ceiling of that record; runout: amplitudes (2,) [m, 0-pk] of what follows the shaft angle before the excitation
    begins, raw and filtered, None where the shaft does not turn.
    """

    source: idn.Source
    second: idn.Source
    found: dict[str, idn.Identification]
    validation: dict[str, np.ndarray]
    ceiling: np.ndarray
    runout: tuple[np.ndarray, np.ndarray] | None


def at_points(locals_: Sequence[Local], wanted: Iterable[tuple[float, float]]) -> list[Local]:
    """Those at the wanted operating points [rad/s, Pa], in that order; a point without one is left out."""
    found = [[one for one in locals_ if _same(one.source, *q)] for q in wanted]
    return [some[0] for some in found if some]


def _same(source: idn.Source, speed: float, pressure: float) -> bool:
    return abs(source.speed - speed) < NEAR[0] and abs(source.pressure - pressure) < NEAR[1]


def second_of(source: idn.Source, others: Sequence[idn.Source]) -> idn.Source | None:
    """The other record at the same operating point."""
    near = [s for s in others if _same(s, source.speed, source.pressure)]
    return near[0] if near else None


def make_locals(
    sources: Sequence[idn.Source], others: Sequence[idn.Source], each: Each, progress: Progress
) -> tuple[list[Local], list[str]]:
    """Locals of all records that could be identified, in their order, and a sentence for each that could not."""
    made: list[Local | str] = []
    for one in each(_local_of, [(source, second_of(source, others)) for source in sources]):
        made.append(one)
        progress()
    return [m for m in made if isinstance(m, Local)], [m for m in made if isinstance(m, str)]


def _local_of(pair: tuple[idn.Source, idn.Source | None]) -> Local | str:
    try:
        return _local(*pair)
    except idn.SchemaError as error:
        return f"{pair[0].path}: {error}"


def _local(source: idn.Source, second: idn.Source | None) -> Local:
    record, steady = idn.open_pair(source)
    found = {kind: idn.identify(record, kind, steady=steady, settings=RECIPE, dead_time=0.0) for kind in MODELS}
    runout = runout_amplitudes(record, steady)
    if second is None:
        return Local(source, source, found, {}, found["3"].ceiling, runout)
    signals = idn.filtered(*idn.open_pair(second), RECIPE)
    fits = {kind: idn.fit_of(one.model, signals) for kind, one in found.items()}
    return Local(source, second, found, fits, idn.ceiling(project(signals.y, signals.Q), signals.noise), runout)


def runout_amplitudes(record: xr.Dataset, steady: xr.Dataset | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Amplitudes (2,) [m, 0-pk] raw and filtered, of the second half of the record's rest before the excitation.

    The filter comes from the steady run; None without one or where the shaft hardly turns.
    """
    if steady is None:
        return None
    signals, raw = idn.filtered(record, steady, RECIPE), np.asarray(record["disc_measured"].values)
    part = slice(signals.rest // 2, signals.rest)
    angle = np.asarray(record["angle_measured"].values)[part]
    if len(angle) < 200 or abs(angle[-1] - angle[0]) < 4 * np.pi:
        return None
    turn = np.linspace(0, 2 * np.pi, 361)
    before, after = (np.ptp(idn.estimate_runout(angle, y[part]).at(turn), axis=0) / 2 for y in (raw, signals.y))
    return before, after
