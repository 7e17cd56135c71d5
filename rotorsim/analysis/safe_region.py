"""Safe operating region: lifted, every mode damped, at least 15 % away from a critical speed (thesis), or not known.

A crossing of a natural frequency with the speed is a critical speed where it amplifies, 1 / (2 zeta) of 2.5 or more;
API 684 calls one below that critically damped and asks for no margin. Crossings count whichever way the natural
frequency crosses and the mode whirls, since bearings and supports that are not isotropic answer to both. They are
looked for around each speed as far as they matter to it, beyond the ends of the map too. Where the film carries only on
a part of that, or the number of modes is not proven, a point that is not found unsafe is not known: NaN.

Cites: api_684, thesis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.analysis.campbell import along_speeds, crossing_numbers
from rotorsim.analysis.modes_over_speed import MARGIN, ModesOverSpeed, modes_over_speed
from rotorsim.base.errors import ConvergenceError, NoLiftOffError
from rotorsim.base.rounding import DAMPED
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant

if TYPE_CHECKING:
    import xarray as xr

AMPLIFIED = 2.5
"""Amplification factor 1 / (2 zeta) from which a crossing is a critical speed."""
SHOWN = 6
"""Branches that are kept for a Campbell diagram."""
FIRST = 4
"""Modes that are looked at at every speed, however low it is: the first two pairs."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Modes at and critical speeds around the speeds (n,) of a row of a map.

    `looked` (n,) is 1 where all modes there and all critical speeds within the margin were looked for, `zeta_least`
    (n,) the least damping ratio, `critical` (k, 4) by crossing: speed [rad/s], damping ratio, 1 where the natural
    frequency rises above the speed and -1 where it falls below, roundness of the orbit. `branches` (b, n, 3) are
    natural frequency [rad/s], damping ratio and roundness of the lowest modes, followed. `models` are the linear models
    by speed.
    """

    looked: np.ndarray
    zeta_least: np.ndarray
    critical: np.ndarray
    branches: np.ndarray
    models: dict[float, LinearPlant]


def surroundings(plant: Plant, speeds: np.ndarray, pressure: float) -> Surroundings:
    """Modes at and critical speeds around the speeds (n,) [rad/s] at a gauge pressure [Pa].

    Nothing is known where no film carries, or where the eigenvalues do not converge; other errors are raised.
    """
    none = np.full(len(speeds), np.nan)
    try:
        found = modes_over_speed(plant, speeds, pressure, FIRST, (1,))
        critical = crossing_numbers(found.crossings)[:, [0, 1, 2, 4]]
    except (NoLiftOffError, ConvergenceError, np.linalg.LinAlgError):
        return Surroundings(np.zeros(len(speeds)), none, np.zeros((0, 4)), np.zeros((0, len(speeds), 3)), {})
    nodes = {node.at: node for node in found.followed.nodes}
    least = [found.least(speed) for speed in speeds.tolist()]
    models = {at: node.pencil for at, node in nodes.items() if isinstance(node.pencil, LinearPlant)}
    s, senses, _ = along_speeds(found, speeds, SHOWN)
    branches = np.stack([np.abs(s), -s.real / np.abs(s), senses], axis=-1)
    looked = np.array([float(_looked(found, speed)) for speed in speeds.tolist()])
    return Surroundings(looked, np.array(least), critical, branches, models)


def _looked(found: ModesOverSpeed, speed: float) -> bool:
    """Whether every mode and every critical speed within the margin of a speed was looked for."""
    low, high = sorted((speed / (1 + MARGIN), speed / (1 - MARGIN)))
    first, last = found.searched
    if low < first - 1e-9 * abs(first) or high > last + 1e-9 * abs(last):
        return False
    unknown = [*found.refused, *found.uncertain, *((v, v) for v in found.unproven)]
    return not any(a <= high and b >= low for a, b in unknown)


def safe_region(found: xr.Dataset, margin: float = MARGIN) -> xr.Dataset:
    """`safe` (..., speed) added to a map: 1 safe, 0 not safe, NaN not known.

    Parameters
    ----------
    found : Dataset
        An operating map.
    margin : float
        Least distance from a critical speed, over the critical speed; at most the 15 % up to which a map looks.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.safe_region(rs.analysis.operating_map(plant, [300.0], [0.5e6], workers=1))
    >>> found["safe"].shape
    (1, 1)
    """
    order = [d for d in found["lifted"].dims if d != "speed"]
    text = f"1: lifted, damped and not within {100 * margin:g} % of a critical speed; 0: not; NaN: not known"
    label = {"units": "1", "long_name": text}
    lifted = found["lifted"].transpose(*order, "speed").values
    if "wn" not in found:
        return found.assign(safe=((*order, "speed"), np.where(lifted == 0, 0.0, np.nan), label))
    critical = found["critical_speed"].transpose(*order, "critical").values[..., None, :]
    counts = found["critical_zeta"].transpose(*order, "critical").values[..., None, :] <= 1 / (2 * AMPLIFIED)
    speeds = found["speed"].values[:, None]
    with np.errstate(invalid="ignore"):
        near = ((np.abs(speeds / critical - 1) < margin) & counts).any(axis=-1)
        grows = found["zeta_least"].transpose(*order, "speed").values <= DAMPED
    looked = found["looked"].transpose(*order, "speed").values == 1
    safe = np.where((lifted == 0) | grows | near, 0.0, np.where(looked & (lifted == 1), 1.0, np.nan))
    return found.assign(safe=((*order, "speed"), safe, label)).assign_attrs(
        safe_margin=margin, least_amplification=AMPLIFIED
    )
