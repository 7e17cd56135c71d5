"""Preparation of measured records: periods, spectral lines, line groups, refusals."""

import numpy as np
import pytest

from identification import from_arrays
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.comparison import tone, unsteady
from rotorsim.discrepancy.data_vector import make_layout, repeat_scatter, repeats
from rotorsim.discrepancy.records import limits, make_trial
from rotorsim.discrepancy.trial import block_lines, find_period
from rotorsim.experiments import Multisine

RATE = 5000
SINES = Multisine(2 * np.pi * 40, 0.5e6, 1.0, 2.5, 250.0, 0.8, 3, 4)


def record(displacement, speed=2 * np.pi * 40, rows=None, **more):
    n = len(displacement)
    rows = SINES.rows(0, n) if rows is None else rows
    time = np.arange(n) / RATE
    return from_arrays(time, rows[:, 2:4], displacement, angle=speed * time, speed=speed, pressure=0.5e6, **more)


def test_the_period_of_a_multisine_is_found_and_a_random_signal_has_none(rng):
    rows = SINES.rows(0, SINES.samples)
    assert find_period(rows[:, 2:4]) == 2000
    assert find_period(rng.normal(size=(12000, 2))) is None


def test_a_sine_is_one_line_of_its_amplitude():
    t = np.arange(12000) / RATE
    y = np.column_stack([2e-6 * np.cos(2 * np.pi * 40 * t), 3e-6 + 0 * t])
    lines = block_lines(y, 4000, 4000, 2, 100)
    assert np.abs(lines[:, 0, 32]) == pytest.approx(2e-6, rel=1e-9)
    assert lines[:, 1, 0].real == pytest.approx(3e-6, rel=1e-9)
    assert np.abs(np.delete(lines[:, 0], 32, axis=1)).max() < 1e-15


def test_orders_and_excited_lines_fall_into_different_groups():
    trial = make_trial(record(np.zeros((12000, 2))))
    assert (trial.start, trial.length, trial.blocks) == (4000, 2000, 4)
    layout = make_layout([trial])
    at = {name: set(layout.frequency[layout.numbers.get((0, 0, name), [])]) for name in layout.groups}
    assert at["1X"] == {40.0} and at["2X"] == {80.0} and at["3X"] == {120.0}
    assert at["orders"] == {160.0, 200.0, 240.0, 280.0}
    assert {2.5, 7.5, 242.5} <= at["low band"] | at["high band"]
    assert len(layout.frequency) == 2 * (2 + 2 * 120)


def test_the_scatter_of_white_noise_is_found_and_repeats_are_recognised(rng):
    sigma = 0.3e-6
    trials = [make_trial(record(rng.normal(0, sigma, (12000, 2)))) for _ in range(4)]
    assert repeats(trials[0], trials[1])
    scatter, _, _, known = repeat_scatter(trials, [t.spectra for t in trials])
    # a real part of a line of N samples, averaged over all 4 x 2000, has sigma sqrt(2 / 8000)
    assert known
    assert np.median(scatter[:, :, 1:]) == pytest.approx(sigma * np.sqrt(2 / 8000), rel=0.15)


def test_a_tone_between_the_lines_is_seen_where_the_mean_over_blocks_cancels_it(rng):
    def shaken(size):
        t = np.arange(12000) / RATE
        humming = size * np.column_stack([np.sin(2 * np.pi * 136.25 * t), 0 * t])  # 54.5 turns in a block
        return make_trial(record(rng.normal(0, 0.3e-6, (12000, 2)) + humming))

    trials = [shaken(0.0), shaken(0.4e-6), shaken(0.0)]
    spectra = [t.spectra for t in trials]
    scatter = repeat_scatter(trials, spectra)[0]
    line = np.searchsorted(trials[1].frequencies, 136.25)
    assert np.abs(spectra[1].mean(axis=0)[0, line - 1 : line + 1]).max() < 0.02e-6
    (flag,) = unsteady(trials, spectra, scatter)
    assert (flag.number, flag.channel, flag.group) == (1, "x", "unsteady")
    frequency, size = tone(trials[1], spectra[1])
    assert frequency == pytest.approx(136.25)
    assert np.abs(size[0]) == pytest.approx(0.4e-6, rel=0.1) and np.abs(size[1]) < 0.04e-6


def test_a_speed_that_wavers_about_an_order_is_not_called_unsteady(rng):
    t = np.arange(12000) / RATE
    wavering = 5e-6 * np.cos(2 * np.pi * 40 * t + 0.02 * np.sin(2 * np.pi * 0.7 * t))
    moved = [rng.normal(0, 0.3e-6, (12000, 2)) + wavering[:, None] for _ in range(3)]
    trials = [make_trial(record(y)) for y in moved]
    spectra = [trial.spectra for trial in trials]
    assert unsteady(trials, spectra, repeat_scatter(trials, spectra)[0]) == []


def test_a_run_up_is_refused_as_a_record_at_constant_speed():
    speed = np.linspace(100, 300, 12000)
    bad = from_arrays(np.arange(12000) / RATE, None, np.zeros((12000, 2)), speed=speed, pressure=0.0)
    with pytest.raises(DataError, match="a run-up with its angle"):
        make_trial(bad)


def test_a_closed_loop_without_its_dither_is_refused():
    bad = record(np.zeros((12000, 2))).assign_attrs(controller="p")
    with refused(DataError, "reference_external"):
        make_trial(bad)


def test_another_sampling_rate_is_refused():
    bad = record(np.zeros((12000, 2)))
    bad = bad.assign_coords(time=("time", bad.time.values * 2, bad.time.attrs))
    with pytest.raises(DataError, match="2500 Hz"):
        make_trial(bad)


def test_few_points_and_one_amplitude_are_noted():
    message = " ".join(limits([make_trial(record(np.zeros((12000, 2))))], True))
    for words in ("operating points: 1", "one speed only", "one excitation amplitude", "one pressure only"):
        assert words in message
