r"""Stability over speed: smallest logarithmic decrement and the onset speed of instability.

All modes are computed at every speed; a motion that grows without oscillation has a damping ratio of -1, a logarithmic
decrement of minus infinity and a frequency of 0. The onset lies where the least damping ratio crosses zero between two
of the given speeds, of the tables' speeds, or of those in between: a step is halved as long as the slopes of the
damping ratios at its ends leave it open whether damping is lost and comes back inside. It is then found by Brent's
method.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
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


NEARBY = 1e-5
"""Step of a derivative over the step between two speeds."""
HALVINGS = 8
"""Halvings of a step in which damping may be lost and come back."""


@dataclass(frozen=True, eq=False)
class StabilityResult:
    """Least stable motion over speed.

    Attributes
    ----------
    speeds, log_dec, wn : ndarray (n_speeds,)
        Speed [rad/s], least logarithmic decrement [1] and natural frequency of its mode [rad/s].
    whirl : ndarray (n_speeds,) of str
        Its whirl; empty for a motion that does not oscillate.
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
    """Stability of `rotor` at `speeds` (n_speeds,) [rad/s], ascending, and the onset of instability between them.

    Examples
    --------
    >>> rotor.run_stability([0.0, 100.0, 200.0]).onset  # stable at all of them
    nan
    """
    speeds = grid("stability: speeds [rad/s]", speeds)
    runs = [modal.run_modal(rotor, float(speed)) for speed in speeds]
    worst = [_worst(run) for run in runs]
    zeta = np.array([entry[0] for entry in worst])
    kinks = {float(v) for b in rotor.bearing_elements for axis in b.axes for v in axis} - set(speeds.tolist())
    more = [modal.run_modal(rotor, v) for v in kinks if speeds[0] < v < speeds[-1]]
    onset, frequency = _onset(rotor, sorted([*runs, *more], key=lambda run: run.speed))
    with np.errstate(divide="ignore"):
        log_dec = 2 * np.pi * zeta / np.sqrt(1 - zeta**2)
    return StabilityResult(
        speeds, log_dec, np.array([e[1] for e in worst]), np.array([e[2] for e in worst]), onset, frequency
    )


def _worst(run: modal.ModalResult) -> tuple[float, float, str]:
    """Damping ratio, frequency and whirl of the mode with the least damping ratio; (-1, 0) of one that diverges."""
    if run.divergence > 0:
        return -1.0, 0.0, ""
    mode = int(run.damping_ratio.argmin())
    return float(run.damping_ratio[mode]), float(run.wn[mode]), str(run.whirl[mode])


def _grows(run: modal.ModalResult) -> bool:
    return _worst(run)[0] < -DAMPED


def _onset(rotor: AssembledRotor, runs: list[modal.ModalResult]) -> tuple[float, float]:
    """Lowest speed at which a mode grows, and its frequency [rad/s]; NaN without one."""
    if _grows(runs[0]):
        return runs[0].speed, _worst(runs[0])[1]
    for a, b in pairwise(runs):
        lost = b if _grows(b) else _lost_between(rotor, a, b, HALVINGS)
        if lost is not None:
            speed = falls_below_zero(lambda s: _worst(modal.run_modal(rotor, s))[0] + DAMPED, a.speed, lost.speed,
                                     rtol=1e-9)  # fmt: skip
            beyond = min(speed + NEARBY * (lost.speed - a.speed), lost.speed)
            if lost.divergence > 0 and modal.run_modal(rotor, beyond).divergence > 0:
                return speed, 0.0
            return speed, _worst(modal.run_modal(rotor, speed))[1]
    return float("nan"), float("nan")


def _lost_between(
    rotor: AssembledRotor, a: modal.ModalResult, b: modal.ModalResult, halvings: int
) -> modal.ModalResult | None:
    """The modes at a speed between two at which one grows; None where no tangent at both ends leads below zero."""
    width = b.speed - a.speed
    falls = a.damping_ratio + width * _slopes(rotor, a, b.speed)
    rises = b.damping_ratio - width * _slopes(rotor, b, a.speed)
    if not halvings or falls.min() > 0 or rises.min() > 0:
        return None
    middle = modal.run_modal(rotor, 0.5 * (a.speed + b.speed))
    if _grows(middle):
        return middle
    return _lost_between(rotor, a, middle, halvings - 1) or _lost_between(rotor, middle, b, halvings - 1)


def _slopes(rotor: AssembledRotor, run: modal.ModalResult, towards: float) -> NDArray[np.float64]:
    """Derivatives (n_modes,) of the damping ratios over the speed, on the side of another speed."""
    step = NEARBY * (towards - run.speed)
    near = modal.run_modal(rotor, run.speed + step)
    same = np.abs(near.eigenvalues[:, None] - run.eigenvalues).argmin(axis=0)
    return np.asarray((near.damping_ratio[same] - run.damping_ratio) / step)
