"""Model 2 with rates of the pins wherever a model may go: records, surfaces, comparisons, laws, files; or refused."""

import numpy as np
import pytest
from test_ident_rates import PLAIN, RATES, TS, moved

import identification as idn
import rotorsim as rs
from identification.local.bias import _velocity
from identification.local.greybox import RATED, STRUCTURES, modes
from identification.local.least_squares import FitProblem, GreyBox
from refusals import refused

pytestmark = pytest.mark.numerical


@pytest.fixture(scope="module")
def found():
    return idn.identify(moved(RATES, RATED), RATED)


@pytest.mark.slow
def test_several_records_give_smaller_deviations(found):
    both = idn.identify([moved(RATES, RATED, 1), moved(RATES, RATED, 2)], RATED)
    np.testing.assert_allclose(both.zeta, modes(RATES)[1], rtol=5e-3)
    assert np.median(both.wn_sd / found.wn_sd) < 0.9


def test_a_gap_does_not_matter():
    holed = moved(RATES, RATED)
    holed["disc_measured"].values[12000:12050] = np.nan
    np.testing.assert_allclose(idn.identify(holed, RATED).zeta, modes(RATES)[1], rtol=5e-3)


@pytest.mark.slow
def test_prediction_error_finds_it_too():
    np.testing.assert_allclose(idn.identify(moved(RATES, RATED, 3), RATED, method="pem").wn, modes(RATES)[0], rtol=1e-3)


def test_its_name_and_its_intervals(found):
    assert found.report().startswith("Model 2 with rates, oe") and found.bias is not None
    assert "R_xy" in found.report() and {one.name for one in found.intervals} >= {"f_1", "zeta_2", "gain_xy"}


def test_a_dead_time_and_a_frequency_response_are_refused_in_a_sentence():
    data = moved(RATES, RATED, seconds=3.0)
    with pytest.raises(idn.UnfitError, match=r"identify.dead_time: .* 2-rate"):
        idn.identify(data, RATED, dead_time=5e-4)
    response = idn.frequency_response(data["reference"].values, data["disc_measured"].values, TS)
    for model in (RATED, 2):
        with refused(idn.UnfitError, "model", model):
            idn.fit_frequency_response(response, model)


@pytest.fixture(scope="module")
def grid():
    """Results at four points, and their records."""
    points = [(0.0, 3e5), (300.0, 3e5), (0.0, 5e5), (300.0, 5e5)]
    records = [
        moved(RATES, RATED, k, 2.0, speed=w, pressure=p, angle=w * np.arange(10000) * TS)
        for k, (w, p) in enumerate(points)
    ]
    return [idn.identify(one, RATED) for one in records], records


@pytest.mark.slow
def test_surfaces_are_refined_by_frequency_responses_and_not_over_all_records(grid):
    results, records = grid
    near = idn.fit_lpv(results, order=1, refine="frequency").at(150.0, 4e5)
    np.testing.assert_allclose(near.wn[:2], modes(RATES)[0], rtol=2e-3)
    with pytest.raises(idn.UnfitError, match=r"fit_lpv.refine: 'global' .* 2-rate"):
        idn.fit_lpv(results, order=1, refine="global", signals=[lambda one=one: idn.filtered(one) for one in records])


def test_a_model_and_surfaces_of_it_are_compared_on_a_record(found, grid):
    held = moved(RATES, RATED, 9)
    rows = idn.compare_models({"rates": found, "surfaces": idn.fit_lpv(grid[0], order=1)}, held).rows
    assert [row.order for row in rows] == [10, 10] and min(np.min(row.fit) for row in rows) > 0.9


@pytest.mark.parametrize("name", ["model.json", "model.mat"])
def test_files_keep_every_bit(found, tmp_path, name):
    found.model.save(tmp_path / name)
    again = idn.load_model(tmp_path / name)
    for one, other in zip((again.A, again.B, again.C), (found.model.A, found.model.B, found.model.C), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(
    "design", ["lqr", "hinf", *(pytest.param(name, marks=pytest.mark.slow) for name in ("p", "lead", "placement"))]
)
def test_laws_are_designed_on_it_and_on_surfaces_of_it(found, grid, design):
    made = getattr(rs.control, design)
    for model in (found.model, idn.fit_lpv(grid[0], order=1)):
        law = made.design(model, made.Spec(speed=0.0, pressure=3e5))
        assert rs.control.overview(law, model)["largest_pole_radius"] < 1


def test_a_closed_loop_with_pins_is_advised_to_take_it():
    data = moved(RATES, RATED, seconds=4.0)
    external = data["reference"].rename("reference_external")
    looped = data.assign(reference_external=external).assign_attrs(law="p")
    assert idn.advise(data).model == "2"
    advice = idn.advise(looped)
    assert advice.model == RATED and "take model 2-rate: pins are measured" in advice.report()


def test_the_amplitude_of_motion_has_the_velocity_of_the_disc_and_not_the_state_next_to_it():
    """x' = v + R u: by differences of the displacement; of Model 2 without rates it is v."""
    n, rng = 4000, np.random.default_rng(0)
    pins = np.cumsum(rng.normal(size=(n, 2)), axis=0) * 1e-8
    w = np.hstack([pins, np.vstack([pins[1:], pins[-1:]])])
    for kind, theta in (("rotor-rate", RATES[:18]), ("rotor", PLAIN[:14])):
        grey = GreyBox(STRUCTURES[kind], TS, "first")
        F, G, _, _ = grey.sampled(theta)
        states = np.zeros((n, len(F)))
        for k in range(n - 1):
            states[k + 1] = F @ states[k] + G @ w[k]
        problem = FitProblem(grey, w, states[:, :2], np.ones((n, 1)) / n**0.5)
        found, x = _velocity(problem, theta, states), states[:, :2]
        slope = (x[2:] - x[:-2]) / (2 * TS)
        assert np.std(found[1:-1] - slope) < 0.05 * np.std(slope)
        if kind == "rotor":
            np.testing.assert_array_equal(found, states[:, 2:4])
        else:
            assert np.std(states[1:-1, 2:4] - slope) > 5 * np.std(found[1:-1] - slope)
