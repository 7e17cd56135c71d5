r"""Undamped critical speed map: synchronous forward critical speeds over the bearing stiffness.

With isotropic undamped bearings forward whirl at the speed has x + i y = u exp(i Omega t), beta - i alpha = theta
exp(i Omega t), and in the plane (x, beta) alone K q = Omega^2 (M + G_f) q with G_f = -I_p of a disc's rotation:
symmetric. That none is missing below the last one is counted by the inertia of M - mu K, mu = 1 / omega^2, since K is
positive definite (Sylvester).

Source: API 684; Friswell et al. (2010), section 6.8.

Cites: api_684, friswell_2010.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, eigvalsh

from fe_shaft.assembly import AssembledRotor
from fe_shaft.checks import ShaftError
from fe_shaft.labelled import dataset
from rotorsim.base.rounding import EPS

if TYPE_CHECKING:
    import xarray as xr


BEYOND = 1e-6
"""Relative distance above the highest critical speed up to which they are counted."""


@dataclass(frozen=True, eq=False)
class UcsResult:
    """Undamped critical speeds `wn` (n_modes, n_stiffness) [rad/s] over `stiffness` (n_stiffness,) [N/m].

    NaN where a disc is so flat that a mode has no forward critical speed. `missing` (n_stiffness,) is the number of
    critical speeds up to the highest one that are not among them, counted independently: 0; NaN where nobody counted.
    """

    stiffness: NDArray[np.float64]
    wn: NDArray[np.float64]
    missing: NDArray[np.float64] = field(default_factory=lambda: np.array(np.nan))

    def dataset(self) -> xr.Dataset:
        """Labelled data over mode and stiffness."""
        return dataset(
            {
                "wn": (("mode", "stiffness"), self.wn, "rad/s", "undamped critical speed"),
                "missing": (
                    ("stiffness",),
                    np.broadcast_to(self.missing, self.stiffness.shape),
                    "1",
                    "critical speeds up to the highest that are not found",
                ),
            },
            {"stiffness": (("stiffness",), self.stiffness, "N/m", "stiffness of every bearing")},
        )


def run_ucs(
    rotor: AssembledRotor, stiffness_range: tuple[float, float] = (1e6, 1e11), num: int = 30, num_modes: int = 4,
    synchronous: bool = True,
) -> UcsResult:  # fmt: skip
    """Undamped critical speeds with every bearing as stiff as k [N/m], at `num` values from the range, evenly in log k.

    Without `synchronous` the shaft stands: its natural frequencies at rest.

    Raises
    ------
    ShaftError
        If the range is not two positive ascending numbers, the rotor has no bearing to vary, or it has
        bearings at one node alone.
    """
    low, high = stiffness_range
    if not 0 < low < high or num < 1 or num_modes < 1:
        raise ShaftError(
            f"ucs: stiffness from {low:g} to {high:g} N/m, {num} values, {num_modes} modes; "
            "give a positive ascending range and counts of at least 1."
        )
    if not rotor.bearing_elements:
        raise ShaftError("ucs: the rotor has no bearing whose stiffness could vary; add one.")
    held = {bearing.n for bearing in rotor.bearing_elements} | set(rotor.pinned)
    if len(held) < 2 and not rotor.clamped:
        raise ShaftError(
            "ucs: bearings at one node alone leave the shaft free to tilt; support it at two nodes at least."
        )
    stiffness = np.geomspace(low, high, num)
    M, K, plane = _plane(rotor, synchronous)
    unit = np.zeros(rotor.ndof)
    for bearing in rotor.bearing_elements:
        unit[rotor.layout.place(bearing.n)] += 1.0
    held_by = [K + np.diag(k * unit[plane]) for k in stiffness]
    wn = [_lowest(M, one, num_modes) for one in held_by]
    missing = [_up_to(M, one, float(np.nanmax(w, initial=0.0))) - np.isfinite(w).sum()
               for one, w in zip(held_by, wn, strict=True)]  # fmt: skip
    return UcsResult(stiffness, np.stack(wn, 1), np.array(missing, float))


def _plane(
    rotor: AssembledRotor, synchronous: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.intp]]:
    """Mass with the gyroscopic part and stiffness of the shaft in the plane x, beta, and its degrees of freedom."""
    axes, free = rotor.layout.axes, rotor.free
    inside = free[free < rotor.ndof - 2 * len(rotor.layout.pedestals)]
    plane = inside[np.isin(axes[inside], (0, 3))]
    # in forward whirl y = -i x and alpha = i beta; G couples the plane to y, alpha
    partner = np.where(axes[plane] == 0, plane + 1, plane - 1)
    turned = np.where(axes[plane] == 0, -1.0, 1.0)
    M = rotor.parts.M[np.ix_(plane, plane)]
    if synchronous:
        G = rotor.parts.G[np.ix_(plane, partner)] * turned
        M = M + (G + G.T) / 2
    return M, rotor.parts.K[np.ix_(plane, plane)], plane


def _lowest(M: NDArray[np.float64], K: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """The lowest real frequencies; K is positive definite, M need not be."""
    K = (K + K.T) / 2
    inverse = eigh(M, K, eigvals_only=True, subset_by_index=(max(0, len(M) - count), len(M) - 1))[::-1]
    wn = np.full(count, np.nan)
    positive = inverse[inverse > len(M) * EPS * max(inverse[0], 0.0)]
    wn[: len(positive)] = 1 / np.sqrt(positive)
    return wn


def _up_to(M: NDArray[np.float64], K: NDArray[np.float64], highest: float) -> int:
    """Number of real frequencies up to the `highest` [rad/s]."""
    if not highest:
        return 0
    unit = 1 / np.sqrt(np.diag(K))  # a congruence, which leaves the inertia as it is
    A = (M - K / (highest * (1 + BEYOND)) ** 2) * unit * unit[:, None]
    return int(np.sum(eigvalsh((A + A.T) / 2) > 0))
