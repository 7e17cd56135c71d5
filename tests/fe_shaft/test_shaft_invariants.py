"""Invariants of rotor matrices: symmetries, rotation by 90 degrees, energy, rigid-body motions."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fe_shaft import BearingElement, DiskElement, Rotor, ShaftElement, elements
from fe_shaft.assembly import _of_shaft

pytestmark = pytest.mark.numerical

sizes = st.floats(0.01, 0.5)
ratios = st.floats(0.0, 0.95)
switches = st.fixed_dictionaries({name: st.booleans() for name in ("shear_effects", "rotary_inertia", "gyroscopic")})


def quarter_turn(nodes: int) -> np.ndarray:
    """Matrix that turns x to y and alpha to beta at every node."""
    return np.kron(np.eye(2 * nodes), [[0.0, -1.0], [1.0, 0.0]])


def isotropic() -> Rotor:
    shaft = [ShaftElement(0.1, 0.0, 0.03) for _ in range(5)]
    bearings = [BearingElement(0, 1e6, 200.0), BearingElement(4, 2e6, 100.0, kxy=3e5, kyx=-3e5)]
    return Rotor(shaft, [DiskElement(5, 2.0, 0.004, 0.007)], bearings)


@given(L=sizes, odl=sizes, ratio=ratios, switch=switches)
def test_element_matrices_have_their_symmetries_for_every_shape(L, odl, ratio, switch):
    """M = M' > 0, K = K' >= 0, G = -G', bitwise where it is a symmetry."""
    element = ShaftElement(L, ratio * odl, odl, **switch)
    M, K, G = (
        elements.mass_matrix(element),
        elements.stiffness_matrix(element),
        elements.gyroscopic_matrix(element),
    )
    assert np.array_equal(M, M.T)
    assert np.array_equal(K, K.T)
    assert np.array_equal(G, -G.T)
    scale = np.sqrt(np.diag(M))
    assert np.linalg.eigvalsh(M / np.outer(scale, scale)).min() > 0
    scale = np.sqrt(np.diag(K))
    assert np.linalg.eigvalsh(K / np.outer(scale, scale)).min() > -1e-13  # four rigid-body motions


@given(L=sizes, odl=sizes, ratio=ratios)
def test_element_neither_resists_rigid_motion_nor_misses_any_of_its_inertia(L, odl, ratio):
    """A shift has the mass; a tilt about the left end has m ((r_o^2 + r_i^2) / 4 + L^2 / 3)."""
    element = ShaftElement(L, ratio * odl, odl)
    shift = np.array([1, 0, 0, 0, 1, 0, 0, 0], dtype=float)
    tilt_x = np.array([0, 0, 0, 1, L, 0, 0, 1], dtype=float)  # beta = 1
    tilt_y = np.array([0, 0, 1, 0, 0, -L, 1, 0], dtype=float)  # alpha = 1
    M, K, G = (
        elements.mass_matrix(element),
        elements.stiffness_matrix(element),
        elements.gyroscopic_matrix(element),
    )
    for motion in (shift, tilt_x, tilt_y):
        assert np.abs(K @ motion).max() <= 1e-11 * np.abs(K).max()
    diametral = element.mass / 16 * (odl**2 + element.idl**2)
    assert shift @ M @ shift == pytest.approx(element.mass)
    assert tilt_x @ M @ tilt_x == pytest.approx(diametral + element.mass * L**2 / 3)
    assert tilt_y @ G @ tilt_x == pytest.approx(2 * diametral)  # polar inertia, at (alpha, beta)


def test_hollow_shear_coefficient_tends_to_the_solid_and_to_the_thin_tube():
    """Cowper (1966): 6 (1 + nu) / (7 + 6 nu) solid, 2 (1 + nu) / (4 + 3 nu) thin-walled."""
    nu = 0.3
    assert elements.shear_coefficient(nu) == pytest.approx(6 * (1 + nu) / (7 + 6 * nu))
    assert elements.shear_coefficient(nu, 1.0) == pytest.approx(2 * (1 + nu) / (4 + 3 * nu))


def test_rotor_matrices_have_their_symmetries(full_rotor):
    M, G, C = full_rotor.M(), full_rotor.G(), full_rotor.C()
    shaft_only = Rotor(full_rotor.shaft_elements, full_rotor.disk_elements)
    assert np.array_equal(M, M.T)
    assert np.linalg.eigvalsh(M).min() > 0
    assert np.array_equal(G, -G.T)
    assert np.array_equal(shaft_only.K(), shaft_only.K().T)
    assert np.count_nonzero(C) == 2 + 4
    assert not shaft_only.C().any()


