"""Probes of a machine: their readings against closed forms, and the plant without and with them."""

from itertools import pairwise

import numpy as np
import pytest

from rotorsim.machine import Machine, load_machine, machine_text
from rotorsim.plant import Plant

PROBE = """
[[probes]]
name = "{}"
angle = "{} deg"
quantity = "{}"
{}
"""
BEAM = """
name = "beam"
[shaft]
max_element_length = "100 mm"
[shaft.material]
density = "7850 kg/m^3"
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "1 m"
outer_diameter = "10 mm"
[[bearings]]
kind = "linear"
position = "0 mm"
kxx = "1000 MN/m"
[[bearings]]
kind = "linear"
position = "1 m"
kxx = "1000 MN/m"
[solver]
modes_per_plane = 1
"""
PEDESTAL = '\n[effects.pedestal]\nmass_ratio = 0.3\nfrequency = "120 Hz"\ndamping_ratio = 0.02\n'
SHAKEN = '\n[effects.base_vibration]\nx = "2 m/s^2"\ny = "1 m/s^2"\nfrequency = "47 Hz"\nphase = "20 deg"\n'
DT = 2e-4


def probes(*rows):
    """Text of probes: name, angle [deg], quantity, further lines."""
    return "".join(PROBE.format(*row) for row in rows)


AROUND = probes(
    *[(f"{q[0]}_{axis}", angle, f"{q}_displacement", 'position = "100 mm"')
      for q in ("relative", "absolute") for axis, angle in (("x", 0), ("y", 90))],
    *[(f"{q}_{axis}", angle, f"housing_{q}", "")
      for q in ("velocity", "acceleration") for axis, angle in (("x", 0), ("y", 90))],
)  # fmt: skip
RUN = {"duration": 0.1, "speed": 400.0, "pressure": 0.5e6, "seed": 3}


def push(t):
    return 20 * np.sin(700 * t), 5.0


def reading(record, name):
    return record["probe_measured"].sel(probe=name).values


@pytest.fixture(scope="module")
def shaken_sleeve():
    """The rig on a resonant pedestal with probes, and its record."""
    text = machine_text("dtu_gas_bearing") + PEDESTAL
    journal = (
        "journal",
        0,
        "relative_displacement",
        f'position = "{1e3 * load_machine("dtu_gas_bearing").film.position} mm"',
    )
    plant = Plant(Machine.from_text(text + AROUND + probes(journal)), n_theta=32, n_z=8, dt=1e-4)
    return plant, plant.simulate(**RUN, disc_force=push)


def with_probe():
    """The plain rotor with a probe where the disc is measured."""
    place = Plant("plain_rotor").assembly.mesh.probe
    text = machine_text("plain_rotor") + probes(("X", 0, "relative_displacement", f'position = "{place} m"'))
    return Plant(Machine.from_text(text)).simulate(0.05, speed=300.0)


@pytest.mark.parametrize("machine", ["plain_rotor", pytest.param("dtu_gas_bearing", marks=pytest.mark.slow)])
def test_probes_change_no_bit_of_a_trajectory(machine, request):
    if machine == "plain_rotor":
        without, with_probes = Plant(machine).simulate(0.05, speed=300.0), with_probe()
    else:
        plant = Plant(Machine.from_text(machine_text(machine) + PEDESTAL), n_theta=32, n_z=8, dt=1e-4)
        without, with_probes = plant.simulate(**RUN, disc_force=push), request.getfixturevalue("shaken_sleeve")[1]
    for name in without.data_vars:
        assert np.array_equal(without[name], with_probes[name], equal_nan=True), name
    assert set(with_probes.data_vars) - set(without.data_vars) == {"probe_measured"}


def test_two_planes_of_a_beam_move_as_its_first_mode_does():
    """Simply supported, uniform: sin(pi z / L); 1e-4 holds shear and the bearings' compliance at L/d = 100."""
    places = (0.117, 0.3, 0.642)
    text = BEAM + probes(
        *[(f"P{i}", 45, "relative_displacement", f'position = "{z} m"') for i, z in enumerate(places)],
        ("X", 0, "absolute_displacement", 'position = "0.3 m"'),
        ("Y", 90, "absolute_displacement", 'position = "0.3 m"\nsense = "-"\nsensitivity = "7.87 V/mm"'),
    )
    record = Plant(Machine.from_text(text)).simulate(0.1, disc_force=push)
    seen = np.stack([reading(record, f"P{i}") for i in range(3)])
    shape = np.sin(np.pi * np.array(places))
    assert np.abs(seen[0]).max() > 1e-6
    assert np.abs(seen / shape[:, None] - seen[1] / shape[1]).max() < 1e-4 * np.abs(seen).max()
    x, y = reading(record, "X"), reading(record, "Y") / -7870.0
    assert seen[1] == pytest.approx((x + y) / np.sqrt(2), abs=1e-12 * np.abs(x).max())


