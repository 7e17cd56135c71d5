"""One model of the records in folders, files and campaigns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from identification import LinearModel, LpvModel, Prefilter, UnfitError
from identification.campaign import NO_EXCITATION, SourceResult, identify_sources
from rotorsim.study.plans import HELD
from rotorsim.study.sources import sources_of

ORDER = 6
"""Of a black-box model."""


def identify_records(
    paths: Sequence[str | Path],
    model: int | str = 3,
    order: int | None = None,
    method: str = "auto",
    settings: Prefilter | None = None,
    mapping: Any = None,
    surfaces: int | str = 2,
    refine: str = "none",
    workers: int = 2,
    progress: Callable[[int], Callable[[SourceResult], None]] | None = None,
    dead_time: float | str = "free",
) -> tuple[LinearModel | LpvModel, list[SourceResult]]:
    """Identify records of files, folders or campaigns: a linear model of one operating point, an LPV model of several.

    Parameters
    ----------
    paths : sequence of path
        Files of records, folders of them, folders of campaigns.
    model : int or str
        1, 2, 3, "actuator" or "blackbox".
    order, method
        Order of a black-box model, 6 if None; "auto", "oe" (output error), "two-stage" (closed loops) or "pem"
        (prediction error).
    settings : Prefilter, optional
        Runout, spike and low-pass filters, probes.
    mapping : path or Mapping, optional
        Which column of a measured file is which channel.
    surfaces : int or str
        Degree of the parameters over speed and pressure, or "hold-out", which chooses it.
    refine : str
        Refinement of the surfaces: "none", "frequency" or "global".
    workers : int
        Records identified at a time.
    progress : callable, optional
        Takes the number of records and returns what is called with each result.
    dead_time : float or "free"
        Of model 3 [s], as for `identify`.

    Returns
    -------
    model : LinearModel or LpvModel
    found : list of Local
        Result or sentence of every record, then of several that one operating point joined.

    Raises
    ------
    UnfitError
        If no record gives a model, or for an order of a model that has none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> model, found = rs.identify_records(["my_campaign"], model=2)  # doctest: +SKIP
    >>> model.save("model.json")  # doctest: +SKIP
    """
    if order is not None and str(model) != "blackbox":
        raise UnfitError(f"identify.order: {order} for model {model}; only model blackbox has an order")
    order = ORDER if order is None else order
    sources = sources_of(paths, mapping)
    if not sources:
        raise UnfitError(f"{paths[0]}: {NO_EXCITATION}")
    shown = progress(len(sources)) if progress is not None else None
    return identify_sources(
        sources, model, order, method, settings, mapping, surfaces, refine, HELD, workers, shown, dead_time
    )
