"""Lower and upper envelopes of long signals for plotting, read block by block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from rotorsim.signals.record_blocks import blocks

BINS = 600


@dataclass(frozen=True)
class Envelope:
    """Least, largest and mean value (bin, ...) of a variable in stretches of the record around `time` (bin,) [s]."""

    time: np.ndarray
    least: np.ndarray
    most: np.ndarray
    mean: np.ndarray


def envelopes(record: xr.Dataset, names: Sequence[str], bins: int = BINS) -> dict[str, Envelope]:
    """Envelopes of some variables in at most `bins` stretches of equally many samples, in one pass."""
    per_bin = max(1, -(-record.sizes["time"] // bins))
    rows: dict[str, list[tuple[np.ndarray, ...]]] = {name: [] for name in names}
    time = []
    for block in blocks(record, ["time", *names], per_bin * max(1, 100_000 // per_bin)):
        starts = np.arange(0, len(block["time"]), per_bin)
        counts = np.diff(np.append(starts, len(block["time"])))
        time.append(np.add.reduceat(block["time"], starts) / counts)
        for name in names:
            v = block[name]
            mean = np.add.reduceat(v, starts) / counts.reshape(-1, *(1,) * (v.ndim - 1))
            rows[name].append((np.minimum.reduceat(v, starts), np.maximum.reduceat(v, starts), mean))
    middle = np.concatenate(time)
    return {k: Envelope(middle, *(np.concatenate(part) for part in zip(*v, strict=True))) for k, v in rows.items()}
