"""Selection of a short stretch of a long record to plot with every sample."""

from __future__ import annotations

import numpy as np
import xarray as xr

from rotorsim.signals.prepare import sampling_time
from rotorsim.signals.record_blocks import blocks

SECONDS, TURNS = 0.25, 8.0
"""Length of the stretch; the shaft makes at most so many turns in it, but it lasts at least a fifth."""
LEAD = 0.1
"""Share of the stretch that lies before the event."""


def eventful_stretch(record: xr.Dataset, names: list[str], speed: float) -> slice:
    """Samples about the largest change of the inputs `names` (time, axis); the middle of the record without any.

    `speed` [rad/s] shortens the stretch of a fast shaft.
    """
    dt, n = sampling_time(record), record.sizes["time"]
    seconds = np.clip(2 * np.pi * TURNS / speed, SECONDS / 5, SECONDS) if speed > 0 else SECONDS
    count = int(min(n, max(2, round(float(seconds) / dt))))
    event = largest_change(record, names)
    start = n // 2 - count // 2 if event is None else event - round(LEAD * count)
    start = int(np.clip(start, 0, n - count))
    return slice(start, start + count)


def largest_change(record: xr.Dataset, names: list[str]) -> int | None:
    """Sample of the largest change from one sample to the next, of the first input that changes at all."""
    best: dict[str, tuple[float, int]] = {}
    last: dict[str, np.ndarray] = {}
    position = 0
    for block in blocks(record, names) if names else ():
        for name, values in block.items():
            joined = np.concatenate((last.get(name, values[:1]), values))
            change = np.abs(np.diff(joined, axis=0)).max(axis=1)
            i = int(change.argmax())
            if change[i] > best.get(name, (0.0, 0))[0] * (1 + 1e-6):
                best[name] = (float(change[i]), position + i)
            last[name] = values[-1:]
        position += len(block[names[0]])
    return next((best[name][1] for name in names if name in best), None)
