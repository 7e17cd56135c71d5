"""Measurement of the parts of the benchmarks, a figure at a time."""

from collections.abc import Iterator
from warnings import warn

from rotorsim.base.errors import DataError, PackageLeftOut
from studies.benchmarks.parts import PARTS
from studies.benchmarks.result import Figure


def measure(part: str | None = None, cold: bool = False, full: bool = False) -> Iterator[Figure]:
    """Figures of speed and accuracy, measured here, each with its bound.

    Parameters
    ----------
    part : str, optional
        One of `PARTS`; all by default, without those that lack a package (warning PackageLeftOut).
    cold : bool
        Also time what starts with an empty cache.
    full : bool
        Also run what takes many minutes.

    Raises
    ------
    DataError
        For an unknown part or one that lacks a package, before anything is measured.
    """
    if part is not None and part not in PARTS:
        raise DataError(f"benchmarks: '{part}' is not known; choose one of {', '.join(PARTS)}, diagnose, decide, ties")
    chosen = [PARTS[name] for name in PARTS if part in (None, name) and _possible(name, part is not None)]
    jobs = [job for each in chosen for job in each.jobs(cold, full)]
    return (figure for job in jobs for figure in job())


def _possible(name: str, asked: bool) -> bool:
    """Whether what a part needs is installed; raises DataError for one asked for."""
    lacks = PARTS[name].lacks()
    if lacks and asked:
        raise DataError(f"bench {name}: needs {lacks}; 'pip install {lacks}'")
    if lacks:
        warn(f"left out: {name}, which needs {lacks}; 'pip install {lacks}'", PackageLeftOut, stacklevel=3)
    return not lacks
