"""Record sources for identification: a campaign's store, read through its index, or other files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from identification import Source, UnfitError, files_of, pair, survey
from rotorsim.campaign import open_store
from rotorsim.campaign.index import DONE
from rotorsim.campaign.store import record_path

if TYPE_CHECKING:
    from rotorsim.campaign.index import IndexRow
    from rotorsim.campaign.store import Store

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
    index = store.index()
    try:
        rows = list(index.rows(DONE))
    finally:
        index.close()
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
