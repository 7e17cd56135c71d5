"""Computations behind the figures against closed forms: responses, gains, loops, decays, spectra, runout."""

import tracemalloc

import numpy as np
import pytest
import xarray as xr
from scipy.signal import lfilter

from identification import make_record
from rotorsim.signals.impact import decay_of, find_pulses, impact_transfer, mode_pair, ring_downs, steady_motion
from rotorsim.signals.orders import deceleration_of
from rotorsim.signals.record_blocks import MissingError, blocks, eventful_stretch, prepared, runout_of
from rotorsim.signals.spectra import difference_of, spectrum_of, welch_transfer
from rotorsim.signals.static_gain import branch_distance, directions, find_holds, loops, rest, static_gain

FS = 1000.0


def record_of(**values: np.ndarray) -> xr.Dataset:
    """Prepared record sampled at 1 kHz."""
    n = len(next(iter(values.values())))
    return prepared(make_record(np.arange(n) / FS, values))


def first_order(u: np.ndarray, gain: float, pole: float) -> np.ndarray:
    return np.asarray(lfilter([gain * (1 - pole)], [1, -pole], u))


def response(f: np.ndarray, gain: float, pole: float) -> np.ndarray:
    return gain * (1 - pole) / (1 - pole * np.exp(-2j * np.pi * f / FS))


GAINS = np.array([[3e-6, 0.4e-6], [-0.2e-6, 2e-6]])
POLES = np.array([[0.7, 0.5], [0.6, 0.8]])


def two_by_two(u: np.ndarray) -> np.ndarray:
    return np.column_stack([sum(first_order(u[:, j], GAINS[i, j], POLES[i, j]) for j in (0, 1)) for i in (0, 1)])


def test_a_known_two_by_two_system_is_found_with_its_noise_in_the_coherence() -> None:
    """Bias of the segments' ends and scatter of 100 averages stay below 3 %."""
    rng = np.random.default_rng(1)
    u = rng.choice([-1.0, 1.0], (100_000, 2))
    y = two_by_two(u)
    y[:, 1] += np.sqrt(2) * np.std(y[:, 1]) * rng.standard_normal(len(y))
    found = welch_transfer(record_of(reference=u, disc=y), (0, 1), "reference", "disc", 200.0)
    f = found.frequency
    for i, j in ((0, 0), (0, 1)):
        truth = response(f, GAINS[i, j], POLES[i, j])
        assert np.abs(found.H[:, i, j] - truth).max() < 0.03 * np.abs(GAINS[0, 0])
    assert found.coherence is not None
    assert found.coherence[:, 0].min() > 0.98
    size = sum(np.abs(response(f, GAINS[1, j], POLES[1, j])) ** 2 for j in (0, 1))
    expected = size / (size + 2 * np.var(two_by_two(u)[:, 1]))
    assert np.abs(found.coherence[:, 1] - expected).mean() < 0.06
    assert not found.together


def test_inputs_at_interleaved_lines_are_separated_and_only_lines_are_kept() -> None:
    t = np.arange(20_000) / FS
    phases = np.random.default_rng(2).uniform(0, 6.3, (2, 20))
    lines = [np.arange(10, 210, 10.0), np.arange(14, 214, 10.0)]
    waves = [np.cos(2 * np.pi * np.outer(t, lines[k]) + phases[k]) for k in (0, 1)]
    u = np.column_stack([w.sum(axis=1) for w in waves])
    found = welch_transfer(record_of(reference=u, disc=two_by_two(u)), (0, 1), "reference", "disc", 300.0)
    for j in (0, 1):
        seen = np.isfinite(found.H[:, 0, j])
        np.testing.assert_allclose(found.frequency[seen], lines[j])
        truth = response(lines[j], GAINS[1, j], POLES[1, j])
        assert np.abs(found.H[seen, 1, j] - truth).max() < 0.01 * np.abs(GAINS[1, j])


