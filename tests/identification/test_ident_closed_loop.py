"""Records of a closed loop with an external reference, identified in two stages."""

import numpy as np
import pytest
from scipy.signal import lfilter

import identification as idn
from identification.local.closed_loop import _regressors, _response, acted_of, orbit_remark, two_stage
from identification.local.confidence import project, simulated
from identification.local.greybox import modes
from identification.records.checks import SATURATED, saturated_share
from model3 import TRUTH, TS, looped_model3, made, model, prbs, record
from refusals import refused
from rotorsim.base.errors import UnfitError

pytestmark = pytest.mark.numerical

WN, ZETA = modes(TRUTH)


def loop(seed=0, gain=1e5, n=30000, **more):
    """Record of Model 3 under a proportional law that names it, with the external reference."""
    u, external, y = looped_model3(seed, gain, n=n, **more)
    return made(u, y, reference_external=external).assign_attrs(law="p")


@pytest.mark.parametrize(
    "gain", [pytest.param(2e4, marks=pytest.mark.slow), 1e5, pytest.param(1.5e5, marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("model", [3, "blackbox"])
def test_two_stages_find_the_plant_behind_any_law(gain, model):
    found = idn.identify(loop(1, gain), model)
    assert found.method == "two-stage"
    assert np.all(np.abs(found.wn / WN - 1) < 2e-3) and np.all(np.abs(found.zeta / ZETA - 1) < 0.05)
    assert "two-stage: the external reference explains" in found.report() and "two-stage," in found.report()


@pytest.mark.slow
def test_where_noise_is_fed_back_two_stages_hold_the_truth_and_the_direct_fit_does_not():
    """Noise of 4 um that keeps its sign for some 20 samples: the direct fit takes part of the law for damping."""
    off = {}
    for method in ("two-stage", "oe"):
        data = [loop(seed, 1.5e5, n=20000, noise=4e-6, colour=0.95) for seed in range(4)]
        found = [idn.identify(one, 3, method=method, check=False, start=TRUTH) for one in data]
        z = np.array([(one.theta - TRUTH) / np.sqrt(np.diag(one.covariance)) for one in found])
        off[method] = float(np.sqrt(np.mean(z**2))), max(np.abs(one.zeta / ZETA - 1).max() for one in found)
    assert off["two-stage"][0] < 2.5 and off["two-stage"][1] < 0.3, off
    assert off["oe"][0] > 4.0 and off["oe"][1] > 1.0, off


@pytest.mark.slow
def test_stated_deviations_hold_in_closed_loop():
    """Six records under a law that feeds back coloured noise of 2 um."""
    found = [idn.identify(loop(seed, n=20000, noise=2e-6, colour=0.95), 3, start=TRUTH) for seed in range(6)]
    z = np.array([(one.theta - TRUTH) / np.sqrt(np.diag(one.covariance)) for one in found])
    assert np.all(np.abs(z.mean(axis=0)) < 4 / np.sqrt(6)), z.mean(axis=0)
    assert 0.6 < np.sqrt(np.mean(z**2)) < 1.6


@pytest.mark.slow
@pytest.mark.parametrize("model", ["3", pytest.param("blackbox", marks=pytest.mark.slow)])
def test_under_a_law_that_damps_the_noise_stated_deviations_are_not_those_of_the_damped_noise(model):
    """White noise of 2 um; by y - G u^ alone frequencies and damping ratios scatter 2.9 times as much as stated."""
    z = []
    for seed in range(6):
        given = {"start": TRUTH, "dead_time": 0} if model == "3" else {}
        found = idn.identify(loop(seed, 1.5e5, n=20000, noise=2e-6), model, **given)
        z.append([(found.wn - WN) / found.wn_sd, (found.zeta - ZETA) / found.zeta_sd])
    assert 0.6 < np.sqrt(np.mean(np.square(z))) < 1.9, np.sqrt(np.mean(np.square(z)))


def test_what_acted_is_filtered_as_what_is_explained_of_it():
    """Without noise both are the same but for what the impulse response leaves out; an open loop has none."""
    staged = two_stage(idn.filtered(loop(0, 1e5, noise=0.0)), loop(0, 1e5, noise=0.0)["reference_external"].values)[0]
    acted = acted_of(staged)
    assert acted.pins is None and acted.acting is None
    assert np.std(acted.u - staged.u) < 0.02 * np.std(staged.u)
    assert acted_of(idn.filtered(record(0, seconds=2.0))) is None


def test_references_that_follow_the_orbit_give_a_warning():
    u, external, y = looped_model3(0, 1e5, n=20000)
    time = np.arange(20000) * TS
    for size, warned in ((0.3, False), (3.0, True)):
        moved = u + size * np.cos(300.0 * time)[:, None]
        data = idn.from_arrays(time, moved, y, angle=300.0 * time, speed=300.0, pressure=3e5)
        texts = orbit_remark(idn.filtered(data), external)
        assert any("follow the orbit with 2.1 V (RMS)" in text for text in texts) == warned, texts
    still = loop(0, n=20000)  # no angle: nothing to tell an orbit by
    assert orbit_remark(idn.filtered(still), still["reference_external"].values) == ()


def test_the_long_impulse_response_is_least_squares_on_the_known_past():
    rng = np.random.default_rng(0)
    r, values, m = prbs(rng, 900, hold=3, rest=0).astype(float), rng.normal(size=(900, 3)), 40
    parts = [slice(0, 400), slice(400, 900)]
    X = np.vstack([_regressors(r[part], m)[m:] for part in parts])
    y = np.vstack([values[part][m:] for part in parts])
    direct = np.linalg.solve(X.T @ X + 1e-7 * np.trace(X.T @ X) / (2 * m) * np.eye(2 * m), X.T @ y)
    np.testing.assert_allclose(_response(r, values, parts, m, 0).reshape(2 * m, 3), direct, rtol=1e-8, atol=1e-9)


def test_staged_inputs_are_what_the_external_reference_explains():
    """Without noise all of it is explained: the fit of the truth's response is perfect."""
    data = loop(0, 1e5, noise=0.0)
    signals = idn.filtered(data)
    staged, text = two_stage(signals, data["reference_external"].values)
    assert "explains 100 %" in text and len(staged.u) == len(staged.y) < len(signals.u)


def test_the_noise_of_staged_signals_is_what_the_filter_leaves_of_it():
    data = loop(0, 2e4)
    staged = two_stage(idn.filtered(data), data["reference_external"].values)[0]
    left = staged.y - simulated(model(), staged)
    np.testing.assert_allclose(project(left, staged.Q).std(axis=0), staged.noise, rtol=0.1)


@pytest.mark.parametrize(("kind", "coarse"), [(1, False), (3, True)])
def test_a_closed_loop_states_no_bias_and_says_so(kind, coarse):
    found = idn.identify(loop(0, n=20000), kind)
    assert found.bias is None and all(one.bias is one.bias_sd is None for one in found.intervals)
    assert any("hold no bias" in text for text in found.warnings)
    assert any("take Model 2-rate where pins are measured" in text for text in found.warnings) == coarse
    assert not any("hold no bias" in text for text in idn.identify(record(0, seconds=2.0), kind).warnings)


def test_prediction_error_in_a_closed_loop_states_no_bias_either():
    found = idn.identify(loop(0, n=20000), 1, method="pem")
    assert found.bias is None
    assert any("hold no bias" in text for text in found.warnings)
    assert "no bias stated" in found.report()


def test_prediction_error_that_ends_at_no_model_is_refused():
    """A displacement that the references have no part in."""
    rng = np.random.default_rng(0)
    u = prbs(rng, 20000)
    moved = lfilter([1.0], [1, -1.97, 0.98], rng.normal(size=u.shape), axis=0)
    moved[:2000] = 0
    y = 1e-5 * moved / moved.std() + 0.2e-6 * rng.normal(size=u.shape)
    with pytest.raises(UnfitError, match=r"pem .* % .* 9\d %"):
        idn.identify(made(u, y), 1, method="pem")


@pytest.mark.slow
def test_gaps_and_several_records_of_closed_loops():
    data, other = loop(1, n=30000), loop(2, n=30000)
    holed = data.copy(deep=True)
    holed["disc_measured"].values[12000:12050] = np.nan
    gaps, both, mixed = (idn.identify(some) for some in (holed, [data, other], [data, record(5, seconds=4.0)]))
    for found in (gaps, both, mixed):
        assert found.method == "two-stage"
        assert np.all(np.abs(found.theta - TRUTH) < 4.5 * np.sqrt(np.diag(found.covariance)))
    alone = idn.identify(data)
    ratio = np.sqrt(np.diag(both.covariance) / np.diag(alone.covariance))
    assert np.median(ratio) == pytest.approx(2**-0.5, rel=0.1)


def test_a_closed_loop_without_external_excitation_is_refused():
    u, external, y = looped_model3(0, 1e5)
    with pytest.raises(idn.UnfitError, match=r"\(p\).*reference_external"):
        idn.identify(made(u, y).assign_attrs(law="p"))
    with pytest.raises(idn.UnfitError, match="no reference_external"):
        idn.identify(made(u, y), method="two-stage")
    for axis in range(2):
        quiet = external.copy()
        quiet[:, axis] = 0.3
        with refused(idn.UnfitError, "reference_external.x" if axis == 0 else "reference_external.y"):
            idn.identify(made(u, y, reference_external=quiet).assign_attrs(law="p"))
    same = np.repeat(external[:, :1], 2, axis=1)
    with refused(idn.UnfitError, "reference_external", pytest.approx(1.0)):
        idn.identify(made(u, y, reference_external=same).assign_attrs(law="p"))


def test_a_closed_loop_in_short_stretches_is_refused():
    data = loop(0, n=20000)
    data["disc_measured"].values[::1000] = np.nan
    with pytest.raises(idn.UnfitError, match=r"no stretch of \d+ samples"):
        idn.identify(data)


def test_a_short_closed_loop_is_refused():
    with pytest.raises(idn.UnfitError, match=r"record: 5500 samples .* 6000"):
        idn.identify(loop(n=7500))


def test_a_law_that_saturates_is_refused_with_its_share():
    free = loop(0, n=20000)
    assert saturated_share(free["reference"].values) == 0.0
    most = float(np.quantile(np.abs(free["reference"].values), 0.97))
    clipped = loop(0, n=20000, most=most)
    share = saturated_share(clipped["reference"].values)
    assert share > 10 * SATURATED
    with pytest.raises(idn.UnfitError, match=rf"range of {most:.4g} V in {100 * share:.2g} % of the samples"):
        idn.identify(clipped)
    assert any("drives the reference to its range" in text for text in idn.identify(clipped, check=False).warnings)


def test_a_constant_channel_is_not_saturated():
    assert saturated_share(np.column_stack([np.linspace(-1, 1, 100), np.full(100, 0.3)])) == 0.0


def test_a_few_saturated_samples_give_a_warning():
    free = loop(0, n=20000)["reference"].values
    most = float(np.sort(np.abs(free).ravel())[-12])
    clipped = loop(0, n=20000, most=most)
    assert 0 < saturated_share(clipped["reference"].values) < SATURATED
    assert any("drives the reference to its range" in text for text in idn.identify(clipped).warnings)
