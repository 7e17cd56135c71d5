"""Prefilter (bias, median, runout), and records unfit for identification."""

import numpy as np
import pytest

import identification as idn
from identification.local.greybox import modes
from identification.records.prefilter import rest_length
from model3 import TRUTH, TS, prbs, record

pytestmark = pytest.mark.numerical

RPM = np.pi / 30


def imbalance(angle):
    """9 um of 1X and some 2X and 3X, x a quarter turn before y."""
    wave = [9e-6, 1e-6, 0.4e-6]
    return np.column_stack(
        [sum(a * np.cos(k * (angle - p)) for k, a in enumerate(wave, 1)) for p in (0.3, 0.3 + np.pi / 2)]
    )


def encoder(rpm, n, first=0.0):
    """Angle of an encoder of 2000 counts."""
    angle = first + rpm * RPM * TS * np.arange(n)
    return np.floor(angle * 2000 / (2 * np.pi)) * 2 * np.pi / 2000


@pytest.mark.parametrize("kind", ["harmonic", "table"])
@pytest.mark.parametrize("rpm", [5000.0, 5013.0, 6000.0, 1234.5])
def test_the_extended_runout_filter_leaves_less_than_half_a_micrometre(rpm, kind):
    rng = np.random.default_rng(0)
    n = 25000
    before = encoder(rpm, n)
    runout = idn.estimate_runout(before, imbalance(before) + 0.33e-6 * rng.normal(size=(n, 2)), kind)
    later = encoder(rpm, 5000, 0.2345)
    assert np.abs(imbalance(later) - runout.at(later)).max() < 0.5e-6


def test_without_a_steady_run_the_fit_takes_the_harmonics_out():
    n = 30000
    angle = encoder(5000.0, n)
    data = record(1, seconds=6.0, speed=5000 * RPM, angle=angle)
    data["disc_measured"] += imbalance(angle)
    found = idn.identify(data)
    wn, zeta = modes(TRUTH)
    np.testing.assert_allclose(found.wn, wn, rtol=2e-3)
    np.testing.assert_allclose(found.zeta, zeta, rtol=0.04)
    assert np.all(found.fit > found.ceiling - 0.02)


def test_median_bias_and_rest():
    data = record(2, seconds=2.0)
    data["disc_measured"][5000, 0] += 1e-3
    assert np.abs(idn.filtered(data).y).max() > 900e-6  # no median unless it is asked for
    signals = idn.filtered(data, settings=idn.Prefilter(median=3))
    assert np.abs(signals.y).max() < 50e-6
    assert np.abs(signals.y[:2000].mean(axis=0)).max() < 1e-10
    assert rest_length(data.reference.values) == signals.rest
    np.testing.assert_allclose(signals.noise, 0.5e-6 * 0.67, rtol=0.1)  # a median of 3 leaves 0.67 of white noise


def test_resampling_on_the_angle_makes_a_sine_of_a_run_up():
    t = np.arange(20000) * TS
    angle = 50 * t + 30 * t**2
    grid, y = idn.on_angle(angle, np.column_stack([np.cos(angle), np.sin(angle)]))
    assert np.abs(y - np.column_stack([np.cos(grid), np.sin(grid)])).max() < 1e-3


def stuck(data):
    data["disc_measured"][4000:5000, 1] = data["disc_measured"][4000, 1]
    return data


def clipped(data):
    data["disc_measured"] = data["disc_measured"].clip(-4e-6, 4e-6).assign_attrs(data["disc_measured"].attrs)
    return data


def scaled(data, name, factor):
    data[name] = (data[name] * factor).assign_attrs(data[name].attrs)
    return data


def still(data, axis):
    data["reference"][:, axis] = 0
    return data


def alike(data):
    data["reference"][:, 1] = data["reference"][:, 0].values
    return data


def drifting(data, name, step):
    data[name] = (data[name] + np.linspace(0, step, data.sizes["time"])).assign_attrs(data[name].attrs)
    return data


FAULTS = {
    "short": (lambda d: d.isel(time=slice(0, 4000)), "0.4 s with excitation"),
    "stuck": (stuck, "drop-out"),
    "clipped": (clipped, "saturated"),
    "micrometres": (lambda d: scaled(d, "disc_measured", 1e6), "um or mm taken for m"),
    "bar": (lambda d: scaled(d, "pressure", 1e-5), "bar or MPa taken for Pa"),
    "no excitation": (lambda d: still(still(d, 0), 1), "does not move"),
    "one axis": (lambda d: still(d, 1), "reference y: does not move"),
    "one signal": (alike, "correlated"),
    "speed": (lambda d: drifting(d, "speed", 60.0), "record.speed: drifts from"),
    "pressure": (lambda d: drifting(d, "pressure", 5e4), "record.pressure: drifts from"),
}


@pytest.mark.parametrize("fault", list(FAULTS))
def test_an_unfit_record_is_refused_with_one_sentence(fault):
    spoil, words = FAULTS[fault]
    data = spoil(record(3, seconds=4.0))
    with pytest.raises(idn.UnfitError) as caught:
        idn.identify(data)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert ";" in str(caught.value)


def test_swapped_channels_are_reported():
    data = record(4, seconds=4.0)
    data["reference"] = data["reference"].copy(data=data["reference"].values[:, ::-1])
    found = idn.identify(data)
    assert any("swapped" in text for text in found.warnings)
    assert not idn.identify(record(4, seconds=4.0)).warnings


def test_model_2_without_pins_is_refused():
    with pytest.raises(idn.UnfitError, match="no pin"):
        idn.identify(record(5, seconds=3.0), 2)


def test_a_filter_needs_a_turning_shaft():
    u = prbs(np.random.default_rng(0), 100)
    with pytest.raises(idn.UnfitError, match="turns 0 times"):
        idn.estimate_runout(np.zeros(100), u)