def test_total_mass_is_that_of_a_shift_of_the_whole_rotor(full_rotor):
    shift = np.tile([1.0, 0.0, 0.0, 0.0], full_rotor.n_nodes)
    assert shift @ full_rotor.M() @ shift == pytest.approx(full_rotor.mass)


def test_matrices_are_copies_so_that_writing_into_one_does_not_change_the_rotor(full_rotor):
    for matrix in (full_rotor.M, full_rotor.G, full_rotor.K, full_rotor.C):
        before = matrix()
        matrix()[:] = 7.0
        assert np.array_equal(matrix(), before)


def test_turning_a_symmetric_rotor_by_90_degrees_changes_no_matrix():
    """Skew cross coupling is symmetric about the axis too; rounding comes from the sums only."""
    rotor = isotropic()
    T = quarter_turn(rotor.n_nodes)
    for matrix in (rotor.M(), rotor.K(), rotor.C(), rotor.G()):
        assert np.array_equal(T.T @ matrix @ T, matrix)


def test_turning_the_unbalance_by_90_degrees_turns_the_answer_by_90_degrees():
    rotor = isotropic()
    first = rotor.run_unbalance_response(5, 1e-5, 0.2, [100.0, 500.0]).response
    second = rotor.run_unbalance_response(5, 1e-5, 0.2 + np.pi / 2, [100.0, 500.0]).response
    assert np.abs(second - quarter_turn(rotor.n_nodes) @ first).max() <= 1e-11 * np.abs(first).max()


def test_turning_an_unsymmetric_rotor_with_its_load_turns_its_frequencies_with_it():
    """Swapping kxx and kyy is a turn by 90 degrees: no frequency changes; 1e-9 is rounding."""
    shaft = [ShaftElement(0.1, 0.0, 0.03) for _ in range(5)]
    one, other = (
        Rotor(shaft, [DiskElement(2, 2.0, 0.004, 0.007)], [BearingElement(n, kx, 50.0, ky) for n in (0, 5)])
        for kx, ky in ((1e6, 3e6), (3e6, 1e6))
    )
    assert one.run_modal(700.0).wn[:8] == pytest.approx(other.run_modal(700.0).wn[:8], rel=1e-9)


def test_rotors_of_one_shaft_share_its_matrices():
    """Two damped shafts in turns on five bearings each: each shaft is assembled once."""
    _of_shaft.cache_clear()
    for k in range(5):
        for length in (0.1, 0.2):
            shaft = [ShaftElement(length, 0.0, 0.03, beta=1e-5) for _ in range(5)]
            rotor = Rotor(
                shaft, [DiskElement(2, 2.0, 0.004, 0.007)], [BearingElement(n, 1e6 + k, 50.0) for n in (0, 5)]
            )
            assert rotor.C()[8, 8] > 0.0 and np.array_equal(rotor.C(), rotor.C().T)
    assert _of_shaft.cache_info()[:2] == (8, 2)


def test_unbalances_at_several_nodes_superpose(full_rotor):
    both = full_rotor.run_unbalance_response([0, 3], [1e-5, 2e-5], [0.1, 2.0], 300.0).response
    apart = sum(
        full_rotor.run_unbalance_response(n, me, phase, 300.0).response
        for n, me, phase in ((0, 1e-5, 0.1), (3, 2e-5, 2.0))
    )
    assert np.abs(both - apart).max() <= 1e-12 * np.abs(both).max()


def test_bearings_carry_the_weight_and_no_more(full_rotor):
    """Equilibrium of forces and of moments about z = 0; 1e-9 of the weight is rounding."""
    forces = full_rotor.run_static().bearing_forces
    weight = full_rotor.mass * 9.80665
    assert forces.sum(axis=0) == pytest.approx([0.0, weight], abs=1e-9 * weight)


