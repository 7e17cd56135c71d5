"""Frequencies, unbalance response and sag against closed forms, with observed order of convergence."""

import numpy as np
import pytest

from fe_shaft import BearingElement, DiskElement, Material, Rotor, ShaftElement, modal, steel
from tests.support import shaft_closed_forms

pytestmark = pytest.mark.numerical

RAD_S = np.pi / 30  # rad/s per rpm
EULER = {"shear_effects": False, "rotary_inertia": False, "gyroscopic": False}

# Pinned-pinned, L = 1 m, d = .1 m, E = 211 GPa, G = 81.2 GPa, rho = 7810 kg/m3; modes 1, 2, 3 [rad/s].
TIMOSHENKO = {
    0.0: [(1267.286466, 1267.286466), (4901.534153, 4901.534153), (10489.581735, 10489.581735)],
    1000.0: [(1261.381956, 1273.216630), (4880.497842, 4922.635952), (10449.679736, 10529.545087)],
}
# Overhung disc on a massless cantilever; rpm: backward, forward, backward, forward [rad/s].
STODOLA = {
    0: (345.007711, 345.007711, 3501.467758, 3501.467758),
    3000: (335.466529, 354.485881, 3214.954367, 3817.112122),
    6000: (325.900819, 363.864560, 2957.170620, 4161.561092),
    30000: (252.996862, 432.068287, 1721.650308, 7754.349952),
}


def frequencies(rotor: Rotor, fixed: list[int], speed: float = 0.0) -> np.ndarray:
    """Natural frequencies with the degrees of freedom `fixed` taken out.

    Elimination, not stiff springs: a pin of 1e12 N/m is wrong by 2e-5 in the first frequency of this shaft,
    as much as the element at 20 elements, and by 1.5e-4 in the third.
    """
    free = np.setdiff1d(np.arange(rotor.ndof), fixed)
    block = np.ix_(free, free)
    values, _ = modal.oscillations(rotor.M()[block], speed * rotor.G()[block], rotor.K()[block])
    return np.abs(values)


def pinned(elements: int, speed: float = 0.0, **switches: bool) -> np.ndarray:
    """Six lowest frequencies of the pinned-pinned shaft: two a mode, backward and forward."""
    rotor = Rotor([ShaftElement(1 / elements, 0.0, 0.1, **switches) for _ in range(elements)])
    return frequencies(rotor, [0, 1, rotor.ndof - 4, rotor.ndof - 3], speed)[:6]


def order(sizes: list[int], errors: np.ndarray) -> float:
    """Slope of log error over log element length."""
    return -float(np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0])


@pytest.mark.parametrize("speed", TIMOSHENKO)
def test_closed_form_gives_the_reference_frequencies_of_the_spinning_pinned_shaft(speed):
    """Reference numbers carry ten digits."""
    for mode, expected in enumerate(TIMOSHENKO[speed], start=1):
        pair = shaft_closed_forms.timoshenko_pinned_frequencies(1.0, 0.1, steel, mode, speed)
        assert (pair.backward, pair.forward) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("speed", TIMOSHENKO)
def test_twenty_timoshenko_elements_have_the_known_small_error_in_three_modes(speed):
    """The element itself is stiff by 1.8e-5, 2.7e-4 and 1.2e-3; within 5 %, spin changes them by 1 %."""
    relative = pinned(20, speed) / np.ravel(TIMOSHENKO[speed]) - 1
    assert relative == pytest.approx(np.repeat([1.85e-5, 2.73e-4, 1.234e-3], 2), rel=0.05)


@pytest.mark.parametrize("speed", TIMOSHENKO)
def test_timoshenko_frequencies_converge_with_the_square_of_the_element_length(speed):
    """Statically exact shapes leave the shear of inertia forces inside an element out: order 2 (2.04)."""
    sizes = [10, 20, 40, 80]
    errors = np.array([pinned(n, speed) / np.ravel(TIMOSHENKO[speed]) - 1 for n in sizes])
    orders = [order(sizes, column) for column in errors.T]
    assert orders == pytest.approx([2.0] * 6, abs=0.05)


