"""Checks of a record before it is compared: constant speed, the dither of a closed loop, the angle, its accuracy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identification.records.prefilter import measured
from rotorsim.base.constants import RIG_SAMPLE, TO_RPM
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.window import TURNING

if TYPE_CHECKING:
    import xarray as xr

LARGEST_ACCURACY = 1e-3
"""Accuracy [m] from which a record shows nothing."""
TURNED = {60 / (2 * np.pi): "rpm taken for rad/s", 2 * np.pi: "Hz taken for rad/s", 60.0: "Hz taken for rpm"}
"""Ratios of a speed to the turning of the angle, or the other way round, that a wrong unit makes."""


def stated_accuracy(record: xr.Dataset, name: str) -> float:
    """Attribute `accuracy` [m] of a record, 0 where there is none; raises DataError for one that is not a length."""
    value = record.attrs.get("accuracy", 0.0)
    try:
        found = float(value)
    except (TypeError, ValueError):
        found = -1.0
    if not 0 <= found < LARGEST_ACCURACY:
        raise DataError(f"{name}: the accuracy is {value!r}; give the standard deviation of an amplitude in metres")
    return found


def check_constant(record: xr.Dataset, name: str) -> None:
    """The speed may differ by 2 % or 2 rad/s, in means of 250 samples."""
    speed = measured(record, "speed")
    if speed is None or speed.ndim == 0 or len(speed) < 1000:
        return
    slow = speed[: len(speed) // 250 * 250].reshape(-1, 250).mean(axis=1)[1:]
    if np.ptp(slow) > max(2.0, 0.02 * abs(slow.mean())):
        raise DataError(
            f"{name}: the speed goes from {slow.min() * TO_RPM:.0f} to {slow.max() * TO_RPM:.0f} rpm; "
            "give records at constant speed, or a run-up with its angle and without excitation"
        )


def check_loop(record: xr.Dataset, name: str) -> None:
    """Closed loop: the dither that was added must be there, and the reference that acted is what is fed."""
    closed = "controller" in record.attrs or str(record.attrs.get("experiment", "")) == "controlled"
    if closed and "reference_external" not in record:
        raise DataError(
            f"{name}: was recorded in closed loop without the dither that was added; record reference_external as well"
        )


def check_turning(record: xr.Dataset, speed: float, n: int, name: str) -> None:
    """The angle must turn as fast as the speed signal."""
    angle = measured(record, "angle")
    if angle is None or angle.ndim == 0 or abs(speed) < TURNING or n < 1000:
        return
    slope = float(np.polyfit(RIG_SAMPLE * np.arange(n), np.unwrap(angle), 1)[0])
    if abs(slope - speed) < 0.02 * abs(speed) + 1.0:
        return
    ratio = abs(speed / slope) if slope else np.inf
    units = [what for factor, what in TURNED.items() if min(abs(ratio / factor - 1), abs(ratio * factor - 1)) < 0.02]
    way = f"is there {units[0]}? state the unit in the mapping; nothing was assumed" if units else "check both channels"
    raise DataError(f"{name}: the speed is {speed:.5g} rad/s, but the angle turns at {slope:.5g} rad/s; {way}")


__all__ = ["check_constant", "check_loop", "check_turning", "stated_accuracy"]
