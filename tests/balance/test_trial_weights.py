"""Balancing with few runs, in closed form: a trial weight a plane, amplitudes alone, a weight that changed nothing."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import rotorsim as rs
from rotorsim.balance import Conditions, Plane, Reading, assess, fit_amplitudes
from rotorsim.base.errors import DataError

FIRST = 8e-6 * np.exp(0.7j)
"""Vector [m] without a weight."""
EACH = 0.4 * np.exp(-2.1j)
"""Influence [m/(kg m)]."""


def made(unbalance, influence, first, phased=True):
    """Conditions of a rotor with these influences (m, q) and first vectors (m,)."""
    u = np.atleast_2d(np.asarray(unbalance, complex).T).T
    y = first + u @ np.asarray(influence).T
    n, m = y.shape
    readings = tuple(Reading(f"p{k}", phased=phased) for k in range(m))
    planes = tuple(Plane(f"plane {k}", radius=0.05) for k in range(u.shape[1]))
    values = (y if phased else np.abs(y)).reshape(n, 1, m)
    return Conditions(tuple(f"run {k}" for k in range(n)), ("",), np.full((n, 1), 300.0), values, u, readings, planes)


@pytest.mark.parametrize("phased", [True, False])
def test_the_correction_of_one_plane_is_minus_the_vector_over_the_influence(phased):
    trial = 1e-5 * np.exp(1j * np.deg2rad([40.0, 160.0, 300.0]))
    runs = np.concatenate([[0], trial if not phased else trial[:1]])
    found = assess("plain_rotor", made(runs, [[EACH]], np.array([FIRST]), phased))
    assert found.correction.wanted[0] == pytest.approx(-FIRST / EACH, rel=1e-6)
    assert abs(found.correction.after[0]) < 1e-6 * abs(FIRST)
    assert found.changes[0] == pytest.approx(1e-5 * abs(EACH / FIRST), rel=1e-6)


def test_three_runs_balance_two_planes_in_closed_form():
    influence = np.array([[0.4, 0.1j], [0.15 - 0.1j, 0.3]])
    first = np.array([5e-6, -3e-6 + 4e-6j])
    found = assess("plain_rotor", made([[0, 0], [1e-5, 0], [0, 2e-5j]], influence, first))
    assert found.correction.wanted == pytest.approx(-np.linalg.solve(influence, first), rel=1e-9)


def test_amplitudes_of_two_planes_are_tried_one_after_the_other():
    influence = np.array([[0.4, 0.1j], [0.15 - 0.1j, 0.3], [0.2, 0.2 + 0.1j]])
    first = np.array([5e-6, -3e-6 + 4e-6j, 2e-6j])
    weights = 1e-5 * np.exp(1j * np.array([0.0, 2.0, 4.0]))
    runs = np.zeros((7, 2), complex)
    runs[1:4, 0], runs[4:, 1] = weights, 2 * weights
    found = assess("plain_rotor", made(runs, influence, first, phased=False))
    expected = -np.linalg.lstsq(influence, first, rcond=None)[0]
    assert found.correction.wanted == pytest.approx(expected, rel=1e-5)


@settings(max_examples=30, deadline=None)
@given(st.floats(0, 6.28), st.floats(0, 6.28), st.floats(0.2, 2.0))
def test_four_runs_find_the_ratio_whatever_its_phase(turn, offset, size):
    """Three circles about the ends of the trial vectors meet in one point."""
    trial = 1e-5 * np.exp(1j * (offset + np.array([0, 2.1, 4.0])))
    unbalance = np.concatenate([[0], trial])[:, None]
    first = 1e-5 * size * np.exp(1j * turn)
    found = fit_amplitudes(np.abs(first + 1.0 * unbalance), unbalance)
    assert found.base[0] / found.coefficients[0, 0] == pytest.approx(first, rel=1e-5)


def test_noise_of_amplitudes_moves_the_answer_by_as_much():
    rng = np.random.default_rng(1)
    trial = np.concatenate([[0], 1e-5 * np.exp(1j * np.array([0, 2.1, 4.2]))])[:, None]
    first = 1.2e-5 * np.exp(2j)
    errors = [
        abs(f.base[0] / f.coefficients[0, 0] - first) / abs(first)
        for _ in range(50)
        for f in [fit_amplitudes(np.abs(first + trial) * (1 + 0.01 * rng.standard_normal((4, 1))), trial)]
    ]
    assert np.sqrt(np.mean(np.square(errors))) < 0.05


@pytest.mark.parametrize("noise", [0.0, 0.005])
@pytest.mark.parametrize("phased", [True, False])
def test_a_trial_weight_that_changed_nothing_is_refused_with_the_number(noise, phased):
    rng = np.random.default_rng(3)
    trial = 3e-6 * np.exp(1j * np.array([0.0, 2.0, 4.0]))
    made_ = made(
        np.concatenate([[0], trial[:1] if phased else trial]), [[0.0], [0.0]], np.array([FIRST, 2 * FIRST]), phased
    )
    shape = made_.vectors.shape
    wobble = made_.vectors * (1 + noise * rng.standard_normal(shape))
    with pytest.raises(DataError, match="plane 0: the trial weight of 3 g mm") as caught:
        assess("plain_rotor", replace(made_, vectors=wobble))
    assert caught.value.argument == "unbalance" and 0 <= caught.value.value < 0.03


@pytest.mark.parametrize("phased", [True, False])
@pytest.mark.parametrize(("times", "passes"), [(9.0, True), (23.0, False)])
def test_a_correction_of_many_trial_weights_is_refused_with_the_number(times, passes, phased):
    """A trial weight of u changes the vectors by u h, the first ones are h n u: the correction is n trial weights."""
    trial = 3e-6 * np.exp(1j * np.array([0.0, 2.0, 4.0]))
    runs = np.concatenate([[0], trial[:1] if phased else trial])
    given = made(runs, [[EACH], [EACH]], times * 3e-6 * EACH * np.array([1, 1]), phased)
    if passes:
        assert abs(assess("plain_rotor", given).correction.wanted[0]) == pytest.approx(times * 3e-6, rel=1e-3)
        return
    with pytest.raises(DataError, match="plane 0") as caught:
        assess("plain_rotor", given)
    assert caught.value.argument == "unbalance" and caught.value.value == pytest.approx(times, rel=1e-3)


def test_a_small_change_that_repeats_make_certain_is_taken():
    runs = np.array([0, 1, 0, 1, 0, 1]) * 1e-6 + 0j
    found = assess("plain_rotor", made(runs, [[0.1]], np.array([1e-5 + 0j])))
    assert found.changes[0] == pytest.approx(0.01)


@pytest.mark.parametrize(
    "runs",
    [[0, 1e-5, 1e-5j], [1e-5, 1e-5j, -1e-5, -1e-5j], [0, 1e-5, 2e-5, 3e-5]],
    ids=["two angles", "no run without", "one angle"],
)
def test_amplitudes_that_leave_two_answers_are_refused(runs):
    with pytest.raises(DataError, match="amplitudes without phase"):
        assess("plain_rotor", made(runs, [[EACH]], np.array([FIRST]), phased=False))


def test_amplitudes_with_weights_in_two_planes_at_once_are_refused():
    with pytest.raises(DataError, match="several planes"):
        fit_amplitudes(np.ones((4, 1)), 1e-5 * np.ones((4, 2), complex))


TABLE = "run,rpm,amp,U,deg\nfirst,3000,8,0,0\na,3000,{},10,0\nb,3000,{},10,120\nc,3000,{},10,240\n"
MAPPING = {
    "conditions": {"column": "run"},
    "speed": {"column": "rpm"},
    "readings": {"X": {"amplitude": "amp", "unit": "um"}},
    "planes": {"disc": {"amount": "U", "angle": "deg", "unit": "g*mm", "radius": "30 mm"}},
}


def test_a_table_of_amplitudes_alone_gives_weights(tmp_path):
    trial = 5.0 * np.exp(1j * np.deg2rad([0, 120, 240]))
    (tmp_path / "a.csv").write_text(TABLE.format(*np.abs(8 * np.exp(1j) + trial)))
    found = rs.balance.assess("plain_rotor", rs.balance.read_conditions([tmp_path / "a.csv"], MAPPING))
    ((angle, mass),) = found.correction.weights[0]
    assert mass == pytest.approx(1e-5 * 8 / 5 / 0.03, rel=1e-5)
    assert np.exp(1j * angle) == pytest.approx(-np.exp(1j), rel=1e-5)


def test_readings_with_and_without_phase_do_not_go_together(tmp_path):
    (tmp_path / "a.csv").write_text(TABLE.format(1, 2, 3))
    both = MAPPING | {"readings": MAPPING["readings"] | {"Y": {"amplitude": "amp", "phase": "deg"}}}
    with pytest.raises(DataError, match="readings 'X' have no phase"):
        rs.balance.read_conditions([tmp_path / "a.csv"], both)


def test_amplitudes_that_no_unbalance_gives_are_refused_with_the_misfit():
    """Four runs without phase are circles that meet in a point; 17, 60, 2 and 30 um do not."""
    unbalance = 1e-5 * np.array([0, 1, np.exp(2j * np.pi / 3), np.exp(-2j * np.pi / 3)])[:, None]
    with pytest.raises(DataError) as caught:
        fit_amplitudes(1e-6 * np.array([17.0, 60.0, 2.0, 30.0])[:, None], unbalance)
    assert caught.value.argument == "vectors" and caught.value.value > 0.1
