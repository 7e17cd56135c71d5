"""Records of the virtual rig under control give the plant's own frequencies and damping."""

import numpy as np
import pytest

import rotorsim as rs
from rotorsim.control import hinf, lqr, p
from rotorsim.experiments import Prbs, controlled, prbs

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
@pytest.mark.parametrize(("name", "amplitude", "duration"), [("p", 0.2, 30.0), ("lqr", 0.5, 10.0), ("hinf", 0.5, 10.0)])
@pytest.mark.parametrize("seed", [1, 2])
def test_closed_loop_records_give_frequencies_within_one_percent_and_damping_within_15(
    plant, model, name, amplitude, duration, seed
):
    dither = Prbs(amplitude=amplitude, duration=duration, sequence=seed)
    record = controlled(plant, law_of(name, model), **POINT, duration=duration, excitations=[dither], seed=seed)
    found, true = rs.identify(record, model=2), plant.linearise(**POINT)
    modes = [true.mode_of_axis(axis) for axis in range(2)]
    assert found.method == "two-stage" and not found.warnings
    np.testing.assert_allclose(found.wn, true.wn[modes], rtol=0.01)
    np.testing.assert_allclose(found.zeta, true.zeta[modes], rtol=0.15)


def test_a_law_that_saturates_on_the_rig_is_refused_with_the_share_of_saturated_samples(plant, model):
    dither = Prbs(amplitude=1.0, duration=3.0, sequence=1)
    record = controlled(plant, law_of("p", model), **POINT, duration=3.0, excitations=[dither])
    with pytest.raises(rs.errors.UnfitError, match=r"range of 5 V in \d+ % of the samples.*excite with less"):
        rs.identify(record, model=2)
