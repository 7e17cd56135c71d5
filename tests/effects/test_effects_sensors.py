"""Signatures of the effects on the sensors, one switched on at a time on a plain rotor."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorsim.effects.sensors.sensor_delay import LENGTH, sensor_delay
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.kernels.layout import READ

SAMPLE = 2e-4
HZ = 2 * np.pi
SPEED = 25 * HZ


@pytest.fixture
def record(neutral, held):
    """Return (true, measured) x and y (n, 2) and the whole table of a second at 25 Hz with some unbalance."""

    def run(effects, seed=0, hertz=25, name="plain_rotor"):
        values = {"shaft.damping_ratio": 0.05, "effects.unbalance.0.me": "25 g*mm"}
        values |= {f"effects.{key}": value for key, value in effects.items()}
        pressure = 0.5e6 if name != "plain_rotor" else 0.0
        table = (
            neutral(values, name=name).start(hertz * HZ, pressure, seed=seed).advance(held(5000, hertz * HZ, pressure))
        )
        return table[:, :2], table[:, READ : READ + 2], table

    return run


def test_gain_and_cross_talk_are_a_matrix_on_the_displacement(record):
    values = {"x": 0.03, "y": -0.02, "cross_x": 0.01, "cross_y": 0.004}
    true, measured, _ = record({f"sensor_gain.{key}": value for key, value in values.items()})
    expected = true @ np.array([[1.03, 0.01], [0.004, 0.98]]).T
    assert measured == pytest.approx(expected, abs=1e-18)


def test_probes_on_a_turned_ring_read_the_motion_in_its_axes_and_keep_their_gains(record):
    """A rotation by 30 deg from x towards y, then each probe's own gain, though the file has the gains first."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    true, measured, _ = record({"sensor_ring.angle": "30 deg", "sensor_gain.x": 0.03, "sensor_gain.cross_y": 0.02})
    expected = true @ (np.array([[1.03, 0.0], [0.02, 1.0]]) @ np.array([[c, s], [-s, c]])).T
    assert measured == pytest.approx(expected, abs=1e-18)
    assert np.abs(measured - true).max() > 0.2 * np.abs(true).max()


def test_a_ring_at_zero_leaves_every_bit_of_runout_and_gain_as_without_it(held):
    machine = load_machine("plain_rotor")
    values = {"amplitude_1x": "5 um", "phase_1x": "20 deg", "amplitude_2x": "2 um", "roughness": "0.1 um"}
    for key, value in values.items():
        machine = machine.replace(f"effects.runout.{key}", value)
    machine = machine.replace("effects.sensor_gain.x", 0.03)
    with_ring = machine.replace("effects.sensor_ring", {})
    tables = [Plant(m).start(SPEED, 0.0).advance(held(500, SPEED, 0.0)) for m in (machine, with_ring)]
    assert tables[0].tobytes() == tables[1].tobytes()
    assert np.abs(tables[0][:, READ] - tables[0][:, 0]).max() > 4e-6


def test_a_lag_delays_and_shrinks_a_turning_orbit_as_its_transfer_function(record):
    """1 / (1 + i Omega T) at 25 Hz; a displacement linear between samples is (Omega Ts)^2 / 12 = 1e-4 off."""
    true, measured, _ = record({"sensor_lag.time": "4 ms"})
    turn = np.exp(-1j * SPEED * SAMPLE * np.arange(4000))
    ratio = (turn @ measured[1000:]) / (turn @ true[1000:])
    assert ratio == pytest.approx(1 / (1 + 1j * SPEED * 4e-3), rel=3e-4)


@pytest.mark.parametrize("delay", [2e-4, 3.3e-4, 0.012])
def test_a_delay_of_any_part_of_a_sample_is_exact_for_a_ramp(delay):
    """s(t) = x(t - T), and the first value before there was one; .7 um a sample, to round-off."""
    w, p = np.zeros(5 + 2 * LENGTH + 1), SimpleNamespace(delay=delay, interval=SAMPLE)
    kernel, t = sensor_delay.py_func, SAMPLE * np.arange(200)
    read = []
    for sample in range(200):
        w[:2] = 2.0 + 3e-3 * t[sample], 1.0 - 1e-3 * t[sample]
        kernel(w, 0, 5, 0.0, float(sample), p)
        read.append(w[:2].copy())
    past = np.maximum(t - delay, 0.0)
    expected = np.column_stack([2.0 + 3e-3 * past, 1.0 - 1e-3 * past])
    assert np.array(read) == pytest.approx(expected, abs=1e-14)


