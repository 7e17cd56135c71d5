"""Recursive LPV estimate: run-ups of a known system, drop-outs, rest, drift, guards, bad input, a record of the rig."""

from dataclasses import replace

import numpy as np
import pytest

import identification as idn
import rotorsim as rs
from lpv_truth import TOP, TS, as_record, deviations, frozen, matrices, runup
from model3 import TRUTH, model
from rotorsim.base.errors import ModelError, SchemaError, UnfitError
from studies.recursive_lpv import kernel
from studies.recursive_lpv.estimate import Recursion, RecursiveLpv, coefficients_of, model_of, without_dead_times

pytestmark = pytest.mark.numerical

FREQUENCY, DAMPING = 0.02, 0.25
"""Aims: largest error of a tracked frequency and damping ratio."""
GAP = (10.0, 11.0)


def online(start=None, pressures=(5e5, 5e5), **settings):
    return RecursiveLpv(start or frozen(0.0), TS, (0.0, TOP), pressures, Recursion(**settings))


def errors(data, estimate, every=0.1):
    """Time [s] and relative errors (k, 2) of frequencies and damping ratios while an estimate takes a run-up in."""
    t, u, y, speed, pressure = data
    found = []
    for first in range(0, len(t), round(every / TS)):
        at = slice(first, first + round(every / TS))
        estimate.take(u[at], y[at], speed[at], pressure[at])
        last = min(at.stop, len(t)) - 1
        model, wanted = estimate.at(speed[last], pressure[last]), frozen(speed[last], pressure[last])
        assert len(model.wn) == 2
        found.append((t[last], *deviations(model, wanted)))
    return np.array([one[0] for one in found]), *(np.abs([one[k] for one in found]) for k in (1, 2))


@pytest.fixture(scope="module")
def to_20_krpm():
    return runup()


def test_the_form_of_third_order_is_model_3():
    omega, wanted = np.linspace(10, 3000, 50), model()
    more = np.vstack([np.zeros((2, 2)), [[0.3, 0.1], [0.0, 0.2]], np.zeros((2, 2))])
    for one in (wanted, replace(wanted, B=wanted.B + more)):
        again = model_of(coefficients_of(one, 700.0, 1e-6), 700.0, 1e-6, 0.0, 0.0, False)
        np.testing.assert_allclose(again.transfer(omega), one.transfer(omega), rtol=1e-8)
    assert np.abs(coefficients_of(wanted, 700.0, 1e-6)[:, 8:]).max() < 1e-12


def test_rouths_test_agrees_with_the_eigenvalues():
    rng, agreed = np.random.default_rng(0), []
    for _ in range(400):
        rows = coefficients_of(model(TRUTH * rng.uniform(0.3, 3, 14)), 750.0, 1e-6)
        rows[:, :6] += 0.3 * rng.normal(size=(2, 6))
        margin = rng.uniform(0, 0.1)
        poles = model_of(rows, 1.0, 1.0, 0, 0, False).poles
        stable = poles.real.max() < -margin
        agreed.append(stable)
        assert kernel.decaying(rows, margin) == stable
    assert 0.1 < np.mean(agreed) < 0.9


def test_modes_are_tracked_through_a_run_up_to_20_krpm(to_20_krpm):
    estimate = online()
    t, frequency, damping = errors(to_20_krpm, estimate)
    assert frequency[t > 2].max() < FREQUENCY and damping[t > 2].max() < DAMPING
    assert frequency[t > 10].max() < 0.005 and damping[t > 10].max() < 0.1  # where it stands
    counts = estimate.counts
    assert sum(counts.values()) == len(to_20_krpm[0])
    assert counts["skipped"] == 0 and counts["updated"] > 0.19 * len(to_20_krpm[0])
    speeds = np.linspace(0, TOP, 9)  # the surface has learned all of the range
    for speed in speeds:
        np.testing.assert_allclose(estimate.at(speed, 5e5).wn, frozen(speed).wn, rtol=FREQUENCY)
    assert np.all(estimate.variances <= 1)


@pytest.mark.parametrize(("noise", "most"), [(0.0, 0.02), (1e-9, 0.02), (1.5e-6, 0.15)])
def test_neither_three_times_the_noise_nor_none_at_all_spoils_the_damping(noise, most):
    """The highest noise costs 42 % of a damping ratio, 15 % in the mean, if measured displacements are instruments."""
    t, frequency, damping = errors(runup(noise=noise), online())
    assert frequency[t > 4].max() < 0.01 and damping[t > 4].max() < most


@pytest.mark.parametrize("factor", [0.8, 1.3])
def test_a_start_with_frequencies_far_off_does_no_harm(to_20_krpm, factor):
    t, frequency, damping = errors(to_20_krpm, online(frozen(0.0, detune=factor)))
    assert frequency[t > 4].max() < FREQUENCY and damping[t > 4].max() < DAMPING


