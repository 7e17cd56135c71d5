"""Motion in x and y at one plane from the readings of two or more displacement probes there.

A probe at the angle a reads r = g (x cos a + y sin a), its gain g holding sensitivity and sense; two at different
angles give x and y, more of them by least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from identification.errors import SchemaError
from identification.records.schema import require
from rotorsim.base.sentences import did_you_mean

if TYPE_CHECKING:
    import xarray as xr

WORST = 20.0
"""Largest condition number of the probes' directions: two probes about 6 degrees apart."""
SAME_PLACE = 1e-6
"""Probes nearer than this [m] are at one plane."""
DISPLACEMENTS = ("relative_displacement", "absolute_displacement")


def probe_outputs(record: xr.Dataset, names: Sequence[str]) -> xr.Dataset:
    """The record with the motion that the probes `names` see as `disc_measured` (n, 2) [m], and without `disc`.

    Raises SchemaError for a name that is not there, a probe that measures no displacement, planes that differ and
    probes that do not see both x and y.
    """
    require(record, "probe_measured", use="the choice of probes")
    known = record["probe"].values.tolist()
    for name in names:
        if name not in known:
            raise SchemaError(f"probes: no '{name}' in the record; {did_you_mean(name, known)}")
    chosen = record["probe_measured"].isel(probe=[known.index(name) for name in names])
    _check_plane(chosen, names)
    gain, angle = (np.asarray(chosen[f"probe_{what}"].values, float) for what in ("gain", "angle"))
    seen = gain[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    if len(set(names)) < 2 or np.linalg.cond(seen / np.abs(gain[:, None])) > WORST:
        raise SchemaError(f"probes {', '.join(names)}: do not see both x and y; choose two at different angles")
    motion = np.linalg.lstsq(seen, np.asarray(chosen.values, float).T, rcond=None)[0].T
    attrs = {"units": "m", "long_name": f"displacement seen by the probes {', '.join(names)}"}
    return record.drop_vars("disc", errors="ignore").assign(disc_measured=(("time", "axis"), motion, attrs))


def _check_plane(chosen: xr.DataArray, names: Sequence[str]) -> None:
    """Refuse probes that lack coordinates, measure no displacement or stand at different planes."""
    for what in ("quantity", "angle", "gain", "position"):
        if f"probe_{what}" not in chosen.coords:
            raise SchemaError(f"record: no coordinate 'probe_{what}'; it is needed to make x and y of probes")
    for name, quantity in zip(names, chosen["probe_quantity"].values.tolist(), strict=True):
        if quantity not in DISPLACEMENTS:
            raise SchemaError(f"probe {name}: measures {quantity}; choose displacement probes")
    if len(set(chosen["probe_quantity"].values.tolist())) > 1:
        raise SchemaError(f"probes {', '.join(names)}: measure relative and absolute displacement; choose one kind")
    place = np.asarray(chosen["probe_position"].values, float)
    if np.ptp(place) > SAME_PLACE:
        at = ", ".join(f"{1e3 * z:.6g}" for z in place)
        raise SchemaError(f"probes {', '.join(names)}: stand at {at} mm; choose probes of one plane")
