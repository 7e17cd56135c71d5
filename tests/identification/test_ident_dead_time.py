"""Dead time of Model 3: found, given or none; what models with one are good for; what is refused."""

from functools import cache

import numpy as np
import pytest

import identification as idn
from identification.local.greybox import STRUCTURES, dead_times, delays, modes
from model3 import DELAYED, TRUTH, TS, model, prbs, record
from rotorsim.control.plants import design_plant, is_delayed_model_3, scaled_model
from rotorsim.control.systems import response

pytestmark = pytest.mark.numerical
KIND = "3-delay"


def late_record(seed=0, seconds=4.0, **more):
    return record(seed, seconds=seconds, theta=DELAYED, kind=KIND, **more)


@cache
def late_model(seed=0):
    return idn.identify(late_record(seed))


def shifted_record(samples, seed=0, seconds=4.0):
    """Model 3 whose reference acts whole samples later."""
    rng = np.random.default_rng(seed)
    u = prbs(rng, round(seconds / TS))
    later = np.vstack([np.zeros((samples, 2)), u[: len(u) - samples]])
    y = model().simulate(later, TS) + 0.5e-6 * rng.normal(size=u.shape)
    return idn.from_arrays(np.arange(len(u)) * TS, u, y, speed=0.0, pressure=3e5)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_dead_times_of_both_axes_are_found(seed):
    found = late_model(seed)
    assert (found.kind, found.model.order) == (KIND, 8)
    z = np.array([(v - t) / sd for (v, sd), t in zip(found.parameters.values(), DELAYED, strict=True)])
    assert np.abs(z).max() < 4
    np.testing.assert_allclose(found.dead_time, [4e-4, 8e-4], rtol=0.03)
    np.testing.assert_allclose(found.delay, delays(KIND, DELAYED), rtol=5e-3)
    np.testing.assert_allclose(found.wn, modes(TRUTH)[0], rtol=1e-3)


def test_a_true_dead_time_of_whole_samples_is_found_and_its_model_fits_another_record():
    found, other = idn.identify(shifted_record(3)), idn.filtered(shifted_record(3, seed=1))
    np.testing.assert_allclose(found.dead_time, 3 * TS, rtol=0.15)
    np.testing.assert_allclose(found.delay, 1 / TRUTH[12:] + 3 * TS, rtol=0.01)
    assert np.all(idn.fit_of(found.model, other) > idn.ceiling(other.y, other.noise) - 0.003)
    without = idn.identify(shifted_record(3), dead_time=0)
    gains = [np.diag(one.static_gain) / np.diag(model().static_gain) - 1 for one in (found, without)]
    assert np.abs(gains[0]).max() < 0.01
    assert gains[1].min() > 0.1  # one lag for all of the delay raises the gain at rest


def test_a_record_without_dead_time_gives_the_model_without():
    free, none = idn.identify(record(2, seconds=3.0)), idn.identify(record(2, seconds=3.0), dead_time=0)
    assert free.kind == none.kind == "3"
    np.testing.assert_array_equal(free.theta, none.theta)
    assert any(note.startswith("no dead time found") for note in free.notes)
    assert not any("dead time" in note for note in none.notes)
    np.testing.assert_array_equal(none.dead_time, 0)


def test_a_given_dead_time_is_kept_and_has_no_uncertainty():
    found = idn.identify(late_record(), dead_time=6e-4)
    np.testing.assert_allclose(found.dead_time, 6e-4)
    assert found.parameters["r_x"] == (2 / 6e-4, 0.0)
    assert found.parameters["p_x"][1] > 0
    free = late_model()
    assert np.all(free.fit > found.fit)


@pytest.mark.slow
def test_a_start_far_off_leads_to_the_same_dead_times():
    start = TRUTH * np.repeat([1.3**2, 1.3 * 3, 1.3**2 * 2, 1.0], [4, 4, 4, 2])
    near = late_model()
    for begin in (start, np.r_[start, 1e4, 1e4]):
        np.testing.assert_allclose(idn.identify(late_record(), start=begin).dead_time, near.dead_time, rtol=1e-3)


