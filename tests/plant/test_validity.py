"""Range in which the film model holds: closed forms of its numbers, and where each limit is passed."""

import numpy as np
import pytest

import rotorsim as rs
from reynolds.injector import critical_ratio
from reynolds.workspace import nodal_pressure
from rotorsim.machine import Gas, GasFilm, Limits
from rotorsim.plant import range_of_validity, validity

RPM = np.pi / 30
AIR = Gas()
FILM = GasFilm(kind="gas_film", position="0 mm", diameter="40 mm", length="40 mm", clearance="25 um")


@pytest.fixture(scope="module")
def plant():
    return rs.Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)


@pytest.fixture(scope="module")
def self_acting():
    return rs.Plant(rs.load_machine("rigid_rotor_self_acting").with_({"grid.n_theta": 24, "grid.n_z": 8}))


def test_numbers_of_air_are_those_of_the_tables():
    """Speed of sound 343.2 m/s, density 1.204 kg/m^3 and mean free path 65.4 nm of air at 20 degC and 1 atm.

    The path is Jennings' (1988), from a viscosity of 18.19 uPa s, .3 % above Sutherland's.
    """
    assert validity.sound(AIR) == pytest.approx(343.2, abs=0.1)
    assert validity.density(AIR, 101325.0) == pytest.approx(1.204, abs=1e-3)
    assert validity.knudsen(AIR, AIR.mu, 101325.0, 1.0) == pytest.approx(65.4e-9, rel=6e-3)
    assert critical_ratio(AIR.kappa) == pytest.approx(0.5283, abs=1e-4)


def test_numbers_of_a_film_are_their_closed_forms():
    """At 1000 rad/s the surface moves at 20 m/s; p, c, mu by hand."""
    assert validity.surface_mach(AIR, FILM, 1000.0) == pytest.approx(20.0 / 343.2, rel=1e-3)
    assert validity.bearing_number(AIR, FILM, 1000.0) == pytest.approx(
        6 * AIR.mu * 1000.0 * 800.0**2 / 101325.0, rel=1e-12
    )
    assert validity.reduced_reynolds(AIR, FILM, 1000.0, 202650.0) == pytest.approx(
        2 * 1.204 * 20.0 * (25e-6) ** 2 / (AIR.mu * 0.02), rel=1e-3
    )
    assert validity.knudsen(AIR, AIR.mu, 202650.0, 25e-6) == pytest.approx(0.5 * 65.4e-9 / 25e-6, rel=6e-3)
    area = 2 * np.pi * 0.04 * 25e-6  # both edges
    assert validity.outflow_mach(AIR, FILM, 1.204 * area * 34.32) == pytest.approx(0.1, rel=1e-3)


def test_the_knudsen_number_is_the_largest_in_the_film(self_acting):
    """A journal near its sleeve that drags the gas out of the wide side: by hand over all nodes, edges included."""
    simulation = self_acting.start("3000 rpm", 0.0)
    a = simulation.assembly
    v, L, gas, film = a.film_part(simulation.w, 0), a.film, self_acting.machine.gas, self_acting.machine.films[0]
    x, y = v[L.journal : L.journal + 2]
    theta = np.arange(24) * 2 * np.pi / 24
    h = (film.clearance - x * np.cos(theta) - y * np.sin(theta))[:, None]
    p = nodal_pressure(a.films[0], L, v)
    path = gas.mu * np.sqrt(np.pi * gas.R * gas.temperature / 2)
    found = validity.film_numbers(simulation)[0]["knudsen"]
    assert found == pytest.approx((path / (p * h)).max(), rel=1e-9)
    assert found > 1.2 * path / (p.mean() * film.clearance)


def test_the_middle_of_a_film_sheared_at_the_speed_of_sound_is_warmer_by_what_the_module_states():
    """Couette flow between walls of one temperature: mu U^2 / (8 k), with Pr = mu cp / k = 0.7."""
    gamma, prandtl = AIR.kappa, 0.7
    heat = gamma * AIR.R / (gamma - 1)
    rise = prandtl * validity.sound(AIR) ** 2 / (8 * heat)
    assert rise / AIR.temperature == pytest.approx(0.035, abs=5e-4)


def test_feed_holes_choke_where_the_film_is_below_the_critical_ratio(plant, self_acting):
    """Narrow curtains let the plenums rise, until the flow into the film is sonic."""
    assert validity.choked_share(plant.start(100.0, 0.5e6)) == 0.0
    narrow = rs.Plant(plant.machine.replace("injection.curtain_discharge", 0.01))
    simulation = narrow.start(100.0, 0.5e6)
    a = simulation.assembly
    v, n = a.film_part(simulation.w, 0), 4
    ratio = v[a.film.local_p :][:n] / v[a.film.plenum :][:n]
    assert (ratio < critical_ratio(1.4)).all() and validity.choked_share(simulation) == 1.0
    assert validity.choked_share(self_acting.start(600.0, 0.0)) == 0.0
    limits = [(one.value, one.limit, one.unit, one.place) for one in range_of_validity(narrow, 100.0, 0.5e6)]
    assert (1.0, 0.0, "1", "film") in limits  # next to the Knudsen number of the thin film that is left


