"""Records with gaps, and several records of one operating point, in one local fit."""

import numpy as np
import pytest

import identification as idn
from identification.local.greybox import STRUCTURES
from identification.local.least_squares import FitProblem, GreyBox
from identification.local.simulation import respond
from identification.records.prefilter import offsets, regressors_of, without_gaps
from model3 import TRUTH, TS, record

pytestmark = pytest.mark.numerical


def holes(data, *spans, channel="disc_measured"):
    """The record with NaN in a channel over (start, stop) samples."""
    data = data.copy(deep=True)
    for start, stop in spans:
        data[channel].values[start:stop] = np.nan
    return data


def cut(data, *spans):
    """The record without its samples from start to stop: time leaps."""
    keep = np.ones(data.sizes["time"], bool)
    for start, stop in spans:
        keep[start:stop] = False
    return data.isel(time=np.flatnonzero(keep))


SPANS = ((4000, 4100), (9000, 9003), (9100, 9102), (15000, 16500))


@pytest.mark.parametrize("damaged", [holes, cut])
def test_a_record_with_gaps_gives_the_model_of_its_whole_stretches(damaged):
    data = record(1, seconds=5.0)
    whole, found = idn.identify(data), idn.identify(damaged(data, *SPANS))
    assert any("1702 of 25000 samples" in text and "whole stretches: 4" in text for text in found.notes), found.notes
    assert np.all(np.abs(found.wn / whole.wn - 1) < 3e-4) and np.all(np.abs(found.zeta / whole.zeta - 1) < 0.01)
    sd = np.array([value[1] for value in found.parameters.values()])
    assert np.all(np.abs(found.theta - TRUTH) < 4.5 * sd)
    assert np.all(found.fit > whole.fit - 0.01)


def test_a_stretch_shorter_than_a_tenth_of_a_second_is_left_out():
    closed, breaks, note = without_gaps(holes(record(0, seconds=3.0), (4000, 4010), (4300, 4310)))
    assert breaks == (4000,) and closed.sizes["time"] == 15000 - 310 and "310 of 15000" in note


def test_a_record_without_gaps_is_not_touched():
    data = record(0, seconds=1.0)
    assert without_gaps(data)[0] is data and without_gaps(data)[1:] == ((), "")


def test_the_angle_loses_the_whole_turns_of_a_gap():
    n = 10000
    angle = 300.0 * np.arange(n) * TS
    data = cut(record(0, seconds=2.0, speed=300.0, angle_measured=angle), (5000, 6000))
    left = without_gaps(data)[0]
    np.testing.assert_allclose(np.exp(1j * left["angle_measured"].values), np.exp(1j * data["angle_measured"].values))
    assert np.abs(np.diff(left["angle_measured"].values)).max() < np.pi + 300 * TS


def test_gaps_of_a_turning_rotor_share_its_harmonics():
    n = 25000
    angle = 300.0 * np.arange(n) * TS
    data = record(2, seconds=5.0, speed=300.0, angle_measured=angle)
    data["disc_measured"].values[:] += 5e-6 * np.column_stack([np.cos(angle), np.sin(angle)])
    found = idn.identify(holes(data, *SPANS))
    assert np.all(np.abs(found.theta - TRUTH) < 4.5 * np.array([sd for _, sd in found.parameters.values()]))


@pytest.mark.parametrize(
    ("method", "kind"),
    [("oe", "3"), ("oe", "blackbox"), ("pem", "1")]
    + [pytest.param(*more, marks=pytest.mark.slow) for more in (("oe", "1"), ("pem", "3"), ("pem", "blackbox"))],
)
def test_every_model_and_method_takes_gaps(kind, method):
    data = record(3, seconds=3.0)
    found = idn.identify(holes(data, (6000, 6050)), kind, method=method)
    assert np.all(np.abs(found.fit - idn.identify(data, kind, method=method).fit) < 0.01)


def test_gaps_that_leave_too_little_are_refused():
    data = record(0, seconds=2.0)
    with pytest.raises(idn.UnfitError, match="0 s of 2 s"):
        idn.identify(holes(data, (0, 10000)))
    every = [(k, k + 1) for k in range(0, 10000, 400)]
    with pytest.raises(idn.UnfitError, match="0 s of 2 s"):
        idn.identify(holes(data, *every))


def test_a_lowpass_across_gaps_is_refused():
    with pytest.raises(idn.UnfitError, match="lowpass"):
        idn.identify(holes(record(0, seconds=2.0), (5000, 5001)), settings=idn.Prefilter(lowpass=800.0))


def test_the_joint_estimate_is_the_weighted_mean_of_single_ones_with_deviations_smaller_by_the_root_of_two():
    """Least squares of independent records: N = N_1 + N_2."""
    one, other = record(1, seconds=4.0), record(2, seconds=4.0)
    other["disc_measured"].values[:] += 3e-6  # an offset of its own
    both, alone = idn.identify([one, other]), [idn.identify(data) for data in (one, other)]
    N = [single.information for single in alone]
    mean = np.linalg.solve(N[0] + N[1], N[0] @ alone[0].theta + N[1] @ alone[1].theta)
    assert np.all(np.abs(both.theta - mean) < 0.1 * np.sqrt(np.diag(both.covariance)))
    np.testing.assert_allclose(both.information, N[0] + N[1], rtol=0.05, atol=1e-3 * np.abs(N[0]).max())
    ratio = np.sqrt(np.diag(both.covariance)) / np.sqrt(np.mean([np.diag(a.covariance) for a in alone], axis=0))
    np.testing.assert_allclose(np.median(ratio), 2**-0.5, rtol=0.05)
    assert np.all(np.abs(ratio * 2**0.5 - 1) < 0.3)
    assert "2 records in one fit" in both.notes
    assert np.all(np.abs(both.theta - TRUTH) < 4.5 * np.sqrt(np.diag(both.covariance)))