def test_whirl_of_a_spinning_symmetric_rotor_splits_into_backward_below_forward():
    rotor = Rotor(
        [ShaftElement(0.25, 0.0, 0.05) for _ in range(6)],
        [DiskElement(2, 30.0, 0.3, 0.5)],
        [BearingElement(n, 1e6, 100.0) for n in (0, 6)],
    )
    result = rotor.run_modal(400.0)
    assert list(result.whirl[:4]) == ["backward", "forward", "backward", "forward"]
    assert np.all(np.diff(result.wn) >= 0)
    assert np.all(result.damping_ratio > 0)
    assert result.wd == pytest.approx(result.wn * np.sqrt(1 - result.damping_ratio**2))
    assert result.log_dec == pytest.approx(2 * np.pi * result.damping_ratio * result.wn / result.wd)
    turned = rotor.run_modal(-400.0)
    assert list(turned.whirl[:2]) == ["backward", "forward"]  # named by the sense of the spin


def test_plane_motion_is_mixed_whirl():
    shaft = [ShaftElement(0.25, 0.0, 0.05) for _ in range(4)]
    rotor = Rotor(shaft, [], [BearingElement(n, 1e6, 0.0, kyy=2e6) for n in (0, 4)])
    assert set(rotor.run_modal(0.0).whirl[:4]) == {"mixed"}


def test_mode_shapes_solve_the_equation_of_motion(full_rotor):
    """Residual against its largest term; 1e-8 allows for the condition of the state matrix."""
    speed = 800.0
    result = full_rotor.run_modal(speed)
    M, D, K = full_rotor.M(), full_rotor.C() + speed * full_rotor.G(), full_rotor.K()
    for value, shape in zip(result.eigenvalues[:8], result.shapes.T[:8], strict=True):
        terms = [value**2 * M @ shape, value * D @ shape, K @ shape]
        assert np.abs(sum(terms)).max() <= 1e-8 * np.abs(terms[2]).max()


def test_campbell_rows_are_the_modal_answers_and_short_rows_end_in_nan():
    """Heavy dampers swallow modes at rest that spin brings back, so that the rows have unequal lengths."""
    shaft = [ShaftElement(0.25, 0.0, 0.05) for _ in range(4)]
    rotor = Rotor(shaft, [DiskElement(0, 5.0, 0.1, 0.19)], [BearingElement(n, 1e6, 2e4) for n in (0, 4)])
    speeds = [0.0, 500.0, 1000.0]
    campbell = rotor.run_campbell(speeds, frequencies=None)
    assert np.isnan(campbell.wn).any()
    for i, speed in enumerate(speeds):
        wn = rotor.run_modal(speed).wn
        assert np.array_equal(campbell.wn[i, : len(wn)], wn)
        assert np.all(np.isnan(campbell.wn[i, len(wn) :]))
        assert np.all(campbell.whirl[i, len(wn) :] == "")


@pytest.mark.parametrize("kind", ["hysteretic", "table"])
def test_branches_with_matrices_at_their_own_frequency_are_those_of_the_rotor_without(kind):
    """Little loss, or a bearing that stiffens with the frequency of whirl, change no branch."""

    def rotor(eta, **table):
        shaft = [ShaftElement(0.1, 0.0, 0.03, eta_h=eta) for _ in range(6)]
        k, c = (1e7, 100.0) if not table else ([1e7, 1.3e7], [100.0, 100.0])
        return Rotor(shaft, [DiskElement(3, 5.0, 0.02, 0.03)], [BearingElement(n, k, c, **table) for n in (0, 6)])

    speeds = np.linspace(10.0, 600.0, 4)
    plain = rotor(0.0).run_campbell(speeds, frequencies=4)
    other = rotor(0.02) if kind == "hysteretic" else rotor(0.0, whirl_frequency=[0.0, 20_000.0])
    found = other.run_campbell(speeds, frequencies=4)
    assert np.array_equal(found.branch, plain.branch) and found.branch.max() == 3
    assert found.along_branch("wn") == pytest.approx(plain.along_branch("wn"), rel=0.02)


def test_rigid_body_motion_of_a_free_rotor_is_not_reported_as_a_mode():
    """Free-free Euler beam: first frequency 4.73004^2 sqrt(EI / rho A) / L^2; element error below 1e-5."""
    switches = {"shear_effects": False, "rotary_inertia": False, "gyroscopic": False}
    shaft = [ShaftElement(0.05, 0.0, 0.02, **switches) for _ in range(20)]
    element = shaft[0]
    exact = 4.7300407**2 * np.sqrt(211e9 * element.second_moment / (7810 * element.area))
    assert Rotor(shaft).run_modal(0.0).wn[0] == pytest.approx(exact, rel=1e-5)