@pytest.mark.slow
def test_prediction_error_finds_them_too():
    found = idn.identify(late_record(3), method="pem")
    assert found.kind == KIND
    np.testing.assert_allclose(found.delay, delays(KIND, DELAYED), rtol=0.02)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"dead_time": -1e-3}, "identify.dead_time"),
        ({"dead_time": float("nan")}, "identify.dead_time"),
        ({"dead_time": "long"}, "identify.dead_time"),
        ({"dead_time": True}, "identify.dead_time"),
        ({"dead_time": None}, "identify.dead_time: None"),
        ({"dead_time": [1e-3]}, "identify.dead_time"),
        ({"dead_time": 1e-6}, "dead_time: 1e-06 .* 1e-05 to 0.005"),
        ({"dead_time": 0.02}, "dead_time: 0.02"),
        ({"dead_time": 1e-3, "model": 2}, "identify.dead_time"),
        ({"dead_time": 1e-3, "model": "blackbox"}, "identify.dead_time"),
        ({"dead_time": 1e-3, "model": STRUCTURES["3"]}, "identify.dead_time"),
    ],
)
def test_dead_times_out_of_reason_end_in_a_sentence(options, words):
    data = record(0, seconds=1.2)  # 0.8 s with excitation
    with pytest.raises(idn.UnfitError, match=words):
        idn.identify(data, **options)


def test_a_record_too_short_for_a_given_dead_time_is_refused():
    with pytest.raises(idn.UnfitError, match=r"0\.005 s .* 0\.5 s"):
        from identification.local.fits import check_dead_time

        check_dead_time(5e-3, 0.4)


def test_a_dead_time_long_for_the_modes_is_remarked():
    found = idn.identify(late_record(seconds=2.0), dead_time=2e-3)
    assert any("too much for one Pade approximation" in text for text in found.warnings)
    assert not late_model().warnings


def lpv_of(theta_at, kind=KIND):
    from dataclasses import replace

    template = idn.identify(late_record(seconds=2.0))
    local = []
    for speed in (0.0, 300.0, 600.0):
        for pressure in (3e5, 5e5, 7e5):
            theta = theta_at(speed, pressure)
            made = idn.LinearModel(*STRUCTURES[kind].matrices(theta))
            local.append(replace(template, theta=theta, speed=speed, pressure=pressure, model=made))
    return idn.fit_lpv(local, 1, refine="frequency")


def test_surfaces_files_simulation_and_designs_take_models_with_dead_time(tmp_path):
    lpv = lpv_of(lambda w, p: DELAYED * (1 + 1e-4 * w / 6 + 1e-7 * (p - 3e5)))
    lpv.save(tmp_path / "lpv.json")
    lpv = idn.load_model(tmp_path / "lpv.json")
    assert lpv.kind == KIND
    at = lpv.at(300.0, 5e5)
    wanted = DELAYED * (1 + 5e-3 + 0.02)
    np.testing.assert_allclose(lpv.derived(300.0, 5e5)["delay"], delays(KIND, wanted), rtol=1e-6)
    assert len(at.wn) == 2  # the dead time's pole is no mode
    u = prbs(np.random.default_rng(0), 3000)
    np.testing.assert_allclose(lpv.simulate(u, 300.0, 5e5, TS), at.simulate(u, TS), atol=1e-15)
    omega = np.array([600.0])
    phase = np.angle(at.transfer(omega)[0, 0, 0] / model(wanted[:14]).transfer(omega)[0, 0, 0])
    assert phase == pytest.approx(-2 * np.arctan(600 * dead_times(KIND, wanted)[0] / 2), rel=1e-6)
    whole, short = scaled_model(lpv, 300.0, 5e5), design_plant(lpv, 300.0, 5e5, 3e-4)
    assert is_delayed_model_3(whole)
    assert (whole.order, short.order) == (8, 6)
    s = 1j * np.array([0.0, 0.7])  # rad/ms
    np.testing.assert_allclose(response(short, s)[0], response(whole, s)[0], rtol=1e-9)
    turned = np.angle(response(short, s)[1, 0, 0] / response(whole, s)[1, 0, 0])
    assert turned == pytest.approx(-0.7 * 0.3, abs=0.12)  # by the loop's delay, but for the error of the approximation


def test_the_global_refinement_takes_models_with_dead_time():
    points = [(0.0, 3e5), (0.0, 7e5), (300.0, 3e5), (300.0, 7e5)]
    data = [late_record(i, 2.0, speed=w, pressure=p) for i, (w, p) in enumerate(points)]
    local = [idn.identify(one) for one in data]
    lpv = idn.fit_lpv(local, 1, refine="global", signals=[lambda d=d: idn.filtered(d) for d in data])
    assert lpv.refined == "global"
    np.testing.assert_allclose(lpv.derived(150.0, 5e5)["delay"], delays(KIND, DELAYED), rtol=0.01)


def test_records_of_which_some_have_a_dead_time_are_identified_alike(tmp_path):
    for k, data in enumerate((late_record(0, 2.0), record(1, seconds=2.0, speed=300.0))):
        idn.save(data, tmp_path / f"{k}.nc")
    from identification.campaign import identify_sources

    made, found = identify_sources(idn.survey(idn.files_of([tmp_path])), surfaces=1)
    assert made.kind == "3"
    assert all(any("other records show no dead time" in note for note in one.result.notes) for one in found)