def test_a_delay_of_the_rotors_sensors_is_what_they_read_before(record):
    true, measured, _ = record({"sensor_delay.delay": "1.1 ms"})
    expected = 0.5 * (true[94:-6] + true[95:-5])
    assert measured[100:] == pytest.approx(expected, abs=1e-18)


def test_at_slow_roll_the_sensors_read_the_surface_a_quarter_turn_apart(record):
    """Orders 1 to 3 of the file come back with their phases; y sees under it what x saw a quarter turn before."""
    values = {
        "amplitude_1x": "5 um",
        "phase_1x": "20 deg",
        "amplitude_2x": "2 um",
        "amplitude_3x": "1 um",
        "phase_3x": "-70 deg",
    }
    true, measured, table = record({f"runout.{key}": value for key, value in values.items()}, hertz=2)
    seen, angle = (measured - true), table[:, 4]

    def surface(a):
        return 5e-6 * np.cos(a + np.radians(20)) + 2e-6 * np.cos(2 * a) + 1e-6 * np.cos(3 * a - np.radians(70))

    assert seen[:, 0] == pytest.approx(surface(-angle), abs=1e-15)
    assert seen[:, 1] == pytest.approx(surface(np.pi / 2 - angle), abs=1e-15)
    quarter = round(0.25 / 2 / SAMPLE)
    assert seen[:-quarter, 0] == pytest.approx(seen[quarter:, 1], abs=1e-14)


@pytest.mark.parametrize("degrees", [90, 30, -200])
def test_probes_on_a_turned_ring_read_the_surface_under_their_new_places(record, degrees):
    """After a quarter turn x reads y of the motion and the surface that y read before, y the opposite of x."""
    values = {"runout.amplitude_1x": "5 um", "runout.phase_1x": "20 deg", "runout.amplitude_2x": "2 um",
              "runout.amplitude_3x": "1 um", "runout.roughness": "0.1 um"}  # fmt: skip
    true, measured, table = record(values, hertz=2)
    _, turned, _ = record({**values, "sensor_ring.angle": f"{degrees} deg"}, hertz=2)
    a, angle = np.radians(degrees), table[:, 4]
    motion = true @ np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    surface = turned - motion
    whole = 5e-6 * np.cos(a - angle + np.radians(20)) + 2e-6 * np.cos(2 * (a - angle)) + 1e-6 * np.cos(3 * (a - angle))
    assert np.std(surface[:, 0] - whole) == pytest.approx(1e-7, rel=0.01)  # the roughness
    quarter = round(0.25 / 2 / SAMPLE)
    assert surface[:-quarter, 0] == pytest.approx(surface[quarter:, 1], abs=1e-14)
    if degrees == 90:
        assert turned[:, 0] - true[:, 1] == pytest.approx(measured[:, 1] - true[:, 1], abs=1e-15)


def test_roughness_has_its_rms_turns_with_the_shaft_and_belongs_to_the_surface(record):
    """Orders 4 to 24 alone, rms .3 um over whole turns; the same in every run, another for another surface."""
    rough = {"runout.roughness": "0.3 um"}
    true, measured, _ = record(rough, hertz=4)
    seen = (measured - true)[:, 0]
    lines = np.abs(np.fft.rfft(seen))[::4]
    assert np.sqrt(np.mean(seen**2)) == pytest.approx(0.3e-6, rel=1e-3)
    assert set(np.flatnonzero(lines > 1e-3 * lines.max())) == set(range(4, 25))
    again = record(rough, seed=9, hertz=4)
    assert np.array_equal(again[1] - again[0], measured - true)
    other = record(rough | {"runout.surface": 2}, hertz=4)
    assert abs(np.corrcoef((other[1] - other[0])[:, 0], seen)[0, 1]) < 0.9


def test_a_drift_lets_the_surface_grow_with_time(record):
    """1 + d t from the first sample on, at every angle."""
    still, growing = ({"runout.amplitude_1x": "5 um", "runout.roughness": "0.3 um"} | more for more in
                      ({}, {"runout.drift": "0.2 1/s"}))  # fmt: skip
    seen = [measured - true for true, measured, _ in (record(still, hertz=4), record(growing, hertz=4))]
    growth = 1 + 0.2 * SAMPLE * np.arange(len(seen[0]))
    assert seen[1] == pytest.approx(seen[0] * growth[:, None], abs=1e-14)