def test_a_probe_where_the_disc_is_measured_reads_what_the_record_calls_disc():
    record = with_probe()
    assert np.array_equal(reading(record, "X"), record["disc"].sel(axis="x"))
    assert np.array_equal(record["probe_angle"], [0.0])
    assert record["probe_measured"].attrs["units"] == "m"


def test_the_housing_moves_on_its_pedestal_as_the_film_force_drives_it(shaken_sleeve):
    """m_p (x'' + 2 zeta omega x' + omega^2 x) = -F at every sample, to the round-off of the terms."""
    plant, record = shaken_sleeve
    mass, omega, zeta = plant.machine.mass / 0.3, 2 * np.pi * 120, 0.02
    for axis in "xy":
        x = reading(record, f"a_{axis}") - reading(record, f"r_{axis}")
        v, a = reading(record, f"velocity_{axis}"), reading(record, f"acceleration_{axis}")
        force = record["film_force"].sel(axis=axis).values
        assert np.abs(force).max() > 10
        assert mass * (a + 2 * zeta * omega * v + omega**2 * x) == pytest.approx(-force, abs=1e-10)


def test_a_relative_probe_at_the_bearing_reads_the_journal_in_its_sleeve(shaken_sleeve):
    record = shaken_sleeve[1]
    assert reading(record, "journal") == pytest.approx(record["journal"].sel(axis="x").values, abs=1e-18)


def test_velocity_and_acceleration_of_the_housing_are_derivatives_of_its_displacement(shaken_sleeve):
    """Central differences over two samples: their own error, (omega T)^2 / 6, is 2 % up to 275 Hz."""
    record = shaken_sleeve[1]
    for axis in "xy":
        x = reading(record, f"a_{axis}") - reading(record, f"r_{axis}")
        v, a = reading(record, f"velocity_{axis}"), reading(record, f"acceleration_{axis}")
        for derivative, of in ((v, x), (a, v)):
            slope = (of[2:] - of[:-2]) / (2 * DT)
            assert slope[20:] == pytest.approx(derivative[21:-1], abs=0.02 * np.abs(derivative).max())


@pytest.mark.slow
def test_the_acceleration_converges_with_the_square_of_the_step():
    text = machine_text("dtu_gas_bearing") + PEDESTAL + AROUND
    runs = [
        reading(Plant(Machine.from_text(text), n_theta=32, n_z=8, dt=dt).simulate(**RUN, disc_force=push),
                "acceleration_x")[50:]
        for dt in (2e-4, 1e-4, 5e-5, 2.5e-5)
    ]  # fmt: skip
    size = [np.sqrt(np.mean((a - b) ** 2)) for a, b in pairwise(runs)]
    orders = np.log2(np.array(size[:-1]) / size[1:])
    assert orders == pytest.approx(2.0, abs=0.35)


def test_a_foundation_that_shakes_carries_housing_and_absolute_displacement():
    """Without mean: displacement -A / omega^2 sin, velocity -A / omega cos, acceleration A sin."""
    record = Plant(Machine.from_text(machine_text("plain_rotor") + SHAKEN + AROUND)).simulate(0.1, speed=300.0)
    phase = 2 * np.pi * 47 * record["time"].values + np.radians(20)
    omega = 2 * np.pi * 47
    for axis, size in (("x", 2.0), ("y", 1.0)):
        moved = reading(record, f"a_{axis}") - reading(record, f"r_{axis}")
        assert reading(record, f"acceleration_{axis}") == pytest.approx(size * np.sin(phase), abs=1e-11)
        assert reading(record, f"velocity_{axis}") == pytest.approx(-size / omega * np.cos(phase), abs=1e-13)
        assert moved == pytest.approx(-size / omega**2 * np.sin(phase), abs=1e-15)
