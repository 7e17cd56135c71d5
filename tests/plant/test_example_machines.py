"""Shipped designs: a spindle on aerostatic bearings and a turbo rotor on grooved ones."""

import numpy as np
import pytest

from rotorsim.machine import load_machine
from rotorsim.plant import Plant

RPM = 2 * np.pi / 60


def test_grooves_keep_the_rotor_stable_that_whirls_on_plain_bearings():
    grooved = load_machine("grooved_turbo_rotor").with_({"grid.n_theta": 24, "grid.n_z": 12})
    plain = grooved.with_({"bearings.0.grooves": None, "bearings.1.grooves": None})
    for speed in (30e3 * RPM, 150e3 * RPM):
        assert Plant(grooved).linearise(speed, 0.0).zeta.min() > 0.03
        unstable = Plant(plain).linearise(speed, 0.0)
        worst = unstable.zeta.argmin()
        assert unstable.zeta[worst] < -0.01
    assert unstable.wn[worst] < 0.5 * speed


def test_the_spindle_floats_and_stiffens_with_the_supply():
    plant = Plant(load_machine("aerostatic_spindle").with_({"grid.n_theta": 16, "grid.n_z": 8}))
    rest = [plant.equilibrium(0.0, pressure) for pressure in (0.3e6, 0.6e6)]
    weight = plant.machine.mass * 9.81
    for one in rest:
        assert one.forces[:, 1].sum() == pytest.approx(weight, rel=0.02)
        assert one.h_min > 15e-6 and one.mass_flow.shape == (32,) and (one.mass_flow > 0).all()
    assert np.abs(rest[1].journals).max() < np.abs(rest[0].journals).max()
    soft, stiff = (plant.linearise(0.0, pressure).wn.min() for pressure in (0.3e6, 0.6e6))
    assert stiff > 1.1 * soft
