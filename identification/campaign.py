"""Identification of many records: files of a folder, local models in parallel threads, then surfaces.

Excited records are paired with steady runs at the same operating point. Each worker holds one record in memory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.local.fits import FREE, subspace_fit
from identification.local.identify import fit_signals, identify
from identification.local.models import LinearModel
from identification.local.result import Identification, noted
from identification.lpv_fit import fit_lpv
from identification.lpv_model import SAME, LpvModel
from identification.readers import checked, load, read
from identification.records.prefilter import Prefilter, Signals, operating_point, rest_length, without_gaps
from identification.records.sampling import sampling_time
from rotorsim.base.errors import SchemaError, UnfitError
from rotorsim.base.processes import one_thread

if TYPE_CHECKING:
    import xarray as xr


SAME_POINT = (5.0, 0.02, 1e4)
"""Largest differences of a steady run from its record: of the speed in rad/s and as a share, of the pressure in Pa."""


@dataclass(frozen=True)
class Source:
    """A file with its operating point [rad/s], [Pa]; `excited` if its references move; its steady run's file.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.identification.Source(Path("run.nc"), speed=300.0, pressure=0.5e6, excited=True).steady is None
    True
    """

    path: Path
    speed: float
    pressure: float
    excited: bool
    role: str = ""
    steady: Path | None = None


def files_of(paths: Iterable[str | Path]) -> list[Path]:
    """Files as they are, and every .nc file in and below folders; raises UnfitError where there is none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> [path.name for path in rs.identification.files_of([Path("run.nc")])]
    ['run.nc']
    """
    found: list[Path] = []
    for path in map(Path, paths):
        if path.is_dir():
            inside = sorted(path.rglob("*.nc"))
            if not inside:
                raise UnfitError(f"{path}: no .nc record in it; give a campaign's folder or name the files")
            found += inside
        else:
            found.append(path)
    return found


def survey(files: Sequence[Path], mapping: Any = None) -> list[Source]:
    """Every file's operating point and, for those that excite, the nearest steady run at the same point.

    Examples
    --------
    >>> import rotorsim as rs
    >>> sources = rs.identification.survey(rs.identification.files_of([Path("run.nc")]))
    """
    return pair([_source(path, mapping) for path in files])


def pair(sources: Sequence[Source]) -> list[Source]:
    """Records that excite, each with the nearest steady run at the same point.

    Examples
    --------
    >>> import rotorsim as rs
    >>> excited = rs.identification.Source(Path("prbs.nc"), speed=300.0, pressure=0.5e6, excited=True)
    >>> quiet = rs.identification.Source(Path("steady.nc"), speed=300.0, pressure=0.5e6, excited=False)
    >>> rs.identification.pair([excited, quiet])[0].steady.name
    'steady.nc'
    """
    quiet = [s for s in sources if not s.excited]
    return [replace(s, steady=_steady(s, quiet)) for s in sources if s.excited]


def _read(path: Path, mapping: Any) -> xr.Dataset:
    """Record of `read`, or of `load` where its only fault are gaps."""
    try:
        return read(path, mapping)
    except SchemaError:
        record = load(path, mapping)
        closed, _, left_out = without_gaps(record)
        if not left_out:
            raise
        checked(closed)
        return record


def _source(path: Path, mapping: Any) -> Source:
    record = without_gaps(_read(path, mapping))[0]
    if "time" not in record.dims:
        raise UnfitError(f"{path}: holds run-up vectors; identification needs time series with reference and disc")
    speed, pressure = operating_point(record, sampling_time(record))
    excited = "reference" in record and rest_length(np.asarray(record["reference"].values)) < record.sizes["time"]
    role = str(record.attrs.get("role", ""))
    return Source(path, speed, pressure, excited, role)


def _steady(source: Source, quiet: Sequence[Source]) -> Path | None:
    def near(other: Source) -> bool:
        slow = abs(other.speed - source.speed) < max(SAME_POINT[0], SAME_POINT[1] * abs(source.speed))
        return slow and not abs(other.pressure - source.pressure) > SAME_POINT[2]

    fitting = [other for other in quiet if near(other)]
    return min(fitting, key=lambda other: abs(other.speed - source.speed)).path if fitting else None


def open_pair(source: Source, mapping: Any = None) -> tuple[xr.Dataset, xr.Dataset | None]:
    """The record and its steady run.

    Examples
    --------
    >>> import rotorsim as rs
    >>> source = rs.identification.survey([Path("run.nc")])[0]
    >>> excited, steady = rs.identification.open_pair(source)
    >>> steady is None
    True
    """
    record = _read(source.path, mapping)
    if source.steady is None or abs(source.speed) < 1:
        return record, None
    return record, without_gaps(_read(source.steady, mapping))[0]


NO_EXCITATION = "no record whose reference moves; identification needs excitation"


@dataclass(frozen=True, eq=False)
class SourceResult:
    """A file with the result of its identification, or the sentence why there is none."""

    source: Source
    result: Identification | None
    error: str = ""
    black_box_fit: np.ndarray | None = None
    """Fit (2,) of a black-box model to the same signals, where one was asked for and the record is long enough."""


def identify_source(source: Source, mapping: Any = None, compared: int = 0, **options: Any) -> SourceResult:
    """Local model of one file, with the options of `identify`, or the sentence why there is none.

    A grey-box model is `compared` with a black box of that order, of 0 with none.
    """
    try:
        record, steady = open_pair(source, mapping)
        found = SourceResult(source, identify(record, steady=steady, **options))
    except SchemaError as error:
        return SourceResult(source, None, f"{source.path}: {error}")
    if compared and found.result is not None and found.result.kind not in ("actuator", "blackbox"):
        with suppress(UnfitError):
            signals = fit_signals(record, steady, options.get("settings"))
            return replace(found, black_box_fit=subspace_fit(signals, compared))
    return found


@one_thread()
def identify_all(
    sources: Sequence[Source], mapping: Any = None, workers: int = 2,
    progress: Callable[[SourceResult], None] | None = None, **options: Any,
) -> list[SourceResult]:  # fmt: skip
    """Local models of files, in their order; `progress` is called as each is finished."""

    def one(source: Source) -> SourceResult:
        found = identify_source(source, mapping, **options)
        if progress is not None:
            progress(found)
        return found

    with ThreadPoolExecutor(max_workers=max(workers, 1)) as pool:
        return list(pool.map(one, sources))


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
    progress: Callable[[SourceResult], None] | None = None,
    dead_time: float | str = FREE,
    compared: int = 0,
) -> tuple[LinearModel | LpvModel, list[SourceResult]]:
    """One model of many records: linear for one operating point, parameter-varying for several; with what each gave.

    Options of `identify` hold for every record, `surfaces` and `refine` are those of `fit_lpv`. Records with a role in
    `held` take no part in the surfaces; `progress` gets each `SourceResult`. Where a free dead time shows in some
    records only, all are identified without. Several fitted together at one operating point give a result more.

    Raises UnfitError if no record gives a model, or there is none.
    """
    options: dict[str, Any] = {"model": model, "order": order, "method": method, "settings": settings}
    found = identify_all(sources, mapping, workers, progress, dead_time=dead_time, compared=compared, **options)
    if dead_time == FREE and len({one.result.kind for one in found if one.result is not None}) > 1:
        dead_time, text = 0.0, "other records show no dead time: identified without"
        plain = identify_all(sources, mapping, workers, dead_time=dead_time, **options)
        found = [
            new if new.result is None else replace(one, result=noted(new.result, text))
            for one, new in zip(found, plain, strict=True)
        ]
    good = [(one.source, one.result) for one in found if one.result is not None]
    if not good:
        raise UnfitError(found[0].error if found else NO_EXCITATION)
    fitted = [(source, result) for source, result in good if source.role not in held] or good
    results = [result for _, result in fitted]
    points = {_point(result) for result in results}
    if len(points) == 1 < len(fitted):
        records, steady = zip(*(open_pair(source, mapping) for source, _ in fitted), strict=True)
        both = identify(records, steady=steady, dead_time=dead_time, **options)
        together = replace(fitted[0][0], path=Path(f"{len(fitted)} together"))
        return both.model, [*found, SourceResult(together, both)]
    if len(points) == 1 or results[0].kind == "actuator":
        return results[0].model, found
    others = [result for source, result in good if source.role in held]
    again = [partial(_signals, source, settings, mapping) for source, _ in fitted] if refine == "global" else ()
    return fit_lpv(results, surfaces, others, refine, again), found


def _signals(source: Source, settings: Prefilter | None, mapping: Any) -> Signals:
    record, steady = open_pair(source, mapping)
    return fit_signals(record, steady, settings)


def _point(result: Identification) -> tuple[int, int] | None:
    """Operating point, rounded; None where it is not known."""
    speed, pressure = result.speed / SAME[0], result.pressure / SAME[1]
    return (round(speed), round(pressure)) if isfinite(speed) and isfinite(pressure) else None
