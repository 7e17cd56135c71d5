"""Growth of the equivalent force is that of the force, whatever a resonance makes of it; orders are the shaft's."""

import numpy as np
import pytest

from rotorsim.discrepancy.calibration import ParameterPoint
from rotorsim.discrepancy.comparison import Misfit, TwinComparison
from rotorsim.discrepancy.gap import _growth, _order, rms
from rotorsim.discrepancy.trial import trial_of

N = 7000


def shaken(twin, hertz, push, amplitude=1.0):
    """Record with an unstated force [N] at 2X along x, next to a stated one at 71 Hz; in steady state."""
    t = np.arange(N + 40000) * 2e-4
    rows = np.zeros((len(t), 6))
    rows[:, 0] = 2 * np.pi * hertz
    rows[:, 4] = amplitude * np.cos(2 * np.pi * 71.0 * t)
    fed = rows.copy()
    fed[:, 4] += push * np.cos(2 * (2 * np.pi * hertz) * t)
    angle = -2 * np.pi * hertz * 40000 * 2e-4
    y = twin.run({}, fed, 0.0, angle, turning=True)[40000:, :2]
    return trial_of(rows[40000:], y, 0.0, f"{hertz} Hz, {amplitude} N")


def found(twin, trials):
    comparison = TwinComparison(twin, trials)
    comparison.set_floor(ParameterPoint(), None, 0.004)
    flag = Misfit("a", "p", "x", "2X", 2, 1e6, 1e-6, 1e-8, 0.0, 0)
    return _growth(comparison, 0.25 * comparison.residual(ParameterPoint()), [flag])


def test_a_constant_force_across_a_resonance_does_not_grow_with_speed(models):
    """2X passes the first natural frequency of 44 Hz; displacements alone would say a power of 3 and more."""
    growth, taken = found(models.twin, [shaken(models.twin, f, 2.0) for f in (12.0, 16.0, 19.0, 20.5)])
    assert growth["speed"] == pytest.approx(0.0, abs=0.1)
    assert taken == pytest.approx(0.75)


def test_a_cubic_force_grows_with_the_third_power_of_the_amplitude(models):
    own = [shaken(models.twin, 16.0, 0.1 * a**3, a) for a in (1.0, 2.0, 3.0, 4.0)]
    assert found(models.twin, own)[0]["amplitude"] == pytest.approx(3.0, abs=0.1)


def test_lines_of_the_exciter_are_no_orders(models):
    trial = shaken(models.twin, 80.0, 0.0)
    assert trial.excited[np.argmin(np.abs(trial.frequencies - 71.0))]
    assert _order(trial, 71.0) is None
    assert _order(shaken(models.twin, 80.0, 0.0, 0.0), 40.0) == pytest.approx(0.5)


def test_the_gap_is_of_vibration_without_the_sag(models):
    trial = shaken(models.twin, 16.0, 0.0)
    comparison = TwinComparison(models.twin, [trial])
    moved = comparison.measured + 50e-6 * (comparison.layout.frequency == 0)
    np.testing.assert_array_equal(rms(comparison, moved), rms(comparison, comparison.measured))
