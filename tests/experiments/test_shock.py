"""Shocks of the base: forces on the whole mass, closed forms of a rigid rotor, exact change of velocity, refusals."""

import numpy as np
import pytest

import rotorsim as rs
from fe_shaft.assembly import AssembledRotor
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.mesh import Mesh

BAR = """
name = "bar"
[shaft]
start = "0 mm"
[shaft.material]
density = "7850 kg/m^3"
youngs_modulus = "10000 GPa"
poisson_ratio = 0.3
[[shaft.sections]]
length = "200 mm"
outer_diameter = "60 mm"
[[discs]]
position = "100 mm"
mass = "2 kg"
diametral_inertia = "0.004 kg*m^2"
polar_inertia = "0.008 kg*m^2"
[[bearings]]
kind = "linear"
position = "20 mm"
kxx = "1 MN/m"
kyy = "1 MN/m"
[[bearings]]
kind = "linear"
position = "180 mm"
kxx = "1 MN/m"
kyy = "1 MN/m"
[solver]
time_step = "20 us"
"""
"""A thick bar of a modulus of 10,000 GPa on two springs: it bounces and bends 3e-5 of that."""


@pytest.fixture(scope="module")
def bar():
    return Plant(Machine.from_text(BAR))


def half_sine(omega, peak, width, t):
    """x of x'' + omega^2 x = -peak sin(pi t / width) from rest, and its free motion after the pulse."""
    rate = np.pi / width
    size = -peak / (omega**2 - rate**2)

    def during(s):
        return size * (np.sin(rate * s) - rate / omega * np.sin(omega * s))

    end = size * (-rate / omega * np.sin(omega * width))
    slope = size * (-rate - rate * np.cos(omega * width))
    after = end * np.cos(omega * (t - width)) + slope / omega * np.sin(omega * (t - width))
    return np.where(t < 0, 0.0, np.where(t < width, during(np.clip(t, 0, width)), after))


def test_a_rigid_rotor_moves_against_the_base_as_one_mass(bar):
    """11 ms half sine, bounce at omega = (2 k / m)^1/2: after six swings the bar's bending is 2e-3 off in phase."""
    record = rs.experiments.shock(bar, peak=50.0, width=11e-3, angle=np.radians(30), lead=0.01, rest=0.05)
    omega = np.sqrt(2e6 / bar.machine.mass)
    exact = half_sine(omega, 50.0, 11e-3, record["time"].values - 0.01)
    for k, share in enumerate((np.cos(np.radians(30)), np.sin(np.radians(30)))):
        assert record["disc"].values[:, k] == pytest.approx(share * exact, abs=2e-3 * np.abs(exact).max())


@pytest.mark.parametrize("width", [1e-6, 5e-5, 3e-4])
def test_a_shock_of_any_duration_changes_the_velocity_exactly(bar, width):
    """2 A T / pi for the base; against it the rotor swings by that over omega, whose phase a sample's hold shifts."""
    record = rs.experiments.shock(bar, peak=1e-1 / width, width=width, angle=0.0, lead=0.01, rest=0.05)
    change = 2 * 1e-1 / np.pi
    assert record["base_acceleration"].values.sum(axis=0) * 2e-4 == pytest.approx([change, 0.0], rel=1e-12)
    omega = np.sqrt(2e6 / bar.machine.mass)
    assert np.abs(record["disc"].values[:, 0]).max() == pytest.approx(change / omega, rel=5e-3)
    assert not record["disc_force"].values.any()


@pytest.mark.parametrize("name", ["plain_rotor", "pump_on_tables", "foil_turbo_rotor", "dtu_gas_bearing"])
def test_the_base_pulls_at_the_mass_of_every_node(name):
    """Phi' M 1 of the finite-element rotor with its housings, node by node, is what acts on the modes."""
    mesh = Mesh(rs.load_machine(name))
    model: AssembledRotor = mesh.constant
    for axis, found in enumerate(mesh.shaken_mass):
        with_base = np.zeros(model.ndof)
        with_base[axis : 4 * len(mesh.nodes) : 4] = 1.0
        for link in mesh._pedestals.values():
            with_base[model.layout.place(link) + axis] = 1.0
        assert found == pytest.approx(mesh.reduced.Phi.T @ model.M() @ with_base, abs=1e-9)


def test_a_base_that_goes_on_accelerating_deflects_the_rotor_as_its_weight_does():
    """g along x over a second, of a damped rotor with a weight along y: the sag of gravity along x, to 1e-3."""
    plant = Plant(
        rs.load_machine("plain_rotor").replace("shaft.damping_ratio", 0.05).replace("effects.unbalance.me", "0 g*mm")
    )
    rest = plant.equilibrium().disc
    table = [[0.0, 0.0, 0.0], [0.2, -9.81, 0.0], [1.0, -9.81, 0.0]]
    record = rs.experiments.shock(plant, lead=0.0, rest=0.0, history=table)
    assert record["disc"].values[-1] == pytest.approx([-rest[1], rest[1]], rel=1e-3)


