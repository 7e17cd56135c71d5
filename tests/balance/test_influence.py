"""Influence coefficients with correlated errors: estimates, regions, doubtful labels."""

from dataclasses import replace

import numpy as np
import pytest

from refusals import refused
from rotorsim.balance import Conditions, Plane, Reading, assess, estimate, fit_influence, leave_one_out
from rotorsim.balance.unbalance import result_rows, summary, unbalance_csv
from rotorsim.base.errors import DataError


def noise(generator, *shape):
    return (generator.standard_normal(shape) + 1j * generator.standard_normal(shape)) / np.sqrt(2)


def conditions(seed, n=30, drift=2e-6, apart=5e-8):
    """A rotor with two planes and six readings whose first unbalance drifts from one condition to the next."""
    generator = np.random.default_rng(seed)
    H = noise(generator, 6, 2)
    u = noise(generator, n, 2) * 2e-5
    along = noise(generator, 6)
    e = drift * noise(generator, n)[:, None] * along + apart * noise(generator, n, 6)
    y = 1e-5 * noise(generator, 6) + u @ H.T + e
    return Conditions(
        tuple(f"c{k}" for k in range(n)), ("",), np.full((n, 1), 100.0), y[:, None, :], u,
        tuple(Reading(f"p{k}") for k in range(6)), (Plane("a"), Plane("b")),
    )  # fmt: skip


def test_exact_vectors_give_the_exact_unbalance():
    c = conditions(1, drift=0.0, apart=1e-15)
    found = fit_influence(c.flat[1:], c.unbalance[1:])
    np.testing.assert_allclose(estimate(found, c.flat[0]).unbalance, c.unbalance[0], rtol=1e-6)


def test_a_drift_that_moves_all_probes_together_is_seen_through():
    """It leaves the plane that it does not look like: plain least squares follows it."""
    c = conditions(2)
    plain = [
        np.linalg.lstsq(f.coefficients, c.flat[i] - f.base, rcond=None)[0] - c.unbalance[i]
        for i in range(30)
        for f in [fit_influence(np.delete(c.flat, i, 0), np.delete(c.unbalance, i, 0))]
    ]
    assert leave_one_out(c).vector_rms < 0.25 * np.sqrt((np.abs(plain) ** 2).mean())


def test_regions_of_90_percent_hold_about_90_percent():
    content = np.mean([leave_one_out(conditions(seed)).content for seed in range(12)])
    assert 0.85 < content < 0.97


def test_a_wrong_label_is_named_and_no_other():
    c = conditions(3)
    u = c.unbalance.copy()
    u[7, 0] += 2e-5
    assert leave_one_out(replace(c, unbalance=u)).contradicts == ("c7",)
    assert leave_one_out(c).contradicts == ()


def test_a_speed_that_was_not_measured_makes_the_estimate_less_certain():
    c = conditions(4)
    found = fit_influence(c.flat[1:], c.unbalance[1:])
    y = c.flat[0].copy()
    y[3:] = np.nan
    assert (estimate(found, y).deviation > estimate(found, c.flat[0]).deviation).all()


def test_vectors_of_another_machine_state_widen_the_region():
    c = conditions(5)
    found = fit_influence(c.flat[1:], c.unbalance[1:])
    far = estimate(found, c.flat[0] + np.array([0, 0, 0, 0, 0, 1e-5]))
    assert far.left > 10 and (far.deviation > 2 * estimate(found, c.flat[0]).deviation).all()


@pytest.mark.parametrize("angle", [0.3, 2.0])
def test_the_origin_of_the_angles_does_not_matter(angle):
    c = conditions(6)
    turned = replace(c, vectors=c.vectors * np.exp(1j * angle))
    assert leave_one_out(turned).vector_rms == pytest.approx(leave_one_out(c).vector_rms, rel=1e-9)


