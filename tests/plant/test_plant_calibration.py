"""The rig against an independent calculation of the same model, and its grid convergence.

REFERENCE is of a separate implementation with plain footprint averages on 256 x 64 intervals: f1 [Hz], zeta1, f2,
zeta2, static gains xx and yy [um/V], delays x and y [ms]. Its own grid error is about .05 % in f.
"""

import numpy as np
import pytest

from rotorsim.plant import film_response
from studies.benchmarks.accuracy import REFERENCE

RPM = np.pi / 30
PUBLISHED_CROSS_GAIN = 0.755
"""Largest cross gain of the rig, .75 um/V as printed with two digits (DTU thesis, Table E.2)."""


def hertz(model):
    return model.wn[:2] / (2 * np.pi)


@pytest.mark.parametrize(("pressure", "rpm"), list(REFERENCE))
def test_modes_gains_and_delays_of_the_rig_agree_with_the_independent_calculation(rig, pressure, rpm):
    """Demanded: f and gain 1 %, zeta .003, delay .005 ms. Met: .15 %, .0002, .2 %, .002; asked for is twice that."""
    model = rig(n_z=16).linearise(rpm * RPM, pressure * 1e6)
    f1, zeta1, f2, zeta2, gain_x, gain_y, delay_x, delay_y = REFERENCE[pressure, rpm]
    assert hertz(model) == pytest.approx([f1, f2], rel=0.003)
    assert model.zeta[:2] == pytest.approx([zeta1, zeta2], abs=0.0005)
    assert np.diag(model.static_gain) * 1e6 == pytest.approx([gain_x, gain_y], rel=0.005)
    assert model.delay * 1e3 == pytest.approx([delay_x, delay_y], abs=0.003)


def test_a_transfer_function_factors_the_film_once_and_delays_once_an_axis_and_at_rest(rig, monkeypatch):
    model, factored = rig(n_z=16).linearise(3000 * RPM, 0.5e6), []
    eliminate, substitute = film_response._compiled()
    monkeypatch.setattr(
        film_response, "_compiled", lambda: (lambda *x: (factored.append(x[7]), eliminate(*x)), substitute)
    )
    model.transfer(100j)
    assert len(factored) == 1
    model.modes, factored.clear()
    assert np.isfinite(model.delay).all() and len(factored) == 3


@pytest.mark.parametrize("pressure", [0.3, 0.5, 0.7])
def test_cross_gains_grow_with_speed_and_change_sign_with_it(rig, pressure):
    plant = rig(n_z=16)

    def cross(rpm):
        gain = plant.linearise(rpm * RPM, pressure * 1e6).static_gain * 1e6
        return np.array([gain[0, 1], gain[1, 0]])

    standing, slow, fast = cross(0), cross(3000), cross(6000)
    assert np.abs(standing).max() < 1e-9
    assert np.all(np.abs(fast) > np.abs(slow)) and np.all(np.abs(slow) > 0.1)
    assert np.abs(fast).max() <= PUBLISHED_CROSS_GAIN
    # the film drags the journal along: pushed to x it goes on towards y, pushed to y towards -x
    assert fast[0] < 0 < fast[1]
    # the mirrored machine is the same machine: only round-off of the sparse factorisations differs
    assert cross(-6000) == pytest.approx(-fast, rel=1e-9)


def test_the_softer_mode_is_horizontal(rig):
    """The load presses the journal down, which stiffens y; standing still the planes do not couple."""
    model = rig(n_z=16).linearise(0.0, 0.3e6)
    x, y = np.abs(model.C @ model._modes[1][:, :2])
    assert x[0] > 1e3 * y[0] and y[1] > 1e3 * x[1]
    assert hertz(model)[0] < hertz(model)[1]


def test_gravity_puts_the_known_load_on_the_gas_bearing(rig):
    """35.84 N of the independent calculation; .3 N is 1 %, of which the eight elements of the shaft take a tenth."""
    rest = rig(n_z=16).equilibrium(0.0, 0.5e6)
    assert rest.force == pytest.approx([0.0, 35.84], abs=0.3)
    assert rest.journal[0] == pytest.approx(0.0, abs=1e-12)
    assert rest.journal[1] < 0 < rest.h_min


@pytest.mark.slow
def test_natural_frequencies_converge_with_the_grid(rig):
    """At .3 MPa, 6 krpm the larger error of the pair falls from grid to grid, and 32 x 16 is within .2 % of 128 x 32.

    Measured against the table .43, .15, .14, .08 %. Halving both steps makes each of the two errors fall.
    """
    grids = ((32, 8), (32, 16), (64, 16), (128, 32))
    found = np.array([hertz(rig(n_theta=t, n_z=z).linearise(6000 * RPM, 0.3e6)) for t, z in grids])
    reference = np.array([REFERENCE[0.3, 6000][0], REFERENCE[0.3, 6000][2]])
    errors = np.abs(found / reference - 1)
    assert np.all(np.diff(errors.max(axis=1)) < 0)
    assert np.all(np.diff(errors[[0, 2, 3]], axis=0) < 0)
    assert found[1] == pytest.approx(found[3], rel=0.002)
