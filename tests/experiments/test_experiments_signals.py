"""Excitation signals: levels, balance, spectral lines, sweep frequencies, impulses; no plant is run."""

from dataclasses import replace

import numpy as np
import pytest

import identification as idn
from rotorsim import experiments as ex
from rotorsim.experiments.catalogue.slow_roll import SlowRoll

SAMPLE = 2e-4
KINDS = [
    ex.Runup(0.0, 100.0, 40.0),
    ex.Coastdown(100.0, 10.0, 30.0),
    ex.Coastdown(100.0, longest=3.0),
    ex.Steady(duration=3.0),
    ex.SlowRoll(revolutions=2),
    ex.Staircase(axis="both", hold=0.05),
    ex.Prbs(duration=5.0),
    ex.Chirp(duration=1.0, axis="both"),
    ex.Multisine(period=0.5, periods=5, bias=0.1),
    ex.Multisine(period=0.5, periods=5, bias=0.1, axis="y", mean_x=2.0, mean_y=-1.0),
    ex.Impact(hits=7, spacing=0.3, jitter=0.01, scatter=0.2),
    ex.Shock(width=3.3e-3, lead=0.1, rest=1.0),
    ex.Shock(history=[[0.0, 0.0, 0.0], [1.1e-3, 5.0, -2.0], [0.9, 1.0, 0.0]], rest=0.0),
    ex.Controlled(
        duration=3.0, bias_x=0.3, controller=ex.ProportionalLaw(), excitations=(ex.Prbs(duration=1.0), ex.Impact())
    ),
]


def all_rows(experiment, sequence=None):
    chosen = experiment if sequence is None else replace(experiment, sequence=sequence)
    return chosen.rows(0, chosen.samples)


@pytest.mark.parametrize("experiment", KINDS, ids=lambda e: e.name)
def test_any_stretch_of_rows_is_the_same_bits_as_a_part_of_all(experiment):
    whole = all_rows(experiment)
    assert whole.shape == (experiment.samples, 6)
    for first, count in [(0, 1), (17, 1000), (experiment.samples - 5, 5), (2001, 333)]:
        assert np.array_equal(experiment.rows(first, count), whole[first : first + count], equal_nan=True)


def test_every_experiment_is_tried_here():
    assert {type(e) for e in KINDS} == set(ex.EXPERIMENTS.values())


def test_binary_references_are_two_valued_balanced_and_independent_of_each_other():
    """Groups of 256 bits are balanced exactly; 2000 independent bits correlate by less than 3 / sqrt(2000) = .067."""
    x, y = all_rows(ex.Prbs(amplitude=0.7, duration=10.4), 5)[2000:, 2:4].T
    assert set(x) == set(y) == {-0.7, 0.7}
    assert abs(x.mean()) < 0.02 and abs(y.mean()) < 0.02
    assert abs(np.mean(x * y)) / 0.49 < 0.067


def test_binary_references_rest_for_the_bias_time_and_jump_at_ticks_only():
    prbs = ex.Prbs(duration=4.0, bias=0.4, hold=1.2e-3)
    reference = all_rows(prbs)[:, 2:4]
    assert not reference[:2000].any() and reference[2000:].all()
    jumps = np.flatnonzero(np.diff(reference, axis=0).any(axis=1)) + 1
    assert np.all((jumps - 2000) % 6 == 0) and np.diff(jumps).min() == 6


def test_the_sequence_and_nothing_else_decides_what_is_drawn():
    for experiment in (ex.Prbs(), ex.Multisine(), ex.Impact(hits=3, jitter=0.1, scatter=0.5)):
        a, b, other = all_rows(experiment, 1), all_rows(experiment, 1), all_rows(experiment, 2)
        assert np.array_equal(a, b) and not np.array_equal(a, other)