def test_derivatives_of_several_stretches_are_those_of_differences():
    rng, theta = np.random.default_rng(0), TRUTH
    w, y = rng.normal(size=(300, 2)), 1e-6 * rng.normal(size=(300, 2))
    Q = np.linalg.qr(rng.normal(size=(300, 3)))[0]
    problem = FitProblem(GreyBox(STRUCTURES["3"], TS), w, y, Q, breaks=(100, 220))
    x0 = 1e-6 * rng.normal(size=18)
    _, g, cost = problem.normal_equations(theta, x0)
    for i in (0, 5, 12):
        step = 1e-4 * abs(theta[i])
        high, low = theta.copy(), theta.copy()
        high[i], low[i] = theta[i] + step, theta[i] - step
        slope = (problem.normal_equations(high, x0)[2] - problem.normal_equations(low, x0)[2]) / (2 * step)
        np.testing.assert_allclose(-2 * g[i], slope, rtol=1e-4, atol=1e-9 * cost / abs(theta[i]))
    for i in (0, 8, 17):
        step = 1e-9
        high, low = x0.copy(), x0.copy()
        high[i], low[i] = x0[i] + step, x0[i] - step
        slope = (problem.normal_equations(theta, high)[2] - problem.normal_equations(theta, low)[2]) / (2 * step)
        np.testing.assert_allclose(-2 * g[len(theta) + i], slope, rtol=1e-4)


def test_stretches_whose_states_follow_each_other_leave_the_residual_of_one():
    """Each later stretch begins at the state that the one before ends with: the sums are those without a break."""
    data = idn.filtered(record(0, seconds=2.0))
    grey, x0 = GreyBox(STRUCTURES["3"], TS), 1e-7 * np.arange(6.0)
    F, G, *_ = grey.sampled(TRUTH)
    states = respond(F, G, np.eye(6), np.zeros((6, 2)), x0, data.u)
    breaks = (1000, 4000)
    cut = FitProblem(grey, data.u, data.y, data.Q, breaks=breaks)
    q, whole = len(TRUTH), FitProblem(grey, data.u, data.y, data.Q).normal_equations(TRUTH, x0)
    _, _, cost = cut.normal_equations(TRUTH, np.concatenate([x0, *states[list(breaks)]]))
    assert cost == pytest.approx(whole[2], rel=1e-9)
    assert cut.states(TRUTH) == 18 and len(cut.residual(TRUTH, np.zeros(18))[1][0, 0]) == q


def test_each_record_has_a_steady_one_of_its_own():
    """Runouts of 5 um that differ: with the first's for both, the second keeps what is not its own."""
    n = 15000
    angle = 300.0 * np.arange(n) * TS
    given, calm = [], []
    for k in range(2):
        runout = 5e-6 * np.column_stack([np.cos(angle + k), np.sin(angle + k)])
        one = record(k, seconds=3.0, speed=300.0, angle_measured=angle)
        still = record(9, seconds=3.0, speed=300.0, angle_measured=angle, u=np.zeros((n, 2)))
        for data in (one, still):
            data["disc_measured"].values[:] += runout
        given.append(one)
        calm.append(still)
    own, shared = (idn.identify(given, 3, steady=steady) for steady in (calm, calm[0]))
    assert own.rms_residual.max() < 0.6e-6 < 1e-6 < shared.rms_residual.min()
    with pytest.raises(idn.UnfitError, match=r"identify\.steady: 1 for 2"):
        idn.identify(given, steady=calm[:1])


def test_regressors_of_a_part_are_those_that_are_not_zero_there():
    Q = offsets(30, (10, 20))
    some, shown = regressors_of(Q, slice(10, 20))
    assert shown.tolist() == [1]
    np.testing.assert_array_equal(some, Q[10:20, 1:2])


def test_records_that_do_not_belong_together_are_refused():
    one = record(0, seconds=2.0)
    for other, text in (
        (record(1, seconds=2.0, pressure=5e5), "record 2: pressure 5e[+]05 Pa.*3e[+]05 Pa"),
        (record(1, seconds=2.0, speed=200.0), "record 2: speed 200 rad/s"),
    ):
        with pytest.raises(idn.UnfitError, match=text):
            idn.identify([one, other])
    slow = record(1, seconds=4.0).isel(time=slice(None, None, 2))
    with pytest.raises(idn.UnfitError, match=r"record 2: a sample every 0\.0004 s"):
        idn.identify([one, slow])
    with pytest.raises(idn.UnfitError, match="identify: no record"):
        idn.identify([])
    for wrong in ("run.nc", [one, "run.nc"]):
        with pytest.raises(idn.UnfitError, match=r"'run\.nc'"):
            idn.identify(wrong)
