"""Hum of the mains: a line at 50 or 60 Hz of every speed is no motion of a shaft and no vibration of the base."""

import numpy as np
import pytest

from rotorsim.discrepancy.calibration import ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison, flagged, table, unsteady
from rotorsim.discrepancy.data_vector import without_hum
from rotorsim.discrepancy.trial import trial_of

SPEEDS, N = (23.0, 31.0, 37.0), 7000


def trials(rng, hum, mains, twin=None):
    found = []
    for i, hertz in enumerate(SPEEDS):
        rows, t = np.zeros((N, 6)), np.arange(N) * 2e-4
        rows[:, 0] = 2 * np.pi * hertz
        y = np.zeros((N, 2)) if twin is None else twin.run({}, rows, 0.0, turning=True)[:, :2]
        y = y + rng.normal(0, 1e-7, (N, 2)) + hum * np.cos(2 * np.pi * mains * t + i)[:, None]
        found.append(trial_of(rows, y, 0.0, f"r{i}"))
    return found


@pytest.mark.parametrize("mains", [50.0, 60.0])
def test_hum_is_found_by_its_frequency_and_size_and_taken_out(rng, mains):
    humming, rng = trials(rng, 1e-6, mains), np.random.default_rng(5)
    quiet, notes = without_hum(humming)
    assert len(notes) == 1 and f"{mains:g} Hz, 1 um" in notes[0]
    for one, plain in zip(quiet, trials(rng, 0.0, mains), strict=True):
        assert one.hum or np.abs(one.spectra - plain.spectra)[:, :, 1:].max() < 1e-8
    assert sum(bool(one.hum) for one in quiet) <= 1  # at 31 Hz 2X lies next to 60 Hz


def shaken(force, reference=1.0, n=10000):
    """Inputs (n, 6): a reference of 10 Hz on x [V], a force of 50 Hz on y [N]."""
    rows, t = np.zeros((n, 6)), np.arange(n) * 2e-4
    rows[:, 2], rows[:, 5] = reference * np.cos(2 * np.pi * 10 * t), force * np.cos(2 * np.pi * 50 * t)
    return rows


@pytest.mark.parametrize("force", [1e-4, 5.0, 1e6])
def test_the_response_to_a_stated_force_is_no_hum_next_to_a_reference(rng, force):
    """Volts and newtons do not compare: a small force excites its line as a large one does."""
    own = []
    for hertz in SPEEDS:
        rows = shaken(force)
        rows[:, 0] = 2 * np.pi * hertz
        response = 3e-6 * rows[:, [5, 5]] / force + 1e-6 * rows[:, [2, 2]]
        own.append(trial_of(rows, response + rng.normal(0, 1e-8, response.shape), 0.0, f"{hertz} Hz"))
        excited = own[-1].frequencies[own[-1].excited]
        assert excited == pytest.approx([10.0, 50.0])
    left, notes = without_hum(own)
    assert not notes and left == own


def test_a_constant_force_excites_no_line():
    rows = shaken(1.0)
    rows[:, 5] = 0.1
    trial = trial_of(rows, np.zeros((len(rows), 2)), 0.0, "held")
    assert trial.frequencies[trial.excited] == pytest.approx([10.0])


@pytest.mark.parametrize(("force", "reference"), [(1e-4, 1.0), (1.0, 1e-4)])
def test_a_mean_counts_against_the_largest_input_of_its_own_kind(force, reference):
    rows = shaken(force, reference)
    assert trial_of(rows, np.zeros((len(rows), 2)), 0.0, "both").balanced
    rows[:, 5 if force < 1 else 2] += 1e-4
    assert not trial_of(rows, np.zeros((len(rows), 2)), 0.0, "mean").balanced


def test_noise_and_a_line_of_one_record_are_no_hum(rng):
    quiet = trials(rng, 0.0, 50.0)
    for own in (quiet, [*quiet[:2], trials(rng, 1e-6, 50.0)[2]], trials(rng, 1e-6, 54.0)):
        left, notes = without_hum(own)
        assert not notes and left == own


def test_hum_that_an_order_hides_is_in_the_floor(rng):
    """At 3000 rpm 1X lies on 50 Hz; the size comes from the other records."""
    rows, t = np.zeros((N, 6)), np.arange(N) * 2e-4
    rows[:, 0] = 2 * np.pi * 50
    hidden = trial_of(rows, np.zeros((N, 2)) + np.cos(2 * np.pi * 50 * t)[:, None] * 1e-6, 0.0, "3000 rpm")
    left, _ = without_hum([*trials(rng, 1e-6, 50.0), hidden])
    assert left[-1].hum == ((50.0, pytest.approx(1e-6, rel=0.05)),) and not left[0].hum


def test_records_with_hum_are_within_the_floor(rng, models):
    """Nothing is flagged with 2 um at 50 Hz, neither as a line between orders nor as what does not repeat."""
    comparison = TwinComparison(models.twin, without_hum(trials(rng, 2e-6, 50.0, models.twin))[0])
    comparison.set_floor(ParameterPoint(), None, 0.004)
    assert not flagged(table(comparison, comparison.residual(ParameterPoint())))
    assert not unsteady(comparison.trials, comparison.apart(ParameterPoint()), comparison.scatter[0])
