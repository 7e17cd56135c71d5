"""Runs that begin on the synchronous orbit: linear response, no start transient, machines that keep no orbit."""

import numpy as np
import pytest

import rotorsim as rs
from refusals import refused
from rotorsim.base.errors import DataError
from rotorsim.plant import Plant
from rotorsim.plant.linearise import linearise
from rotorsim.plant.simulation import rows
from rotorsim.plant.synchronous_orbit import Turns, find_orbit, growth

RPM = np.pi / 30


def rest_of_orders(record, variable, highest=8):
    """Largest part of the first turn, in amplitudes of 1X, that the orders of the end of the run do not explain."""
    angle, motion = record["angle"].values, record[variable].values
    waves = [wave(k * angle) for k in range(1, highest + 1) for wave in (np.cos, np.sin)]
    waves = np.column_stack([np.ones_like(angle), *waves])
    half = len(angle) // 2
    found, *_ = np.linalg.lstsq(waves[half:], motion[half:], rcond=None)
    size = np.hypot(found[1], found[2]).max()
    turn = int(np.searchsorted(angle, 2 * np.pi))
    return np.abs(motion - waves @ found)[:turn].max() / size


@pytest.mark.parametrize("rpm", [900, 2000, 4000])
def test_a_linear_rotor_begins_on_its_unbalance_response(rpm):
    """On springs: q = D(i Omega)^-1 me Omega^2 (1, -i) Phi'; steps of 20 us are 4e-4 off near the critical speed."""
    plant, speed = Plant("plain_rotor", dt=2e-5), rpm * RPM
    a, start = plant.assembly, plant.start(speed, 0.0, begin="orbit")
    rest = plant.start(speed)
    [call] = [c for c in a.calls if c.effect.name == "unbalance"]
    one = call.effect.me * speed**2 * np.exp(1j * call.effect.phase) * np.array([1.0, -1j])
    model = linearise(a, rest.w, speed)
    q = np.linalg.solve(model.dynamic_stiffness(1j * speed), one @ rows(a, call.shape, a.w))
    expected = np.real(rows(a, a.rotor.disc, a.w) @ q)
    disc = rows(a, a.rotor.disc, a.w) @ (start.w[a.rotor.q_old :] - rest.w[a.rotor.q_old :])[: a.rotor.n]
    assert start.on_orbit
    assert disc == pytest.approx(expected, abs=2e-3 * np.abs(rows(a, a.rotor.disc, a.w) @ q).max())


@pytest.mark.parametrize(
    ("name", "rpm", "pressure"),
    [("dtu_gas_bearing", 3000, 0.3e6), ("rigid_rotor_self_acting", 9000, 0.0), ("bently_rk4", 1500, 0.0)],
)
def test_no_start_transient_is_left(name, rpm, pressure):
    """From rest the first turn is a quarter of the orbit off, on the orbit a thousandth: the search ends at 1e-4."""
    machine = rs.load_machine(name)
    left = {}
    for begin in ("rest", "orbit"):
        record = rs.experiments.steady(Plant(machine), rpm * RPM, pressure, duration=0.4, begin=begin)
        left[begin] = rest_of_orders(record, "disc")
        assert record.attrs["begin"] == begin and record.attrs.get("began_on_orbit", 0) == (begin == "orbit")
    assert left["orbit"] < 1e-3 and left["rest"] > 0.25


def test_the_motion_that_lasts_decays_as_the_linear_model_says():
    """The least damped motion about the orbit, from the steps of the search, and about the equilibrium: 10 %."""
    plant, speed = Plant("dtu_gas_bearing"), 6000 * RPM
    orbit = find_orbit(plant.assembly, plant.start(speed, 0.3e6).w.copy(), speed, 0.3e6)
    assert orbit.growth == pytest.approx(plant.linearise(speed, 0.3e6).eigenvalues.real.max(), rel=0.1)


def test_growth_of_a_linear_map_is_found_to_round_off():
    G = np.diag(np.exp([0.3, -1.0, -2.0]))
    states = np.random.default_rng(1).normal(size=(4, 3))
    assert growth([(x, G @ x) for x in states], 0.1) == pytest.approx(3.0, rel=1e-9)


def test_a_machine_that_whirls_by_itself_starts_at_rest():
    """12,000 rpm are above its onset of 9500 rpm: its orbit is there, and it leaves it."""
    plant, speed = Plant("rigid_rotor_self_acting"), 12000 * RPM
    start, rest = plant.start(speed, begin="orbit"), plant.start(speed)
    orbit = find_orbit(plant.assembly, rest.w.copy(), speed, 0.0)
    assert orbit.w is not None and orbit.growth > 0
    assert not start.on_orbit and np.array_equal(start.w, rest.w)


def test_a_negative_speed_is_the_mirror_image():
    plant = Plant("plain_rotor")
    a = plant.assembly
    places = []
    for speed in (100.0, -100.0):
        orbit, rest = plant.start(speed, begin="orbit"), plant.start(speed)
        assert orbit.on_orbit
        places.append(rows(a, a.rotor.disc, a.w) @ (orbit.w - rest.w)[a.rotor.q_old :][: a.rotor.n])
    x, y = places
    assert x == pytest.approx(y * [1.0, -1.0], abs=1e-4 * np.abs(x).max())


def test_switches_and_the_solvers_memory_are_never_a_mixture_of_several_runs():
    """The order of the step is a whole number; a state with another in its place gives the bits of one without."""
    plant, speed = Plant("rigid_rotor_self_acting"), 9000 * RPM
    rest = plant.start(speed).w.copy()
    turns, mixed = Turns(plant.assembly, rest, speed, 0.0), rest.copy()
    R = plant.assembly.rotor
    mixed[R.order], mixed[R.contact] = 0.6, 0.3
    assert np.array_equal(turns.run(rest), turns.run(mixed))


def test_what_does_not_repeat_with_the_turn_begins_with_the_run():
    """A base that shakes and a blade that is lost after 10 ms: the run begins on the orbit without them."""
    machine = rs.load_machine("plain_rotor")
    later = {
        "effects.base_vibration": {"x": "1 m/s^2", "frequency": "37 Hz"},
        "effects.sudden_unbalance": {"me": "100 g*mm", "time": "10 ms"},
    }
    starts = [Plant(one).start(150.0, begin="orbit") for one in (machine, machine.with_(later))]
    assert all(one.on_orbit for one in starts)
    q = [one.w[one.assembly.rotor.q_old :][: one.assembly.rotor.n] for one in starts]
    assert np.array_equal(*q)


def test_a_run_up_from_standstill_begins_at_rest_whatever_is_asked():
    plant = Plant("plain_rotor")
    ramps = [rs.experiments.runup(plant, 0.0, 20.0, 100.0, begin=begin) for begin in ("orbit", "rest")]
    assert np.array_equal(*(ramp["disc"].values for ramp in ramps))
    assert ramps[0].attrs["began_on_orbit"] == 0


def test_a_run_up_with_a_pressure_that_changes_begins_on_the_orbit_too():
    plant = Plant("dtu_gas_bearing", n_theta=16, n_z=4, dt=2e-4)
    one, other = (rs.experiments.runup(plant, 300.0, 310.0, 100.0, pressure) for pressure in (0.5e6, lambda t: 0.5e6))
    assert np.array_equal(one["disc"].values, other["disc"].values)


def test_another_beginning_is_refused():
    with refused(DataError, "begin", "blow"):
        rs.experiments.Steady(begin="blow")
