r"""Natural frequencies, damping and whirl from the eigenvalues of the state matrix.

.. math:: \frac{d}{dt}\begin{bmatrix} q \\ \dot q \end{bmatrix} =
          \begin{bmatrix} 0 & I \\ -M^{-1}K & -M^{-1}D \end{bmatrix}
          \begin{bmatrix} q \\ \dot q \end{bmatrix}, \quad D = C + \Omega G, \quad
          \lambda = -\zeta\omega_n + i\omega_n\sqrt{1-\zeta^2}

With X, Y the complex amplitudes of a node, x + iy is a forward circle of radius |X + iY|/2 plus a backward
circle of radius |X - iY|/2; the larger one names the whirl.

Source: Friswell et al. (2010), chapters 3 and 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve, eig

if TYPE_CHECKING:
    from fe_shaft.rotor import Rotor

# Real eigenvalues (overdamped or rigid-body motion) that rounding has split into a pair are not oscillations.
_REAL = 1e-6  # smallest wd / wn
_ZERO = 1e-8  # smallest wn over the largest: the square root of the rounding, as for a double eigenvalue
_STILL = 1e-3  # a node that moves less than this part of the largest motion has no say in the whirl
_PLANAR = 1e-3  # circles whose radii differ by less than this part of their sum make a straight line


@dataclass(frozen=True, eq=False)
class ModalResult:
    """Oscillating modes at one speed, by ascending `wn`.

    Attributes
    ----------
    speed : float
        [rad/s]
    eigenvalues : ndarray (n_modes,) complex
        With positive imaginary part [rad/s].
    shapes : ndarray (ndof, n_modes) complex
        Displacements, the largest transverse one being 1 [m/m, rad/m].
    whirl : ndarray (n_modes,) of str
        'forward', 'backward', or 'mixed' where nodes disagree or move on a straight line.
    """

    speed: float
    eigenvalues: NDArray[np.complex128]
    shapes: NDArray[np.complex128]
    whirl: NDArray[np.str_]

    @property
    def wn(self) -> NDArray[np.float64]:
        """Undamped natural frequencies (n_modes,) [rad/s]."""
        return np.abs(self.eigenvalues)

    @property
    def wd(self) -> NDArray[np.float64]:
        """Damped natural frequencies (n_modes,) [rad/s]."""
        return self.eigenvalues.imag

    @property
    def damping_ratio(self) -> NDArray[np.float64]:
        """Damping ratios zeta (n_modes,) [1]; negative when unstable."""
        return -self.eigenvalues.real / self.wn

    @property
    def log_dec(self) -> NDArray[np.float64]:
        """Logarithmic decrements 2 pi zeta / sqrt(1 - zeta^2) (n_modes,) [1]."""
        return -2 * np.pi * self.eigenvalues.real / self.wd


@dataclass(frozen=True, eq=False)
class CampbellResult:
    """Modes over speed.

    Attributes
    ----------
    speeds : ndarray (n_speeds,)
        [rad/s]
    wn, wd, damping_ratio : ndarray (n_speeds, n_modes)
        [rad/s], [rad/s], [1]; ascending `wn`, NaN at the end of a speed at which fewer modes oscillate.
    whirl : ndarray (n_speeds, n_modes) of str
        As in ModalResult; empty where `wn` is NaN.
    """

    speeds: NDArray[np.float64]
    wn: NDArray[np.float64]
    wd: NDArray[np.float64]
    damping_ratio: NDArray[np.float64]
    whirl: NDArray[np.str_]


def state_matrix(M: NDArray[Any], D: NDArray[Any], K: NDArray[Any]) -> NDArray[np.float64]:
    """State matrix (2n, 2n) of M q'' + D q' + K q = 0, for M, D, K (n, n) in SI."""
    n = len(M)
    factor = cho_factor(M)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-cho_solve(factor, K), -cho_solve(factor, D)]])


def oscillations(
    M: NDArray[Any], D: NDArray[Any], K: NDArray[Any]
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Eigenvalues (n_modes,) [rad/s] of positive imaginary part, ascending, and vectors (n, n_modes)."""
    values, vectors = eig(state_matrix(M, D, K))
    modulus = np.abs(values)
    keep = np.flatnonzero((values.imag > _REAL * modulus) & (modulus > _ZERO * modulus.max()))
    keep = keep[np.argsort(modulus[keep], kind="stable")]
    return values[keep], vectors[: len(M), keep]


def run_modal(rotor: Rotor, speed: float) -> ModalResult:
    """Modes of `rotor` at `speed` [rad/s]; overdamped and rigid-body motions are left out.

    Repeated frequencies (a symmetric rotor at rest) have arbitrary shapes, and so an arbitrary whirl.
    """
    values, vectors = oscillations(rotor.M(), rotor.C(speed) + speed * rotor.G(), rotor.K(speed))
    x, y = vectors[0 :: rotor.number_dof], vectors[1 :: rotor.number_dof]
    transverse = np.concatenate([x, y])
    largest = transverse[np.abs(transverse).argmax(axis=0), np.arange(len(values))]
    return ModalResult(float(speed), values, vectors / largest, _whirl(x, y))


def run_campbell(rotor: Rotor, speeds: ArrayLike) -> CampbellResult:
    """Modes of `rotor` at each of `speeds` (n_speeds,) [rad/s]."""
    speeds = np.atleast_1d(np.asarray(speeds, dtype=float))
    runs = [run_modal(rotor, float(speed)) for speed in speeds]
    wn, wd, zeta = (_table([getattr(r, name) for r in runs], np.nan) for name in ("wn", "wd", "damping_ratio"))
    return CampbellResult(speeds, wn, wd, zeta, _table([r.whirl for r in runs], ""))


def _whirl(x: NDArray[np.complex128], y: NDArray[np.complex128]) -> NDArray[np.str_]:
    """Name the whirl of modes with node amplitudes `x`, `y` (n_nodes, n_modes)."""
    forward, backward = np.abs(x + 1j * y), np.abs(x - 1j * y)
    size = forward + backward
    moving = size > _STILL * size.max(axis=0)
    turn = np.where(np.abs(forward - backward) < _PLANAR * size, 0.0, np.sign(forward - backward))
    all_forward = np.all((turn > 0) | ~moving, axis=0)
    all_backward = np.all((turn < 0) | ~moving, axis=0)
    return np.where(all_forward, "forward", np.where(all_backward, "backward", "mixed"))


def _table(rows: list[NDArray[Any]], fill: float | str) -> NDArray[Any]:
    """Rows of unequal length as one array, filled up at the end."""
    table = np.full((len(rows), max(len(row) for row in rows)), fill, dtype=rows[0].dtype)
    for line, row in zip(table, rows, strict=True):
        line[: len(row)] = row
    return table
