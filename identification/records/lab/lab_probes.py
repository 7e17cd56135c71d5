"""Displacement probes of a laboratory: angle, plane, coupling and gap voltage; what dead ones leave.

A proximity probe gives volts round its gap voltage. DC-coupled, the gap voltage (or the mean) is taken off, so that
motion is measured from there; without either the reading stays as it is. AC-coupled, there is no mean to measure.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.errors import ReadError
from identification.records.probes import SAME_PLACE, WORST
from identification.records.units import quantity_at
from rotorsim.base.sentences import quote

MEAN = "mean"
OWN = ("angle", "position", "coupling", "gap")


@dataclass(frozen=True)
class LabProbe:
    """Angle [rad] from x towards y, position [m] along the shaft, coupling AC, DC or '', gap [V] or 'mean'."""

    angle: float
    position: float | None = None
    coupling: str = ""
    gap: float | str | None = None


def split_probe(path: str, table: dict[str, Any]) -> tuple[dict[str, Any], LabProbe]:
    """The entry of a probe's column and the probe itself; raises ReadError for what is missing or contradictory."""
    if "angle" not in table:
        raise ReadError(f"{path}.angle: is missing; give the probe's angle from x towards y, e.g. angle = '45 deg'")
    own = {key: table[key] for key in OWN if key in table}
    coupling, gap = own.get("coupling", ""), own.get("gap")
    if coupling not in ("", "AC", "DC"):
        raise ReadError(f"{path}.coupling: {quote(coupling)}; write AC or DC")
    if coupling == "AC" and gap is not None:
        raise ReadError(f"{path}.gap: an AC-coupled probe has no gap voltage in its signal; remove gap")
    if gap is not None and gap != MEAN:
        gap = quantity_at(f"{path}.gap", gap, "V")
    position = quantity_at(f"{path}.position", own["position"], "m") if "position" in own else None
    probe = LabProbe(quantity_at(f"{path}.angle", own["angle"], "rad"), position, coupling, gap)
    return {key: value for key, value in table.items() if key not in OWN}, probe


def disc_plane(probes: dict[str, LabProbe], wanted: float | None) -> tuple[str, ...]:
    """Names of the probes at the disc's plane, the position `wanted` [m] or the only one there is."""
    places = {name: probe.position for name, probe in probes.items()}
    if wanted is not None:
        found = tuple(name for name, z in places.items() if z is not None and abs(z - wanted) <= SAME_PLACE)
        if not found:
            raise ReadError(f"disc.position: no probe at {1e3 * wanted:.6g} mm; give the position of a probe")
        return found
    known = [z for z in places.values() if z is not None]
    if known and (len(known) < len(places) or np.ptp(known) > SAME_PLACE):
        at = ", ".join(f"{name} {'nowhere' if z is None else f'{1e3 * z:.6g} mm'}" for name, z in places.items())
        raise ReadError(f"probes: stand at several planes ({at}); state the disc's: [disc] with position = '150 mm'")
    return tuple(places)


def in_plane(readings: dict[str, np.ndarray], probes: dict[str, LabProbe]) -> dict[str, np.ndarray] | None:
    """Motion in x and y [m] from readings (n,) [m] at one plane by least squares; None if they do not see both."""
    names = list(readings)
    if len({column.size for column in readings.values()}) > 1:
        raise ReadError(f"probes {', '.join(names)}: have different numbers of samples; take columns of one length")
    angles = np.array([probes[name].angle for name in names])
    seen = np.column_stack([np.cos(angles), np.sin(angles)])
    if len(names) < 2 or np.linalg.cond(seen) > WORST:
        return None
    x, y = np.linalg.lstsq(seen, np.array(list(readings.values())), rcond=None)[0]
    return {"x": x, "y": y}


def coordinates(probes: dict[str, LabProbe]) -> dict[str, Any]:
    """Coordinates of probes as a record keeps them; the position of one that states none is NaN."""
    return {
        "probe": list(probes),
        "probe_quantity": ["relative_displacement"] * len(probes),
        "probe_position": [np.nan if p.position is None else p.position for p in probes.values()],
        "probe_angle": [p.angle for p in probes.values()],
        "probe_gain": [1.0] * len(probes),
        "probe_unit": ["m"] * len(probes),
    }
