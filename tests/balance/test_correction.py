"""Correction weights in holes, and the physical model of a machine against itself."""

from math import pi

import numpy as np
import pytest

from rotorsim.balance import Conditions, Plane, Reading, correction, fit_influence, fit_physical, leave_one_out
from rotorsim.balance.unbalance import in_holes, model_influence
from rotorsim.base.errors import DataError
from rotorsim.machine import load_machine


@pytest.mark.parametrize("angle", [0.0, 0.1, 1.7, 3.3, 6.2])
def test_two_weights_in_neighbouring_holes_make_the_vector(angle):
    wanted = 3e-5 * np.exp(1j * angle)
    weights = in_holes(wanted, Plane("d", 0.1, 0.03, 8))
    assert sum(m * 0.03 * np.exp(1j * a) for a, m in weights) == pytest.approx(wanted, rel=1e-12)
    assert all(m > 0 and (a * 4 / pi) % 1 == pytest.approx(0, abs=1e-9) for a, m in weights)


def test_one_weight_anywhere_and_none_without_a_radius():
    assert in_holes(3e-5j, Plane("d", 0.1, 0.03)) == ((pytest.approx(pi / 2), pytest.approx(1e-3)),)
    assert in_holes(3e-5j, Plane("d", 0.1)) == ()


def rk4(seed=0, n=12, positions=(0.16, 0.4)):
    """Records of the shipped rotor kit by its own model: probes of unknown angle and gain."""
    generator = np.random.default_rng(seed)
    planes = tuple(Plane(f"disc {k}", z, 0.03) for k, z in enumerate(positions))
    readings = (Reading("a", 0.12), Reading("b", 0.44))
    speed = np.tile([105.0, 126.0], (n, 1))
    empty = np.zeros((n, 2, 2), complex)
    frame = Conditions(tuple(map(str, range(n))), ("1", "2"), speed, empty, np.zeros((n, 2), complex), readings, planes)
    model = model_influence(load_machine("bently_rk4"), frame)
    u = 2e-5 * (generator.standard_normal((n, 2)) + 1j * generator.standard_normal((n, 2)))
    gain = np.tile([0.8 * np.exp(0.4j), 1.3 * np.exp(-1j)], 2)
    first = 1e-5 * (generator.standard_normal(2) + 1j * generator.standard_normal(2))
    y = ((u + first) @ model.T) * gain + 1e-8 * generator.standard_normal((n, 4))
    return Conditions(frame.labels, frame.speeds, speed, y.reshape(n, 2, 2), u, readings, planes)


def test_the_physical_model_knows_its_own_records_whatever_the_probes_are():
    c = rk4()
    assert leave_one_out(c, fit_physical(load_machine("bently_rk4"), c)).vector_rms < 2e-7


def test_weights_take_the_vectors_away():
    c = rk4()
    fix = correction(fit_influence(c.flat, c.unbalance), c.flat[3], c.planes)
    assert np.abs(fix.after).max() < 0.01 * np.abs(fix.before).max()


def test_a_position_off_the_shaft_and_a_film_are_refused():
    c = rk4()
    with pytest.raises(DataError, match="needs linear bearings"):
        model_influence(load_machine("dtu_gas_bearing"), c)
    far = Conditions(c.labels, c.speeds, c.speed, c.vectors, c.unbalance, c.readings, (Plane("d", 0.9),) * 2)
    with pytest.raises(DataError, match="d: 900 mm is not on the shaft"):
        model_influence(load_machine("bently_rk4"), far)
