"""Modal reduction: exact with all modes, accurate with six per plane, correct signs and couplings."""

import numpy as np
import pytest

from fe_shaft import BearingElement, Rotor, modal, modal_reduction

pytestmark = pytest.mark.numerical

SPRING = 4e6  # N/m, nominal gas bearing


def reduced_frequencies(reduced, node, support, speed):
    """Frequencies of the reduced rotor on a support of (k, c) at the node."""
    k, c = support
    s = reduced.shape(node)
    D = reduced.C + speed * reduced.G + c * s.T @ s
    values, _ = modal.oscillations(np.eye(len(reduced.K)), D, reduced.K + k * s.T @ s)
    return np.abs(values)


def receptance(M, D, K, shape, w):
    """Displacement of a node for unit forces on it (n_w, 2, 2) [m/N]."""
    return np.array([shape @ np.linalg.solve(K + 1j * x * D - x**2 * M, shape.T) for x in w])


def on_gas_bearing(rig, stiffness, damping=0.0):
    bearings = [*rig.rotor.bearing_elements, BearingElement(rig.gas, stiffness, damping)]
    return Rotor(rig.rotor.shaft_elements, rig.rotor.disk_elements, bearings)


def test_reduction_with_all_modes_keeps_every_frequency(full_rotor):
    """A change of coordinates only; 1e-7 is rounding, since the highest frequency is 1e4 times the lowest."""
    n = 2 * full_rotor.n_nodes
    reduced = modal_reduction(full_rotor, {3: SPRING}, n, 0.0)
    expected = full_rotor.run_modal(600.0).wn
    assert reduced_frequencies(reduced, 3, (0.0, 0.0), 600.0) == pytest.approx(expected, rel=1e-7)


def test_reduced_mass_is_the_identity_in_both_planes_and_planes_stay_apart(full_rotor):
    reduced = modal_reduction(full_rotor, {3: SPRING}, 6, 0.01)
    assert np.abs(reduced.Phi.T @ full_rotor.M() @ reduced.Phi - np.eye(12)).max() < 1e-12
    rows = np.arange(full_rotor.ndof) % 4
    assert not reduced.Phi[np.isin(rows, (1, 2)), :6].any()
    assert not reduced.Phi[np.isin(rows, (0, 3)), 6:].any()


def test_reduced_stiffness_leaves_the_nominal_spring_out(rig):
    r = rig()
    reduced = modal_reduction(r.rotor, {r.gas: SPRING}, 6, 0.0)
    s = reduced.shape(r.gas)
    with_spring = np.diag(reduced.frequencies**2)
    assert np.abs(reduced.K + SPRING * s.T @ s - with_spring).max() < 1e-9 * with_spring.max()


def test_modes_of_an_unsupported_node_need_no_spring(rig):
    """Without a node the modes are those of the rotor on its own bearings, so K is diagonal."""
    rotor = rig(gas_stiffness=SPRING).rotor
    reduced = modal_reduction(rotor, {}, 4, 0.0)
    assert np.abs(reduced.K - np.diag(reduced.frequencies**2)).max() < 1e-9 * reduced.K.max()
    assert reduced.frequencies[:4] == pytest.approx(rotor.run_modal(0.0).wn[:8:2], rel=1e-7)


def test_damping_is_that_of_the_bearings_plus_that_of_the_modes(full_rotor):
    plain = modal_reduction(full_rotor, {3: SPRING}, 5, 0.0)
    damped = modal_reduction(full_rotor, {3: SPRING}, 5, 0.02)
    np.testing.assert_allclose(plain.C, plain.Phi.T @ full_rotor.C() @ plain.Phi, rtol=1e-9, atol=1e-9)
    extra = damped.C - plain.C
    np.testing.assert_allclose(extra, np.diag(0.04 * plain.frequencies), rtol=1e-9, atol=1e-9)


def test_cross_coupling_between_the_planes_stays_in_the_reduced_matrices(full_rotor):
    """Also with bearings that are not symmetric: the blocks are projections of the rotor's own."""
    reduced = modal_reduction(full_rotor, {3: SPRING}, 6, 0.0)
    x, y = reduced.Phi[:, :6], reduced.Phi[:, 6:]
    assert reduced.K[:6, 6:] == pytest.approx(x.T @ full_rotor.K() @ y)
    assert np.abs(reduced.K[:6, 6:] + reduced.K[6:, :6].T).max() > 0
    assert np.allclose(reduced.G, -reduced.G.T, rtol=0, atol=1e-12)


def test_both_planes_of_a_symmetric_rotor_have_the_same_modes_with_the_same_sign(rig):
    """A turn by 90 degrees, x to y and alpha to beta, must change nothing, signs included."""
    r = rig()
    reduced = modal_reduction(r.rotor, {r.gas: SPRING}, 6, 0.0)
    x, y = reduced.Phi[:, :6].reshape(-1, 4, 6), reduced.Phi[:, 6:].reshape(-1, 4, 6)
    assert y[:, 1] == pytest.approx(x[:, 0])
    assert y[:, 2] == pytest.approx(-x[:, 3])


