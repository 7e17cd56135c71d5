"""Identification of many records: local models in parallel threads, then surfaces; one record in memory per worker."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any

from identification.errors import SchemaError, UnfitError
from identification.local.dead_time import FREE
from identification.local.identify import identify
from identification.local.models import LinearModel
from identification.local.prepare import fit_signals
from identification.local.result import Identification, noted
from identification.lpv.fit import fit_lpv
from identification.lpv.model import LpvModel
from identification.lpv.surfaces import SAME
from identification.records.folder import Source, open_pair
from identification.records.prefilter import Prefilter, Signals
from identification.threads import one_thread

NO_EXCITATION = "no record whose reference moves; identification needs excitation"


@dataclass(frozen=True, eq=False)
class Local:
    """A file and what came of it: a result, or the sentence why not."""

    source: Source
    result: Identification | None
    error: str = ""


def identify_source(
    source: Source, model: int | str = 3, order: int = 6, method: str = "auto", settings: Prefilter | None = None,
    mapping: Any = None, dead_time: float | str = FREE,
) -> Local:  # fmt: skip
    """Local model of one file, or the sentence why there is none."""
    try:
        record, steady = open_pair(source, mapping)
        return Local(source, identify(record, model, order, method, steady, settings, dead_time=dead_time))
    except SchemaError as error:
        return Local(source, None, f"{source.path}: {error}")


@one_thread
def identify_all(
    sources: Sequence[Source],
    model: int | str = 3,
    order: int = 6,
    method: str = "auto",
    settings: Prefilter | None = None,
    mapping: Any = None,
    workers: int = 2,
    progress: Callable[[Local], None] | None = None,
    dead_time: float | str = FREE,
) -> list[Local]:
    """Local models of files, in their order; `progress` is called as each is finished."""

    def one(source: Source) -> Local:
        found = identify_source(source, model, order, method, settings, mapping, dead_time)
        if progress is not None:
            progress(found)
        return found

    with ThreadPoolExecutor(max_workers=max(workers, 1)) as pool:
        return list(pool.map(one, sources))


def loaders(
    locals_: Sequence[Local], settings: Prefilter | None = None, mapping: Any = None
) -> list[Callable[[], Signals]]:
    """Functions that read and filter each record again, for `fit_lpv(refine='global')`."""
    return [partial(_signals, one.source, settings, mapping) for one in locals_]


def _signals(source: Source, settings: Prefilter | None, mapping: Any) -> Signals:
    record, steady = open_pair(source, mapping)
    return fit_signals(record, steady, settings)


def identify_sources(
    sources: Sequence[Source],
    model: int | str = 3,
    order: int = 6,
    method: str = "auto",
    settings: Prefilter | None = None,
    mapping: Any = None,
    surfaces: int | str = 2,
    refine: str = "none",
    held: Sequence[str] = (),
    workers: int = 2,
    progress: Callable[[Local], None] | None = None,
    dead_time: float | str = FREE,
) -> tuple[LinearModel | LpvModel, list[Local]]:
    """One model of many records: linear for one operating point, parameter-varying for several.

    Parameters
    ----------
    sources : sequence of Source
        Records, see `survey` and `rotorsim.study.sources_of`.
    model, order, method, settings, mapping
        As for `identify`, of every record.
    surfaces, refine
        As for `fit_lpv`: degree over the operating points or "hold-out"; none, frequency or global.
    held : sequence of str
        Roles of records that take no part in the surfaces.
    workers : int
        Records identified at a time.
    progress : callable, optional
        Called with each `Local`.
    dead_time : float or "free"
        Of model 3, as for `identify`; where a free one shows in some records only, all are identified without.

    Returns
    -------
    model : LinearModel or LpvModel
    found : list of Local
        A result or a sentence per record; where several at one operating point were fitted together, that as well.

    Raises
    ------
    UnfitError
        If no record gives a model, or there is none.
    """
    found = identify_all(sources, model, order, method, settings, mapping, workers, progress, dead_time)
    if dead_time == FREE and len({one.result.kind for one in found if one.result is not None}) > 1:
        dead_time = 0.0
        found = identify_all(sources, model, order, method, settings, mapping, workers, None, dead_time)
        text = "other records show no dead time: identified without"
        found = [one if one.result is None else replace(one, result=noted(one.result, text)) for one in found]
    good = [one for one in found if one.result is not None]
    if not good:
        raise UnfitError(found[0].error if found else NO_EXCITATION)
    if together := _together(good, held):
        records, steady = zip(*(open_pair(one.source, mapping) for one in together), strict=True)
        both = identify(records, model, order, method, steady, settings, dead_time=dead_time)
        return both.model, [*found, Local(replace(together[0].source, path=Path(f"{len(together)} together")), both)]
    return _model(good, surfaces, refine, settings, mapping, held), found


def _together(good: list[Local], roles: Sequence[str]) -> list[Local]:
    """The records of one operating point that make one model, where there are several."""
    fitted = [one for one in good if one.source.role not in roles] or good
    points = {_point(one.result) for one in fitted if one.result is not None}
    return fitted if len(fitted) > 1 and len(points) == 1 else []


def _point(result: Identification) -> tuple[int, int] | None:
    """Operating point, rounded; None where it is not known."""
    speed, pressure = result.speed / SAME[0], result.pressure / SAME[1]
    return (round(speed), round(pressure)) if isfinite(speed) and isfinite(pressure) else None


def _model(
    good: list[Local], surfaces: int | str, refine: str, settings: Any, mapping: Any, roles: Sequence[str]
) -> LinearModel | LpvModel:
    """A linear model of one operating point; surfaces through several."""
    fitted = [one for one in good if one.source.role not in roles] or good
    results = [one.result for one in fitted if one.result is not None]
    points = {_point(result) for result in results}
    if len(points) == 1 or results[0].kind == "actuator":
        return results[0].model
    held = [one.result for one in good if one.source.role in roles and one.result is not None]
    again = loaders(fitted, settings, mapping) if refine == "global" else ()
    return fit_lpv(results, surfaces, held, refine, again)
