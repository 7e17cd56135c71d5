"""Shipped designs: a spindle on aerostatic bearings, rotors on grooved and plain ones, a pump on tables."""

import numpy as np
import pytest

from fe_shaft.modal import run_modal
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.linearise import DAMPED

RPM = 2 * np.pi / 60


@pytest.mark.slow
def test_grooves_keep_the_rotor_stable_that_whirls_on_plain_bearings():
    grooved = load_machine("grooved_turbo_rotor").with_({"grid.n_theta": 24, "grid.n_z": 12})
    plain = grooved.with_({"bearings.0.grooves": None, "bearings.1.grooves": None})
    for speed in (30e3 * RPM, 150e3 * RPM):
        assert Plant(grooved).linearise(speed, 0.0).zeta.min() > 0.03
        unstable = Plant(plain).linearise(speed, 0.0)
        worst = unstable.zeta.argmin()
        assert unstable.zeta[worst] < -0.01
    assert unstable.wn[worst] < 0.5 * speed


def test_the_spindle_floats_and_stiffens_with_the_supply():
    plant = Plant(load_machine("aerostatic_spindle").with_({"grid.n_theta": 16, "grid.n_z": 8}))
    rest = [plant.equilibrium(0.0, pressure) for pressure in (0.3e6, 0.6e6)]
    weight = plant.machine.mass * 9.81
    for one in rest:
        assert one.forces[:, 1].sum() == pytest.approx(weight, rel=0.02)
        assert one.h_min > 15e-6 and one.mass_flow.shape == (32,) and (one.mass_flow > 0).all()
    assert np.abs(rest[1].journals).max() < np.abs(rest[0].journals).max()
    soft, stiff = (plant.linearise(0.0, pressure).wn.min() for pressure in (0.3e6, 0.6e6))
    assert stiff > 1.1 * soft


def test_the_rigid_rotor_whirls_at_half_its_speed_above_its_onset():
    plant = Plant(load_machine("rigid_rotor_self_acting").with_({"grid.n_theta": 24, "grid.n_z": 8}))
    below, above = (plant.linearise(speed * RPM, 0.0) for speed in (8e3, 11e3))
    assert below.zeta.min() > 0.005 and above.zeta.min() < -0.005
    assert above.wn[above.zeta.argmin()] == pytest.approx(0.5 * 11e3 * RPM, rel=0.02)


def short_bearing(speed, load=525.0, diameter=0.1, length=0.03, clearance=1e-4, viscosity=0.1):
    """Eccentricity ratio, K [N/m] and C [N s/m] of an oil bearing: Friswell et al. (2010), section 5.5.1."""
    number = diameter * speed * viscosity * length**3 / (8 * load * clearance**2)
    roots = np.roots([1, -4, 6 - number**2 * (16 - np.pi**2), -(4 + np.pi**2 * number**2), 1])
    e = np.sqrt(min(r.real for r in roots if abs(r.imag) < 1e-9 and 0 < r.real < 1))
    p, q = np.pi, 1 - e**2
    h = 1 / (p**2 * q + 16 * e**2) ** 1.5
    root = e * np.sqrt(q)
    K = [
        [4 * (p**2 * (2 - e**2) + 16 * e**2), p * (p**2 * q**2 - 16 * e**4) / root],
        [
            -p * (p**2 * q * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2)) / root,
            4 * (p**2 * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2) / q),
        ],
    ]
    across = -8 * (p**2 * (1 + 2 * e**2) - 16 * e**2)
    C = [
        [2 * p * np.sqrt(q) * (p**2 * (1 + 2 * e**2) - 16 * e**2) / e, across],
        [across, 2 * p * (p**2 * q**2 + 48 * e**2) / root],
    ]
    return e, h * load / clearance * np.array(K), h * load / (clearance * speed) * np.array(C)


def test_the_closed_form_of_an_oil_bearing_is_the_published_one():
    """Friswell et al. (2010), example 5.5.1: 1500 rpm, MN/m and kN s/m."""
    e, K, C = short_bearing(1500 * RPM)
    assert e == pytest.approx(0.2663, abs=5e-5)
    assert pytest.approx(np.array([[12.81, 16.39], [-25.06, 8.815]]), rel=5e-4) == K / 1e6
    assert pytest.approx(np.array([[232.9, -81.92], [-81.92, 294.9]]), rel=5e-4) == C / 1e3


def test_the_pumps_tables_are_those_of_its_oil_bearings_and_its_modes_those_of_the_finite_elements():
    machine = load_machine("pump_on_tables")
    for bearing in machine.bearings:
        for point in bearing.points:
            _, K, C = short_bearing(point.speed)
            assert pytest.approx(K, rel=1e-4) == point.K and pytest.approx(C, rel=1e-4) == point.C
    plant = Plant(machine.with_({"shaft.damping_ratio": 0.0}))
    for speed in (1000 * RPM, 4000 * RPM):
        model, whole = plant.linearise(speed, 0.0), run_modal(plant.assembly.mesh.rotor, speed)
        expected = np.sort(whole.wn[whole.damping_ratio < DAMPED])
        assert model.wn[:5] == pytest.approx(expected[:5], rel=1e-7)
    # oil whip: the first forward mode loses its damping where half the speed passes its frequency
    assert plant.linearise(2000 * RPM, 0.0).zeta.min() > 0 > plant.linearise(3000 * RPM, 0.0).zeta.min()


def test_the_foils_are_those_of_the_published_bumps():
    """Stiffness per area: bumps of 4.572 mm pitch, 1.778 mm half length, foil of .1016 mm (Heshmat et al. 1983)."""
    stiffness = 207e9 * (0.1016 / 1.778) ** 3 / (2 * 4.572e-3 * (1 - 0.29**2))
    machine = load_machine("foil_turbo_rotor")
    assert all(film.foil.stiffness == pytest.approx(stiffness, rel=2e-3) for film in machine.films)


@pytest.mark.slow
def test_the_rotor_on_foils_whirls_at_high_speed():
    plant = Plant(load_machine("foil_turbo_rotor").with_({"grid.n_theta": 24, "grid.n_z": 12}))
    assert plant.equilibrium(6000 * RPM, 0.0).h_min > 5e-6
    assert plant.linearise(15_000 * RPM, 0.0).zeta.min() > 0.05 > 0 > plant.linearise(24_000 * RPM, 0.0).zeta.min()


def test_the_foil_bearings_carry_the_load_of_the_published_test():
    """134 N a bearing at 30,000 rpm (Ruscitto, McCormick & Gray 1978), as the weight of a heavier and shaken rotor."""
    g = 100.0
    machine = load_machine("foil_turbo_rotor")
    wheels = 0.5 * (2 * 134.0 / g - machine.shaft.mass)
    loaded = machine.with_({"discs.0.mass": wheels, "discs.1.mass": wheels, "effects.gravity.acceleration": g})
    found = Plant(loaded).equilibrium(30_000 * RPM, 0.0)
    assert np.hypot(*found.forces.T) == pytest.approx([134.0, 134.0], rel=2e-3)
    assert 6e-6 < found.h_min < 7e-6