def test_euler_frequencies_converge_with_the_fourth_power_of_the_element_length():
    """Hermite cubics: fourth order; modes 2 and 3, whose errors stay above rounding (3.99, 3.98)."""
    sizes = [10, 20, 40]
    exact = [shaft_closed_forms.euler_pinned_frequency(1.0, 0.1, steel, mode) for mode in (2, 3)]
    errors = np.array([pinned(n, **EULER)[[2, 4]] / exact - 1 for n in sizes])
    assert [order(sizes, column) for column in errors.T] == pytest.approx([4.0, 4.0], abs=0.05)


def test_timoshenko_closed_form_tends_to_euler_for_a_slender_shaft():
    """Shear and rotary inertia lower the frequency by (pi d / L)^2 (1 + E / kappa G) / 32 = 1.2e-6."""
    pair = shaft_closed_forms.timoshenko_pinned_frequencies(10.0, 0.01, steel, 1)
    euler = shaft_closed_forms.euler_pinned_frequency(10.0, 0.01, steel, 1)
    assert pair.forward == pytest.approx(euler, rel=2e-6)
    assert pair.forward < euler


def test_pins_of_1e15_newton_a_metre_equal_eliminated_pins():
    """The spring's compliance is 1e-8 of the shaft's, weighted by the mode; half of it in the frequency."""
    ends = [BearingElement(0, 1e15, 0.0), BearingElement(20, 1e15, 0.0)]
    rotor = Rotor([ShaftElement(0.05, 0.0, 0.1) for _ in range(20)], [], ends)
    assert rotor.run_modal(1000.0).wn[:6] == pytest.approx(pinned(20, 1000.0), rel=2e-7)


@pytest.mark.parametrize("rpm", STODOLA)
def test_overhung_disc_on_a_massless_shaft_whirls_at_stodolas_frequencies(rpm):
    """One element is statically exact; its density of 1e-9 kg/m3 adds 1e-13 of the disc's mass."""
    feather = Material("massless", rho=1e-9, E=211e9, Poisson=0.3)
    shaft = ShaftElement(0.3, 0.0, 0.02, material=feather, shear_effects=False)
    rotor = Rotor([shaft], [DiskElement(1, 1.5, 0.001858625, 0.003675)])
    wn = frequencies(rotor, [0, 1, 2, 3], rpm * RAD_S)
    assert wn == pytest.approx(STODOLA[rpm], rel=2e-9)
    pairs = shaft_closed_forms.overhung_disc_frequencies(0.3, 0.02, 211e9, 1.5, 0.001858625, 0.003675, rpm * RAD_S)
    assert [f for pair in pairs for f in (pair.backward, pair.forward)] == pytest.approx(STODOLA[rpm], rel=2e-9)


def test_a_disc_on_an_arm_whirls_as_the_closed_form_of_its_rigid_arm():
    """Centre of gravity 40 mm beyond the end of the massless cantilever: M = [m, m a; m a, I_d + m a^2]."""
    feather = Material("massless", rho=1e-9, E=211e9, Poisson=0.3)
    shaft = ShaftElement(0.3, 0.0, 0.02, material=feather, shear_effects=False)
    rotor = Rotor([shaft], [DiskElement(1, 1.5, 0.001858625, 0.003675, offset=0.04)])
    for speed in (0.0, 300.0, 3000.0):
        pairs = shaft_closed_forms.overhung_disc_frequencies(
            0.3, 0.02, 211e9, 1.5, 0.001858625, 0.003675, speed, arm=0.04
        )
        exact = sorted(f for pair in pairs for f in (pair.backward, pair.forward))
        assert np.sort(frequencies(rotor, [0, 1, 2, 3], speed)) == pytest.approx(exact, rel=2e-9)


LAYERS = {
    "steel under titanium": (Material("titanium", 4430.0, 114e9, Poisson=0.34), True),
    "magnets, mass alone": (Material("magnets", 7500.0, 150e9, Poisson=0.24), False),
}


