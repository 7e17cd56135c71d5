"""Signatures of the effects that draw random numbers along the run: broadband force and wander of the speed."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import welch

from rotorsim.effects.rotor.broadband_force import broadband_force
from rotorsim.effects.rotor.speed_wander import speed_wander
from rotorsim.machine import MachineFileError, load_machine
from rotorsim.plant.kernels.layout import AT

SAMPLE = 2e-4
HZ = 2 * np.pi
FORCE = {"effects.broadband_force.density": "0.02 N^2/Hz", "effects.broadband_force.corner": "400 Hz"}
DAMPED = {"shaft.damping_ratio": 0.05, "effects.gravity.acceleration": "0 m/s^2"}


@pytest.fixture
def rotor(neutral):
    """Return the builder of the plain rotor with every effect in it, damped, the weight switched off."""
    return lambda values=None: neutral(DAMPED | dict(values or {}), name="plain_rotor")


def drawn(n, speed, seed=0.0, **values):
    """Forces (n, 2) [N] at the samples for a speed [rad/s]."""
    given = {"density": 0.02, "speed": 100 * HZ, "exponent": 2.0, "corner": 400 * HZ, "sequence": 1.0} | values
    record = np.zeros(1, [(name, "f8") for name in (*given, "interval")]).view(np.recarray)[0]
    for name, value in (given | {"interval": SAMPLE}).items():
        record[name] = value
    out, w = np.zeros((n, 2)), np.zeros(6)
    for k in range(n):
        broadband_force(w, 0, seed, float(k), speed, record)
        out[k] = w[4:]
    return out


def test_the_force_has_the_density_of_the_low_pass_and_grows_with_the_speed():
    """Welch over 200 segments: 7 % a bin and axis, 1 % over a band; n = 3 multiplies the force by 2^1.5 exactly."""
    force = drawn(100_000, 100 * HZ)
    f, density = welch(force.T, 1 / SAMPLE, nperseg=2000)
    for low, high in ((5, 50), (100, 200), (350, 450)):
        band = (f >= low) & (f <= high)
        assert density[:, band].mean() == pytest.approx((0.02 / (1 + (f[band] / 400) ** 2)).mean(), rel=0.03)
    assert abs(np.corrcoef(force.T)[0, 1]) < 0.02
    assert drawn(100, 200 * HZ, exponent=3.0) == pytest.approx(2**1.5 * drawn(100, 100 * HZ, exponent=3.0), rel=1e-14)
    assert not drawn(100, 0.0).any() and drawn(100, 0.0, exponent=0.0).any()


def test_numbers_of_sequences_and_seeds_make_forces_that_have_nothing_in_common():
    first, same = drawn(20_000, 100 * HZ), drawn(20_000, 100 * HZ)
    assert first.tobytes() == same.tobytes()
    for other in (drawn(20_000, 100 * HZ, seed=1.0), drawn(20_000, 100 * HZ, sequence=2.0)):
        assert np.abs(np.corrcoef(first.T, other.T)[:2, 2:]).max() < 0.1


def test_a_mode_under_the_force_has_the_variance_of_an_oscillator_under_coloured_noise(rotor, held):
    """G / (4 c k) w_c (w_c + 2 z w) / (w^2 + 2 z w w_c + w_c^2) of the first mode; 10 s give it within 3 % (1 sd).

    The higher modes add less than a hundredth.
    """
    values = FORCE | {"effects.broadband_force.exponent": 0.0, "shaft.damping_ratio": 0.2}
    plant = rotor(values)
    linear = plant.linearise()
    w, z, corner = linear.wn[0], linear.zeta[0], 400 * HZ
    share = np.linalg.norm(plant.assembly.mesh.shape(0.3)[0, :2]) ** 2  # inverse modal mass at the disc
    k, c = w**2 / share, 2 * z * w / share
    expected = 0.02 / (4 * c * k) * corner * (corner + 2 * z * w) / (w**2 + 2 * z * w * corner + corner**2)
    run = plant.start(0.0)
    run.advance(held(5000, 0.0, 0.0))
    disc = run.advance(held(50_000, 0.0, 0.0))[:, :2]
    assert disc.var(axis=0).mean() == pytest.approx(expected, rel=0.09)


def test_runs_of_one_seed_are_one_run_and_a_saved_state_goes_on_with_the_same_bits(rotor, held):
    plant = rotor(FORCE | {"effects.speed_wander.sd": 0.01})
    rows = held(400, 50 * HZ, 0.0)
    first, other = (plant.start(50 * HZ, seed=seed).advance(rows) for seed in (4, 5))
    run = plant.start(50 * HZ, seed=4)
    begin = run.advance(rows[:150])
    saved = run.save()
    run.advance(rows[:99])
    run.restore(saved)
    assert np.concatenate([begin, run.advance(rows[150:])]).tobytes() == first.tobytes()
    assert not np.array_equal(other[1:, :2], first[1:, :2]) and not np.array_equal(
        other[2:, AT["speed"]], first[2:, AT["speed"]]
    )


def test_a_drive_wanders_about_its_speed_with_the_standard_deviation_and_the_correlation_of_the_file(rotor, held):
    """Matern's (1 + t/T) exp(-t/T) at T and 3 T; 20 s of T = 20 ms give the sd within 3 % and correlations within .04.

    The acceleration has the rms sd Omega / T, the shaft angle is the integral of the speed, and the encoder sees both.
    """
    omega, T = 50 * HZ, 0.02
    values = {"speed_wander.sd": 0.01, "speed_wander.time": "20 ms", "encoder.counts": 2000}
    plant = rotor({f"effects.{name}": value for name, value in values.items()})
    run = plant.start(omega)
    run.advance(held(2000, omega, 0.0))
    table = run.advance(held(100_000, omega, 0.0))
    speed, angle = table[:, AT["speed"]], table[:, AT["angle"]]
    xi = speed / omega - 1
    assert xi.std() == pytest.approx(0.01, rel=0.1) and abs(xi.mean()) < 2e-3
    for times in (1, 3):
        lag = round(times * T / SAMPLE)
        assert (xi[lag:] * xi[:-lag]).mean() / xi.var() == pytest.approx((1 + times) * math.exp(-times), abs=0.12)
    assert (np.diff(speed) / SAMPLE).std() == pytest.approx(0.01 * omega / T, rel=0.06)
    assert np.diff(angle) == pytest.approx(0.5 * SAMPLE * (speed[1:] + speed[:-1]), abs=1e-9)
    read = table[:, AT["angle_measured"]]
    assert (angle - read).min() >= 0 and (angle - read).max() <= HZ / 2000
    window = 50
    mean = (read[window:] - read[:-window]) / (window * SAMPLE)
    assert table[window:, AT["speed_measured"]] == pytest.approx(mean, rel=1e-12)


def test_a_ramp_wanders_about_its_speed_and_a_shaft_that_coasts_does_not(rotor, held):
    values = {"effects.speed_wander.sd": 0.02, "effects.speed_wander.time": "20 ms", "drive.dry_drag": "0 N*m"}
    plant, still = rotor(values), rotor({"drive.dry_drag": "0 N*m"})
    rows = held(3000, 50 * HZ, 0.0)
    rows[:2000, 0] = np.linspace(50, 100, 2000) * HZ
    rows[2000:, 0] = np.nan
    moved, straight = (one.start(50 * HZ, seed=2).advance(rows)[:, AT["speed"]] for one in (plant, still))
    assert moved[0] == straight[0]
    deviation = moved[1:2000] / straight[1:2000] - 1
    assert 0.01 < deviation.std() < 0.03
    assert np.ptp(moved[2001:]) == pytest.approx(0, abs=1e-6 * HZ)


def test_a_run_begins_off_its_speed_by_the_same_standard_deviation_and_goes_on_without_a_step():
    """2000 seeds: xi and its filter at the first sample have variance 1, covariance (1 + r^2)^(-1/2), within 3 sd."""
    p = SimpleNamespace(sd=0.01, time=1.0, interval=SAMPLE)
    w, first, after = np.zeros((2000, 2)), [], []
    for seed in range(len(w)):
        first.append(speed_wander.py_func(w[seed], 0, float(seed), 0.0, 1.0, p) - 1)
        after.append(speed_wander.py_func(w[seed].copy(), 0, float(seed), 1.0, 1.0, p) - 1)
    assert np.std(first) == pytest.approx(0.01, rel=0.05)
    assert np.cov(w.T) == pytest.approx(np.array([[1.0, 0.5**0.5], [0.5**0.5, 1.0]]), abs=0.1)
    assert np.abs(np.subtract(after, first)).max() < 4 * 0.01 * SAMPLE / 1.0


def test_neutral_the_drive_reaches_the_speed_that_is_set_to_the_last_bit():
    p = SimpleNamespace(sd=0.0, time=1.0, interval=SAMPLE)
    assert speed_wander.py_func(np.zeros(2), 0, 0.0, 0.0, 123.456, p) == 123.456


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ([{"density": "1 N^2/Hz", "corner": "3 kHz"}], "corner"),
        ([{"density": "1 N^2/Hz"}, {"density": "2 N^2/Hz", "position": "100 mm"}], "sequence"),
        ([{"density": "1 N"}], "density"),
        ([{"speed": "0 rpm"}], "speed"),
    ],
)
def test_a_force_that_the_samples_cannot_hold_or_that_is_another_table_again_is_refused(values, field):
    with pytest.raises(MachineFileError, match=field):
        load_machine("plain_rotor").replace("effects.broadband_force", values)


SIGNATURES = {
    "broadband_force": test_a_mode_under_the_force_has_the_variance_of_an_oscillator_under_coloured_noise,
    "speed_wander": test_a_drive_wanders_about_its_speed_with_the_standard_deviation_and_the_correlation_of_the_file,
}
