"""Signatures of the pins' sensors: lag, gain and noise of the readings, and the pins whose loops act on them."""

import numpy as np
import pytest
import tomlkit
from scipy.signal import StateSpace, lsim

from rotorsim.base.errors import MachineFileError
from rotorsim.machine import load_machine, machine_text
from rotorsim.machine.gas_film import Actuators, PinnedInjector
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.kernels.layout import COLUMNS

SAMPLE = 2e-4
PINS, READ = slice(len(COLUMNS), len(COLUMNS) + 4), slice(len(COLUMNS) + 4, len(COLUMNS) + 8)
"""Columns of the true and of the measured pins of the rig."""
NEUTRAL = "effects.pin_sensor.0"
PRESSURE = 0.5e6


@pytest.fixture
def jumping(neutral, held):
    """Return true and measured pins (n, 4) [m] of ideal actuators that step to 1 V along x and -0.5 V along y."""

    def run(values, seed=0, samples=100):
        rows = held(samples, 0.0, PRESSURE)
        rows[10:, 2:4] = 1.0, -0.5
        table = neutral({f"{NEUTRAL}.{key}": value for key, value in values.items()}).start(0.0, PRESSURE, seed=seed)
        table = table.advance(rows)
        return table[:, PINS], table[:, READ], table

    return run


@pytest.fixture
def controlled():
    """Return the builder of the rig with position loops, linear stacks and sensors of the pins."""

    def build(**sensors):
        text = tomlkit.parse(machine_text("dtu_gas_bearing"))
        text["effects"] = {"gravity": {"acceleration": "9.81 m/s^2"}, **sensors}
        return Plant(Machine.from_text(tomlkit.dumps(text)), n_theta=16, n_z=8, dt=2e-4)

    return build


def test_a_jump_of_the_pin_arrives_as_the_step_response_of_a_first_order_lag(jumping):
    """1 - exp(-t / T) of the jump, to round-off; the pin itself has jumped."""
    true, read, _ = jumping({"lag": "0.7 ms"})
    jump = np.array([-0.5, 1.0, 0.5, -1.0]) * load_machine("dtu_gas_bearing").injection.pin_per_volt
    late = np.exp(-SAMPLE * np.maximum(np.arange(100) - 10, 0) / 0.7e-3)[:, None]
    assert true[10:] - true[0] == pytest.approx(np.tile(jump, (90, 1)), abs=1e-18)
    assert read - true[0] == pytest.approx(jump * (1 - late), abs=1e-17)


def test_a_gain_is_a_factor_on_the_travel_of_the_pin_that_the_table_names(jumping):
    true, read, _ = jumping({"gain": 0.04})
    assert read == pytest.approx(1.04 * true, rel=1e-15)
    true, read, _ = jumping({"gain": 0.04, "injector": 3})
    assert read[:, 2] == pytest.approx(1.04 * true[:, 2], rel=1e-15)
    assert np.array_equal(np.delete(read, 2, 1), np.delete(true, 2, 1))


def test_the_noise_of_readings_is_white_independent_and_moves_no_pin(jumping):
    """2000 samples: standard errors .016 of sigma and .022 of mean and correlation; bounds at 4 of them."""
    true, read, table = jumping({"sigma": "50 nm"}, seed=4, samples=2000)
    n = (read - true) / 50e-9
    assert n.std(axis=0) == pytest.approx(np.ones(4), abs=0.064)
    assert np.abs(n.mean(axis=0)).max() < 0.09
    assert np.abs(np.corrcoef(n.T) - np.eye(4)).max() < 0.09
    assert np.abs(np.mean(n[1:] * n[:-1], axis=0)).max() < 0.09
    other = jumping({"sigma": "50 nm"}, seed=5, samples=2000)[2]
    assert other[:, : READ.start].tobytes() == table[:, : READ.start].tobytes()
    assert abs(np.corrcoef((other[:, READ] - other[:, PINS])[:, 0], n[:, 0])[0, 1]) < 0.09


def closed_loop(machine, k, T, gain):
    """Pin k as states of PD law, amplifier, stack and sensor: from the reference [V] to travel and reading [m]."""
    piezos, own = machine.actuators, machine.injectors[k]
    P, z, p, s = own.pd_gain, own.pd_zero, piezos.pd_pole, piezos.sensor_sensitivity
    fast, slow = 1 / own.amplifier_lag, 1 / own.stack_lag
    # x' = -p x + e, v' = fast (P (e + (z - p) x) - v), y' = slow (S v - y), m' = ((1 + g) y - m) / T, e = r - m / s
    A = [[-p, 0, 0, -1 / s], [fast * P * (z - p), -fast, 0, -fast * P / s], [0, slow * piezos.sensitivity, -slow, 0],
         [0, 0, (1 + gain) / T, -1 / T]]  # fmt: skip
    return StateSpace(A, [[1], [fast * P], [0], [0]], [[0, 0, 1, 0], [0, 0, 0, 1]], [[0], [0]])