@pytest.mark.parametrize("name", LAYERS)
def test_layers_of_a_span_bend_as_the_sum_of_their_sections(name):
    """Composite Timoshenko shaft, pinned, spin 1000 rad/s: order 2.

    Each layer has its own static shapes, so that its shear stiffness is low by 1 / (1 + h^2 kappa G A / (12 E I)).
    """
    material, stiff = LAYERS[name]

    def layers(length, n=None):
        outer = ShaftElement(length, 0.06, 0.1, material=material, stiff=stiff, n=n)
        return [ShaftElement(length, 0.0, 0.06, material=steel, n=n), outer]

    exact = [shaft_closed_forms.layered_pinned_frequencies(layers(1.0), mode, 1000.0) for mode in (1, 2)]
    exact = [f for pair in exact for f in (pair.backward, pair.forward)]
    sizes, errors = [20, 40, 80], []
    for number in sizes:
        rotor = Rotor([one for n in range(number) for one in layers(1 / number, n)])
        assert rotor.n_nodes == number + 1
        errors.append(frequencies(rotor, [0, 1, rotor.ndof - 4, rotor.ndof - 3], 1000.0)[:4] / exact - 1)
    assert np.abs(errors[-1]).max() < 2.1e-4
    assert [order(sizes, column) for column in np.array(errors).T] == pytest.approx([2.0] * 4, abs=0.12)


def jeffcott() -> Rotor:
    """Massless simply supported shaft with a point mass and a damper in the middle.

    Pins of 1e15 N/m: their compliance is 2e-10 of the shaft's.
    """
    feather = Material("massless", rho=1e-9, E=211e9, Poisson=0.3)
    shaft = [ShaftElement(0.15, 0.0, 0.02, material=feather, shear_effects=False) for _ in range(4)]
    bearings = [BearingElement(0, 1e15, 0.0), BearingElement(2, 0.0, 30.0), BearingElement(4, 1e15, 0.0)]
    return Rotor(shaft, [DiskElement(2, 2.0, 0.0, 0.0)], bearings)


def test_jeffcott_rotor_answers_unbalance_as_the_closed_form_does():
    """Amplitudes below, at and just below resonance; the references carry seven to nine digits."""
    w = np.array([200.0, 429.106323, 400.0])
    q = jeffcott().run_unbalance_response(2, 2e-5, 0.0, w).response
    assert np.abs(q[8]) == pytest.approx([2.7746283e-6, 2.86070882e-4, 6.434245e-5], rel=1e-6)
    k = shaft_closed_forms.jeffcott_stiffness(0.6, 0.02, 211e9)
    assert q[8] == pytest.approx(shaft_closed_forms.jeffcott_unbalance(k, 2.0, 30.0, 2e-5, w), rel=1e-6)


def test_unbalance_turns_forward_from_its_phase_angle():
    """Far below resonance the shaft points along the force: at the phase angle, y 90 deg behind x."""
    q = jeffcott().run_unbalance_response(2, 2e-5, np.pi / 3, 0.1).response[:, 0]
    assert np.angle(q[8]) == pytest.approx(np.pi / 3, abs=1e-4)
    assert q[9] == pytest.approx(-1j * q[8], rel=1e-9)


def test_shaft_sags_between_its_supports_by_the_closed_form():
    """Static shape functions are exact at the nodes; supports of 1e12 N/m are taken off, 1e-8 is rounding."""
    ends = [BearingElement(0, 1e12, 0.0), BearingElement(4, 1e12, 0.0)]
    rotor = Rotor([ShaftElement(0.25, 0.0, 0.1) for _ in range(4)], [], ends)
    result = rotor.run_static()
    sag = result.displacement[1] - result.displacement[9]
    assert sag == pytest.approx(shaft_closed_forms.pinned_sag(1.0, 0.1, steel, 9.80665), rel=1e-8)
    assert result.bearing_forces == pytest.approx(np.array([[0, 1], [0, 1]]) * rotor.mass * 9.80665 / 2)
