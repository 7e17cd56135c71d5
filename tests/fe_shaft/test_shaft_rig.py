"""The rig's shaft: weight, static load, and natural frequencies on a rigid gas bearing."""

import numpy as np
import pytest

pytestmark = pytest.mark.numerical

# Distance from ball bearing to disc [m]: first frequency [Hz] with the gas bearing rigid.
RIGID = {0.34: 183.0, 0.38: 155.0, 0.40: 143.0, 0.42: 132.0}


@pytest.mark.parametrize("disc_at", RIGID)
def test_first_frequency_of_the_rig_on_a_rigid_gas_bearing(rig, disc_at):
    """1 %: the references carry three digits. 1e11 N/m is rigid: 1e4 times the shaft."""
    wn = rig(disc_at, gas_stiffness=1e11).rotor.run_modal(0.0).wn
    assert wn[0] / (2 * np.pi) == pytest.approx(RIGID[disc_at], rel=0.01)


def test_first_frequency_of_the_rig_without_a_stub_on_a_rigid_gas_bearing(rig):
    """The disc at .5 m leaves no stub behind the ball bearing; 1 % as above."""
    wn = rig(0.5, gas_stiffness=1e11).rotor.run_modal(0.0).wn
    assert wn[0] / (2 * np.pi) == pytest.approx(99.7, rel=0.01)


def test_gas_bearing_of_the_rig_carries_between_34_and_38_newton(rig):
    """Two supports are statically determinate: moments about the ball bearing give the load."""
    r = rig(gas_stiffness=4e6)
    forces = r.rotor.run_static().bearing_forces
    assert 34.0 < forces[1, 1] < 38.0
    assert forces[:, 0] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert forces[:, 1].sum() == pytest.approx(9.80665 * r.rotor.mass, rel=1e-9)
    lever = np.array([1.5 * 0.3787, 1.7169 * (0.3787 - 0.25), 0.3216 * 0.625 * 0.3787])  # disc, shaft, collar [kg m]
    assert forces[1, 1] == pytest.approx(9.80665 * lever.sum() / (0.625 * 0.3787), rel=1e-3)


def test_shaft_of_the_rig_weighs_2_04_kilograms(rig):
    assert rig().rotor.mass - 1.5 == pytest.approx(2.04, abs=0.005)


def test_stub_behind_the_ball_bearing_is_counted_in_the_positions_of_the_nodes(rig):
    r = rig()
    z = r.rotor.nodes_pos
    assert z[r.disc] == pytest.approx(0.5)
    assert z[r.gas] == pytest.approx(0.5 - 0.3787 + 0.625 * 0.3787)