def test_planes_that_were_never_changed_apart_are_refused():
    c = conditions(7)
    with refused(DataError, "unbalance"):
        fit_influence(c.flat, np.stack([c.unbalance[:, 0]] * 2, axis=1))
    with refused(DataError, "unbalance", 2):
        fit_influence(c.flat[:2], c.unbalance[:2])
    with refused(DataError, "vectors", 1):
        estimate(fit_influence(c.flat, c.unbalance), np.array([1e-6, *[np.nan] * 5]))


def runs(H, base, *weights):
    """A run without trial weights and one with each of `weights` [kg m, a row a run], without noise."""
    u = np.array([np.zeros(H.shape[1]), *weights], complex)
    y = base + u @ H.T
    readings = tuple(Reading(f"p{k}", 0.1 + 0.1 * k, 0.0) for k in range(len(base)))
    planes = tuple(Plane(f"plane {k}", 0.2 + 0.1 * k, 0.03) for k in range(H.shape[1]))
    return Conditions(tuple(f"run {k}" for k in range(len(u))), ("",), np.full((len(u), 1), 100.0), y[:, None, :], u,
                      readings, planes)  # fmt: skip


@pytest.mark.parametrize("machine", ["bently_rk4", "dtu_gas_bearing"])
def test_one_trial_weight_balances_one_plane(machine):
    """The textbook's correction is -y0 T / (y1 - y0), with T the trial weight (Friswell et al. 2010, chapter 8)."""
    y0, influence, trial = 8e-6 * np.exp(0.7j), 0.31 * np.exp(-2.1j), 2e-5 * np.exp(1.2j)
    c = runs(np.array([[influence]]), np.array([y0]), [trial])
    found = assess(machine, c)
    y1 = c.flat[1, 0]
    assert found.correction.wanted[0] == pytest.approx(-y0 * trial / (y1 - y0), rel=1e-12)
    assert abs(found.correction.after[0]) < 1e-12 * abs(y0)
    assert found.corrected == "run 0" and found.tests == {}
    assert ("Physical model", f"left out: {found.left_out}") in result_rows(found) and found.left_out
    assert "nan" not in str(result_rows(found)).lower() + str(summary(found)).lower() + unbalance_csv(found).lower()


def test_one_trial_weight_a_plane_balances_two_planes():
    """The two vectors of two planes: u = -H^-1 y0 with the columns (y_k - y0) / T_k of H."""
    generator = np.random.default_rng(3)
    H, y0 = noise(generator, 2, 2), 1e-5 * noise(generator, 2)
    c = runs(H, y0, [2e-5, 0], [0, 3e-5j])
    columns = np.column_stack([(c.flat[1] - y0) / 2e-5, (c.flat[2] - y0) / 3e-5j])
    assert assess("bently_rk4", c).correction.wanted == pytest.approx(-np.linalg.solve(columns, y0), rel=1e-9)


def test_an_unknown_run_beside_one_trial_is_estimated_without_a_deviation():
    c = runs(np.array([[0.3 + 0.1j]]), np.array([1e-6j]), [2e-5], [1e-5j])
    unknown = replace(c, unbalance=np.array([[0], [2e-5], [np.nan]], complex))
    found = assess("bently_rk4", unknown).estimates["run 2"]
    assert found.unbalance[0] == pytest.approx(1e-5j, rel=1e-9)
    assert np.isnan(found.deviation).all()


def test_repeats_equal_to_the_last_digit_do_not_make_a_matrix_singular():
    c = runs(np.array([[0.3 + 0.1j], [0.1]]), np.array([1e-6j, 2e-6]), [0], [2e-5], [2e-5], [0], [1e-5])
    unknown = replace(c, unbalance=np.array([[0], [0], [2e-5], [2e-5], [0], [np.nan]], complex))
    assert assess("bently_rk4", unknown).estimates["run 5"].unbalance[0] == pytest.approx(1e-5, rel=1e-9)


def test_a_trial_alone_is_one_run_too_few():
    c = runs(np.array([[0.3 + 0.1j]]), np.array([1e-6j]), [2e-5])
    with pytest.raises(DataError):
        assess("bently_rk4", replace(c, unbalance=np.array([[np.nan], [2e-5]])))
