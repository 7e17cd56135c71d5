"""Displayed readings (modes from impacts, eigenvalues) with their validity, or the reason why there is none."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.base.constants import TO_MPA, TO_RPM
from rotorsim.base.rounding import DAMPED
from rotorsim.live.rig.controls import OFF
from rotorsim.live.rig.modes import DRIFT, RigModes, RingdownReading
from rotorsim.live.rig.rig import Rig

REPLAY = "not in a replay"
SAME = 1e-3
"""Distance of eigenvalues, over the frequency, up to which they are one."""


def hit_shown(rig: Rig, kept: tuple[int, float, RingdownReading], replay: bool) -> dict[str, Any]:
    """Displayed values of the last impact: axis, frequency [Hz], zeta, scatter of both, or the reason for none."""
    epoch, speed, reading = kept
    why = _hit_void(rig, epoch, speed, reading, replay)
    shown: dict[str, Any] = {"axis": reading.axis, "why": why or reading.why}
    if not shown["why"]:
        shown |= {
            "frequency": round(reading.frequency, 1), "frequency_scatter": round(reading.frequency_scatter + 0.05, 1),
            "zeta": round(reading.zeta, 4), "zeta_scatter": round(reading.zeta_scatter + 0.00005, 4),
        }  # fmt: skip
    return shown


def _hit_void(rig: Rig, epoch: int, speed: float, reading: RingdownReading, replay: bool) -> str:
    if replay:
        return REPLAY
    if rig.stopped:
        return "the plant has stopped"
    if rig.hit is not None:
        return f"{'xy'[rig.hit.axis]}: ringing"
    if not reading.axis:
        return "not yet"
    if epoch != rig.epoch:
        return f"{rig.change} since; hit again"
    if abs(rig.speed - speed) > DRIFT:
        return "the speed has changed since; hit again"
    return ""


def eigenvalues_shown(rig: Rig, kept: tuple[int, RigModes], replay: bool) -> dict[str, Any]:
    """Plain values of the open loop's eigenvalues: frequency [Hz] and zeta by axis, the speed [rpm] and pressure [MPa]
    they are at, why there are none."""
    epoch, modes = kept
    why = _eigenvalues_void(rig, epoch, replay) or modes.why
    if why:
        return {"why": why}
    shown: dict[str, Any] = {
        "why": "", "frequency": [round(f, 1) for f in modes.frequency], "zeta": [round(z, 4) for z in modes.zeta],
        "growing": another_growing(modes), "all": modes.proven, "speed": round(modes.speed * TO_RPM),
        "open": rig.settings.positions["controller"] != OFF,
    }  # fmt: skip
    return shown | {"pressure": round(modes.pressure * TO_MPA, 3)} if rig.has_film else shown


def another_growing(modes: RigModes) -> list[float]:
    """Frequency [Hz] and damping ratio of a mode that grows and is not among those of the axes; empty without one."""
    frequency, zeta = modes.least
    axes = zip(modes.frequency, modes.zeta, strict=True)
    shown = any(np.hypot(f - frequency, (z - zeta) * f) < SAME * f for f, z in axes)
    return [] if zeta >= -DAMPED or shown else [round(frequency, 1), round(zeta, 4)]


def _eigenvalues_void(rig: Rig, epoch: int, replay: bool) -> str:
    if replay:
        return REPLAY
    if epoch != rig.epoch:
        return "being computed"
    if any(rig.settings.numbers.get(f"reference_{axis}", 0.0) for axis in "xy"):
        return "is for references of 0 V"
    return ""
