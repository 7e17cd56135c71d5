"""Model-predictive control: the unlimited regulator inside its limits, and the limits kept on the model."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from rotorsim.base.errors import OtherMachine
from rotorsim.control import DesignError, lqr, mpc

pytest.importorskip("osqp")


@pytest.fixture(scope="module")
def law(model):
    """Little film is to spare, so that its limit binds."""
    return mpc.design(model, mpc.Spec(film=15.0, average=0.0))


def swing(law, plant, state, samples=300):
    """Displacement (n, 2) [um] and references (n, 2) [V] of the law's own model from a state, known to the law."""
    law.reset()
    law.state, rows, outputs = state.copy(), [], []
    for _ in range(samples):
        rows.append(plant.C @ state)
        outputs.append(law.step(1e-6 * rows[-1], 300.0, 0.5e6))
        state = plant.A @ state + plant.B @ outputs[-1]
    return np.array(rows), np.array(outputs)


def test_inside_its_limits_it_is_the_regulator(law):
    rng = np.random.default_rng(0)
    for _ in range(20):
        state = 0.1 * rng.normal(size=law.gains.plant.order)
        found, solved = law.program.solve(state)
        assert solved
        np.testing.assert_allclose(found, -law.gains.F @ state, rtol=1e-7, atol=1e-10)


def test_in_closed_loop_it_is_the_law_of_the_regulator(model):
    free = mpc.design(model, mpc.Spec(average=0.0))
    same = lqr.design(model).with_(average=0.0, fade=0.0, centre=(0.0, 0.0), plausibility=None)
    rng = np.random.default_rng(1)
    for measured in 3e-7 * rng.normal(size=(300, 2)):
        np.testing.assert_allclose(free.step(measured, 300.0, 5e5), same.step(measured, 300.0, 5e5), atol=1e-9)


def test_the_film_is_kept_where_the_regulator_does_not(law):
    """From a velocity: the regulator's disc passes `reach` by a tenth, the predictive one stops at it within 2 %."""
    plant = law.gains.plant
    state = np.zeros(plant.order)
    state[2] = 1.1 * velocity_to_reach(law)
    wide = mpc.Predictive(mpc.Spec(film=0.1, average=0.0), law.gains, mpc.Program(mpc.Spec(film=0.1), law.gains))
    free, _ = swing(wide, plant, state)
    kept, u = swing(law, plant, state)
    assert np.abs(free).max() > 1.08 * law.spec.reach
    assert np.abs(kept).max() < 1.02 * law.spec.reach and np.abs(u).max() <= law.spec.limit
    assert law.unsolved == 0


def velocity_to_reach(law):
    """Velocity x [um/ms] from which the regulator's disc just comes to `reach`."""
    plant = law.gains.plant
    state, closed = np.zeros(plant.order), plant.A - plant.B @ law.gains.F
    state[2] = 1.0
    moved = []
    for _ in range(300):
        moved.append(np.abs(plant.C @ state).max())
        state = closed @ state
    return law.spec.reach / max(moved)


def test_references_stay_within_their_limit_from_any_state(law):
    rng = np.random.default_rng(2)
    for _ in range(20):
        found, _ = law.program.solve(20 * rng.normal(size=law.gains.plant.order))
        assert np.abs(found).max() <= law.spec.limit


def test_the_same_samples_give_the_same_bits(law):
    state = np.zeros(law.gains.plant.order)
    state[:4] = 8.0, -6.0, 4.0, 3.0
    first, second = (swing(law, law.gains.plant, state, 80)[1] for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_lost_sample_is_held_and_alarmed(law):
    law.reset()
    before = law.step((1e-6, 0.0), 300.0, 5e5)
    np.testing.assert_array_equal(law.step((np.nan, 0.0), 300.0, 5e5), before)
    assert "not a number" in law.alarm and law.past_alarms.startswith("1 bad samples")


def estimate_error(law, given, bias=0.0, samples=1500):
    """Largest error [um, um/ms, V] of the estimate in the second half of a run of the model under a PRBS of 0.5 V."""
    plant, rng = law.gains.plant, np.random.default_rng(3)
    law.reset()
    rest = np.linalg.solve(np.eye(plant.order) - plant.A, plant.B @ [bias, bias])
    state, worst = rest.copy(), 0.0
    for k in range(samples):
        if given:
            law.applied(state[-2:])
        output = law.step(1e-6 * plant.C @ state, 300.0, 5e5)
        state = plant.A @ state + plant.B @ (output + bias + (0.5 * rng.choice([-1.0, 1.0], 2) if k > 500 else 0.0))
        if k > samples // 2:
            worst = max(worst, float(np.abs(law.state - (state - rest))[:-2].max()))
    return worst


@pytest.mark.parametrize("bias", [0.0, 0.4])
def test_the_estimate_follows_the_reference_that_acts_and_not_its_own_output(model, bias):
    law = mpc.design(model, mpc.Spec(average=0.1))
    assert estimate_error(law, given=True, bias=bias) < 1e-6
    assert estimate_error(law, given=False, bias=bias) > 0.1


def test_a_controller_for_another_machine_warns(model):
    law = mpc.design(replace(model, machine="my_rig 0123"))
    with pytest.warns(OtherMachine, match="law mpc: was designed on a model of my_rig"):
        law.check_machine("dtu_gas_bearing")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        law.check_machine("my_rig")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [({"film": 17.0}, "thick at rest already"), ({"horizon": 0}, "mpc.horizon"), ({"limit": 0.0}, "mpc.limit")],
)
def test_what_leaves_nothing_to_control_is_refused(model, changes, sentence):
    with pytest.raises(DesignError, match=sentence):
        mpc.design(model, mpc.Spec(**changes))


def test_another_sampling_time_is_refused(law):
    with pytest.raises(DesignError, match=r"samples every 0\.1 ms"):
        law.check_sampling(1e-4)
