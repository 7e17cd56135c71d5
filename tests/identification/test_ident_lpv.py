"""LPV surfaces: exactness, order selection, files, moving scheduling, extrapolation, refinement."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import identification as idn
from identification.local.greybox import STRUCTURES
from identification.local.models import LinearModel
from model3 import TRUTH, TS, prbs, record
from refusals import refused

pytestmark = pytest.mark.numerical

CROSS = [1, 2, 9, 10]
SPEEDS, PRESSURES = np.linspace(0, 600, 5), np.linspace(3e5, 7e5, 4)


def theta_at(speed, pressure, cubic=0.0):
    """Parameters that are second-order polynomials of the operating point, and a cubic part."""
    a, b = speed / 600, (pressure - 3e5) / 4e5
    change = np.ones(14)
    change[:4] += 0.3 * b + 0.02 * a * a
    change[4:8] -= 0.4 * b - 0.1 * a * b + cubic * a**3
    change[8:] += 0.2 * b * b - 0.05 * a
    theta = TRUTH * change
    theta[CROSS] = TRUTH[CROSS] * a * (1 + 0.1 * b)  # the product with `change` would be of third order
    return theta


@pytest.fixture(scope="module")
def template():
    return idn.identify(record(0, seconds=2.0))


def test_models_keep_the_machine_of_their_records_and_files_too(template, tmp_path):
    made = record(0, seconds=2.0)
    assert (template.model.machine, idn.identify(made).model.to_dict().get("machine")) == ("", None)
    known = made.assign_attrs(machine='name = "my_rig"\n', machine_hash="0123")
    found = idn.identify(known)
    assert found.model.machine == "my_rig 0123"
    for attrs in ({"machine": "not [toml"}, {"machine_hash": ""}):
        assert idn.identify(known.assign_attrs(attrs)).model.machine == ""
    found.model.save(tmp_path / "model.json")
    assert idn.load_model(tmp_path / "model.json").machine == "my_rig 0123"
    local = [replace(one, model=found.model) for one in results(template)]
    lpv = idn.fit_lpv(local)
    assert lpv.machine == lpv.at(300.0, 5e5).machine == "my_rig 0123"
    for name in ("lpv.json", "lpv.mat"):
        lpv.save(tmp_path / name)
        assert idn.load_model(tmp_path / name).machine == "my_rig 0123"
    mixed = [replace(local[0], model=replace(found.model, machine="b 1")), *local[1:]]
    assert idn.fit_lpv(mixed).machine == "" and "machine" not in idn.fit_lpv(mixed).to_dict()


def results(template, cubic=0.0, noise=0.0):
    rng = np.random.default_rng(0)
    made = []
    for w, p in product(SPEEDS, PRESSURES):
        theta = theta_at(w, p, cubic) * (1 + noise * rng.normal(size=14))
        local = LinearModel(*STRUCTURES["3"].matrices(theta))
        made.append(replace(template, theta=theta, speed=float(w), pressure=float(p), model=local))
    return made


def test_second_order_surfaces_are_exact_for_second_order_parameters(template):
    lpv = idn.fit_lpv(results(template))
    for w, p in ((137.0, 4.4e5), (600.0, 7e5)):
        np.testing.assert_allclose(lpv.theta(w, p), theta_at(w, p), rtol=1e-9, atol=1e-9)
    assert np.all(lpv.rms_hold_out < 1e-6 * np.abs(TRUTH))


def test_the_order_is_chosen_by_hold_out(template):
    assert idn.fit_lpv(results(template, noise=1e-3), "hold-out").order == 2
    assert idn.fit_lpv(results(template, cubic=0.3), "hold-out").order == 3


def test_a_model_survives_its_file(template, tmp_path):
    lpv = idn.fit_lpv(results(template))
    lpv.save(tmp_path / "lpv.json")
    again = idn.load_model(tmp_path / "lpv.json")
    assert again.to_dict() == lpv.to_dict()
    local = lpv.at(300.0, 5e5)
    local.save(tmp_path / "local.json")
    back = idn.load_model(tmp_path / "local.json")
    assert np.array_equal(back.A, local.A)
    assert (back.speed, back.pressure, back.Ts) == (300.0, 5e5, 0.0)


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"kind": "lpv"}', '{"kind": "linear"}'])
def test_a_file_that_is_no_model_ends_in_a_sentence(tmp_path, text):
    (tmp_path / "bad.json").write_text(text)
    with pytest.raises(idn.ModelError, match="model"):
        idn.load_model(tmp_path / "bad.json")


def test_extrapolation_is_warned_of_and_marked(template):
    lpv = idn.fit_lpv(results(template))
    assert not lpv.at(300.0, 5e5).extrapolated
    with pytest.warns(idn.ExtrapolationWarning, match="rad/s"):
        assert lpv.at(900.0, 5e5).extrapolated


def test_too_few_points_are_refused(template):
    few = results(template)
    with pytest.raises(idn.UnfitError, match="pressures, order 2 needs 3"):
        idn.fit_lpv([r for r in few if r.pressure < 4.5e5])
    with refused(idn.UnfitError, "order", 2):
        idn.fit_lpv([few[i] for i in (0, 5, 10, 15, 19)])
    line = idn.fit_lpv([r for r in few if r.pressure < 3.1e5])
    assert line.basis.exponents.tolist() == [[0, 0], [1, 0], [2, 0]]


def test_frozen_scheduling_simulates_the_frozen_model_and_a_ramp_ends_like_it(template):
    lpv = idn.fit_lpv(results(template))
    u = prbs(np.random.default_rng(1), 5000)
    frozen = lpv.at(300.0, 5e5).simulate(u, TS)
    np.testing.assert_allclose(lpv.simulate(u, 300.0, 5e5, TS), frozen, atol=1e-15)
    speed = np.interp(np.arange(5000), [0, 2000], [0.0, 300.0])
    moving = lpv.simulate(u, speed, 5e5, TS)
    assert np.abs(moving[4500:] - frozen[4500:]).max() < 1e-9
    with pytest.raises(idn.ModelError, match="5000 samples"):
        lpv.simulate(u, np.zeros(3), 5e5, TS)


def test_the_frequency_refinement_brings_responses_closer(template):
    local = results(template, cubic=0.3)
    points, values = np.array([(r.speed, r.pressure) for r in local]), np.array([r.theta for r in local])
    plain, refined = (idn.fit_lpv(local, 2, refine=name) for name in ("none", "frequency"))
    before, after = (np.sum(idn.distance(m, points, values) ** 2) for m in (plain, refined))
    assert after < 0.95 * before


def test_the_global_refinement_finds_surfaces_from_records(template):
    points = [(w, p) for w in (0.0, 300.0, 600.0) for p in (3e5, 7e5)]
    data = [record(i, seconds=2.0, theta=theta_at(w, p), speed=w, pressure=p) for i, (w, p) in enumerate(points)]
    local = [replace(idn.identify(d), speed=w, pressure=p) for d, (w, p) in zip(data, points, strict=True)]
    loads = [lambda d=d: idn.filtered(d) for d in data]
    lpv = idn.fit_lpv(local, 1, refine="global", signals=loads)
    plain = idn.fit_lpv(local, 1)

    def fit(m):
        return np.mean([idn.fit_of(m.at(*q), load()) for q, load in zip(points, loads, strict=True)])

    assert fit(lpv) > fit(plain)


@pytest.mark.slow
def test_black_box_models_in_one_basis_keep_their_responses_and_interpolate_worse(template):
    black = []
    for i, (w, p) in enumerate(product((0.0, 300.0, 600.0), (3e5, 5e5, 7e5))):
        found = idn.identify(record(i, seconds=3.0, theta=theta_at(w, p)), "blackbox", 6)
        black.append(replace(found, speed=w, pressure=p))
    same = idn.coherent_basis([r.model for r in black])
    omega = np.linspace(200, 1200, 20)
    for one, r in zip(same, black, strict=True):
        wanted = r.model.transfer(omega)
        assert np.linalg.norm(one.transfer(omega) - wanted) < 1e-6 * np.linalg.norm(wanted)
    lpv = idn.fit_lpv(black, 2)
    assert lpv.at(150.0, 4e5).Ts == pytest.approx(TS)


def test_a_model_becomes_controls_state_space(template):
    control = pytest.importorskip("control")
    lpv = idn.fit_lpv(results(template))
    made, own = lpv.to_control(300.0, 5e5), lpv.at(300.0, 5e5)
    assert isinstance(made, control.StateSpace)
    np.testing.assert_allclose(made(700j), own.transfer(700.0)[0], rtol=1e-9)


def test_surfaces_of_models_with_dead_times():
    """Model 3 as `identify` gives it by default."""
    import model3

    results = []
    for speed in (0.0, 200.0, 400.0):
        record = model3.record(int(speed), seconds=2.0, theta=model3.DELAYED, kind="3-delay")
        results.append(replace(idn.identify(record, 3), speed=speed, pressure=5e5))
    assert {one.kind for one in results} == {"3-delay"}
    lpv = idn.fit_lpv(results, order=1)
    assert lpv.at(200.0, 5e5).order == 8
