r"""Stability over speed: smallest logarithmic decrement and the onset speed of instability.

The onset lies where the largest real part of the eigenvalues crosses zero between two of the given speeds; it is then
found by Brent's method on that real part over the frequency.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fe_shaft import modal
from fe_shaft.assembly import AssembledRotor
from fe_shaft.checks import grid
from fe_shaft.labelled import dataset
from rotorsim.base.rounding import DAMPED, falls_below_zero

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class StabilityResult:
    """Least stable oscillation over speed.

    Attributes
    ----------
    speeds, log_dec, wn : ndarray (n_speeds,)
        Speed [rad/s], least logarithmic decrement [1] and natural frequency of its mode [rad/s].
    whirl : ndarray (n_speeds,) of str
        Its whirl.
    onset : float
        Lowest speed at which a mode becomes unstable [rad/s]; the first speed if it is unstable there already, NaN if
        all speeds are stable.
    onset_frequency : float
        Whirl frequency there [rad/s].
    """

    speeds: NDArray[np.float64]
    log_dec: NDArray[np.float64]
    wn: NDArray[np.float64]
    whirl: NDArray[np.str_]
    onset: float
    onset_frequency: float

    def dataset(self) -> xr.Dataset:
        """Labelled data over speed."""
        over = ("speed",)
        return dataset(
            {
                "log_dec": (over, self.log_dec, "1", "least logarithmic decrement"),
                "wn": (over, self.wn, "rad/s", "natural frequency of the least stable mode"),
                "whirl": (over, self.whirl, "", "sense of whirl"),
            },
            {"speed": (over, self.speeds, "rad/s", "speed of the shaft")},
            onset=self.onset,
            onset_frequency=self.onset_frequency,
        )


def run_stability(rotor: AssembledRotor, speeds: ArrayLike) -> StabilityResult:
    """Stability of `rotor` at `speeds` (n_speeds,) [rad/s], ascending, and the onset of instability between them."""
    speeds = grid("stability: speeds [rad/s]", speeds)
    worst = [_worst(modal.run_modal(rotor, float(speed))) for speed in speeds]
    zeta = np.array([entry[0] for entry in worst])
    onset, frequency = _onset(rotor, speeds, zeta)
    log_dec = 2 * np.pi * zeta / np.sqrt(1 - zeta**2)
    return StabilityResult(
        speeds, log_dec, np.array([e[1] for e in worst]), np.array([e[2] for e in worst]), onset, frequency
    )


def _worst(run: modal.ModalResult) -> tuple[float, float, str]:
    """Damping ratio, frequency and whirl of the mode with the least damping ratio."""
    mode = int(run.damping_ratio.argmin())
    return float(run.damping_ratio[mode]), float(run.wn[mode]), str(run.whirl[mode])


def _onset(rotor: AssembledRotor, speeds: NDArray[np.float64], zeta: NDArray[np.float64]) -> tuple[float, float]:
    unstable = np.flatnonzero(zeta < -DAMPED)
    if not unstable.size:
        return float("nan"), float("nan")
    first = int(unstable[0])
    speed = float(speeds[first])
    if first:
        speed = falls_below_zero(lambda s: _worst(modal.run_modal(rotor, s))[0] + DAMPED, speeds[first - 1], speed,
                                 rtol=1e-9)  # fmt: skip
    return speed, _worst(modal.run_modal(rotor, speed))[1]
