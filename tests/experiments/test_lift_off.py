"""Self-acting machines from rest on their sleeves: static depth, friction, lift-off at W(e), touch-down, energy."""

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import brentq

import rotorsim as rs
from rotorsim.base.errors import NoLiftOffError
from rotorsim.experiments.summary import lift_off, summarise_experiment
from rotorsim.plant import Plant

ASPERITY, STIFFNESS, FRICTION, RADIUS = 2.4e-6, 200e6, 0.1, 0.02
LOAD = 0.67744 * 101325.0 * 0.04 * 0.04
"""Load [N] of a film of L/D = 1 at bearing number 1 and eccentricity ratio 0.8, by a spectral solution."""
LIFTS = 101325.0 * 12e-6**2 / (6 * 18.5e-6 * RADIUS**2)
"""Speed [rad/s] of bearing number 1."""


@pytest.fixture(scope="module")
def plant():
    """A rigid rotor of two bearings that touch at an eccentricity ratio of 0.8 and carry `LOAD` each."""
    machine = rs.load_machine("rigid_rotor_self_acting")
    contact = {"stiffness": "200 MN/m", "friction": FRICTION, "damping": "1 s/m", "asperity": "2.4 um"}
    return Plant(
        machine.with_(
            {
                "effects.contact": contact,
                "effects.gravity": {"acceleration": f"{2 * LOAD / machine.mass!r} m/s^2"},
                "effects.unbalance.me": "0 g*mm",
                "drive.speed_recovery_time": "10 ms",
            }
        ),
        dt=2e-4,
    )


@pytest.fixture(scope="module")
def up(plant):
    """Run-up from standstill."""
    return rs.experiments.runup(plant, 0.0, 400.0, 400.0)


@pytest.fixture(scope="module")
def down(plant):
    """Coast-down from just above lift-off to standstill."""
    return rs.experiments.coastdown(plant, 345.0, 0.0, longest=10.0)


def test_a_shaft_that_a_ramp_stops_ends_at_standstill_and_does_not_turn_back(plant):
    """Friction and the drive's delay would turn it back at the end of the ramp."""
    made = rs.experiments.coastdown(plant, 345.0, 0.0, rate=400.0)
    speed = made["speed"].values
    assert speed[-1] <= 0 < speed[-2] and made.sizes["time"] <= round(345.0 / 400.0 / plant.machine.sampling_time)
    ends = summarise_experiment(made)["speed_rpm"]
    assert ends["last"] == 0.0 and ends["first"] == pytest.approx(345.0 * 30 / np.pi, rel=1e-3)


def test_at_standstill_the_journals_rest_on_their_sleeves_as_deep_as_their_weight_presses(plant):
    """Depth W / k of each below the asperities, to 2e-4 by the modes left out; the gas is at ambient pressure."""
    start = plant.start(0.0)
    a = plant.assembly
    for k in range(2):
        film = a.film_part(start.w, k)
        x, y = film[a.film.journal : a.film.journal + 2]
        assert -y - (12e-6 - ASPERITY) == pytest.approx(LOAD / STIFFNESS, rel=5e-4) and abs(x) < 1e-12
        assert start.film_pressure(k) == pytest.approx(101325.0, rel=1e-12)
    rows, _ = plant.inputs(0.02, 0.0, 0.0)
    still = start.advance(rows)[:, 2:4]
    assert np.ptp(still, axis=0).max() < 1e-11


def test_a_slow_shaft_is_braked_by_dry_friction_at_the_radius(up):
    """mu W R of both bearings before the film carries; the journal that climbs the sleeve takes 1 % off at 10 rad/s."""
    slow = (up["speed"].values > 0.5) & (up["speed"].values < 3.0)
    assert np.median(up["friction_torque"].values[slow]) == pytest.approx(FRICTION * 2 * LOAD * RADIUS, rel=0.01)


def test_the_shaft_lifts_off_where_its_film_carries_it_at_the_asperities(plant, up):
    """The speed of this grid within 1 %, 2 % above that of the converged film, which 32 x 16 cells miss by as much."""
    of_grid = brentq(lambda speed: plant.equilibrium(speed).h_min - ASPERITY, 300.0, 380.0, xtol=0.01)
    found = lift_off(up)
    speed = found["lift_off"]["rpm"] * np.pi / 30
    assert speed == pytest.approx(of_grid, rel=0.01) and speed == pytest.approx(LIFTS, rel=0.035)
    assert set(found) == {"lift_off"}
    after = up["contact"].values[up["time"].values > found["lift_off"]["time_s"]]
    assert not after.any() and up["contact"].values.any()


def test_a_shaft_that_slows_down_touches_where_it_lifted(up, down):
    found = lift_off(down)
    assert found["touch_down"]["rpm"] == pytest.approx(lift_off(up)["lift_off"]["rpm"], rel=0.02)
    assert down["speed"].values[-1] == pytest.approx(0.0, abs=0.2)


def test_friction_takes_the_spin_and_its_energy(plant, down):
    """J d(Omega) = -T dt in every sample, and J Omega^2 / 2 = int T Omega dt: to round-off, through the touch-down."""
    inertia, speed, torque = plant.assembly.P.inertia, down["speed"].values, down["friction_torque"].values
    lost = inertia * (speed[:-1] - speed[1:])
    assert lost[:-1] == pytest.approx(torque[:-2] * 2e-4, rel=1e-7, abs=1e-12)
    work = (torque[:-2] * (speed[:-2] + speed[1:-1]) / 2).sum() * 2e-4
    assert work == pytest.approx(inertia * (speed[0] ** 2 - speed[-2] ** 2) / 2, rel=1e-7)


def test_the_torque_falls_by_a_hundred_from_dry_friction_to_the_film(up):
    torque, speed = up["friction_torque"].values, up["speed"].values
    assert torque[speed > 380].mean() < 0.012 * torque[(speed > 1) & (speed < 5)].mean()


def made(contact, speed):
    """A record of a shaft at a constant speed [rad/s] that touches where `contact` is 1."""
    contact = np.asarray(contact, float)
    time = np.arange(len(contact)) * 1e-3
    values = {"contact": contact, "angle": speed * time, "speed": np.full(len(contact), speed)}
    return xr.Dataset({name: ("time", value) for name, value in values.items()}, {"time": time})


def test_a_revolution_decides_on_lift_off():
    """At 50 Hz a revolution has 20 samples: 18 without contact between two with it are none."""
    turn = 2 * np.pi * 50 * (1 + 1e-9)
    assert lift_off(made([1] * 5 + [0] * 18 + [1] * 5, turn)) == {}
    found = lift_off(made([1] * 5 + [0] * 30 + [1] * 5 + [0] * 40, turn))
    assert found["lift_off"]["time_s"] == pytest.approx(4e-3) and found["touch_down"]["time_s"] == pytest.approx(35e-3)
    assert lift_off(made([0] * 30, turn)) == {}


def test_a_machine_without_contact_still_does_not_start_and_a_turning_one_needs_its_film():
    machine = rs.load_machine("rigid_rotor_self_acting")
    soft = Plant(machine.with_({"effects.contact.stiffness": "0 N/m"}))
    with pytest.raises(NoLiftOffError):
        soft.start(0.0)
    with pytest.raises(NoLiftOffError):
        Plant(machine).equilibrium(0.0)


def test_the_summary_says_where_the_shaft_lifts_off(up):
    assert summarise_experiment(up)["contact_samples"] > 0
    assert rs.report.friction_curve(up).layout.annotations[0].text == "lift-off"