@pytest.mark.parametrize("element", [0.025, 0.0125, 0.00625])
def test_signs_of_the_modes_do_not_depend_on_the_mesh(rig, element):
    """Modes at disc and gas bearing against a fine mesh: 6e-4, 1.5e-4, 3e-5 of the largest."""
    fine, r = rig(element=0.003125), rig(element=element)
    expected = modal_reduction(fine.rotor, {fine.gas: SPRING}, 6, 0.0)
    reduced = modal_reduction(r.rotor, {r.gas: SPRING}, 6, 0.0)
    for name in ("gas", "disc"):
        shape, reference = reduced.shape(getattr(r, name)), expected.shape(getattr(fine, name))
        assert np.abs(shape - reference).max() < 1e-3 * np.abs(reference).max()


@pytest.mark.parametrize("speed", [0.0, 628.3])
@pytest.mark.parametrize("stiffness", [2e6, 4e6, 8e6])
def test_six_modes_a_plane_give_the_first_frequencies_for_every_film_stiffness(rig, speed, stiffness):
    """First six frequencies within 3e-4: 2.5e-4 at half and 1.5e-4 at twice the nominal stiffness."""
    r = rig()
    reduced = modal_reduction(r.rotor, {r.gas: SPRING}, 6, 0.0)
    expected = on_gas_bearing(r, stiffness).run_modal(speed).wn[:6]
    assert reduced_frequencies(reduced, r.gas, (stiffness, 0.0), speed)[:6] == pytest.approx(expected, rel=3e-4)


def gas_node_error(r, n_modes, stiffness):
    """Largest error of the gas node's receptance up to 400 Hz, over the largest receptance."""
    w = 2 * np.pi * np.linspace(0.0, 400.0, 81)
    full, speed = on_gas_bearing(r, stiffness, 1000.0), 628.3
    unit = np.eye(full.ndof)[4 * r.gas : 4 * r.gas + 2]
    exact = receptance(full.M(), full.C() + speed * full.G(), full.K(), unit, w)
    reduced = modal_reduction(r.rotor, {r.gas: SPRING}, n_modes, 0.0)
    s = reduced.shape(r.gas)
    D = reduced.C + speed * reduced.G + 1000.0 * s.T @ s
    close = receptance(np.eye(2 * n_modes), D, reduced.K + stiffness * s.T @ s, s, w)
    return np.abs(close - exact).max() / np.abs(exact).max()


@pytest.mark.parametrize(("stiffness", "limit"), [(2e6, 4e-3), (4e6, 5e-4), (8e6, 8e-3)])
def test_six_modes_a_plane_give_the_receptance_of_the_gas_node(rig, stiffness, limit):
    """Within 2.6e-3, 2.7e-4, 5.3e-3 of its peak up to 400 Hz at 6000 rpm; limits are half as much again."""
    r = rig()
    errors = [gas_node_error(r, n, stiffness) for n in (4, 6, 10)]
    assert errors[1] < limit
    assert errors[0] > errors[1] > errors[2]


def test_six_modes_a_plane_carry_the_static_load_of_the_gas_bearing(rig):
    """Reduced rest position under gravity against the full one; 1e-4 is what the six modes leave out."""
    r = rig(gas_stiffness=None)
    reduced = modal_reduction(r.rotor, {r.gas: SPRING}, 6, 0.012)
    s = reduced.shape(r.gas)
    eta = np.linalg.solve(reduced.K + SPRING * s.T @ s, -9.80665 * reduced.body()[1])
    expected = rig(gas_stiffness=SPRING).rotor.run_static().bearing_forces[1]
    assert -SPRING * s @ eta == pytest.approx(expected, rel=1e-4)


def test_participation_of_all_modes_is_the_rotors_mass(full_rotor):
    reduced = modal_reduction(full_rotor, {3: SPRING}, 2 * full_rotor.n_nodes, 0.0)
    assert reduced.body() @ reduced.body().T == pytest.approx(full_rotor.mass * np.eye(2), abs=1e-10)


@pytest.mark.parametrize("stiffness", [0.1 * SPRING, 10 * SPRING])
def test_deflections_of_loads_are_exact_on_another_support(rig, stiffness):
    """The deflection on another spring is a sum of two that are kept: of the load, and of the force of the spring."""
    r = rig()
    at, loads = 4 * r.gas + np.arange(2), np.zeros((r.rotor.ndof, 1))
    loads[at] = 1.0
    K = r.rotor.K()
    K[at, at] += stiffness
    whole = np.linalg.inv(K)[at, at]

    def found(reduced):
        assert np.abs(reduced.Phi.T @ r.rotor.M() @ reduced.Phi - np.eye(len(reduced.K))).max() < 1e-9
        s = reduced.shape(r.gas)
        return np.diag(s @ np.linalg.solve(reduced.K + stiffness * s.T @ s, s.T))

    np.testing.assert_allclose(found(modal_reduction(r.rotor, {r.gas: SPRING}, 2, 0.0, loads)), whole, rtol=1e-7)
    without = found(modal_reduction(r.rotor, {r.gas: SPRING}, 3, 0.0))
    assert np.abs(without / whole - 1).min() > 1e-4
