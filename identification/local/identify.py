"""`identify`: local model with parameter uncertainty from one record, or several, at a constant operating point.

On the way from records to the signals of one fit gaps are left out, closed loops recognised and several records joined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from identification.local.closed_loop import NO_BIAS, judged, two_stage
from identification.local.fits import (
    FREE,
    actuator_signals,
    black_box,
    check_dead_time,
    delayed,
    grey_box,
    kind_for,
    own_structure,
    two_steps,
)
from identification.local.greybox import DELAYED, RATED, STRUCTURES
from identification.local.result import Identification, noted
from identification.local.structures import Structure
from identification.records import checks
from identification.records.frequency_response import FrequencyResponse
from identification.records.prefilter import Prefilter, Signals, chosen_output, filtered, joined, without_gaps
from identification.records.sampling import sampling_time
from identification.records.schema import machine_of
from rotorsim.base.errors import SchemaError, UnfitError
from rotorsim.base.processes import one_thread

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class FitSignals:
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
) -> FitSignals:
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
    checks.check_signals(whole if external is None else replace(whole, u=external), parameters, name)
    fits = [_staged(one) for one in each]
    fit = whole if all(one is other.whole for one, other in zip(fits, each, strict=True)) else joined(fits)
    remarks = tuple(dict.fromkeys(text for one in each for text in one.remarks))
    return FitSignals(fit, whole, external, methods.pop(), remarks)


def _one(
    record: xr.Dataset, method: str, steady: xr.Dataset | None, settings: Prefilter | None, check: bool
) -> FitSignals:
    method = checks.method_for(record, method)
    closed = method == "two-stage"
    record, signals = of_stretches(record, None if closed else steady, settings)
    if check:
        checks.check_record(chosen_output(record, settings), sampling_time(record))
    remarks = checks.check_loop(record, method, check)
    if closed:
        remarks += checks.check_saturation(record, check)
    external = np.asarray(record["reference_external"].values, float) if closed else None
    return FitSignals(signals, signals, external, method, remarks)


def refusal(record: xr.Dataset) -> str:
    """The sentence with which `identify` refuses a record for every model; empty where it takes it."""
    try:
        ready([record], "auto", None, None, True, min(len(one.parameters) for one in STRUCTURES.values()))
    except (SchemaError, UnfitError) as error:
        return str(error)
    return ""


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


def _staged(one: FitSignals) -> Signals:
    if one.external is None:
        return one.whole
    staged, text = two_stage(one.whole, one.external)
    return replace(staged, notes=(*staged.notes, text))


MODELS = ("1", "2", RATED, "3", "actuator", "blackbox")
METHODS = ("auto", "oe", "pem", "two-stage")
PINS_READ = "pins as their sensors read them (pin_measured); lags of these sensors count to the actuators, not the film"


def check_names(model: int | str | Structure, method: str) -> None:
    """Raise UnfitError for a model or a method of another name."""
    names: tuple[tuple[str, Any, tuple[str, ...]], ...] = (("model", model, MODELS), ("method", method, METHODS))
    for argument, value, known in names:
        if not isinstance(value, Structure) and str(value) not in known:
            raise UnfitError(
                f"{argument}: '{value}' is not known; choose one of {', '.join(known)}", argument=argument, value=value
            )


LOST = 0.25
"""Least fit of a prediction-error model, as a share of the fit that its noise allows."""


@one_thread()
def identify(
    ds: xr.Dataset | Sequence[xr.Dataset],
    model: int | str | Structure = 3,
    order: int = 6,
    method: str = "auto",
    steady: xr.Dataset | Sequence[xr.Dataset | None] | None = None,
    settings: Prefilter | None = None,
    start: Any = None,
    check: bool = True,
    dead_time: float | str = FREE,
) -> Identification:
    """Identify one record at a constant operating point, or several at the same point in one fit.

    Parameters
    ----------
    ds : Dataset or sequence of Dataset
        Record of the schema with `reference` and `disc_measured`; for models 2 and 'actuator' also `pin_measured` or,
        where there is none, `pin`: a note states it. Samples that are not finite and leaps of time are left out; every
        stretch has its own initial state, every record its own offset.
    model : 1, 2, '2-rate', 3, 'actuator', 'blackbox' or Structure
        Structure, see `identification.local.greybox` and `identification.local.blackbox`, or one of your own.
    order : int
        Of the black-box model.
    method : 'auto', 'oe', 'pem' or 'two-stage'
        Output error, which leftover imbalance disturbs less, prediction error, or two stages: output error behind what
        the external reference explains, see `identification.local.closed_loop`. 'auto' takes two stages for a record
        of a closed loop that holds `reference_external`, and output error otherwise.
    steady : Dataset or None, or a sequence of them
        Record without excitation at the same operating point, for the extended runout filter; of several records for
        all or, as a sequence, for each.
    settings : Prefilter or None
        Prefilter.
    start : sequence of float or None
        Start of the parameters in place of values found in the data, or of a structure's own.
    check : bool
        Refuse records with saturation, drop-outs, mistaken units or drift, and for output error those that name the
        controller they were made with; length and excitation are always checked. A record whose reference follows past
        displacements gives a warning.
    dead_time : float or 'free'
        Of Model 3, by which its references act later: found for each axis, with none where the record shows none; or
        given [s]; 0 for the Model 3 of the thesis, which has none.

    Returns
    -------
    Identification

    Raises
    ------
    SchemaError, UnfitError
        With one sentence about what the record lacks, or about a grey-box model with a mode above the record's
        Nyquist frequency, or a structure whose start is unfit or that is not identifiable, with the parameters' names.
    ModelError
        For a structure whose function fails or returns what are no matrices.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.identify(record, model=3)
    >>> found.model.wn.shape
    (2,)
    """
    if isinstance(ds, FrequencyResponse):
        raise UnfitError("identify: a frequency response and no record; fit_frequency_response takes it")
    own = model if isinstance(model, Structure) else None
    began, kind = perf_counter(), own.name if own else str(model)
    check_names(model, method)
    kind = kind_for(kind, dead_time)  # a structure of one's own has none of the models' names
    records: list[Any] = list(ds) if isinstance(ds, (list, tuple)) else [ds]
    count = 4 * order if kind == "blackbox" else len((own or STRUCTURES[kind]).parameters)
    made = ready(records, method, steady, settings, check, count)
    signals, method = made.fit, "oe" if made.method == "two-stage" else made.method
    pinned = kind in ("2", RATED, "actuator")
    if pinned and signals.pins is None:
        raise UnfitError(f"record: no pin; model {kind} needs pin positions, map them or take model 3")
    check_dead_time(dead_time, (len(signals.u) - signals.rest) * signals.Ts)
    if own:
        found = own_structure(own, signals, method, start)
    elif kind in ("2", RATED):
        found = two_steps(kind, signals, method, start)
    elif kind == "blackbox":
        found = black_box(signals, order, method)
    elif kind == DELAYED:
        found = delayed(signals, method, start, dead_time)
    else:
        found = grey_box(kind, signals, method, start)
    if made.external is not None:
        found = judged(found, actuator_signals(made.whole) if kind == "actuator" else made.whole, made.external)
    elif any(checks.controller_of(record) for record in records):
        found = replace(found, bias=None, warnings=(*found.warnings, NO_BIAS))
    if method == "pem":
        _check_found(found)
    if pinned and any("pin_measured" in record for record in records):
        found = noted(found, PINS_READ)
    known = replace(found.model, machine=machine_of(records[0]))
    return replace(found, model=known, seconds=perf_counter() - began, warnings=(*made.remarks, *found.warnings))


def _check_found(found: Identification) -> None:
    """Raise UnfitError where prediction error has ended at no model of the record."""
    fit, ceiling = 100 * float(found.fit.max()), 100 * float(found.ceiling.max())
    if fit < LOST * ceiling:
        raise UnfitError(
            f"identify: method pem ended at a model that explains {fit:.0f} % of the record where its noise allows "
            f"{ceiling:.0f} %; choose method 'auto', or another model"
        )
