"""Natural frequency and damping ratio read from a live impact, against the plant's eigenvalues."""

import numpy as np
import pytest

from coarse_rig import RPM, make_rig
from rotorsim.live.modes import BEFORE, LEAD, RING, modes_at, read_ringdown


def ringing(rig, axis, clearance=25e-6):
    """Reading of a hit on a rig that turns steadily."""
    rig.advance(6000)
    rig.strike(axis)
    rig.advance(LEAD + RING)
    return read_ringdown(rig.history.last(BEFORE + LEAD + RING), axis, clearance, 5.0, rig.Ts)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(
    ("speed", "pressure"), [(0.0, 0.3e6), (3000 * RPM, 0.5e6), (6000 * RPM, 0.6e6), (100 * RPM, 0.3e6)]
)
def test_a_hit_reads_an_eigenvalue_within_its_scatter(speed, pressure, axis):
    rig = make_rig(speed=speed, pressure=pressure, impulse=0.005)
    reading, modes = ringing(rig, axis), modes_at(rig.assembly, speed, pressure)
    assert not reading.why
    assert np.min(np.abs(np.array(modes.frequency) - reading.frequency)) <= reading.frequency_scatter
    mode = int(np.argmin(np.abs(np.array(modes.frequency) - reading.frequency)))
    assert reading.zeta == pytest.approx(modes.zeta[mode], abs=reading.zeta_scatter)
    assert reading.frequency_scatter < 0.02 * reading.frequency and reading.zeta_scatter < 0.01
