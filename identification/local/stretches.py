"""Stretches of a local fit: those of a record with gaps, and several records of one operating point.

The signals of all stretches stand behind each other; `Signals.breaks` are the numbers of the samples at which the later
ones begin. Each stretch has an initial state of its own in the fit. Those of one record share its offset and its
harmonics of the shaft angle; records have their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from identification.errors import UnfitError
from identification.records.checks import DRIFT
from identification.records.prefilter import Signals

ALIKE = 1e-3
"""Relative difference of sampling times that are the same."""


def parts_of(breaks: Sequence[int], n: int) -> Iterator[slice]:
    """Slices of the stretches of n samples."""
    edges = [0, *breaks, n]
    return (slice(a, b) for a, b in pairwise(edges))


def longest_part(signals: Signals) -> slice:
    """The stretch with the most samples after the rest of the first."""
    parts = list(parts_of(signals.breaks, len(signals.u)))
    return max(parts, key=lambda part: part.stop - max(part.start, signals.rest))


def regressors_of(Q: np.ndarray, at: slice) -> tuple[np.ndarray, np.ndarray]:
    """Regressors (n, k) of a part of the samples and their numbers, without those that are zero there."""
    shown = np.flatnonzero(np.any(Q[at] != 0, axis=0))
    return np.ascontiguousarray(Q[at][:, shown]), shown


def offsets(n: int, breaks: Sequence[int]) -> np.ndarray:
    """An offset for each stretch, orthonormal, (n, stretches)."""
    columns = np.zeros((n, len(breaks) + 1))
    for k, part in enumerate(parts_of(breaks, n)):
        columns[part, k] = (part.stop - part.start) ** -0.5
    return columns


def joined(records: Sequence[Signals]) -> Signals:
    """Signals of several records at one operating point as one.

    Raises
    ------
    UnfitError
        If their sampling times or operating points differ, or only some have pins.
    """
    first = records[0]
    if len(records) == 1:
        return first
    for k, other in enumerate(records[1:], start=2):
        _check_alike(first, other, k)
    lengths = [len(one.u) for one in records]
    starts = np.cumsum([0, *lengths[:-1]])
    breaks = [int(at + b) for at, one in zip(starts, records, strict=True) for b in (0, *one.breaks)][1:]
    Q = np.zeros((sum(lengths), sum(one.Q.shape[1] for one in records)))
    column = 0
    for at, one in zip(starts, records, strict=True):
        Q[at : at + len(one.u), column : column + one.Q.shape[1]] = one.Q
        column += one.Q.shape[1]
    notes = tuple(dict.fromkeys(text for one in records for text in one.notes))
    return replace(
        first, u=_stacked([one.u for one in records]), y=_stacked([one.y for one in records]), Q=Q,
        truth=None if any(one.truth is None for one in records) else _stacked([one.truth for one in records]),
        pins=None if any(one.pins is None for one in records) else _stacked([one.pins for one in records]),
        acting=None if all(one.acting is None for one in records) else _stacked([_acting(one) for one in records]),
        noise=np.sqrt(np.average([one.noise**2 for one in records], axis=0, weights=lengths)),
        speed=float(np.average([one.speed for one in records], weights=lengths)),
        pressure=float(np.average([one.pressure for one in records], weights=lengths)),
        notes=(*notes, f"{len(records)} records in one fit"), breaks=tuple(breaks),
    )  # fmt: skip


def _acting(one: Signals) -> np.ndarray:
    """Reference and pins that acted: in open loop those of the fit."""
    if one.acting is not None:
        return one.acting
    return one.u if one.pins is None else np.hstack([one.u, one.pins])


def _stacked(values: Sequence[np.ndarray | None]) -> np.ndarray:
    return np.ascontiguousarray(np.vstack([one for one in values if one is not None]))


def _check_alike(first: Signals, other: Signals, number: int) -> None:
    if abs(other.Ts / first.Ts - 1) > ALIKE:
        raise UnfitError(
            f"record {number}: a sample every {other.Ts:.6g} s, the first record's every {first.Ts:.6g} s; one local "
            "fit takes records of one sampling time"
        )
    for name in DRIFT:
        share, least, unit = DRIFT[name]
        a, b = getattr(first, name), getattr(other, name)
        if abs(b - a) > max(share * abs(a), least):
            raise UnfitError(
                f"record {number}: {name} {b:.5g} {unit}, the first record's {a:.5g} {unit}; one local fit takes "
                "records of one operating point: identify each alone and fit_lpv them"
            )
    if (first.pins is None) != (other.pins is None):
        raise UnfitError(f"record {number}: only some of the records have pin positions; map them in all or drop them")
