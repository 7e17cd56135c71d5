"""Model 2 whose force follows the rates of the pins too."""

import numpy as np
import pytest

import identification as idn
from identification.local.greybox import RATED, STRUCTURES, modes, split, static_gain
from identification.local.models import LinearModel
from model3 import TRUTH, TS, prbs

pytestmark = pytest.mark.numerical

ACTUATOR = [2.0e7, 1.1e4, 2.0e7 * 4.2e-6, 1.6e7, 9e3, 1.6e7 * 4.2e-6]
ROTOR = np.r_[TRUTH[:8], 3.6e5, -7e4, 6e4, 3.9e5, 5e3, 6e3, 25.0, 30.0, -20.0, 15.0]
RATES = np.r_[ROTOR, ACTUATOR]
PLAIN = np.r_[ROTOR[:14], ACTUATOR]


def moved(theta, kind, seed=0, seconds=6.0, noise=0.1e-6, **more):
    """Record of a Model 2 with or without rates, with its pins."""
    rng = np.random.default_rng(seed)
    u = prbs(rng, round(seconds / TS))
    pins = LinearModel(*STRUCTURES["actuator"].matrices(theta[-6:])).simulate(u, TS)
    y = LinearModel(*STRUCTURES[kind].matrices(theta)).simulate(u, TS)
    four = np.column_stack([pins[:, 1], pins[:, 0], -pins[:, 1], -pins[:, 0]]) / 2  # an axis is moved by a pair
    y = y + noise * rng.normal(size=y.shape)
    return idn.from_arrays(np.arange(len(u)) * TS, u, y, pin=four, **({"speed": 0.0, "pressure": 3e5} | more))


def late(theta):
    """2 B / r - R (2, 2): how much later than the pins the force comes, which rates and delays share."""
    return 2 * split(theta)[2] / theta[12:14] - theta[14:18].reshape(2, 2)


def test_the_response_is_that_of_a_delayed_force_and_of_the_rates():
    """(s^2 - s D - K) x = (B (r - s)/(r + s) + s R) u."""
    K, D, B = split(ROTOR)
    R, r = ROTOR[14:].reshape(2, 2), ROTOR[12:14]
    made = LinearModel(*STRUCTURES["rotor-rate"].matrices(ROTOR))
    for omega in (50.0, 720.0, 3000.0):
        s = 1j * omega
        force = B @ np.diag((r - s) / (r + s)) + s * R
        wanted = np.linalg.solve(s**2 * np.eye(2) - s * D - K, force)
        np.testing.assert_allclose(made.transfer(np.array([omega]))[0], wanted, rtol=1e-9)


def test_without_rates_it_is_model_2():
    none = np.r_[ROTOR[:14], np.zeros(4), ACTUATOR]
    for one, other in zip(STRUCTURES[RATED].matrices(none), STRUCTURES["2"].matrices(PLAIN), strict=True):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(static_gain(RATED, none), static_gain("2", PLAIN))


def test_modes_gains_and_rates_of_a_known_model_are_found_and_model_2_is_biased():
    data = moved(RATES, RATED)
    found, plain = idn.identify(data, RATED), idn.identify(data, 2)
    wn, zeta = modes(RATES)
    np.testing.assert_allclose(found.wn, wn, rtol=2e-4)
    np.testing.assert_allclose(found.zeta, zeta, rtol=5e-3)
    np.testing.assert_allclose(found.static_gain, static_gain(RATED, RATES), rtol=5e-3, atol=1e-9)
    np.testing.assert_allclose(late(found.theta), late(RATES), atol=1.0)
    assert found.parameters["R_xy"][0] == pytest.approx(30.0, rel=0.05)
    np.testing.assert_allclose(found.delay, np.diag(late(RATES)) / np.diag(split(RATES)[2]), rtol=0.02)
    assert np.abs(plain.zeta / zeta - 1).max() > 0.03
    assert found.model.order == 10


def test_a_model_2_is_found_again():
    found = idn.identify(moved(PLAIN, "2"), RATED)
    np.testing.assert_allclose(late(found.theta), late(np.r_[ROTOR[:14], np.zeros(4)]), atol=1.0)
    np.testing.assert_allclose(found.zeta, modes(PLAIN)[1], rtol=5e-3)


@pytest.mark.slow
def test_surfaces_of_it_keep_one_actuator(tmp_path):
    points = [(0.0, 3e5), (300.0, 3e5), (0.0, 5e5), (300.0, 5e5)]
    results = [idn.identify(moved(RATES, RATED, k, 2.0, speed=w, pressure=p, angle=w * np.arange(10000) * TS), RATED)
               for k, (w, p) in enumerate(points)]  # fmt: skip
    lpv = idn.fit_lpv(results, order=1)
    assert not lpv.coefficients[-6:, 1:].any()
    lpv.save(tmp_path / "rates.json")
    again = idn.load_model(tmp_path / "rates.json")
    np.testing.assert_array_equal(again.at(100.0, 4e5).A, lpv.at(100.0, 4e5).A)
    np.testing.assert_allclose(lpv.at(100.0, 4e5).static_gain, static_gain(RATED, RATES), rtol=0.03, atol=3e-8)


def test_without_pins_it_is_refused():
    with pytest.raises(idn.UnfitError, match="no pin"):
        idn.identify(moved(RATES, RATED, seconds=2.0).drop_vars("pin"), RATED)


@pytest.mark.parametrize(("model", "given", "wanted"), [("2-rate", 20, 24), ("2", 24, 20), ("1", 3, 12)])
def test_a_start_of_another_model_is_refused_with_both_numbers(model, given, wanted):
    with pytest.raises(idn.UnfitError, match=rf"has {wanted} parameters, {given} are given"):
        idn.identify(moved(PLAIN, "2", seconds=3.0), model, start=np.ones(given))
