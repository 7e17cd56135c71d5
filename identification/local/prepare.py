"""From records to the signals of one local fit: gaps left out, closed loops recognised, several records joined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.errors import UnfitError
from identification.local.closed_loop import two_stage
from identification.records.checks import check_loop, check_record, check_saturation, check_signals, method_for
from identification.records.prefilter import Prefilter, chosen_output, filtered
from identification.records.sampling import sampling_time
from identification.records.stretches import Signals, joined, without_gaps

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Ready:
    """Signals of the fit and of the records themselves; external references (n, 2) [V] of closed loops; method."""

    fit: Signals
    whole: Signals
    external: np.ndarray | None
    method: str
    remarks: tuple[str, ...]


def ready(
    records: Sequence[xr.Dataset],
    method: str,
    steady: xr.Dataset | Sequence[xr.Dataset | None] | None,
    settings: Prefilter | None,
    check: bool,
    parameters: int,
) -> Ready:
    """Signals of records at one operating point; raises SchemaError or UnfitError for what no fit can take."""
    if not records:
        raise UnfitError("identify: no record; give one or several")
    if wrong := [record for record in records if not hasattr(record, "data_vars")]:
        raise UnfitError(f"identify: {wrong[0]!r} is not a record; open files with identification.read")
    calm: list[Any] = list(steady) if isinstance(steady, (list, tuple)) else [steady] * len(records)
    if len(calm) != len(records):
        raise UnfitError(f"identify.steady: {len(calm)} for {len(records)} records; give one for all or one for each")
    each = [_one(record, method, own, settings, check) for record, own in zip(records, calm, strict=True)]
    methods = {one.method for one in each}
    if methods == {"oe", "two-stage"}:
        methods = {"two-stage"}
    whole = joined([one.whole for one in each])
    excited = [one.whole.u if one.external is None else one.external for one in each]
    external = np.vstack(excited) if any(one.external is not None for one in each) else None
    name = "reference" if external is None else "reference_external"
    check_signals(whole if external is None else replace(whole, u=external), parameters, name)
    fits = [_staged(one) for one in each]
    fit = whole if all(one is other.whole for one, other in zip(fits, each, strict=True)) else joined(fits)
    remarks = tuple(dict.fromkeys(text for one in each for text in one.remarks))
    return Ready(fit, whole, external, methods.pop(), remarks)


def _one(record: xr.Dataset, method: str, steady: xr.Dataset | None, settings: Prefilter | None, check: bool) -> Ready:
    method = method_for(record, method)
    closed = method == "two-stage"
    record, signals = of_stretches(record, None if closed else steady, settings)
    if check:
        check_record(chosen_output(record, settings), sampling_time(record))
    remarks = check_loop(record, method, check)
    if closed:
        remarks += check_saturation(record, check)
    external = np.asarray(record["reference_external"].values, float) if closed else None
    return Ready(signals, signals, external, method, remarks)


def of_stretches(
    record: xr.Dataset, steady: xr.Dataset | None = None, settings: Prefilter | None = None
) -> tuple[xr.Dataset, Signals]:
    """A record without its gaps, and its signals, which know where stretches begin."""
    record, breaks, left_out = without_gaps(record)
    if breaks and settings is not None and settings.lowpass is not None:
        raise UnfitError("record: has gaps, across which no low-pass can run; cut it or leave lowpass out")
    signals = filtered(record, steady, settings)
    if breaks or left_out:
        signals = replace(signals, breaks=breaks, notes=(*signals.notes, left_out))
    return record, signals


def fit_signals(record: xr.Dataset, steady: xr.Dataset | None = None, settings: Prefilter | None = None) -> Signals:
    """Signals of the fit of one record by the method that suits it, without the checks of `identify`."""
    return _staged(_one(record, "auto", steady, settings, check=False))


def _staged(one: Ready) -> Signals:
    if one.external is None:
        return one.whole
    staged, text = two_stage(one.whole, one.external)
    return replace(staged, notes=(*staged.notes, text))
