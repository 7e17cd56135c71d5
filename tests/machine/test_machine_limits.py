"""Limits of a machine, and the range in which its model was compared with measurements: closed forms, text, faults."""

import numpy as np
import pytest

from rotorsim.base.errors import DataError, MachineFileError
from rotorsim.machine import Checked, Limits, Machine, ShaftMaterial, load_machine, schema
from rotorsim.machine.file_text import dumps
from rotorsim.machine.limits import (
    FASTEST,
    check_speed,
    first_passed,
    hottest,
    largest_radius,
    limits_of,
    spin_stress,
)
from rotorsim.machine.numerics import HOT

STEEL = ShaftMaterial(density="7850 kg/m^3", youngs_modulus="210 GPa", poisson_ratio=0.3)
RIM = 0.07
"""Radius [m] of the rig's disc, 140 mm wide: of its inertia, 2 J = m R^2."""


@pytest.fixture(scope="module")
def rig():
    return load_machine("dtu_gas_bearing")


def test_a_spinning_disc_bears_what_its_radial_equilibrium_gives():
    """Stress at the centre by integrating the equilibrium of a solid disc, against the closed form."""
    nu, rho, radius, omega = 0.3, 7850.0, 0.2, 2500.0
    r = np.linspace(1e-6, radius, 2001)
    radial = (3 + nu) / 8 * rho * omega**2 * (radius**2 - r**2)
    hoop = np.gradient(r * radial, r, edge_order=2) + rho * omega**2 * r**2  # d(r s_r)/dr - s_t + rho w^2 r^2 = 0
    assert radial[-1] == 0 and hoop[0] == pytest.approx(radial[0], rel=1e-4)
    assert spin_stress(STEEL, omega * radius) == pytest.approx(radial[0], rel=1e-6)
    assert spin_stress(STEEL, limits_of(load_machine("plain_rotor")).tip_speed) == pytest.approx(810e6, rel=1e-3)


def test_the_rim_passes_its_limit_at_the_speed_over_the_radius(rig):
    slow = rig.with_({"limits": Limits(tip_speed="42.02 m/s")})
    speed = np.linspace(0.0, 700.0, 7001)
    sample, sentence = first_passed(slow, speed)
    assert speed[sample - 1] <= 42.02 / RIM < speed[sample]
    assert sentence.startswith("ended at 573") and "the rim of discs.0, radius 70 mm, moves at 42.0" in sentence
    assert "above limits.tip_speed 42.02 m/s" in sentence
    assert first_passed(slow, -speed)[0] == sample and first_passed(rig, speed) is None


def test_a_film_passes_its_temperature_by_what_warms_it(rig):
    speed = np.full(100, 300.0)
    rises = np.linspace(0.0, 200.0, 100)[:, None] * (1.0, 0.5, 0.2)
    sample, sentence = first_passed(rig, speed, rises)
    assert rises[sample - 1, 0] <= HOT - 293.15 < rises[sample, 0]
    assert "151.3 degC in a film, above limits.temperature 150 degC" in sentence
    heated = rig.replace("effects.gas_heating.heating", "50 K")  # 50 K at 100 Hz, with the square of the speed
    speed = np.linspace(0.0, 1200.0, 12001)
    sample, _ = first_passed(heated.replace("limits.temperature", "80 degC"), speed)
    assert speed[sample] == pytest.approx(200 * np.pi * np.sqrt(60.0 / 50.0), abs=0.2)


def test_a_machine_without_a_film_has_no_limit_of_its_temperature():
    rotor = load_machine("plain_rotor").replace("limits.temperature", "294 K").replace("gas.temperature", "293 K")
    assert first_passed(rotor, np.linspace(0.0, 600.0, 7), np.zeros((7, 0))) is None


def test_gas_that_is_fed_hot_has_no_limit_of_its_own(rig):
    assert hottest(rig) == HOT
    hot = rig.replace("gas.temperature", "600 degC")
    assert hottest(hot) == np.inf
    assert hottest(hot.replace("limits.temperature", "700 degC")) == pytest.approx(973.15)


def test_what_was_checked_changes_no_hash_and_limits_do(rig):
    """Stores of campaigns know a machine by its hash; no run depends on the table `checked`."""
    assert rig.with_({"checked": None}).hash == rig.hash
    assert rig.replace("checked.highest_speed", "9000 rpm").hash == rig.hash
    assert rig.replace("limits.tip_speed", "200 m/s").hash != rig.hash
    assert Machine.from_text(rig.text) == rig and rig.checked.highest_speed == pytest.approx(200 * np.pi)


@pytest.mark.parametrize("changes", [{}, {"checked": None}], ids=["checked", "not checked"])
def test_a_hash_writes_the_machine_once_whether_it_was_checked_or_not(rig, monkeypatch, changes):
    machine, written = rig.with_(changes), []
    monkeypatch.setattr(schema, "dumps", lambda part: written.append(part) or dumps(part))
    machine.hash  # noqa: B018
    assert len(written) == 1 and written[0].checked is None


@pytest.mark.parametrize(
    ("speed", "pressure", "held"),
    [(0.0, 0.3e6, True), (200 * np.pi, 0.7e6, True), (-200 * np.pi, 0.5e6, True), (640.0, 0.5e6, False),
     (300.0, 0.2e6, False), (300.0, 0.8e6, False)],
)  # fmt: skip
def test_the_checked_range_holds_its_ends(rig, speed, pressure, held):
    assert rig.checked.holds(speed, pressure) is held


def test_a_range_without_a_highest_pressure_is_open():
    checked = Checked(highest_speed="3000 rpm", lowest_pressure="0.3 MPa")
    assert checked.holds(300.0, 5e6) and not checked.holds(300.0, 0.1e6)
    assert checked.pressures == "from 0.3 MPa on" and checked.against == "measurements"


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("limits.tip_speed", "-3 m/s", "limits.tip_speed: '-3 m/s' must be above 0"),
        ("limits.tip_speed", "500 km/s", "limits.tip_speed: '500 km/s' is"),
        ("limits.tip_speed", "3 kg", "limits.tip_speed: '3 kg' is not a velocity"),
        ("limits.temperature", "-300 degC", "limits.temperature: '-300 degC'"),
        ("limits.temperature", "20 K",
         "limits.temperature: '20 K' is not above the gas.temperature '293.15 K'; make it higher"),
        ("limits.choked_feeds", 1.5, "limits.choked_feeds: 1.5 is above the limit"),
        ("limits.tipspeed", "3 m/s", "limits.tipspeed: unknown field; did you mean 'tip_speed'?"),
        ("checked.highest_speed", "-1 rpm", "checked.highest_speed: '-1 rpm'"),
        ("checked.lowest_pressure", "0.8 MPa",
         "checked.lowest_pressure: '0.8 MPa' is above highest_pressure '0.7 MPa'; make it smaller"),
    ],
)  # fmt: skip
def test_faults_are_one_sentence(rig, path, value, words):
    with pytest.raises(MachineFileError) as caught:
        rig.replace(path, value)
    assert str(caught.value).startswith(words) and len(str(caught.value).splitlines()) == 1


def test_no_sampling_rate_is_advised_for_a_speed_that_bursts_the_rotor(rig):
    bursts = FASTEST / largest_radius(rig)[1]
    for speed in (0.99 * bursts, 1.01 * bursts):
        with pytest.raises(DataError) as refused:
            check_speed(rig, speed)
        assert (refused.value.argument, refused.value.value) == ("speed", speed)
        assert ("sampling_rate" in str(refused.value)) == (speed < bursts)
        assert (" m/s " in str(refused.value)) == (speed > bursts)