def test_inputs_that_move_together_are_reported() -> None:
    u = np.repeat(np.random.default_rng(3).standard_normal((20_000, 1)), 2, axis=1)
    found = welch_transfer(record_of(reference=u, disc=two_by_two(u)), (0, 1), "reference", "disc", 200.0)
    assert found.together and found.inputs == (0,)


def test_a_short_record_gives_no_frequency_response() -> None:
    u = np.random.default_rng(3).standard_normal((300, 2))
    with pytest.raises(MissingError, match="too short"):
        welch_transfer(record_of(reference=u, disc=two_by_two(u)), (0, 1), "reference", "disc", 200.0)


LEVELS = np.concatenate([np.arange(0, 5), np.arange(3, -5, -1), np.arange(-3, 5)]) * 0.5


def staircase(loop: float = 0.0, speed: float = 0.0) -> xr.Dataset:
    """Steps of 0.2 s along x, then along y; the disc lags by `loop` [V] on its way, pins 1 and 2 follow y and x."""
    own = np.repeat(LEVELS, 200)
    lag = np.repeat(loop * np.where(directions(LEVELS), -1.0, 1.0), 200)
    none = np.zeros_like(own)
    r = np.vstack((np.column_stack((own, none)), np.column_stack((none, own))))
    seen = r + np.vstack((np.column_stack((lag, none)), np.column_stack((none, lag))))
    angle = speed * np.arange(len(r)) / FS
    disc = 1e-5 + seen @ np.array([[3e-6, -0.2e-6], [0.4e-6, 2e-6]])
    if speed:
        disc = disc + 1e-6 * np.column_stack((np.cos(angle), np.sin(angle)))
    return record_of(reference=r, disc=disc, pin=2e-5 + 4e-6 * seen[:, ::-1], angle=angle)


def test_a_known_gain_with_a_loop_is_found() -> None:
    holds = rest(staircase(loop=0.1), "disc")
    for g, truth in zip(static_gain(holds), ([3e-6, -0.2e-6], [0.4e-6, 2e-6]), strict=True):
        np.testing.assert_allclose(g.gain, truth, rtol=0.05)  # the loop turns the line a little
        assert g.opening[g.axis] == pytest.approx(0.2 * truth[g.axis])
        assert not g.other_moves
    straight = static_gain(rest(staircase(), "disc"))
    np.testing.assert_allclose(straight[0].gain, [3e-6, -0.2e-6], rtol=1e-9)
    assert np.abs(straight[0].deviation).max() < 1e-15


def test_rests_of_a_turning_shaft_are_means_over_whole_revolutions() -> None:
    gains = static_gain(rest(staircase(speed=2 * np.pi * 25), "disc"))
    np.testing.assert_allclose(gains[0].gain, [3e-6, -0.2e-6], rtol=1e-9)


def test_pins_are_shown_over_the_reference_that_moves_them() -> None:
    holds = rest(staircase(loop=0.1), "disc")
    first, second = loops(holds, static_gain(holds))
    assert (first.injector, first.axis, second.injector, second.axis) == (1, 1, 2, 0)
    assert first.opening == pytest.approx(0.8e-6) and first.travel == pytest.approx(16e-6, rel=0.1)


def test_holds_do_not_depend_on_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    record = staircase()
    whole = find_holds(record, 100)
    monkeypatch.setattr("rotorsim.signals.static_gain.blocks", lambda r, n: _small_blocks(r, n, 137))
    for a, b in zip(whole, find_holds(record, 100), strict=True):
        np.testing.assert_array_equal(a, b)
    assert len(whole[0]) == 2 * len(LEVELS)  # the rests at 0 V of both parts stay apart


LONG = 3_000_000


