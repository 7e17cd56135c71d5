r"""Dead time of Model 3: found in the record, given, or none.

Between reference and film force lie two poles of an actuator and the film. Model 3's one lag that stands for all of
them takes their phase at the modes, and with it more of the gain there than they do, so that the fit raises the gain at
rest. With a dead time on each axis next to it, a first-order Pade approximation, the phase costs no gain.

.. math:: F_i(s) = \frac{p_i}{s + p_i}\; \frac{r_i - s}{r_i + s}, \qquad \tau_i = 2/r_i

The approximation is off by less than 0.1 rad while omega tau < 1.1, beyond which `remark` warns.

Cites: skogestad_2005.
"""

from __future__ import annotations

from dataclasses import replace
from numbers import Real

import numpy as np

from identification.errors import UnfitError
from identification.local.confidence import Spread
from identification.local.greybox import DELAYED, SHORTEST_DEAD, STRUCTURES, Structure
from identification.local.least_squares import FitProblem, GreyBox

FREE = "free"
LONGEST = 5e-3
"""Longest dead time [s] that can be given."""
SHARE = 0.01
"""Longest dead time as a share of the record."""
SIGNIFICANT, LEAST = 3.0, 0.25
"""Least dead time of both axes that counts as found, in standard deviations and in samples."""
NONE = "no dead time found on both axes: Model 3 without one"
"""Note about a free dead time that the record does not show."""
COARSE = 1.1
"""Angle omega tau [rad] of the highest mode from which a first-order Pade approximation is coarse."""


def kind_of(model: str, dead_time: float | str) -> str:
    """Structure for `identify(model=, dead_time=)`.

    Raises
    ------
    UnfitError
        For a dead time that is negative, no number, too short or too long, or of another model than 3.
    """
    if isinstance(dead_time, str) and dead_time == FREE:
        return DELAYED if model == "3" else model
    wrong = isinstance(dead_time, bool) or not isinstance(dead_time, Real)
    if isinstance(dead_time, str) or wrong or not np.isfinite(dead_time) or dead_time < 0:
        raise UnfitError(f"identify.dead_time: {dead_time!r}; give seconds, 0 for none, or '{FREE}' to find it")
    if dead_time == 0:
        return model
    if model != "3":
        raise UnfitError(f"identify.dead_time: {dead_time:g} s for model {model}; only model 3 has a dead time")
    if not SHORTEST_DEAD < dead_time <= LONGEST:
        raise UnfitError(
            f"identify.dead_time: {dead_time:g} s; give {SHORTEST_DEAD:g} to {LONGEST:g} s, or shift the reference of "
            "the record by whole samples"
        )
    return DELAYED


def check_length(dead_time: float | str, lasting: float) -> None:
    """Raise UnfitError for a given dead time that is more than a hundredth of the excited record [s]."""
    if not isinstance(dead_time, str) and dead_time > SHARE * lasting:
        raise UnfitError(
            f"record: {lasting:.3g} s with excitation, a dead time of {dead_time:g} s needs {dead_time / SHARE:.3g} s "
            "or more; record longer"
        )


def fixed(dead_time: float) -> Structure:
    """Model 3 behind a given dead time [s] on both axes: the parameters of Model 3."""
    full, known = STRUCTURES[DELAYED], np.full(2, 2 / dead_time)
    return replace(
        STRUCTURES["3"], name=full.name, matrices=lambda theta: full.matrices(np.concatenate([theta[:14], known]))
    )


def completed(theta: np.ndarray, found: Spread, dead_time: float) -> tuple[np.ndarray, Spread]:
    """Parameters (16,) and their spread of `fixed` as those of the structure with free dead times."""
    known = np.zeros((2, 2))
    return np.concatenate([theta, np.full(2, 2 / dead_time)]), found.joined(Spread(known, known))


def promising(problem: FitProblem, theta: np.ndarray, x0: np.ndarray, Ts: float) -> bool:
    """Whether from a fit of Model 3 without dead time, at theta and x0, a step by Gauss and Newton lengthens one of
    LEAST samples on both axes; a look before the whole fit."""
    ahead = replace(problem, model=GreyBox(STRUCTURES[DELAYED], Ts))
    begin = np.concatenate([theta[:14], np.full(2, 2 / (LEAST * Ts))])
    states = x0.reshape(-1, len(problem.model.sampled(theta)[0]))  # of each stretch
    N, g, _ = ahead.normal_equations(begin, np.pad(states, ((0, 0), (0, 2))).ravel())
    scale = np.sqrt(np.maximum(np.diag(N), 1e-300))
    step = np.linalg.lstsq(N / np.outer(scale, scale), g / scale, rcond=1e-12)[0]
    return bool(np.all(step[14:16] < 0))  # of the rates 2 / dead time


def found(theta: np.ndarray, covariance: np.ndarray, Ts: float) -> bool:
    """Whether dead times of both axes differ from zero by more than their uncertainty."""
    tau, sd = _times(theta, covariance)
    return bool(np.all(tau > max(1.1 * SHORTEST_DEAD, LEAST * Ts)) and np.all(tau > SIGNIFICANT * sd))


def remark(theta: np.ndarray, wn: np.ndarray) -> tuple[str, ...]:
    """A sentence about dead times that are long for the modes wn [rad/s]."""
    tau = 2 / theta[14:16]
    if wn.size == 0 or wn.max() * tau.max() < COARSE:
        return ()
    return (
        f"dead time {1e3 * tau.max():.3g} ms: {np.degrees(wn.max() * tau.max()):.0f} deg at the highest mode, too much "
        "for one Pade approximation; shift the reference of the record by whole samples",
    )


def _times(theta: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    r = theta[14:16]
    return 2 / r, 2 * np.sqrt(np.maximum(np.diag(covariance)[14:16], 0)) / r**2
