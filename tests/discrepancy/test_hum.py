"""Hum of the mains: a line at 50 or 60 Hz of every speed is no motion of a shaft and no vibration of the base."""

import numpy as np
import pytest

from identification import make_record
from rotorsim.discrepancy import runup_vectors
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


def run_up(hum, frequency, zeta, fs=2000.0, seconds=20.0, low=10.0, high=100.0):
    """Run-up through a resonance at 48 Hz, 1X of 2 um above it, 2X of 0.3 um, noise of 0.1 um; y has half the hum."""
    rng, t = np.random.default_rng(3), np.arange(int(seconds * fs)) / fs
    speed = 2 * np.pi * (low + (high - low) * t / seconds)
    angle, r = np.cumsum(speed) / fs, speed / (2 * np.pi * 48)
    one = 2e-6 * r**2 / (1 - r**2 + 2j * zeta * r) * np.exp(1j * angle)
    disc = (
        np.column_stack([one.real, one.imag]) + 0.3e-6 * np.cos(2 * angle)[:, None] + rng.normal(0, 1e-7, (t.size, 2))
    )
    tone = hum * np.cos(2 * np.pi * frequency * t + 1.0)
    return make_record(t, {"disc_measured": disc + tone[:, None] * [1.0, 0.5], "angle": angle}, {"record": "up"})


@pytest.mark.parametrize("zeta", [0.02, 0.003])
@pytest.mark.parametrize("frequency", [50.0, 49.93, 60.02, 100.0])
def test_hum_of_a_run_up_goes_and_its_orders_stay(frequency, zeta):
    """1X and 2X pass the tone at a sharp resonance: the vectors are those without hum.

    The tone's standard deviation is s sqrt(2 / n) = 0.7 nm; s is 0.1 um.
    """
    whole, plain = (runup_vectors(run_up(hum, frequency, zeta)) for hum in (1e-6, 0.0))
    vectors = [one["amplitude"].values * np.exp(-1j * one["phase"].values) for one in (whole, plain)]
    assert np.abs(vectors[0] - vectors[1]).max() < 6 * 0.7e-9
    assert "notes" not in plain.attrs
    (note,) = whole.attrs["notes"]
    assert float(note.partition(" at ")[2].partition(" Hz")[0]) == pytest.approx(frequency, abs=0.001)
    assert "1 um in x, 0.5 um in y" in note


def test_a_line_that_is_not_of_the_mains_or_not_coherent_stays_in_a_run_up(rng):
    """A tone at 54 Hz, and one at 50 Hz whose phase wanders by a radian in each tenth of a second."""
    record = run_up(0.0, 50.0, 0.02)
    wander = np.cumsum(rng.normal(0, 1, 200)).repeat(200)
    tone = 3e-7 * np.cos(2 * np.pi * 50 * record["time"].values + wander[: record.sizes["time"]])
    record["disc_measured"] = record["disc_measured"] + tone[:, None]
    for one in (run_up(1e-6, 54.0, 0.02), record):
        assert "notes" not in runup_vectors(one).attrs


@pytest.mark.parametrize("turning", [1.0, 0.3])
@pytest.mark.parametrize(("begin", "end"), [(11.0, 20.0), (0.0, 10.0), (0.0, 20.0)])
def test_a_whirl_near_the_mains_frequency_is_no_hum(turning, begin, end):
    """One that sets in or ends is none whatever its orbit; one from end to end only where its orbit is round."""
    record = run_up(0.0, 50.0, 0.02)
    t = record["time"].values
    there, phase = (t >= begin) & (t < end), 2 * np.pi * 50.2 * t
    record["disc_measured"] = record["disc_measured"] + 5e-6 * there[:, None] * np.column_stack(
        [np.cos(phase), turning * np.sin(phase)]
    )
    assert ("notes" in runup_vectors(record).attrs) == (turning < 1 and end - begin == 20)