def test_multisine_lines_are_disjoint_and_exact_on_the_grid_of_the_transform():
    """Spectra of whole periods hold the lines alone: elsewhere at most 1e-12 of them; the two meet nowhere."""
    sines = ex.Multisine(low=3.0, high=300.0, period=0.5, periods=4, amplitude=1.5)
    reference = all_rows(sines)[:, 2:4]
    lines = sines.lines()
    assert not set(lines[0]) & set(lines[1])
    assert lines[0][0] == 2 and lines[1][-1] == 149 and lines[0][-1] == 150
    for axis in range(2):
        spectrum = np.abs(np.fft.rfft(reference[:, axis]))
        at = 4 * lines[axis]
        assert spectrum[at] == pytest.approx(spectrum[at].mean(), rel=1e-9)
        assert np.delete(spectrum, at).max() < 1e-11 * spectrum[at].mean()
        assert np.abs(reference[:, axis]).max() == pytest.approx(1.5)


def interleaved(sines):
    """References of both axes without a mean: phases drawn by axis, the flattest of the draws, whole periods."""
    n, columns = round(sines.period / SAMPLE), []
    lines = np.arange(round(sines.low * sines.period), round(sines.high * sines.period) + 1)
    for axis in range(2):
        rng, best = np.random.default_rng([sines.sequence, 2, axis]), np.full(n, np.inf)
        for _ in range(sines.tries):
            spectrum = np.zeros(n // 2 + 1, complex)
            spectrum[lines[axis::2]] = np.exp(1j * rng.uniform(0, 2 * np.pi, len(lines[axis::2])))
            drawn = np.fft.irfft(spectrum, n)
            best = drawn if np.abs(drawn).max() < np.abs(best).max() else best
        columns.append(best * (sines.amplitude / np.abs(best).max()))
    rest = np.zeros((round(sines.bias / SAMPLE), 2))
    return np.concatenate([rest, *[np.column_stack(columns)] * sines.periods])


@pytest.mark.parametrize("sequence", range(3))
def test_a_multisine_of_both_axes_without_a_mean_is_its_formula_to_the_last_bit(sequence):
    sines = ex.Multisine(low=2.0, high=150.0, period=0.5, periods=3, amplitude=1.5, bias=0.02, sequence=sequence)
    assert all_rows(sines)[:, 2:4].tobytes() == interleaved(sines).tobytes()


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_multisine_of_one_axis_has_all_lines_there_and_leaves_the_other_at_its_mean(axis):
    sines = ex.Multisine(
        low=4.0, high=100.0, period=0.5, periods=2, amplitude=3.5, bias=0.1, axis=axis, mean_x=1.5, mean_y=-1.5
    )
    driven, other = (2, 3) if axis == "x" else (3, 2)
    rows, mean = all_rows(sines), {2: 1.5, 3: -1.5}
    assert np.all(rows[:, other] == mean[other]) and np.all(rows[:500, driven] == mean[driven])
    assert np.abs(rows[:, driven]).max() <= 5.0
    spectrum = np.abs(np.fft.rfft(rows[500:, driven] - mean[driven]))
    assert set(np.flatnonzero(spectrum > 0.5 * spectrum.max())) == set(range(4, 101, 2))


def test_more_draws_of_phases_give_a_lower_crest_factor():
    """The largest value being the same, the rms rises; by more than 5 % in the mean of 10 sequences."""
    one, many = (
        np.mean([all_rows(ex.Multisine(tries=tries, periods=1), n)[:, 2].std() for n in range(10)]) for tries in (1, 50)
    )
    assert many > 1.05 * one


@pytest.mark.parametrize("law", ["linear", "logarithmic"])
def test_the_frequency_of_a_chirp_is_the_derivative_of_its_phase(law):
    chirp = ex.Chirp(low=20.0, high=400.0, duration=4.0, law=law)
    t = np.linspace(0, 4, 4001)
    frequency = np.gradient(chirp.phase(t), t) / (2 * np.pi)
    share = t / 4
    result = 20 + 380 * share if law == "linear" else 20 * 20**share
    assert frequency[1:-1] == pytest.approx(result[1:-1], rel=1e-5)


def test_a_chirp_on_both_axes_sweeps_x_and_then_y():
    chirp = ex.Chirp(duration=1.0, axis="both", bias=0.2)
    reference = all_rows(chirp)[:, 2:4]
    assert np.array_equal(reference[1000:6000, 0], reference[6000:, 1])
    assert not reference[:6000, 1].any() and not reference[6000:, 0].any() and not reference[:1000].any()


@pytest.mark.parametrize("width", [2e-4, 1e-3, 1.37e-3])
def test_the_impulse_of_a_hit_is_2_A_T_over_pi_whatever_its_width(width):
    hit = ex.Impact(peak=30.0, width=width, angle=np.pi / 2, jitter=3.3e-4)
    force = all_rows(hit)[:, 4:6]
    assert force[:, 1].sum() * SAMPLE == pytest.approx(2 * 30.0 * width / np.pi, rel=1e-12)
    assert not force[:, 0].any() and force[:, 1].max() <= 30.0


def test_hits_come_at_their_times_late_by_the_jitter_at_most():
    force = all_rows(ex.Impact(hits=20, spacing=0.5, lead=0.2, jitter=0.05))[:, 4]
    begins = np.flatnonzero((force[1:] > 0) & (force[:-1] == 0)) + 1
    late = begins * SAMPLE - (0.2 + 0.5 * np.arange(20))
    assert len(begins) == 20 and late.min() > -2 * SAMPLE and late.max() < 0.05 + SAMPLE and late.std() > 0.005


def test_a_staircase_goes_up_down_and_home_and_drives_one_axis_at_a_time():
    levels = ex.Staircase(axis="both", amplitude=2.0, step=0.5).levels()
    assert levels[:17, 0].tolist() == [*np.arange(0, 2.1, 0.5), *np.arange(1.5, -2.1, -0.5), *np.arange(-1.5, 0.1, 0.5)]
    assert np.array_equal(levels[:17, 0], levels[17:, 1]) and not (levels[:, 0] * levels[:, 1]).any()


def test_a_slow_roll_ends_with_the_sample_that_completes_its_revolutions():
    assert ex.SlowRoll(speed=2 * np.pi, revolutions=3).samples == 15000
    odd = ex.SlowRoll(speed=10.0, revolutions=2)
    assert (odd.samples - 1) * SAMPLE * 10 < 4 * np.pi <= odd.samples * SAMPLE * 10


def test_an_excitation_that_is_over_leaves_bias_alone():
    rows = all_rows(KINDS[-1])
    assert np.all(rows[5500:, 2] == 0.3) and not rows[5500:, 3:].any()
    assert rows[:5500, 4].max() > 15 and np.ptp(rows[:5000, 2]) == pytest.approx(2.0)


@pytest.mark.parametrize(("speed", "slow"), [(10.0, True), (300.0, False)])
def test_a_slow_roll_lists_the_orders_of_the_runout_or_why_it_is_none(speed, slow):
    angle = speed * np.arange(round(4 * 2 * np.pi / speed * 5000) + 1) / 5000
    y = 1e-6 * np.stack([2 * np.cos(angle), np.sin(angle) + 0.5 * np.cos(2 * angle)], axis=1)
    record = idn.make_record(np.arange(angle.size) / 5000, {"disc_measured": y, "angle": angle})
    found = SlowRoll.findings(record)
    if slow:
        assert [row["order"] for row in found["runout_orders"]] == [1, 2]
        np.testing.assert_allclose(found["runout_orders"][0]["um"], [2.0, 1.0], rtol=1e-3)
        assert [name for name, _ in SlowRoll.table(found)][:2] == ["Runout: peak", "Runout: 1X"]
    else:
        assert "no_slow_roll" in found and SlowRoll.table(found)[0][0] == "No slow roll"