FAULTS = {
    "NaN": lambda u, y, speed, pressure: y.fill(np.nan),
    "one axis is NaN": lambda u, y, speed, pressure: y[:, 0].fill(np.nan),
    "infinite": lambda u, y, speed, pressure: y.fill(np.inf),
    "zero": lambda u, y, speed, pressure: y.fill(0.0),
    "stands still": lambda u, y, speed, pressure: y.__setitem__(slice(None), y[0].copy()),
    "no speed": lambda u, y, speed, pressure: speed.fill(np.nan),
    "no pressure": lambda u, y, speed, pressure: pressure.fill(np.nan),
    "no reference": lambda u, y, speed, pressure: u.fill(np.nan),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_second_of_lost_signals_is_skipped_counted_and_survived(to_20_krpm, fault):
    t, *signals = to_20_krpm
    lost = [values.copy() for values in signals]
    gap = slice(*np.searchsorted(t, GAP))
    FAULTS[fault](*(values[gap] for values in lost))
    estimate, (speed, pressure) = online(), signals[2:]
    for first in range(0, len(t), 2500):
        at = slice(first, first + 2500)
        estimate.take(*(values[at] for values in lost))
        last = min(at.stop, len(t)) - 1
        frequency, damping = deviations(estimate.at(speed[last], pressure[last]), frozen(speed[last]))
        if t[last] > 2:
            assert np.abs(frequency).max() < FREQUENCY and np.abs(damping).max() < DAMPING
    assert 4990 <= estimate.counts["skipped"] <= 5000


@pytest.mark.parametrize(("share", "size"), [(0.01, 200e-6), (0.001, 1.0)])
def test_outliers_are_skipped_one_by_one(to_20_krpm, share, size):
    t, u, y, speed, pressure = to_20_krpm
    struck = np.random.default_rng(1).random(len(t)) < share
    y = y + size * struck[:, None]
    estimate = online()
    when, frequency, damping = errors((t, u, y, speed, pressure), estimate)
    assert frequency[when > 2].max() < FREQUENCY and damping[when > 2].max() < DAMPING
    assert estimate.counts["skipped"] == pytest.approx(struck.sum(), rel=0.05)


def test_without_excitation_nothing_is_learned_and_no_variance_grows():
    data, estimate = runup(quiet=(10.0, 13.0)), online(drift=(0.05, 0.05, 0.05, 0.05))
    t, *signals = data
    for first, last in ((0, 11.0), (11.0, 12.9)):
        part = slice(*np.searchsorted(t, (first, last)))
        before = estimate._theta.copy(), estimate.variances.copy()
        estimate.take(*(values[part] for values in signals))
    np.testing.assert_array_equal(estimate._theta, before[0])
    np.testing.assert_array_equal(estimate.variances, before[1])
    assert estimate.counts["idle"] > 2200
    when, frequency, damping = errors(data, online())
    assert frequency[when > 2].max() < FREQUENCY and damping[when > 2].max() < DAMPING


def test_variances_of_directions_that_nothing_excites_stay_below_the_first():
    _, u, y, _, pressure = runup(seconds=20.0)
    estimate = online(drift=(1.0, 1.0, 1.0, 1.0))
    estimate.take(np.column_stack([u[:, 0], np.zeros(len(u))]), y, np.zeros(len(u)), pressure)  # one speed, one input
    assert estimate.variances.max() <= 1 and np.all(np.linalg.eigvalsh(estimate._P) > -1e-9)


def test_speed_and_pressure_may_move_together():
    data = runup(seconds=40.0, pressures=lambda t: 5e5 + 2e5 * np.sin(2 * np.pi * t / 7))
    t, frequency, damping = errors(data, online(pressures=(3e5, 7e5)))
    assert frequency[t > 8].max() < FREQUENCY and damping[t > 8].max() < DAMPING


@pytest.mark.parametrize(("drift", "within"), [(0.05, 1.0), (0.005, 3.0)])
def test_a_change_with_time_is_followed_as_fast_as_the_drift_allows(drift, within):
    data = runup(seconds=12.0, detune=lambda t: 1.0 if t < 7 else 1.05, top=1e-3)
    estimate = online(drift=(drift, drift, 0.05, 0.05))
    t, *signals = data
    estimate.take(*(values[t < 7] for values in signals))
    np.testing.assert_allclose(estimate.at(0.0, 5e5).wn, frozen(0.0).wn, rtol=FREQUENCY)
    estimate.take(*(values[(t >= 7) & (t < 7 + within)] for values in signals))
    np.testing.assert_allclose(estimate.at(0.0, 5e5).wn, frozen(0.0, detune=1.05).wn, rtol=FREQUENCY)


def test_an_update_that_would_make_the_model_unstable_is_refused():
    """A system that grows: coefficients stop at the edge of stability and no further."""
    rng, n = np.random.default_rng(0), 20000
    A, B, C, _ = matrices(0.0)
    A[2:4, 2:4] *= -0.3
    u = np.repeat(2.0 * rng.integers(0, 2, (n // 25, 2)) - 1, 25, axis=0)
    y = idn.LinearModel(A, B, C, np.zeros((2, 2))).simulate(u, TS)
    y = np.clip(y + 0.5e-6 * rng.normal(size=y.shape), -1.0, 1.0)
    estimate = online()
    for first in range(0, n, 500):
        estimate.take(u[first : first + 500], y[first : first + 500], np.zeros(500), np.full(500, 5e5))
        assert estimate.at(0.0, 5e5).stable
        assert np.all(np.isfinite(estimate._theta))
    assert estimate.counts["refused"] > 0


def test_coefficients_stay_within_their_bounds(to_20_krpm):
    estimate = online(frozen(0.0, detune=1.3), reach=0.1)
    estimate.take(*(values[:50000] for values in to_20_krpm[1:]))
    low, high = estimate._box
    assert np.all((estimate._theta >= low) & (estimate._theta <= high))
    assert np.any((estimate._theta == low) | (estimate._theta == high))


def test_sample_by_sample_block_by_block_and_a_record_give_the_same_bits(to_20_krpm):
    t, *signals = (values[:4000] for values in to_20_krpm)
    one, blocks, whole = online(), online(), online()
    outcomes = [one.update(*(values[k] for values in signals)) for k in range(len(t))]
    for first in range(0, len(t), 333):
        blocks.take(*(values[first : first + 333] for values in signals))
    track = whole.run(as_record(t, *signals), every=0.1)
    for other in (blocks, whole):
        np.testing.assert_array_equal(one._theta, other._theta)
        np.testing.assert_array_equal(one._P, other._P)
        assert one.counts == other.counts
    assert set(outcomes) <= set(one.counts) and outcomes.count("updated") == one.counts["updated"] > 0
    assert track.wn.shape == (8, 2) and track.time[-1] == pytest.approx(t[-1])
    np.testing.assert_allclose(track.wn[-1], one.at(signals[2][-1], signals[3][-1]).wn)


def test_a_model_beyond_what_was_learned_from_is_marked(to_20_krpm):
    estimate = online()
    assert estimate.at(0.0, 5e5).extrapolated
    estimate.take(*(values[:50000] for values in to_20_krpm[1:]))
    assert not estimate.at(0.2 * TOP, 5e5).extrapolated and estimate.at(0.9 * TOP, 5e5).extrapolated


def test_it_may_start_from_surfaces(to_20_krpm):
    points = [(speed, pressure) for speed in np.linspace(0, TOP, 4) for pressure in (4e5, 5e5, 6e5)]
    results = [idn.identify(_at(*point), 3) for point in points]
    lpv = idn.fit_lpv(results, order=2)
    estimate = RecursiveLpv(lpv, TS, (0.0, TOP), (5e5, 5e5))
    for speed in (0.0, 0.5 * TOP, TOP):
        np.testing.assert_allclose(estimate.at(speed, 5e5).wn, lpv.at(speed, 5e5).wn, rtol=0.02)


def _at(speed, pressure):
    rng = np.random.default_rng(int(speed + pressure))
    u = np.repeat(2.0 * rng.integers(0, 2, (400, 2)) - 1, 25, axis=0)
    y = frozen(speed, pressure).simulate(u, TS) + 0.5e-6 * rng.normal(size=(10000, 2))
    return idn.from_arrays(np.arange(10000) * TS, u, y, speed=speed, pressure=pressure)


@pytest.mark.slow
def test_on_the_rig_the_run_up_is_tracked_as_the_plants_eigenvalues_move():
    from rotorsim.experiments.catalogue.prbs import bits

    plant = rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)
    t = np.arange(100000) * TS
    speed, top = np.clip((t - 1) / 18, 0, 1) * 6000 * np.pi / 30, 6000 * np.pi / 30
    u = np.stack([bits(1, axis, np.arange(len(t)) // 25) for axis in range(2)], axis=1)
    u[:2000] = 0
    record = plant.simulate(20.0, speed=speed, pressure=0.5e6, reference=u, seed=1)
    start = idn.identify(rs.experiments.prbs(plant, 0.0, 0.5e6, duration=4.0), 3).model
    track = RecursiveLpv(start, TS, (0.0, top), (0.5e6, 0.5e6)).run(record, every=0.5)
    physics = [plant.linearise(one, 0.5e6) for one in np.linspace(0, top, 7)]
    for k in range(2):
        wn, zeta = (
            np.interp(track.speed, np.linspace(0, top, 7), [getattr(p, name)[k] for p in physics])
            for name in ("wn", "zeta")
        )
        assert np.abs(track.wn[4:, k] / wn[4:] - 1).max() < FREQUENCY
        assert np.abs(track.zeta[4:, k] / zeta[4:] - 1).max() < 0.3


@pytest.mark.parametrize(
    ("call", "error", "sentence"),
    [
        (lambda: online(replace(frozen(0.0), A=-frozen(0.0).A)), UnfitError, "unstable"),
        (lambda: online(frozen(0.0).discrete(TS)), ModelError, "recursive.start.* six"),
        (lambda: online(idn.LinearModel(-np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))), ModelError, "six states"),
        (lambda: online(replace(frozen(0.0), B=np.ones((6, 2)))), ModelError, "recursive.start"),
        (lambda: online(replace(frozen(0.0), C=np.eye(2, 6)[::-1] * [[0], [1]])), ModelError, "recursive.start"),
        (lambda: RecursiveLpv(frozen(0.0), 2e-3, (0, TOP), (5e5, 5e5)), UnfitError, "times their frequency"),
        (lambda: RecursiveLpv(frozen(0.0), np.nan, (0, TOP), (5e5, 5e5)), UnfitError, "times their frequency"),
        (lambda: RecursiveLpv(frozen(0.0), TS, (TOP, 0), (5e5, 5e5)), UnfitError, "recursive.speeds"),
        (lambda: RecursiveLpv(frozen(0.0), TS, (0, TOP), 5e5), UnfitError, "recursive.pressures"),
        (lambda: Recursion(order=7), UnfitError, "order 7"),
        (lambda: Recursion(harmonics=-1), UnfitError, "-1 harmonics"),
        (lambda: Recursion(drift=(0.1, 0.1)), UnfitError, "recursion.drift"),
        (lambda: Recursion(drift=(-1, 0, 0, 0)), UnfitError, "recursion.drift"),
        (lambda: Recursion(spread=(0, 1, 1, 1)), UnfitError, "recursion.spread"),
        (lambda: Recursion(corner=np.nan), UnfitError, "recursion.corner: nan"),
        (lambda: Recursion(least_input=-1), UnfitError, "recursion.least_input: -1"),
    ],
)
def test_what_makes_no_estimate_is_refused_in_a_sentence(call, error, sentence):
    with pytest.raises(error, match=sentence):
        call()


@pytest.mark.parametrize(
    "samples",
    [
        ([1.0], [0.0, 0.0], 0.0, 5e5),
        ([1.0, 1.0], [0.0], 0.0, 5e5),
        ([1.0, 1.0], [0.0, 0.0], [0.0, 0.0], 5e5),
        ([1.0, 1.0], [0.0, 0.0], 0.0, [5e5] * 3),
        ([[1.0, 1.0]] * 2, [[0.0, 0.0]] * 2, 0.0, 5e5),
    ],
)
def test_samples_of_wrong_shapes_are_refused_before_they_are_taken_in(samples):
    estimate = online()
    with pytest.raises(UnfitError, match=r"recursive: u \("):
        estimate.update(*samples)
    assert sum(estimate.counts.values()) == 0


def test_records_that_lack_something_or_have_another_rate_are_refused(to_20_krpm):
    t, *signals = (values[:2000] for values in to_20_krpm)
    record = as_record(t, *signals)
    with pytest.raises(SchemaError, match="no reference"):
        online().run(record.drop_vars("reference"))
    with pytest.raises(UnfitError, match="no pressure"):
        online().run(record.drop_vars("pressure"))
    with pytest.raises(UnfitError, match=r"closed loop \(lqr\)"):
        online().run(record.assign_attrs(controller="lqr"))
    with pytest.raises(UnfitError, match="resample"):
        online().run(as_record(2 * t, *signals))


def test_a_start_with_dead_times_has_them_in_its_lags():
    """Model 3 as `identify` gives it by default: eight states; frequencies, damping and gain at rest are kept."""
    from identification.local.greybox import STRUCTURES

    theta = np.array([-5e5, 0, 0, -6e5, -50, 0, 0, -40, 1.5, 0.1, -0.1, 1.6, 900, 1100, 4e3, 5e3], float)
    late = idn.LinearModel(*STRUCTURES["3-delay"].matrices(theta))
    short = without_dead_times(late)
    assert short.order == 6 and without_dead_times(short) is short
    np.testing.assert_allclose(short.static_gain, late.static_gain, rtol=1e-12)
    np.testing.assert_allclose(short.wn, late.wn, rtol=1e-9)
    np.testing.assert_allclose(-1 / short.A[[4, 5], [4, 5]], 1 / theta[12:14] + 2 / theta[14:16], rtol=1e-12)
    RecursiveLpv(late, 2e-4, speeds=(0.0, 600.0), pressures=(0.5e6, 0.5e6))