def test_a_bow_and_a_shock_add_up():
    machine = rs.load_machine("plain_rotor")
    bowed = machine.with_({"effects.shaft_bow": {"bow": "20 um"}})
    given = {"speed": 100.0, "peak": 20.0, "lead": 0.01, "rest": 0.05, "begin": "rest"}
    shaken, both = (rs.experiments.shock(Plant(one), **given)["disc"].values for one in (machine, bowed))
    still = rs.experiments.steady(Plant(bowed), 100.0, duration=len(both) * 2e-4, begin="rest")["disc"].values
    plain = rs.experiments.steady(Plant(machine), 100.0, duration=len(both) * 2e-4, begin="rest")["disc"].values
    assert both - still == pytest.approx(shaken - plain, abs=1e-9 * np.abs(shaken).max())


def test_a_table_is_integrated_exactly_and_a_file_is_the_table(bar, tmp_path):
    """A triangle of 3 ms: base velocity A T / 2, displacement A T^2 / 4 at its end."""
    table = [[0.0, 0.0, 0.0], [1.5e-3, 40.0, 4.0], [3e-3, 0.0, 0.0]]
    one = rs.experiments.Shock(lead=0.01, rest=0.02, history=table)
    place, velocity = one.base_motion(np.array([0.01, 0.013, 0.015]))
    assert velocity[1:, 0] == pytest.approx([0.06, 0.06]) and place[:, 0] == pytest.approx([0.0, 9e-5, 2.1e-4])
    path = tmp_path / "shock.csv"
    path.write_text("y [m/s^2], time [ms], x [m/s^2]\n0,0,0\n4,1.5,40\n0,3,0\n", encoding="utf-8")
    read = rs.experiments.Shock(lead=0.01, rest=0.02, history=path)
    assert np.array_equal(read.history, one.history)
    assert read.rows(0, 165) == pytest.approx(np.vstack([one.rows(0, 50), one.rows(50, 115)]))


def test_probes_against_the_ground_read_the_base_too():
    """The displacement of the shaft against the base and the base's own, which goes on after the shock."""
    probe = '[[probes]]\nname = "ground"\nposition = "100 mm"\nangle = "0 deg"\nquantity = "absolute_displacement"\n'
    given = {"peak": 10.0, "angle": 0.0, "lead": 0.01, "rest": 0.02}
    record = rs.experiments.shock(Plant(Machine.from_text(BAR + probe)), **given)
    base = rs.experiments.Shock(**given).base_motion(record["time"].values)[0][:, 0]
    read = record["probe_measured"].values[:, 0] / float(record["probe_gain"].values[0])
    assert base[-1] == pytest.approx(2 * 10.0 * 11e-3 / np.pi * (5.5e-3 + 0.0198), rel=1e-9)
    assert read == pytest.approx(record["disc"].values[:, 0] + base, abs=1e-9 * base.max())


def test_what_is_no_shock_is_refused(tmp_path):
    for wrong in ([[0, 1, 2]], [[0, 1], [1, 2]], np.zeros((3, 4))):
        with refused(DataError, "history", np.shape(wrong)):
            rs.experiments.Shock(history=wrong)
    for wrong, time in (
        ([[0, 0, 0], [0, 1, 1]], 0.0),
        ([[0.1, 0, 0], [0.2, 1, 1]], 0.1),
        ([[0, 0, 0], [-1, 1, 1]], -1),
    ):
        with refused(DataError, "history", time):
            rs.experiments.Shock(history=wrong)
    with refused(DataError, "history", np.nan):
        rs.experiments.Shock(history=[[0, 0, 0], [1, np.nan, 0]])
    with refused(DataError, "peak", 20.0):
        rs.experiments.Shock(peak=20.0, history=[[0, 0, 0], [1, 1, 0]])
    for text in (
        "",
        "time [s], x [m/s^2]\n0,0\n1,1\n",
        "time, x, y\n0,0,0\n1,1,1\n",
        "time [s], x [N], y [m/s^2]\n0,0,0\n1,1,1\n",
    ):
        path = tmp_path / "wrong.csv"
        path.write_text(text, encoding="utf-8")
        with refused(DataError, "history", str(path)):
            rs.experiments.Shock(history=path)
    with refused(DataError, "history", str(tmp_path / "none.csv")):
        rs.experiments.Shock(history=tmp_path / "none.csv")


def test_a_pedestal_of_an_effect_is_refused():
    plant = Plant(rs.load_machine("dtu_gas_bearing").with_({"effects.pedestal": {"mass_ratio": 0.3}}))
    with refused(DataError, "machine", plant.machine.name):
        rs.experiments.shock(plant, pressure=0.5e6)
