"""Advice before a fit, and models held against one record."""

import numpy as np
import pytest

import identification as idn
from identification.local.greybox import delays, modes
from model3 import DELAYED, TRUTH, TS, looped_model3, made, model, record

pytestmark = pytest.mark.numerical


def test_order_and_delay_of_a_known_model_are_proposed():
    found = idn.advise(record(0, seconds=4.0))
    assert found.order in (6, 7)  # six states, of which the subspace method needs one more in noise
    assert found.fits[found.orders.index(4)].mean() < found.fits[found.orders.index(6)].mean()
    assert found.delay == pytest.approx(np.mean(1 / TRUTH[12:]), rel=0.15)
    assert found.peak == pytest.approx(modes(TRUTH)[0].mean(), rel=0.05)
    assert found.model == "3"
    assert "take model 3" in found.report()


def test_a_dead_time_adds_to_the_delay():
    found = idn.advise(record(0, seconds=4.0, theta=DELAYED, kind="3-delay"))
    assert found.delay == pytest.approx(np.mean(delays("3-delay", DELAYED)), rel=0.15)
    assert found.dead_time > 0


def test_the_model_follows_from_pins_and_delay():
    at_once = record(1, seconds=3.0, theta=TRUTH[:12], kind="1")
    assert idn.advise(at_once).model == "1"
    u = at_once.reference.values
    pins = 1e-6 * np.column_stack([u[:, 1], u[:, 0], -u[:, 1], -u[:, 0]])
    assert idn.advise(record(1, seconds=3.0, pin=pins)).model == "2"


def test_a_record_of_a_controller_is_remarked_and_a_short_one_refused():
    named = record(0, seconds=3.0).assign_attrs(controller="pid")
    assert any("closed loop" in text for text in idn.advise(named).sentences)
    with pytest.raises(idn.UnfitError, match="with excitation"):
        idn.advise(record(0, seconds=1.0))


def test_a_closed_loop_with_its_external_reference_is_seen_in_two_stages():
    u, external, y = looped_model3(1, 1e5, n=30000)
    data = made(u, y, reference_external=external).assign_attrs(law="p")
    found = idn.advise(data)
    assert "closed loop: seen in two stages" in found.report()
    assert "may be far off" not in found.report()
    assert found.order in (6, 7)
    assert found.peak == pytest.approx(modes(TRUTH)[0].mean(), rel=0.1)
    assert found.delay == pytest.approx(np.mean(1 / TRUTH[12:]), rel=0.15)
    assert "may be far off" in idn.advise(data.drop_vars("reference_external")).report()


def test_gaps_are_left_out_of_advice_and_comparison():
    whole, holed = record(0, seconds=5.0), record(0, seconds=5.0)
    holed["disc_measured"].values[6000:6003] = np.nan
    found = idn.advise(holed)
    assert found.order in (6, 7) and any("longest stretch, 18997 samples" in text for text in found.sentences)
    a, b = (idn.compare_models({"truth": model()}, one) for one in (whole, holed))
    np.testing.assert_allclose(b.rows[0].fit, a.rows[0].fit, atol=2e-3)
    with pytest.raises(idn.UnfitError, match="lowpass"):
        idn.compare_models({"truth": model()}, holed, settings=idn.Prefilter(lowpass=800.0))


def test_models_are_ordered_by_their_fit_of_the_held_out_record():
    data, held = record(0, seconds=3.0), record(1, seconds=3.0)
    found = {kind: idn.identify(data, kind) for kind in ("3", "1")}
    table = idn.compare_models({"none": found["1"], "lag": found["3"], "truth": model()}, held)
    assert [row.name for row in table.rows][-1] == "none"
    best = {row.name: row for row in table.rows}
    np.testing.assert_allclose(best["lag"].fit, table.ceiling, atol=0.005)
    np.testing.assert_allclose(best["truth"].static_gain, model().static_gain)
    assert not best["lag"].remark
    text = table.report()
    assert "noise ceiling" in text
    assert len(text.splitlines()) == 5


def test_models_of_another_point_are_remarked_and_unfit_ones_refused():
    data = record(0, seconds=3.0)
    found = idn.identify(data)
    moved = idn.compare_models({"one": found}, record(1, seconds=3.0, speed=300.0))
    assert "another operating point" in moved.report()
    with pytest.raises(idn.ModelError, match="no models"):
        idn.compare_models({}, data)
    with pytest.raises(idn.ModelError, match="is a str"):
        idn.compare_models({"file": "model.json"}, data)
    with pytest.raises(idn.ModelError, match="1 inputs and 1 outputs"):
        one = idn.LinearModel(-np.eye(1), np.eye(1), np.eye(1), np.zeros((1, 1)))
        idn.compare_models({"one": one}, data)
    with pytest.raises(idn.ModelError, match="is unstable"):
        worse = TRUTH.copy()
        worse[4:8] *= -1
        idn.compare_models({"worse": model(worse)}, data)
    assert TS == 2e-4
