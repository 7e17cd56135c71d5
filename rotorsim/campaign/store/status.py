"""State of a campaign: finished, failed and remaining cases, computing time, reasons of failures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rotorsim.campaign.store.index import FAILED
from rotorsim.campaign.store.store import open_store


def status(folder: str | Path, failures: int = 5) -> dict[str, Any]:
    """Counts of cases by state, computing time [s], bytes, and the first failed cases; also while it runs.

    Parameters
    ----------
    folder : path
        Of the campaign; raises StoreError where it is damaged.
    failures : int
        How many failed cases to list.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.campaign.status("mine")["done"]
    1
    """
    store = open_store(Path(folder))
    index = store.index()
    try:
        counts, (seconds, size) = index.counts(), index.totals()
        rows = [(row.number, row.experiment, row.parameters, row.error) for row in index.rows(FAILED, limit=failures)]
    finally:
        index.close()
    named = [dict(zip(("number", "experiment", "parameters", "error"), row, strict=True)) for row in rows]
    return {"name": store.plan.name, **counts, "computing_s": seconds, "bytes": size, "failures": named}
