"""Impact tests: frequency response of the disc to the force, and ring-down of each axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from rotorsim.signals.decay import Decay, decay_of
from rotorsim.signals.missing import MissingError, need
from rotorsim.signals.prepare import sampling_time
from rotorsim.signals.pulses import Pulse, answer, find_pulses
from rotorsim.signals.record_blocks import Values
from rotorsim.signals.transfer import Sums, Transfer, solve

LEAST = 0.1
"""An answer is used from so many seconds on."""


@dataclass(frozen=True)
class RingDown:
    """A pulse, its answer (`pulses.answer`) and its decay along the pulse; `why` is the reason if there is none."""

    pulse: Pulse
    values: Values
    decay: Decay | None
    why: str


def ring_downs(record: xr.Dataset, output: str) -> list[RingDown]:
    """Ring-down after the strongest pulse along x and along y.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.signals.ring_downs(impact, "disc")
    """
    pulses = find_pulses(record)
    strongest = [max((p for p in pulses if p.axis == k), key=lambda p: abs(p.peak), default=None) for k in (0, 1)]
    return [_ring_down(record, p, output) for p in strongest if p is not None]


def _ring_down(record: xr.Dataset, pulse: Pulse, output: str) -> RingDown:
    values = answer(record, pulse, output)
    free = values["time"] > (pulse.stop - pulse.start) * sampling_time(record)
    try:
        return RingDown(pulse, values, decay_of(values["time"][free], values["disc"][free, pulse.axis]), "")
    except MissingError as missing:
        return RingDown(pulse, values, None, str(missing))


def impact_transfer(record: xr.Dataset, output: str, most: float) -> Transfer:
    """H1 (m/N) averaged over the answers to all impacts, each cut before the next; frequencies up to `most` [Hz].

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.signals.impact_transfer(impact, "disc", 500.0)
    """
    dt, pulses = sampling_time(record), find_pulses(record)
    lengths = [p.end - p.start for p in pulses]
    usable = [p for p, n in zip(pulses, lengths, strict=True) if n >= max(LEAST / dt, 0.5 * np.median(lengths))]
    need(bool(usable), f"No impact is followed by {LEAST:g} s of free motion.")
    length = min(p.end - p.start for p in usable)
    inputs = tuple(sorted({p.axis for p in usable}))
    sums = Sums()
    for pulse in usable:
        values = answer(record, pulse, output)
        u, y = values["force"][:length, inputs], values["disc"][:length]
        sums.add(np.fft.rfft(u, 2 * length, axis=0), np.fft.rfft(y, 2 * length, axis=0))
    return solve(sums, np.fft.rfftfreq(2 * length, dt), inputs, "disc_force", output, len(usable), most)
