"""Record files of a folder, and pairs of excited records with steady runs at the same operating point."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import SchemaError, UnfitError
from identification.readers import checked, load, read
from identification.records.lab.without_gaps import without_gaps
from identification.records.prefilter import operating_point, rest_length
from identification.records.sampling import sampling_time

if TYPE_CHECKING:
    import xarray as xr

NEAR = (5.0, 0.02, 1e4)
"""A steady run belongs to a record within so many rad/s, this share of the speed, and so many Pa."""


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
    """Those that excite, each with the nearest steady run at the same point.

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
    """As `read`, but a record with gaps comes as it is."""
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
        slow = abs(other.speed - source.speed) < max(NEAR[0], NEAR[1] * abs(source.speed))
        return slow and not abs(other.pressure - source.pressure) > NEAR[2]

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
