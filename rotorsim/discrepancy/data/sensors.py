"""Checks of what a record's sensors are: speed, x and y of the disc, planes of the machine file, ring of the probes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.changes import RING_KEY, ring_angle
from rotorsim.discrepancy.data.spectra import Trial, only_probe
from rotorsim.machine import Machine
from rotorsim.plant.mesh import Mesh

if TYPE_CHECKING:
    import xarray as xr

SAME_PLANE = 1e-3
"""Distance [m] up to which a probe of a record stands at a plane of the machine file."""
TURNING = ("speed", "speed_measured", "angle", "angle_measured")


def check_sensors(machine: Machine, record: xr.Dataset, name: str) -> None:
    """Raise DataError for a record without a speed, without x and y of the disc, or of another plane."""
    if not any(channel in record for channel in TURNING):
        raise DataError(f"{name}: has no speed and no keyphasor; map one, or state [constants] speed in the mapping")
    if "disc_measured" in record or "disc" in record or "probe_measured" not in record:
        check_plane(machine, record.attrs.get("disc_position"), name)
    elif (probe := only_probe(record)) is not None:
        position = float(probe["probe_position"])
        check_plane(machine, None if np.isnan(position) else position, name)
    else:
        probes = ", ".join(map(str, record["probe"].values))
        raise DataError(
            f"{name}: has readings of {probes}, which are not x and y of the disc; a diagnosis needs one displacement "
            "probe with its angle, or two at one plane"
        )


def check_plane(machine: Machine, stated: Any, name: str) -> None:
    """Raise DataError where probes at the position `stated` [m] are not where the machine file has its own."""
    if stated is None:
        return
    own = Mesh(machine).probe
    if abs(float(stated) - own) > SAME_PLANE:
        raise DataError(
            f"{name}: its probes stand at {1e3 * float(stated):.6g} mm, the machine file's at {1e3 * own:.6g} mm; "
            "set [probe] position there, or [disc] position in the mapping"
        )


def check_ring(machine: Machine, trial: Trial) -> None:
    """Raise DataError for a single probe on a sensor ring that is turned: the record states where the probe stands."""
    if trial.probe_angle is not None and (trial.changes.get(RING_KEY) or ring_angle(machine)):
        raise DataError(
            f"{trial.name}: the sensor ring is turned, but the record has one probe; leave the ring out of [changes] "
            "and of the machine file, and state the angle of the probe"
        )
