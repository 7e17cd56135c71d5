"""Cones, internal coordinates, tension, torque and rotating damping against closed forms."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import jv

from fe_shaft import (
    BearingElement,
    DiskElement,
    Material,
    Rotor,
    ShaftElement,
    ShaftError,
    elements,
    modal_reduction,
    steel,
)
from tests.support import shaft_closed_forms

pytestmark = pytest.mark.numerical

EULER = {"shear_effects": False, "rotary_inertia": False, "gyroscopic": False}
TIMOSHENKO = (1267.286466, 4901.534153, 10489.581735)


def slope(sizes, errors):
    return -float(np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0])


def pinned(count, **more):
    shaft = [ShaftElement(1 / count, 0.0, 0.1, **more) for _ in range(count)]
    return Rotor(shaft, pinned=[0, count])


def test_cone_of_equal_ends_is_the_cylinder():
    cylinder, cone = ShaftElement(0.2, 0.01, 0.05), ShaftElement(0.2, 0.01, 0.05, 0.01, 0.05)
    for matrix in (elements.mass_matrix, elements.stiffness_matrix, elements.gyroscopic_matrix):
        assert np.array_equal(matrix(cylinder), matrix(cone))


def test_cone_carries_a_static_end_load_exactly():
    """Cantilever cone, d from a to b: tip deflection 64 P L^3 / (3 pi E a b^3) of bending; b clamped, P at a.

    Source: Roark's Formulas, tapered beams; the cone's 12 Gauss points integrate 1/d^4 to 1e-9 at this taper.
    """
    rotor = Rotor([ShaftElement(0.5, 0.0, 0.04, odr=0.08, **EULER)], clamped=[1])
    force = np.zeros(rotor.ndof)
    force[0] = 1000.0
    exact = 64 * 1000.0 * 0.5**3 / (3 * np.pi * 211e9 * 0.04 * 0.08**3)
    assert rotor.run_static(0.0, force).displacement[0] == pytest.approx(exact, rel=1e-8)


def test_pointed_cone_vibrates_at_kirchhoffs_frequency():
    """Full cone clamped at its base: w = 8.7192 sqrt(E I / rho A) / L^2 at the base (Kirchhoff 1879).

    With u = k z from the tip, v = J_2(2 sqrt u)/u and I_2(2 sqrt u)/u are regular at it. The tip cannot be a point:
    cut at 1 % of the length it lacks 1e-6 of the mass.
    """
    base, L, n = 0.1, 1.0, 40
    ends = base * np.linspace(0.01, 1.0, n + 1)
    shaft = [ShaftElement(L * 0.99 / n, 0.0, a, odr=b, **EULER) for a, b in pairwise(ends)]
    wn = Rotor(shaft, clamped=[n]).run_modal(0.0).wn[0]
    assert wn == pytest.approx(8.7192 * np.sqrt(211e9 / 7810) * base / 4 / L**2, rel=2e-4)
    assert jv(2, 0) == 0


def test_cone_converges_faster_than_steps_of_cylinders():
    """Against 80 cones, 8 cones are ten times closer than 8 cylinders of the mean diameter."""

    def first(count, cone):
        ends = np.linspace(0.03, 0.09, count + 1)
        pairs = [(a, b) if cone else ((a + b) / 2,) * 2 for a, b in pairwise(ends)]
        shaft = [ShaftElement(1 / count, 0.0, a, odr=b) for a, b in pairs]
        return Rotor(shaft, clamped=[0]).run_modal(0.0).wn[0]

    exact = first(80, True)
    assert abs(first(8, True) - exact) < 0.1 * abs(first(8, False) - exact)


def test_internal_coordinates_raise_the_order_from_two_to_four_and_more():
    """Three frequencies of the pinned Timoshenko shaft; reference with ten digits, so errors above 3e-10 count."""
    exact = [shaft_closed_forms.timoshenko_pinned_frequencies(1.0, 0.1, steel, mode).forward for mode in (1, 2, 3)]
    sizes = [4, 6, 8, 12]
    plain = np.array([pinned(n).run_modal(0.0).wn[:6:2] / exact - 1 for n in sizes])
    better = np.array([pinned(n, internal=True).run_modal(0.0).wn[:6:2] / exact - 1 for n in sizes])
    for mode in (1, 2):
        assert slope(sizes, plain[:, mode]) < 2.6
        assert slope(sizes, better[:, mode]) > 3.7
    assert np.all(np.abs(better[:, 1:]) < 0.1 * np.abs(plain[:, 1:]))


def test_ten_elements_with_internal_coordinates_beat_forty_without():
    """84 degrees of freedom against 164: errors of 7e-5 and 3e-4 of the third frequency."""
    usual, better = (
        pinned(n, internal=i).run_modal(0.0).wn[4] / TIMOSHENKO[2] - 1 for n, i in ((40, False), (10, True))
    )
    assert abs(better) < 0.3 * abs(usual)


def test_internal_coordinates_change_no_static_answer():
    """They are orthogonal to the static shapes in the stiffness."""
    K = elements.stiffness_matrix(ShaftElement(0.3, 0.01, 0.04, odr=0.06, internal=True))
    assert np.abs(K[:8, 8:]).max() < 1e-9 * np.abs(K).max()


@pytest.mark.parametrize("force", [-2e6, 0.0, 3e6])
def test_tension_raises_the_frequency_of_the_pinned_shaft_by_the_closed_form(force):
    """w^2 = w0^2 (1 + F L^2 / (pi^2 E I)) for an Euler shaft; its 12 elements err by 4e-6."""
    element = {"axial_force": force, **EULER}
    euler = shaft_closed_forms.euler_pinned_frequency(1.0, 0.1, steel, 1)
    ratio = 1 + force / (np.pi**2 * 211e9 * np.pi * 0.1**4 / 64)
    assert pinned(12, **element).run_modal(0.0).wn[0] == pytest.approx(euler * np.sqrt(ratio), rel=5e-6)


def test_pinned_shaft_buckles_under_greenhills_torque():
    """T = 2 pi E I / L: the determinant of K passes zero there (Greenhill 1883); 20 elements err by 1e-4."""
    EI = 211e9 * np.pi * 0.1**4 / 64

    def least(torque):
        rotor = pinned(20, torque=torque, **EULER)
        block = np.ix_(rotor.free, rotor.free)
        return np.linalg.slogdet(rotor.K()[block] / EI)[0] * np.linalg.svd(rotor.K()[block] / EI)[1][-1]

    smallest = min(np.linspace(0.95, 1.05, 41), key=lambda r: abs(least(r * 2 * np.pi * EI)))
    assert smallest == pytest.approx(1.0, abs=0.003)


def supported(eta_v=0.0, eta_h=0.0, c=0.0):
    shaft = [ShaftElement(0.127, 0.0, 0.1016, material=ZORZI, eta_v=eta_v, eta_h=eta_h) for _ in range(10)]
    return Rotor(shaft, [], [BearingElement(n, 1.75e7, c) for n in (0, 10)])


ZORZI = Material("Zorzi", rho=7833.0, E=2.068e11, Poisson=0.3)


def test_viscous_damping_of_the_shaft_destabilises_forward_whirl_above_the_first_critical_only():
    """Undamped isotropic bearings: onset exactly at the first forward critical speed (Zorzi & Nelson 1977)."""
    rotor = supported(eta_v=2e-4)
    critical = rotor.run_critical_speed(count=2)
    onset = rotor.run_stability(np.linspace(10.0, 800.0, 40))
    forward = critical.wn[critical.whirl == "forward"][0]
    assert onset.onset == pytest.approx(forward, rel=1e-6)
    assert rotor.run_modal(0.9 * forward).damping_ratio.min() > 0
    modes = rotor.run_modal(1.3 * forward)
    assert modes.whirl[modes.damping_ratio.argmin()] == "forward"


def test_shaft_on_springs_at_its_ends_has_the_frequency_of_its_closed_form():
    """Zorzi & Nelson's shaft as an Euler beam: E I b^3 (tan bl + tanh bl) = 2 k, l half the length, b the wave number.

    From v = cos(bl) cosh(bx) + cosh(bl) cos(bx), free of moment at its ends; ten elements err by 1e-6 of it.
    """
    E, rho, d, L, k = 2.068e11, 7833.0, 0.1016, 1.27, 1.75e7
    EI, mass = E * np.pi * d**4 / 64, rho * np.pi * d**2 / 4
    b = brentq(lambda b: EI * b**3 * (np.tan(b * L / 2) + np.tanh(b * L / 2)) - 2 * k, 0.1, 0.999 * np.pi / L)
    shaft = [ShaftElement(L / 10, 0.0, d, material=ZORZI, **EULER) for _ in range(10)]
    wn = Rotor(shaft, [], [BearingElement(n, k, 0.0) for n in (0, 10)]).run_modal(0.0).wn[0]
    assert wn == pytest.approx(b**2 * np.sqrt(EI / mass), rel=1e-5)


@pytest.mark.parametrize("speed", [0.0, 0.5, 0.98, 1.02, 1.6, -0.5, -1.6])
def test_hysteretic_damping_changes_its_sign_where_the_shaft_overtakes_the_whirl(speed):
    """K (1 + i eta sgn(omega - Omega)) in the undamped shape v: (Genta 2004)

    d(omega) = i eta v' K v / (2 omega v' M v - i Omega v' G v), half eta times the shaft's share of the strain energy.
    Every whirl is damped below its frequency, the shaft at rest included; the one that the shaft overtakes is driven.
    """
    eta, plain, rotor = 2e-4, supported(), supported(eta_h=2e-4)
    speed = speed * plain.run_modal(0.0).wn[0]
    undamped, modes = plain.run_modal(speed), rotor.run_modal(speed)
    for k in range(2):
        v, wn = undamped.shapes[:, k], undamped.wn[k]
        whole = np.real(v.conj() @ (2 * wn * plain.M() - 1j * speed * plain.G()) @ v)
        zeta = eta * np.real(v.conj() @ plain.parts.K @ v) / whole / wn
        overtaken = abs(speed) > wn and modes.whirl[k] == "forward"
        assert modes.damping_ratio[k] == pytest.approx(-zeta if overtaken else zeta, rel=1e-4)


def test_a_hysteretic_shaft_on_undamped_bearings_whirls_from_its_first_forward_critical_speed_on():
    """As a viscous one does: synchronous whirl is where damping ends and drive begins; at rest it is stable."""
    plain, rotor = supported(), supported(eta_h=2e-4)
    critical = plain.run_critical_speed(count=2)
    forward = critical.wn[critical.whirl == "forward"][0]
    assert rotor.run_stability(np.linspace(10.0, 800.0, 10)).onset == pytest.approx(forward, rel=1e-6)
    assert rotor.run_modal(0.0).damping_ratio.min() > 0


def test_a_hysteretic_shaft_that_turns_sags_sideways_by_its_loss_factor():
    """Kimball's experiment: static load, deflection turned by arctan eta to where the lower surface moves.

    A pinned shaft, so that all of the deflection is the shaft's; without turning there is no side.
    """
    eta, rotor = 0.01, pinned(8, eta_h=0.01)
    free, load = rotor.free, np.zeros(rotor.ndof)
    load[4 * 4 + 1] = -100.0
    for speed, side in ((0.0, 0.0), (50.0, 1.0), (-50.0, -1.0)):
        sag = np.zeros(rotor.ndof)
        sag[free] = np.linalg.solve(rotor.K(speed, 0.0)[np.ix_(free, free)], load[free])
        x, y = sag[16], sag[17]
        assert x / -y == pytest.approx(side * eta, rel=1e-9, abs=1e-12)


def test_hysteretic_damping_resists_no_synchronous_whirl_and_every_faster_one():
    """Unbalance strains an isotropic shaft constantly; at omega above Omega the stiffness is K (1 + i eta)."""
    eta, plain, rotor = 0.02, pinned(8), pinned(8, eta_h=0.02)
    speeds = np.array([0.6, 0.9, 1.3]) * plain.run_modal(0.0).wn[0]
    assert rotor.run_unbalance_response(4, 1e-3, 0.0, speeds).response == pytest.approx(
        plain.run_unbalance_response(4, 1e-3, 0.0, speeds).response, rel=1e-9, abs=1e-15
    )
    w, speed, block = speeds[2], 0.5 * speeds[2], np.ix_(plain.free, plain.free)
    Z = plain.K() * (1 + 1j * eta) - w**2 * plain.M() + 1j * w * speed * plain.G()
    at = list(plain.free).index(16)
    exact = np.linalg.inv(Z[block])[at, at]
    answer = rotor.run_freq_response([w], speed=speed, inputs=[16], outputs=[16]).response[0, 0, 0]
    assert answer == pytest.approx(exact, rel=1e-9)


def test_analyses_without_a_place_for_turning_damping_refuse_it():
    """A model in time has no hysteretic law, and matrices at rest have no circulatory part."""
    with pytest.raises(ShaftError, match="eta_h"):
        pinned(4, eta_h=0.01).run_time_response(10.0, None, np.linspace(0.0, 1e-3, 3))
    for name in ("eta_h", "eta_v"):
        with pytest.raises(ShaftError, match=name):
            modal_reduction(pinned(4, **{name: 1e-4}), {}, 2, 0.0)


def test_damping_in_bearings_pushes_the_onset_up():
    """A Jeffcott rotor with external damping c_e and internal c_i whirls from w_n (1 + c_e/c_i) on."""
    eta, m, L, d = 1e-4, 200.0, 0.6, 0.02
    light = Material("light", rho=10.0, E=211e9, Poisson=0.3)
    shaft = [ShaftElement(L / 2, 0.0, d, material=light, shear_effects=False, eta_v=eta) for _ in range(2)]
    k = shaft_closed_forms.jeffcott_stiffness(L, d, 211e9)
    c_i, c_e = eta * k, 0.5 * eta * k
    rotor = Rotor(shaft, [DiskElement(1, m, 0.5, 0.0)], [BearingElement(1, 0.0, c_e)], pinned=[0, 2])
    onset = rotor.run_stability(np.linspace(0.2, 3.0, 15) * np.sqrt(k / m)).onset
    assert onset == pytest.approx(np.sqrt(k / m) * (1 + c_e / c_i), rel=1e-4)


def test_proportional_damping_has_its_closed_form():
    """zeta = alpha / (2 w) + beta w / 2 in every mode."""
    modes = pinned(8, alpha=5.0, beta=2e-6).run_modal(0.0)
    assert modes.damping_ratio[:6] == pytest.approx(5.0 / (2 * modes.wn[:6]) + 2e-6 * modes.wn[:6] / 2, rel=1e-6)


def test_clamped_shaft_has_the_frequency_of_a_cantilever():
    """1.8751041^2 sqrt(EI / rho A) / L^2."""
    rotor = Rotor([ShaftElement(0.05, 0.0, 0.02, **EULER) for _ in range(20)], clamped=[0])
    exact = 1.8751041**2 * np.sqrt(211e9 / 7810) * 0.02 / 4
    assert rotor.run_modal(0.0).wn[0] == pytest.approx(exact, rel=1e-6)
    assert brentq(lambda x: np.cos(x) * np.cosh(x) + 1, 1.5, 2.0) == pytest.approx(1.8751041)
