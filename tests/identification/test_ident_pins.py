"""Measured pins in identification: models 2 and 'actuator' take what the pins' sensors read, as the thesis did."""

import numpy as np
import pytest
from scipy.signal import cont2discrete

import identification as idn
from identification.local.greybox import actuator, cascade
from model3 import TRUTH, TS, prbs

pytestmark = pytest.mark.numerical

LAG = 0.2e-3
ROTOR = np.r_[TRUTH[:12], 2 / 0.4e-3, 2 / 0.33e-3]
PINS = np.array([3078 * 8143, 3078 + 8143, 0.9 * 3078 * 8143, 2452 * 6494, 2452 + 6494, 0.9 * 2452 * 6494]) + 0.0
"""Actuators with the poles of the thesis' Table C.2."""


@pytest.fixture(scope="module")
def seen():
    """Return records of 2 s of Model 2 with the true pins alone and with those of sensors that lag too, exact."""
    A, B, *_ = cascade(np.r_[ROTOR, PINS])
    c, n, order = actuator(PINS)[2], round(2 / TS), len(A)
    whole = np.zeros((order + 2, order + 2))
    whole[:order, :order] = A
    whole[order:, order - 4 : order], whole[order:, order:] = c / LAG, -np.eye(2) / LAG
    F, G, *_ = cont2discrete((whole, np.vstack([B, np.zeros((2, 2))]), np.eye(order + 2), np.zeros((order + 2, 2))), TS)
    rng = np.random.default_rng(2)
    u, x = prbs(rng, n), np.zeros((n, order + 2))
    for k in range(n - 1):
        x[k + 1] = F @ x[k] + G @ u[k]
    # um of disc and 10 um of pin for a unit of the model
    y, true, lagged = x[:, :2] + 1e-7 * rng.normal(size=(n, 2)), x[:, order - 4 : order] @ c.T, x[:, order:]
    pins = {"pin": 1e-5 * true, "pin_measured": 1e-5 * lagged}
    records = [{"pin": pins["pin"]}, pins, {"pin": pins["pin_measured"]}]
    return [idn.from_arrays(np.arange(n) * TS, u, y, speed=0.0, pressure=3e5, **more) for more in records]


def test_the_delay_from_pin_to_disc_shrinks_by_the_lag_of_the_sensor_and_nothing_else_moves(seen):
    """At 730 rad/s a lag of .2 ms also makes the pins 1.1 % smaller; frequencies and damping ratios are the rotor's."""
    true, measured, _ = (idn.identify(record, 2) for record in seen)
    assert true.delay == pytest.approx([0.4e-3, 0.33e-3], abs=0.01e-3)
    assert true.delay - measured.delay == pytest.approx([LAG, LAG], abs=0.02e-3)
    assert measured.wn == pytest.approx(true.wn, rel=2e-3)
    assert measured.zeta == pytest.approx(true.zeta, abs=2e-3)
    assert np.abs(measured.static_gain - true.static_gain).max() < 0.02 * np.abs(true.static_gain).max()
    assert not any("pin_measured" in text for text in true.notes)
    assert any("pin_measured" in text for text in measured.notes)


def test_the_actuators_that_are_identified_are_those_with_their_sensors(seen):
    """The lag of an actuator is the sum of its poles' times; the sensor adds its own. Mapped pins are taken as read."""
    true, measured, mapped = (idn.identify(record, "actuator") for record in seen)

    def lags(found):
        return [found.parameters[f"a1_{x}"][0] / found.parameters[f"a0_{x}"][0] for x in "xy"]

    assert lags(true) == pytest.approx([1 / 3078 + 1 / 8143, 1 / 2452 + 1 / 6494], rel=1e-3)
    assert np.subtract(lags(measured), lags(true)) == pytest.approx([LAG, LAG], rel=0.15)
    assert mapped.parameters == measured.parameters
    assert any("pin_measured" in text for text in measured.notes) and mapped.notes != measured.notes


def test_the_ceiling_of_actuators_is_what_the_noise_of_their_readings_leaves(seen):
    """White noise of s at rest: 1 - s / std of the signal; a fit of the true structure reaches it."""
    record, noise = seen[2].copy(deep=True), 2e-7
    true = record["pin"].values.copy()
    record["pin"][:] = true + noise * np.random.default_rng(5).normal(size=true.shape)
    found, whole = idn.identify(record, "actuator"), idn.identify(seen[2], "actuator")
    expected = 1 - noise / record["pin"].values.std(axis=0)
    assert found.ceiling == pytest.approx(expected, abs=0.003)
    assert found.fit == pytest.approx(expected, abs=0.006)
    assert whole.ceiling == pytest.approx([1.0, 1.0], abs=1e-9)


@pytest.mark.parametrize("suffix", [".nc", ".csv", ".mat"])
def test_measured_pins_come_back_from_files_to_the_last_bit(seen, tmp_path, suffix):
    short = seen[1].isel(time=slice(0, 100), injector=[1])
    back = idn.read(idn.save(short, tmp_path / f"pins{suffix}"))
    assert back.identical(short) and back["pin_measured"].dims == ("time", "injector")


def test_columns_and_mappings_name_measured_pins(tmp_path):
    (tmp_path / "a.csv").write_text("time,pin_measured_2 [um],pin_measured_1 [um]\n0,2,1\n0.1,4,3\n", "utf-8")
    found = idn.read(tmp_path / "a.csv")
    assert found["pin_measured"].values == pytest.approx(np.array([[1e-6, 2e-6], [3e-6, 4e-6]]))
    assert found["injector"].values.tolist() == [1, 2]


@pytest.mark.parametrize("number", [1, 2])
def test_mapped_pins_and_their_readings_are_of_the_same_injectors(tmp_path, number):
    (tmp_path / "b.csv").write_text("t,p,q\n0,1,2\n0.1,3,4\n", "utf-8")
    measured = {str(number): {"column": "q", "unit": "um"}}
    channels = {"pin": {"1": {"column": "p", "unit": "um"}}, "pin_measured": measured}
    mapping = {"time": {"column": "t", "unit": "s"}, "channels": channels}
    if number == 1:
        assert idn.read(tmp_path / "b.csv", mapping)["pin_measured"].values.ravel() == pytest.approx([2e-6, 4e-6])
    else:
        with pytest.raises(idn.ReadError):
            idn.read(tmp_path / "b.csv", mapping)
