"""A diagnosis of run-up vectors shows gap, speed of a flag, equivalent force, Bode plot."""

import numpy as np
import pytest

from identification import make_vectors
from rotorsim.discrepancy.calibration import ParameterPoint
from rotorsim.discrepancy.comparison import TwinComparison, flagged, table
from rotorsim.discrepancy.gap import equivalent_force, rms, spectra_of
from rotorsim.discrepancy.run_ups import make_sweeps
from rotorsim.discrepancy.twin import Twin
from rotorsim.machine import load_machine
from rotorsim.plant.linearise import linearise
from rotorsim.plant.simulation import settle
from rotorsim.report.diagnosis import bode

SPEEDS = 2 * np.pi * np.arange(8.0, 38.0, 1.0)


@pytest.fixture(scope="module")
def twin():
    return Twin(load_machine("plain_rotor"), only=())


def comparison(twin, vectors):
    """Comparison of the rows to fit of a table (rows, orders, 2) [m] of 1X and 2X, with a floor of 0.1 um."""
    given = make_vectors(SPEEDS, np.abs(vectors), -np.angle(vectors), (1, 2), {"rate": 60.0})
    out = TwinComparison(twin, make_sweeps(given, "t", False)[:1], 1)
    out.sigma = np.full(len(out.measured), 1e-7)
    return out


def test_the_gap_of_vectors_is_the_rms_of_a_signal_and_not_its_sum_over_the_rows(twin):
    """An amplitude of 34 sqrt(2) um at every speed is 34 um rms, of however many rows."""
    vectors = np.zeros((len(SPEEDS), 2, 2), complex)
    vectors[:, 0] = 34e-6 * np.sqrt(2) * np.array([1, -1j])
    c = comparison(twin, vectors)
    np.testing.assert_allclose(rms(c, c.measured), [[34e-6, 34e-6]], rtol=1e-12)


def test_a_flag_of_vectors_states_the_speed_at_which_the_residual_is_largest(twin):
    """One row of 2X off by 3 + 4i um in x: 5 um."""
    c = comparison(twin, np.zeros((len(SPEEDS), 2, 2), complex))
    row = 3
    residual = c.trials[0].spectra * 0
    residual[0, 0, 1 + len(c.trials[0].speeds) + row] = 3e-6 + 4e-6j
    (flag,) = flagged(table(c, c.trials[0].vector(residual) / c.sigma))
    assert (flag.group, flag.channel) == ("2X", "x")
    assert flag.speed == c.trials[0].speeds[row]
    assert flag.place == f"5 um at {c.trials[0].speeds[row] * 30 / np.pi:.0f} rpm"


def test_the_equivalent_force_of_vectors_is_that_which_made_them(twin):
    """3 N forward at 2X at the lowest speed, growing with its square, shown where the residual is largest."""
    a, c = twin.set({}), comparison(twin, np.zeros((len(SPEEDS), 2, 2), complex))
    trial = c.trials[0]
    residual = trial.spectra * 0
    for row, speed in enumerate(trial.speeds):
        G = linearise(a, settle(a, speed, 0.0), speed).transfer(2j * speed)[:, 2:4]
        force = 3.0 / np.sqrt(2) * (speed / trial.speeds[0]) ** 2 * np.array([1, -1j])
        residual[0, :, 1 + len(trial.speeds) + row] = G @ force
    white = trial.vector(residual) / c.sigma
    found = equivalent_force(c, ParameterPoint(), white, flagged(table(c, white)))
    (line,) = found["lines"]
    worst = trial.speeds[np.argmax(np.abs(residual[0, 0, 1 + len(trial.speeds) :]))]
    assert 20 < worst / (2 * np.pi) < 25
    assert line["order"] == 2 and line["direction"] == "turns forward"
    assert line["point"] == f"{worst * 30 / np.pi:.0f} rpm"
    assert line["force_n"] == pytest.approx(3.0 * (worst / trial.speeds[0]) ** 2, rel=1e-6)
    assert found["growth"]["speed"] == pytest.approx(2.0, abs=1e-6)


def test_phases_that_mean_nothing_stay_within_a_turn():
    """Vectors of noise: unwrapped, their phases would run over many turns."""
    rng = np.random.default_rng(2)
    noise = rng.standard_normal((2, 1, 400)) + 1j * rng.standard_normal((2, 1, 400))
    part = {"channels": ("x", "y"), "speeds": np.linspace(50.0, 300.0, 400), "measured_vectors": noise,
            "simulated_vectors": [noise[:, ::-1, ::-1], noise]}  # fmt: skip
    lags = [np.asarray(trace.y, float) for trace in bode([part], 0, False).data[1::2]]
    assert all(np.nanmin(lag) >= -450 and np.nanmax(lag) <= 450 and np.nanmax(lag) - np.nanmin(lag) < 400
               for lag in lags)  # fmt: skip


def test_a_bode_plot_holds_what_was_measured_and_what_was_simulated(twin):
    """Amplitude and lag of all rows, by rising speed; the residual taken off the measured is the simulation."""
    vectors = np.zeros((len(SPEEDS), 2, 2), complex)
    vectors[:, 0] = 20e-6 * np.exp(-1j * 1.2) * np.array([1, -1j])
    c = comparison(twin, vectors)
    shown = spectra_of(c, [ParameterPoint(), None, None])
    figure = bode(shown, 0, with_effect=False)
    names = [trace.name for trace in figure.data]
    assert set(names) == {"measured", "file as given", "re-calibrated"}
    np.testing.assert_allclose(figure.data[0].x, c.trials[0].speeds * 30 / np.pi, rtol=1e-6)
    np.testing.assert_allclose(figure.data[0].y, 20.0, rtol=1e-6)
    np.testing.assert_allclose(figure.data[1].y, np.degrees(1.2), rtol=1e-6)
    simulated = c.predict(ParameterPoint())
    np.testing.assert_allclose(shown[0]["simulated_vectors"][0].real.ravel()[:3], simulated[2:5], atol=1e-12)
