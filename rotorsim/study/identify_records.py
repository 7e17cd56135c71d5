"""Identification from the records in folders, files and campaigns: their sources, and one model of all of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identification import LinearModel, LpvModel, Prefilter, Source, UnfitError, files_of, pair, survey
from identification.campaign import NO_EXCITATION, SourceResult, identify_sources
from rotorsim.campaign import open_store
from rotorsim.campaign.store import DONE, record_path
from rotorsim.study.plans import HELD

if TYPE_CHECKING:
    from rotorsim.campaign.store import IndexRow, Store

EXCITING = ("prbs", "chirp", "multisine")
"""Kinds of experiments that move both references and are at one operating point."""
QUIET = ("steady",)


def sources_of(paths: Iterable[str | Path], mapping: Any = None) -> list[Source]:
    """Sources of campaigns and other files; the name of a campaign's experiment is the role of its records.

    Raises
    ------
    UnfitError, ReadError
        If there is nothing to read.
    StoreError
        If a campaign's store is damaged.

    Examples
    --------
    >>> import rotorsim as rs
    >>> sources = rs.study.sources_of(["run.nc"])
    """
    found: list[Source] = []
    others: list[Path] = []
    for path in map(Path, paths):
        if (path / "store.json").is_file():
            found += campaign_sources(path)
        else:
            others.append(path)
    return found + (survey(files_of(others), mapping) if others else [])


def campaign_sources(folder: Path) -> list[Source]:
    """Records with excitation in a campaign's store, each with the steady run at its operating point.

    Raises
    ------
    UnfitError
        If nothing that excites is done yet.

    Examples
    --------
    >>> import rotorsim as rs
    >>> sources = rs.study.campaign_sources(Path("mine"))  # doctest: +SKIP
    """
    store = open_store(folder)
    with closing(store.index()) as index:
        rows = list(index.rows(DONE))
    known = [source for row in rows if (source := _source(store, row)) is not None]
    found = pair(known)
    if not found:
        raise UnfitError(
            f"{folder}: no {', '.join(EXCITING)} record in the campaign is done; run it, or take a plan that excites"
        )
    return found


def _source(store: Store, row: IndexRow) -> Source | None:
    entry = next(entry for entry in store.plan.entries if entry.name == row.experiment)
    values = {**entry.parameters, **row.parameters}
    if entry.kind not in EXCITING + QUIET or not {"speed", "pressure"} <= values.keys():
        return None
    path = record_path(store.folder, row.key)
    excited = entry.kind in EXCITING
    return Source(path, float(values["speed"]), float(values["pressure"]), excited, row.experiment)


ORDER = 6
"""Default order of a black-box model."""


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
    found : list of SourceResult
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