def test_the_rig_is_within_its_range_where_the_thesis_measured_it_and_beyond_elsewhere(plant):
    for speed in (0.0, 3000 * RPM, 6000 * RPM):
        assert range_of_validity(plant, speed, 0.3e6) == range_of_validity(plant, speed, 0.7e6) == []
    (fast,) = range_of_validity(plant, "12000 rpm", "0.5 MPa")
    assert (fast.name, fast.unit, fast.value) == ("speed", "rad/s", pytest.approx(12000 * RPM))
    assert fast.sentence.startswith("12000 rpm, 2 times the highest speed at which the machine's model was compared")
    assert "(6000 rpm, DTU thesis, Table E.2)" in fast.sentence
    (low,) = range_of_validity(plant, 0.0, 0.2e6)
    assert (low.name, low.limit) == ("pressure", 0.3e6) and "0.2 MPa, below the pressures" in low.sentence
    (high,) = range_of_validity(plant, 0.0, 0.9e6)
    assert high.limit == 0.7e6 and "0.9 MPa, above the pressures" in high.sentence


@pytest.mark.slow
def test_films_are_named_together_and_slip_widens_the_range_of_the_knudsen_number():
    machine = rs.load_machine("grooved_turbo_rotor").with_({"grid.n_theta": 24, "grid.n_z": 8})
    (found,) = range_of_validity(rs.Plant(machine), 9000 * RPM)
    assert (
        found.name == "Knudsen number" and found.place == "films front, rear" and "add [effects.slip]" in found.sentence
    )
    plant = rs.Plant(machine.replace("effects.slip.mean_free_path", "0.068 um"))
    assert range_of_validity(plant, 9000 * RPM) == []
    # where the effect acts in one film only, or by a thousandth of the gas' mean free path, the other limit stays
    simulation = plant.start(9000 * RPM, 0.0)
    rear = simulation.assembly.film_part(simulation.w, 1)
    rear[simulation.assembly.film.slip] *= 1e-3
    (found,) = validity.exceeded(simulation, 0.0)
    assert found.place == "film rear" and "add [effects.slip]" in found.sentence


def test_a_run_is_beyond_from_the_speed_at_which_a_limit_is_passed(plant):
    """The surface reaches the speed of sound at a / R, whatever the film does."""
    machine = plant.machine.with_({"checked": None, "limits": Limits(tip_speed="2000 m/s")})
    assembly = rs.Plant(machine).assembly
    sonic = validity.sound(machine.gas) / 0.02
    found = validity.beyond(assembly, 300.0, 1.05 * sonic, 0.5e6)
    mach = next(text for text in found if "Mach number of the surface" in text)
    rpm = float(mach.removeprefix("above ").partition(" rpm: ")[0])
    assert rpm * RPM == pytest.approx(sonic, rel=1 / 2**validity.STEPS * 1.05)
    assert validity.beyond(assembly, 300.0, 600.0, 0.5e6) == ()


@pytest.mark.slow
def test_a_limit_that_only_low_speeds_exceed_is_stated_too(plant):
    machine = rs.load_machine("grooved_turbo_rotor").with_(
        {"grid.n_theta": 24, "grid.n_z": 8, "gas.ambient_pressure": 118e3}
    )
    (found,) = validity.beyond(rs.Plant(machine).assembly, 9000 * RPM, 60000 * RPM, 0.0)
    rpm = float(found.removeprefix("below ").partition(" rpm: ")[0])
    assert 35000 < rpm < 48000 and "rpm: Knudsen number 0.0119 > 0.01" in found
    within = range_of_validity(rs.Plant(machine), 1.01 * rpm * RPM)
    (beyond,) = range_of_validity(rs.Plant(machine), 0.99 * rpm * RPM)
    assert within == [] and beyond.value == pytest.approx(0.01, rel=2e-3)


def test_a_point_without_equilibrium_is_judged_by_the_machine_alone(plant):
    """At 0.05 MPa the film does not carry the rotor."""
    (text,) = validity.beyond(plant.assembly, 0.0, 0.0, 0.05e6)
    assert text.startswith("0.05 MPa, below the pressures")


def test_a_machine_without_a_film_and_a_checked_range_exceeds_nothing():
    assert range_of_validity(rs.Plant("plain_rotor"), 600.0) == []


@pytest.mark.parametrize("share", [1.0, 2.0, float("nan")])
def test_a_pressure_below_vacuum_is_refused_wherever_a_machine_is_at_rest(share):
    machine = rs.Plant("plain_rotor")
    below = -share * machine.machine.gas.ambient_pressure
    for job in (
        lambda: machine.equilibrium(0.0, below),
        lambda: machine.linearise(0.0, below),
        lambda: rs.analysis.campbell(machine, [0.0, 100.0], below),
        lambda: rs.analysis.unbalance_response(machine, [100.0], below),
        lambda: rs.analysis.mode_shapes(machine, 0.0, below),
        lambda: rs.analysis.operating_map(machine, [0.0], [below]),
    ):
        with pytest.raises(rs.errors.DataError):
            job()
