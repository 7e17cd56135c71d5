"""Rotor of beam elements that shares no code with rotorsim: its gyroscopic moments."""

import numpy as np
import pytest
from scipy.linalg import eig

from studies.benchmarks.foreign_rotor import BEARINGS, Rig, rotor


def whirls(sense: int, hertz: float) -> dict[int, float]:
    """Lowest natural frequency [Hz] on isotropic undamped supports that whirls with (1) and against (-1) x to y."""
    round_supports = tuple((kx, kx, 0.0, 0.0) for _, kx, *_ in BEARINGS)
    M, C, K = rotor(Rig(round_supports, (), sense=sense), 2 * np.pi * hertz, 0.0)
    n = len(K)
    zero, one = np.zeros((n, n)), np.eye(n)
    poles, shapes = eig(np.block([[zero, one], [-K, -C]]), np.block([[one, zero], [zero, M]]))
    found: dict[int, float] = {}
    for i in np.argsort(np.abs(poles.imag)):
        if poles[i].imag > 1.0:
            x, y = shapes[:n:4, i], shapes[1:n:4, i]
            # x = cos, y = sin is the phasor y = -i x
            found.setdefault(int(np.sign(-np.imag(np.conj(x) @ y))), float(poles[i].imag / (2 * np.pi)))
    return found


@pytest.mark.parametrize("sense", [1, -1])
def test_the_forward_mode_rises_with_the_speed_and_the_backward_mode_falls(sense):
    still = whirls(sense, 1e-3)
    turning = whirls(sense, 200.0)
    assert still[1] == pytest.approx(still[-1], rel=1e-4)
    assert turning[sense] > 1.02 * still[sense]
    assert turning[-sense] < 0.98 * still[-sense]
