"""Records of the virtual rig under control give the plant's own frequencies and damping."""

import numpy as np
import pytest

import rotorsim as rs
from identification.local.closed_loop import NO_BIAS
from rotorsim.control import hinf, lqr, p
from rotorsim.experiments import Prbs, controlled, prbs, without_orbit

POINT = {"speed": 300.0, "pressure": 0.5e6}


@pytest.fixture(scope="module")
def plant():
    return rs.Plant("dtu_gas_bearing", n_theta=16, n_z=8)


@pytest.fixture(scope="module")
def model(plant):
    return rs.identify(prbs(plant, **POINT, amplitude=0.5, duration=4.0), model=2).model


def law_of(name, model):
    if name == "p":
        return p.design(model, p.Spec(**POINT))
    if name == "lqr":
        return lqr.design(model, lqr.Spec(**POINT))
    return hinf.design(model, hinf.Spec(**POINT, weights=hinf.PRESETS["rig"].weights, delay=None))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "amplitude", "duration"), [("p", 0.2, 30.0), ("lqr", 0.3, 20.0), ("hinf", 0.3, 20.0)])
@pytest.mark.parametrize("seed", [1, 2])
def test_closed_loop_records_give_frequencies_within_one_percent_and_damping_within_15(
    plant, model, name, amplitude, duration, seed
):
    dither = Prbs(amplitude=amplitude, duration=duration, sequence=seed)
    calm = without_orbit(plant, law_of(name, model), **POINT)
    record = controlled(plant, calm, **POINT, duration=duration, excitations=[dither], seed=seed)
    true = plant.linearise(**POINT)
    modes = [true.mode_of_axis(axis) for axis in range(2)]
    for kind in (2, "2-rate"):
        found = rs.identify(record, model=kind)
        assert found.method == "two-stage" and found.warnings == (NO_BIAS,)
        np.testing.assert_allclose(found.wn, true.wn[modes], rtol=0.01)
        np.testing.assert_allclose(found.zeta, true.zeta[modes], rtol=0.15)


@pytest.mark.slow
def test_references_that_follow_the_orbit_are_warned_of_and_cost_accuracy(plant):
    """LQR at 6000 rpm, 0.7 MPa: frequencies."""
    point = {"speed": 628.3, "pressure": 0.7e6}
    made = rs.identify(prbs(plant, **point, amplitude=0.5, duration=4.0), model=2).model
    law, dither = lqr.design(made, lqr.Spec(**point)), Prbs(amplitude=0.3, duration=12.0, sequence=1)
    true, off = plant.linearise(**point), []
    for one, warned in ((law, True), (without_orbit(plant, law, **point), False)):
        found = rs.identify(controlled(plant, one, **point, duration=12.0, excitations=[dither], seed=1), "2-rate")
        assert any("follow the orbit with" in text for text in found.warnings) == warned
        off.append(np.abs(found.wn / true.wn[:2] - 1).max())
    assert off[1] < 0.005 < 0.008 < off[0], off


@pytest.mark.slow
def test_a_law_that_saturates_on_the_rig_is_refused_with_the_share_of_saturated_samples(plant, model):
    dither = Prbs(amplitude=1.0, duration=3.0, sequence=1)
    record = controlled(plant, law_of("p", model), **POINT, duration=3.0, excitations=[dither])
    with pytest.raises(rs.errors.UnfitError, match=r"range of 5 V in \d+ % of the samples.*excite with less"):
        rs.identify(record, model=2)
