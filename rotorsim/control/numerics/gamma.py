r"""Minimum gamma of the H-infinity problem between proven lower and upper bounds.

From above by loops: a gamma is reached where a controller's own closed loop is stable and its norm is below gamma. From
below by Parrott's theorem at single frequencies, D11 among them (infinity): with the rows V of the left null space

.. math:: V \begin{bmatrix} A - i\omega I & B_2\\ C_1 & D_{12} \end{bmatrix} = 0, \quad V = [V_1\; V_2]: \quad
          \gamma \ge \bar\sigma\left((V_2 V_2^H)^{-1/2} (V_1 B_1 + V_2 D_{11})\right)

whatever the controller, and the same of the transposed plant. Between the two the theorem of `numerics.central`
decides: a central controller whose loop is unstable, by more than rounding, shows that no other reaches its gamma
either. Where rounding leaves it open nothing is concluded, and another gamma is tried. Below the gammas refused in this
way more are tried: one that is reached after all shows that the theorem's word cannot be taken there.

Cites: zhou_1996.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from rotorsim.base.rounding import unstable_poles
from rotorsim.control.designs.mixed import Generalised, closed
from rotorsim.control.errors import DesignError
from rotorsim.control.numerics.central import (
    Scaled,
    central,
    dual,
    equation,
    hamiltonian,
    highest_frequency_bound,
    normalised,
    state_side,
)
from rotorsim.control.numerics.systems import System, largest, peak_gain, with_middles

TOLERANCE = 1e-6
ROUNDING = 3e-6
"""Share by which the norm of a loop may exceed the gamma that it was made for."""
LEAST, HIGHEST = 1e-9, 1e12
"""Gamma that counts as zero, and largest gamma that is searched, both in the plant's own unit."""
SHARES = (0.5, 0.25, 0.75, 0.125, 0.375, 0.625, 0.875)
"""Places in a bracket that are tried, in turn."""


class Bounds(NamedTuple):
    """No controller goes below `low`, one reaches `high`."""

    low: float
    high: float


def solve(P: Generalised, tolerance: float = TOLERANCE) -> float:
    """Smallest gamma that a controller was seen to reach; raises DesignError if none stabilises the plant."""
    return bounds(P, tolerance).high


def controller(P: Generalised, gamma: float) -> System:
    """The central controller for gamma, whose loop keeps it; raises DesignError if there is none."""
    scaled = normalised(P)
    found = central(scaled.P, gamma / scaled.unit)
    if found is None:
        raise DesignError(why_out_of_reach(scaled, gamma))
    K = System(found.A, found.B @ scaled.Sy, scaled.Su @ found.C, scaled.Su @ found.D @ scaled.Sy)
    norm = peak_gain(closed(P, K))
    if norm <= gamma * (1 + ROUNDING):
        return K
    if np.isfinite(norm):
        raise DesignError(
            f"h-infinity: by rounding the controller for gamma = {gamma:.7g} reaches {norm:.7g}; raise backoff"
        )
    raise DesignError(why_out_of_reach(scaled, gamma))


def bounds(P: Generalised, tolerance: float = TOLERANCE) -> Bounds:
    """Proven bounds of the smallest gamma; raises DesignError if no controller stabilises the plant."""
    scaled = normalised(P)
    P, floor = scaled.P, max(frequency_bound(scaled.P), LEAST)
    highest = HIGHEST * max(floor, 1.0)
    high = next((g for g in np.geomspace(2 * floor, highest, 30) if reached(P, g)), None)
    if high is None:
        raise DesignError(why_out_of_reach(scaled, highest * scaled.unit))
    found = enclosed(partial(reached, P), Bounds(floor, high), tolerance)
    return Bounds(float(found.low * scaled.unit), float(found.high * scaled.unit))


Decide = Callable[[float], bool | None]
"""Whether a gamma is reached (a proof), is not (the theorem's word), or nothing can be concluded."""


def enclosed(decide: Decide, proven: Bounds, tolerance: float) -> Bounds:
    """Bounds that hold whatever `decide` refuses: where it reaches less than it refused, only the proven low stays."""
    found, contradicted = narrowed(decide, proven, tolerance), False
    while found.low > proven.low * (1 + tolerance):
        below = next((g for g in between(proven.low, found.low) if decide(g)), None)
        if below is None:
            break
        found, contradicted = narrowed(decide, Bounds(proven.low, below), tolerance), True
    return Bounds(proven.low, found.high) if contradicted else found