@pytest.mark.parametrize(("lag", "gain"), [(0.25e-3, 0.0), (0.36e-3, 0.1)])
def test_the_loop_of_a_pin_acts_on_what_its_sensor_reads(controlled, held, lag, gain):
    """Four coupled lags in closed form; the loop of substeps of 50 us, as long as the stack's lag, is 1 % off."""
    plant = controlled(pin_sensor={"lag": f"{1e3 * lag} ms", "gain": gain})
    rows = held(300, 0.0, PRESSURE)
    rows[50:, 2:4] = 0.2, 0.1
    table = plant.start(0.0, PRESSURE).advance(rows)
    assert table[:50, READ] == pytest.approx((1 + gain) * table[:50, PINS], rel=1e-13)
    steps = np.where(np.arange(300) >= 50, 1.0, 0.0)
    for k, volts in enumerate((0.1, 0.2, -0.1, -0.2)):
        fine = np.repeat(volts * steps, 20)
        _, exact, _ = lsim(closed_loop(plant.machine, k, lag, gain), fine, np.arange(6000) * SAMPLE / 20, interp=False)
        moved = table[:, [PINS.start + k, READ.start + k]] - table[0, [PINS.start + k, READ.start + k]]
        assert moved == pytest.approx(exact[::20], abs=1e-2 * np.abs(exact).max())


def test_a_pin_behind_a_slow_sensor_is_ahead_of_its_reading_by_the_lag(controlled, held):
    """A slow sweep of the reference: reading and travel differ in phase by atan(omega T) and in size by its cosine."""
    plant, omega = controlled(pin_sensor={"lag": "0.4 ms"}), 2 * np.pi * 25
    rows = held(1000, 0.0, PRESSURE)
    rows[:, 2] = 0.5 * np.sin(omega * SAMPLE * np.arange(1000))
    table = plant.start(0.0, PRESSURE).advance(rows)
    turn = np.exp(-1j * omega * SAMPLE * np.arange(800))
    ratio = (turn @ table[200:, READ.start + 1]) / (turn @ table[200:, PINS.start + 1])
    assert ratio == pytest.approx(1 / (1 + 1j * omega * 0.4e-3), rel=2e-3)


def test_sensors_at_neutral_values_leave_every_bit_and_read_the_pins(controlled, held):
    rows = held(400, 300.0, PRESSURE)
    rows[100:, 2:4] = np.random.default_rng(0).choice([-1.0, 1.0], (300, 2))
    tables = [plant.start(300.0, PRESSURE).advance(rows) for plant in (controlled(), controlled(pin_sensor={}))]
    assert tables[0].shape[1] + 4 == tables[1].shape[1] == READ.stop
    assert np.ascontiguousarray(tables[1][:, : READ.start]).tobytes() == tables[0].tobytes()
    assert np.array_equal(tables[1][:, READ], tables[1][:, PINS])


def test_the_slowest_sensor_of_a_loop_with_one_lag_takes_45_deg_at_the_crossover():
    """K / (1 + i w T) is 1 at w = (K^2 - 1)^1/2 / T, with more than 90 deg of margin; a table of K < 1 has none."""
    common = {"mode": "reference", "pd_pole": "500 rad/s", "amplifier_lag": "0 s", "stack_lag": "2 ms"}
    piezos = Actuators(**common, sensitivity="4.5 um/V", sensor_sensitivity="4.5 um/V")
    pin = PinnedInjector(angle="0 deg", reference="+x", pd_gain=5.0, pd_zero="500 rad/s")
    assert piezos.slowest_sensor(pin) == pytest.approx(2e-3 / np.sqrt(24), rel=0.01)
    assert piezos.slowest_sensor(pin, 1.0) == pytest.approx(2e-3 / np.sqrt(99), rel=0.01)
    assert piezos.slowest_sensor(pin.model_copy(update={"pd_gain": 0.9})) == np.inf
    assert piezos.model_copy(update={"mode": "voltage"}).slowest_sensor(pin) == np.inf


@pytest.mark.parametrize(
    ("sensors", "field"),
    [
        ({"lag": "1 ms"}, "lag"),
        ([{"injector": 1, "lag": "0.1 ms"}, {"injector": 3, "lag": "0.9 ms"}], "1.lag"),
        ({"injector": 5}, "injector"),
        ([{"lag": "0.1 ms"}, {"injector": 2, "gain": 0.1}], "1.injector"),
        ([{"injector": 2, "lag": "0.1 ms"}, {"injector": 2, "sigma": "10 nm"}], "1.injector"),
    ],
)
def test_a_sensor_that_its_loop_does_not_allow_or_that_has_no_pin_of_its_own_is_refused(sensors, field):
    text = tomlkit.parse(machine_text("dtu_gas_bearing"))
    text["effects"]["pin_sensor"] = sensors
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(tomlkit.dumps(text))
    assert len(caught.value.problems) == 1
    assert caught.value.problems[0].startswith(f"effects.pin_sensor.{field}: ")


@pytest.mark.parametrize("mode", ["ideal", "voltage"])
def test_a_pin_without_a_loop_takes_any_sensor(mode):
    machine = load_machine("dtu_gas_bearing").replace("actuators.mode", mode)
    assert machine.replace("effects.pin_sensor.lag", "20 ms").effects["pin_sensor"][0].lag == 0.02


@pytest.mark.parametrize("name", ["plain_rotor", "grooved_turbo_rotor"])
def test_a_machine_without_pins_refuses_their_sensors(name):
    with pytest.raises(MachineFileError) as caught:
        load_machine(name).replace("effects.pin_sensor.gain", 0.1)
    assert len(caught.value.problems) == 1 and caught.value.problems[0].startswith("effects.pin_sensor")


SIGNATURES = {"pin_sensor": test_a_jump_of_the_pin_arrives_as_the_step_response_of_a_first_order_lag}
