r"""Orbit ellipse of a node: half axes, inclination, forward or backward whirl.

x + i y is a forward circle of radius |X + iY|/2 plus a backward circle of radius |X - iY|/2: their sum and difference
are the half axes, and the larger one names the whirl. Whirl is forward where it turns as the shaft does; a shaft at
rest counts as turning from x to y.

Source: Friswell et al. (2010), chapter 3.

Cites: friswell_2010.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_STILL = 1e-3  # a node that moves less than this part of the largest motion does not count for the whirl
_PLANAR = 1e-3  # circles whose radii differ by less than this part of their sum make a straight line


def half_axes(
    x: NDArray[np.complex128], y: NDArray[np.complex128], speed: float = 0.0
) -> tuple[NDArray[np.float64], ...]:
    """Major and minor half axis, in the unit of x, of Re(x exp(st)) with Im s >= 0; the minor one is negative in
    backward whirl of a shaft at `speed` [rad/s]."""
    y = y if speed >= 0 else -y
    forward, backward = np.abs(x + 1j * y) / 2, np.abs(x - 1j * y) / 2
    return forward + backward, forward - backward


def inclination(x: NDArray[np.complex128], y: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Angle of the major axis from x towards y [rad], between -pi/2 and pi/2."""
    forward, backward = x + 1j * y, np.conj(x) + 1j * np.conj(y)
    angle = (np.angle(forward) + np.angle(backward)) / 2
    return np.asarray((angle + np.pi / 2) % np.pi - np.pi / 2)


def name(x: NDArray[np.complex128], y: NDArray[np.complex128], speed: float = 0.0) -> NDArray[np.str_]:
    """'forward', 'backward' or 'mixed' for node amplitudes `x`, `y` (n_nodes, n_modes) at a shaft `speed` [rad/s].

    'mixed' where nodes disagree or move on a straight line.
    """
    major, minor = half_axes(x, y, speed)
    moving = major > _STILL * major.max(axis=0)
    turn = np.where(np.abs(minor) < _PLANAR * major, 0.0, np.sign(minor))
    all_forward = np.all((turn > 0) | ~moving, axis=0)
    all_backward = np.all((turn < 0) | ~moving, axis=0)
    return np.where(all_forward, "forward", np.where(all_backward, "backward", "mixed"))