def narrowed(decide: Decide, found: Bounds, tolerance: float) -> Bounds:
    """Bounds `tolerance` apart, tried from below first, or as near as decisions go."""
    low, high = found
    if decide(gamma := low * (1 + tolerance)) and gamma < high:
        return Bounds(low, gamma)
    while high > low * (1 + tolerance):
        answers = ((gamma, decide(gamma)) for gamma in between(low, high))
        gamma, answer = next((one for one in answers if one[1] is not None), (high, None))
        if answer is None:
            break
        low, high = (low, gamma) if answer else (gamma, high)
    return Bounds(low, high)


def between(low: float, high: float) -> Iterator[float]:
    """Gammas within a bracket, its middle first."""
    return (low ** (1 - share) * high**share for share in SHARES)


def reached(P: Generalised, gamma: float) -> bool | None:
    """Whether a normalised plant's central controller keeps gamma; None where rounding leaves it open."""
    K = central(P, gamma)
    if K is None:
        return None
    loop = closed(P, K)
    if unstable_poles(loop.A):
        return False
    return True if peak_gain(loop) <= gamma * (1 + ROUNDING) else None


def frequency_bound(P: Generalised) -> float:
    """Lower bound on gamma from single frequencies, for any controller (Parrott's theorem)."""
    best = max(highest_frequency_bound(P), parrott(P, np.append(np.abs(np.linalg.eigvals(P.A)), 0.0)))
    while best > 0 and (better := parrott(P, level_frequencies(P, best * (1 + TOLERANCE)))) > best:
        best = better
    return best


def level_frequencies(P: Generalised, gamma: float) -> np.ndarray:
    """Frequencies that may force gamma: those of the eigenvalues of both Hamiltonians, and those between them."""
    values = [np.linalg.eigvals(hamiltonian(*equation(side, gamma)[:3])[0]) for side in (P, dual(P))]
    return with_middles(np.concatenate(values))


def parrott(P: Generalised, frequencies: np.ndarray) -> float:
    """Largest gamma that one of the frequencies (f,) forces."""
    return max(_gain_beyond_u(P, frequencies), _gain_beyond_u(dual(P), frequencies))


def _gain_beyond_u(P: Generalised, frequencies: np.ndarray) -> float:
    """Largest gain from w to the part of z that u does not reach, at the frequencies (f,)."""
    n, (p, m) = P.order, P.D12.shape
    if p == m:
        return 0.0
    states = np.diag(np.repeat([1.0, 0.0], [n, max(p, m)]))[: n + p, : n + m]
    pencil = np.block([[P.A, P.B2], [P.C1, P.D12]]) - 1j * frequencies[:, None, None] * states
    V = np.linalg.svd(pencil)[0][..., m - p :].conj().swapaxes(-1, -2)
    Q, size, _ = np.linalg.svd(V[..., n:], full_matrices=False)
    known = size[:, -1] > 1e-8  # else a mode next to the axis is out of u's reach, and V2 has no digits
    gain = Q.conj().swapaxes(-1, -2) @ (V @ np.vstack([P.B1, P.D11]))
    return float(largest(gain[known] / size[known][..., None]).max(initial=0.0))


def why_out_of_reach(scaled: Scaled, gamma: float) -> str:
    """Which condition of the theorem fails."""
    P, unit = scaled.P, scaled.unit
    text = f"h-infinity: no controller reaches gamma = {gamma:.4g}: "
    highest, single = highest_frequency_bound(P) * unit, frequency_bound(P) * unit
    if gamma <= highest:
        return text + f"the weights at infinite frequency alone ask for {highest:.4g}; lower W_p there"
    if gamma <= single:
        return text + f"the weights at a single frequency alone ask for {single:.4g}; lower W_p or W_u there"
    for side, word in ((P, "the state-feedback Riccati equation (W_p against W_u) has no solution; lower W_p or W_u"),
                       (dual(P), "the estimation Riccati equation has no solution; the disturbances are not seen well "
                                 "enough")):  # fmt: skip
        found = state_side(side, gamma / unit)
        if found is None or unstable_poles(side.A + side.B2 @ found[1][side.B1.shape[1] :]):
            return text + word
    return text + "both Riccati equations hold and only their coupling fails; relax W_p or W_u a little"
