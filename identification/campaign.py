"""Identification of many records: local models in parallel threads, then surfaces; one record in memory per worker."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any

from identification.errors import SchemaError
from identification.local.identify import identify
from identification.local.result import Identification
from identification.records.folder import Source, open_pair
from identification.records.prefilter import Prefilter, Signals, filtered
from identification.threads import one_thread


@dataclass(frozen=True, eq=False)
class Local:
    """A file and what came of it: a result, or the sentence why not."""

    source: Source
    result: Identification | None
    error: str = ""


def identify_source(
    source: Source, model: int | str = 3, order: int = 6, method: str = "oe", settings: Prefilter | None = None,
    mapping: Any = None,
) -> Local:  # fmt: skip
    """Local model of one file, or the sentence why there is none."""
    try:
        record, steady = open_pair(source, mapping)
        return Local(source, identify(record, model, order, method, steady, settings))
    except SchemaError as error:
        return Local(source, None, f"{source.path}: {error}")


@one_thread
def identify_all(
    sources: Sequence[Source],
    model: int | str = 3,
    order: int = 6,
    method: str = "oe",
    settings: Prefilter | None = None,
    mapping: Any = None,
    workers: int = 2,
    progress: Callable[[Local], None] | None = None,
) -> list[Local]:
    """Local models of files, in their order; `progress` is called as each is finished."""

    def one(source: Source) -> Local:
        found = identify_source(source, model, order, method, settings, mapping)
        if progress is not None:
            progress(found)
        return found

    with ThreadPoolExecutor(max_workers=max(workers, 1)) as pool:
        return list(pool.map(one, sources))


def loaders(
    locals_: Sequence[Local], settings: Prefilter | None = None, mapping: Any = None
) -> list[Callable[[], Signals]]:
    """Functions that read and filter each record again, for `fit_lpv(refine='global')`."""
    return [partial(_signals, one.source, settings, mapping) for one in locals_]


def _signals(source: Source, settings: Prefilter | None, mapping: Any) -> Signals:
    record, steady = open_pair(source, mapping)
    return filtered(record, steady, settings)