def test_noise_is_white_normal_independent_and_belongs_to_the_seed(record):
    """5000 samples: standard errors .014 of mean and correlation, .01 of sigma; bounds at 4 of them."""
    noisy = {"noise.sigma": "0.5 um"}
    true, measured, table = record(noisy, seed=4)
    n = (measured - true) / 0.5e-6
    assert np.abs(n.mean(axis=0)).max() < 0.06
    assert n.std(axis=0) == pytest.approx([1, 1], abs=0.04)
    assert abs(np.mean(n[:, 0] * n[:, 1])) < 0.06
    for lag in (1, 2, 3, 10, 100):
        assert np.abs(np.mean(n[lag:] * n[:-lag], axis=0)).max() < 0.06
    assert np.array_equal(record(noisy, seed=4)[2], table)
    other = record(noisy, seed=5)[2]
    assert other[:, :READ].tobytes() == table[:, :READ].tobytes()
    assert abs(np.corrcoef(other[:, READ] - other[:, 0], n[:, 0])[0, 1]) < 0.06


def test_readings_are_whole_steps_of_the_converter_nearest_to_the_displacement(record):
    true, measured, _ = record({"quantisation.step": "0.5 um"})
    counts = measured / 0.5e-6
    assert counts == pytest.approx(np.round(counts), abs=1e-9)
    assert np.abs(measured - true).max() <= 0.25e-6 * (1 + 1e-9)
    assert np.ptp(measured[:, 0]) > 2e-6


@pytest.mark.parametrize("window", [10, 50])
def test_the_encoder_counts_and_its_speed_is_off_by_less_than_a_count_in_its_window(record, window):
    """2000 counts: the angle is up to a count behind; the speed within 2 pi / (N m Ts) once the window is full."""
    _, _, table = record({"encoder.counts": 2000, "encoder.window": window}, hertz=23.73)
    count = 2 * np.pi / 2000
    angle, speed = table[:, READ + 2], table[:, READ + 3]
    behind = table[:, 4] - angle
    assert behind.min() > -1e-9 and behind.max() < count + 1e-9
    assert angle / count == pytest.approx(np.round(angle / count), abs=1e-6)
    error = speed[window:] - table[window:, 5]
    assert 0.2 < np.abs(error).max() / (count / (window * SAMPLE)) < 1
    assert error.mean() == pytest.approx(0, abs=0.02 * count / (window * SAMPLE) * np.sqrt(window))


def test_the_pressure_transducer_has_gain_zero_and_noise(record):
    values = {"gain": 0.01, "zero": "2 kPa", "sigma": "1 kPa"}
    table = record({f"pressure_transducer.{k}": v for k, v in values.items()}, name="dtu_gas_bearing")[2]
    error = table[:, READ + 4] - (1.01 * table[:, 6] + 2e3)
    assert error.mean() == pytest.approx(0, abs=60)
    assert error.std() == pytest.approx(1e3, rel=0.04)
    assert np.abs(np.mean(error[1:] * error[:-1])) < 0.06e6


def test_the_normal_deviates_are_those_of_twelve_uniform_ones():
    """Irwin & Hall: variance 1, kurtosis 3 - 6/60; 4e5 deviates have standard errors of .002 and .015, bounds at 4."""
    from numba import njit

    from rotorsim.effects.sensors import normal

    @njit
    def draw(n):
        values = np.empty(n)
        for k in range(n):
            values[k] = normal(11.0, 1.0, k * 1.0)
        return values

    values = draw(400_000)
    assert values.mean() == pytest.approx(0, abs=0.0065)
    assert values.var() == pytest.approx(1, abs=0.009)
    assert np.mean(values**4) == pytest.approx(2.9, abs=0.06)
    assert np.abs(values).max() < 6


SIGNATURES = {
    "sensor_ring": test_probes_on_a_turned_ring_read_the_motion_in_its_axes_and_keep_their_gains,
    "sensor_gain": test_gain_and_cross_talk_are_a_matrix_on_the_displacement,
    "sensor_lag": test_a_lag_delays_and_shrinks_a_turning_orbit_as_its_transfer_function,
    "sensor_delay": test_a_delay_of_any_part_of_a_sample_is_exact_for_a_ramp,
    "runout": test_at_slow_roll_the_sensors_read_the_surface_a_quarter_turn_apart,
    "noise": test_noise_is_white_normal_independent_and_belongs_to_the_seed,
    "quantisation": test_readings_are_whole_steps_of_the_converter_nearest_to_the_displacement,
    "encoder": test_the_encoder_counts_and_its_speed_is_off_by_less_than_a_count_in_its_window,
    "pressure_transducer": test_the_pressure_transducer_has_gain_zero_and_noise,
}