def long_rests(levels: list[int]) -> xr.Dataset:
    """A record of 3000 s, small in memory: one value of the disc, references as bytes."""
    column = np.repeat(np.array(levels, np.int8), LONG // len(levels))
    disc = np.broadcast_to(np.float16(0.5), (LONG, 2))
    dims = ("time", "axis")
    values = {"reference": (dims, np.stack([column] * 2, axis=1)), "disc": (dims, disc)}
    return xr.Dataset(values, {"time": np.arange(LONG) / FS})


def test_rests_of_a_long_record_are_read_in_blocks_of_bounded_memory() -> None:
    """A block of 100 000 samples is 1.6 MB, of which changes of the reference take six; half a rest would be 8 MB."""
    record = long_rests([0, 1, 2])
    tracemalloc.start()
    try:
        holds = rest(record, "disc")
        assert tracemalloc.get_traced_memory()[1] < 12e6
    finally:
        tracemalloc.stop()
    assert holds.reference[:, 0].tolist() == [0, 1, 2] and np.all(holds.disc == 0.5)


def test_displacements_are_not_read_without_three_levels(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[tuple[str, ...]] = []
    monkeypatch.setattr("rotorsim.signals.static_gain.blocks", lambda r, n: read.append(tuple(n)) or blocks(r, n))
    with pytest.raises(MissingError, match=r"2 levels for 0\.1 s.* 3"):
        rest(long_rests([0, 1]), "disc")
    assert read == [("reference",)]


def _small_blocks(record: xr.Dataset, names: tuple[str, ...], size: int) -> list[dict[str, np.ndarray]]:
    starts = range(0, record.sizes["time"], size)
    return [{k: record[k].values[i : i + size] for k in names} for i in starts]


def test_branches_without_a_way_back_have_no_distance() -> None:
    r = np.arange(4.0)
    assert np.isnan(branch_distance(r, r[:, None])).all()


@pytest.mark.parametrize(("frequency", "zeta"), [(60.0, 0.02), (35.0, 0.1)])
def test_a_ring_down_gives_its_decrement_and_frequency(frequency: float, zeta: float) -> None:
    """The smoothing filter and extremes between samples leave 2 %."""
    t, omega = np.arange(0, 2, 1 / 5000), 2 * np.pi * frequency
    noise = 1e-9 * np.random.default_rng(1).standard_normal(t.size)
    decay = decay_of(t, 1e-5 * np.exp(-zeta * omega / np.sqrt(1 - zeta**2) * t) * np.cos(omega * t - 1) + noise)
    assert decay.frequency == pytest.approx(frequency, rel=5e-3)
    assert decay.zeta == pytest.approx(zeta, rel=0.02)
    assert decay.decrement == pytest.approx(2 * np.pi * zeta / np.sqrt(1 - zeta**2), rel=0.02)


@pytest.mark.parametrize(
    ("frequency", "zeta"),
    [((97.8, 107.9), (0.365, 0.305)), ((118.0, 124.0), (0.06, 0.037)), ((40.0, 90.0), (0.7, 0.1))],
)
def test_two_modes_of_a_decay_are_told_apart_however_damped(
    frequency: tuple[float, float], zeta: tuple[float, float]
) -> None:
    """Closed form with noise of .1 % of the start: 8000 numbers for 8 unknowns of a decay that lasts 50 samples."""
    t, wn, z = np.arange(0, 0.8, 1 / 5000), 2 * np.pi * np.array(frequency), np.array(zeta)
    s = wn * (-z + 1j * np.sqrt(1 - z**2))
    shares = np.array([[1.0, 0.4 - 0.2j], [0.3j, 0.9 + 0.1j]])
    motion = 1e-5 * np.real(np.exp(np.outer(t, s)) @ shares)
    noise = 1e-8 * np.random.default_rng(3).standard_normal(motion.shape)
    clean, noisy = mode_pair(t, motion), mode_pair(t, motion + noise)
    assert clean.frequency == pytest.approx(frequency, rel=1e-6) and clean.zeta == pytest.approx(zeta, rel=1e-5)
    assert noisy.frequency == pytest.approx(frequency, rel=0.02) and noisy.zeta == pytest.approx(zeta, rel=0.05)
    assert clean.explained > 1 - 1e-9 and noisy.explained > 0.98


@pytest.mark.parametrize("seed", range(3))
def test_a_mode_of_the_noise_is_none(seed: int) -> None:
    """Noise of a probe, .33 um, at 10 um: one mode is one, and two near ones are read to some percent."""
    t, rng = np.arange(0, 0.8, 1 / 5000), np.random.default_rng(seed)
    wn, z = 2 * np.pi * np.array([118.0, 124.0]), np.array([0.06, 0.037])
    waves = np.exp(np.outer(t, wn * (-z + 1j * np.sqrt(1 - z**2))))
    one = 1e-5 * np.real(waves[:, :1] @ np.array([[1.0, 0.3j]])) + 3.3e-7 * rng.standard_normal((len(t), 2))
    both = 1e-5 * np.real(waves @ np.array([[1.0, 0.4 - 0.2j], [0.3j, 0.9 + 0.1j]]))
    found, pair = mode_pair(t, one), mode_pair(t, both + 3.3e-7 * rng.standard_normal(both.shape))
    assert found.clear.sum() == 1
    assert float(found.frequency[found.clear][0]) == pytest.approx(118, rel=0.01)
    assert pair.clear.all() and pair.frequency == pytest.approx([118, 124], rel=0.01)
    assert pair.zeta == pytest.approx(z, rel=0.12)


def test_a_disc_at_rest_has_no_modes() -> None:
    with pytest.raises(MissingError):
        mode_pair(np.arange(100) / 5000, np.zeros((100, 2)))


def hit(noise: float = 0.0, speed: float = 0.0) -> xr.Dataset:
    """Two hits along x and two along y on a mass-spring-damper of 50 Hz, zeta 0.05, 1 um/N, along each axis."""
    n = 8000
    force = np.zeros((n, 2))
    for k in range(4):
        force[2000 * k + 600 : 2000 * k + 604, k // 2] = 10 + k
    t = np.arange(n) / FS
    wn = 2 * np.pi * 50
    h = 1e-6 * wn * np.exp(-0.05 * wn * t) * np.sin(wn * np.sqrt(1 - 0.05**2) * t) / np.sqrt(1 - 0.05**2) / FS
    disc = np.column_stack([np.convolve(force[:, k], h)[:n] for k in (0, 1)])
    angle = speed * t
    disc = disc + 5e-6 * np.column_stack((np.cos(angle), np.sin(2 * angle))) * bool(speed)
    disc = disc + noise * np.random.default_rng(4).standard_normal(disc.shape)
    return record_of(disc_force=force, disc=disc, angle=angle)


def test_hits_give_ring_downs_and_the_response_of_the_oscillator() -> None:
    record = hit(noise=1e-10, speed=2 * np.pi * 21)
    downs = ring_downs(record, "disc")
    assert [d.pulse.peak for d in downs] == [11, 13]
    for down in downs:
        assert down.decay is not None
        assert down.decay.zeta == pytest.approx(0.05, rel=0.03)
        assert down.decay.frequency == pytest.approx(50 * np.sqrt(1 - 0.05**2), rel=0.01)
    found = impact_transfer(record, "disc", 120.0)
    s = found.frequency / 50
    truth = 1e-6 / (1 - s**2 + 0.1j * s)
    assert np.abs(found.H[:, 0, 0] - truth).max() < 0.03 * np.abs(truth).max()
    assert np.abs(found.H[:, 1, 0]).max() < 0.01 * np.abs(truth).max()


def test_a_lasting_force_is_no_impact() -> None:
    force = np.zeros((3000, 2))
    with pytest.raises(MissingError, match="No force"):
        find_pulses(record_of(disc_force=force, disc=force))
    force[1000:, 0] = 5
    with pytest.raises(MissingError, match="pulses shorter"):
        find_pulses(record_of(disc_force=force, disc=force))


def test_motion_before_an_impact_is_continued_over_it() -> None:
    angle = 2 * np.pi * 20 * np.arange(2000) / FS
    d = np.column_stack((1 + np.cos(angle), np.sin(3 * angle)))
    np.testing.assert_allclose(steady_motion(angle, d, 400), d, atol=1e-9)


def test_an_ellipse_shows_its_forward_and_backward_parts() -> None:
    t = np.arange(20_000) / FS
    turn = 2 * np.pi * 30 * t
    d = 1e-6 * np.column_stack((3 * np.cos(turn), np.sin(turn))) + 1e-5
    s = spectrum_of(record_of(disc=d), "disc", 100.0)
    at = int(np.abs(s.frequency - 30).argmin())
    np.testing.assert_allclose(s.single[at], [3e-6, 1e-6], rtol=1e-6)
    assert s.full[np.abs(s.signed - 30).argmin()] == pytest.approx(2e-6)
    assert s.full[np.abs(s.signed + 30).argmin()] == pytest.approx(1e-6)


def test_a_runout_of_known_harmonics_is_found() -> None:
    """Bins of 2 degrees average the 5th harmonic to sin(5 deg) / 5 deg = 0.9987 of itself."""
    t = np.arange(30_000) / FS
    angle = 2 * np.pi * 0.37 * t
    x = 2e-6 * np.cos(angle - 1) + 0.5e-6 * np.cos(5 * angle)
    d = 3e-5 + np.column_stack((x, 1e-6 * np.sin(2 * angle)))
    d = d + 1e-8 * np.random.default_rng(5).standard_normal(d.shape)
    found = runout_of(record_of(disc=d, angle=angle), "disc", 11.1)
    np.testing.assert_allclose(np.abs(found.harmonic[[0, 4], 0]), [2e-6, 0.5e-6], rtol=0.01)
    assert -np.angle(found.harmonic[0, 0]) == pytest.approx(1, abs=0.01)
    assert abs(found.harmonic[1, 1]) == pytest.approx(1e-6, rel=0.01)
    assert np.abs(found.harmonic[2, 0]) < 1e-8
    with pytest.raises(MissingError, match="whole one"):
        runout_of(record_of(disc=d, angle=angle), "disc", 0.5)


def test_sensor_errors_are_measured_with_offset_and_line() -> None:
    t = np.arange(20_000) / FS
    error = np.column_stack((1e-6 * np.sin(2 * np.pi * 40 * t) + 4e-6, np.zeros(t.size)))
    truth = 1e-5 * np.random.default_rng(6).standard_normal((t.size, 2))
    found = difference_of(record_of(disc=truth, disc_measured=truth + error), 100.0)
    np.testing.assert_allclose(found.offset, [4e-6, 0], atol=1e-12)
    np.testing.assert_allclose(found.rms, [1e-6 / np.sqrt(2), 0], rtol=1e-6, atol=1e-12)
    assert found.peak_to_peak[0] == pytest.approx(2e-6, rel=0.02)
    at = np.abs(found.spectrum.frequency - 40).argmin()
    assert found.spectrum.single[at, 0] == pytest.approx(1e-6, rel=1e-3)


def test_an_exponential_coast_down_has_a_proportional_deceleration() -> None:
    t = np.arange(20_000) / FS
    speed = 600 * np.exp(-t / 5)
    found = deceleration_of(record_of(disc=np.zeros((t.size, 2)), speed=speed))
    np.testing.assert_allclose(found.rate[1:-1], found.speed[1:-1] / 5, rtol=1e-3)


def test_a_speed_is_taken_from_the_angle_where_it_is_read() -> None:
    t = np.arange(5000) / FS
    record = record_of(disc=np.zeros((t.size, 2)), angle_measured=3 * t**2)
    np.testing.assert_allclose(record["speed"].isel(time=slice(100, 200)).values, 6 * t[100:200], rtol=1e-9)
    assert float(record["speed"].isel(time=2500).values) == pytest.approx(15)
    np.testing.assert_allclose(record["speed"].values[20:-20], 6 * t[20:-20], rtol=1e-9)


def test_the_stretch_lies_about_the_largest_change() -> None:
    force = np.zeros((5000, 2))
    force[3000:3004, 1] = 7
    chosen = eventful_stretch(record_of(disc_force=force, disc=force), ["disc_force"], 0.0)
    assert chosen.start < 3000 < chosen.stop and chosen.stop - chosen.start == 250
