"""Speed and deceleration of a coast-down."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from rotorsim.signals.envelope import envelopes
from rotorsim.signals.missing import need

BINS = 200


@dataclass(frozen=True)
class Deceleration:
    """Mean `speed` [rad/s] in stretches about `time` [s] and its negative slope `rate` [rad/s^2], each (stretch,)."""

    time: np.ndarray
    speed: np.ndarray
    rate: np.ndarray


def deceleration_of(record: xr.Dataset) -> Deceleration:
    """Deceleration in at most 200 stretches, of the size of the speed whichever way the shaft turns.

    Examples
    --------
    >>> import rotorsim as rs
    >>> down = rs.experiments.coastdown(plant, start=300.0, stop=280.0, rate=100.0, pressure=0.5e6)
    >>> float(rs.signals.deceleration_of(down).rate.mean().round(1))
    100.0
    """
    data = envelopes(record, ["speed"], BINS)["speed"]
    need(data.time.size >= 5, "The record is too short for a deceleration.")
    speed = np.abs(data.mean)
    need(bool(speed.max() > 0), "The shaft stands still.")
    return Deceleration(data.time, speed, -np.gradient(speed, data.time))
