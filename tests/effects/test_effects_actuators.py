"""Signatures of the effects on the piezo actuators, in voltage mode and with closed PD loops."""

import numpy as np
import pytest
import tomlkit

from rotorsim.machine import machine_text
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.kernels.layout import COLUMNS

SAMPLE = 2e-4
PIN = len(COLUMNS)
"""Column of the first pin: injector 1 at the top, which follows +r_y."""
NO_LAG = {"actuators.amplifier_lag": "0 s", "actuators.stack_lag": "0 s"}
NO_LAG |= {f"injectors.{k}.{lag}": "0 s" for k in range(4) for lag in ("amplifier_lag", "stack_lag")}
LOOP = {"effects.hysteresis.weight": "0.336 um/V"}


@pytest.fixture
def rig_of(changed):
    """Return the builder of the rig with actuators in a mode and their effects switched off."""

    def build(mode, values=None):
        text = tomlkit.parse(machine_text("dtu_gas_bearing"))
        text["effects"] = {"gravity": {"acceleration": "9.81 m/s^2"}, "hysteresis": {}, "creep": {}, "dead_zone": {}}
        machine = Machine.from_text(tomlkit.dumps(text))
        return Plant(changed(machine, {"actuators.mode": mode} | dict(values or {})), n_theta=16, n_z=8, dt=2e-4)

    return build


def pin_under(plant, held, reference, speed=0.0):
    """Travel (n,) [m] of pin 1 after each sample of a reference r_y (n,) [V]."""
    rows = held(len(reference) + 1, speed, 0.6e6)
    rows[:-1, 3] = reference
    return plant.start(speed, 0.6e6).advance(rows)[1:, PIN]


def triangle(samples, swing):
    """One rise to +swing, two full cycles between -swing and +swing, ending at +swing (3 * 2 samples)."""
    up = np.linspace(-swing, swing, samples)
    return np.concatenate([np.linspace(0, swing, samples), up[::-1], up, up[::-1], up])


def opening(reference, travel, samples):
    """Largest distance [m] between the last falling and the last rising branch."""
    down, up = slice(3 * samples, 4 * samples), slice(4 * samples, 5 * samples)
    grid = np.linspace(0.98 * reference.min(), 0.98 * reference.max(), 197)
    falling = np.interp(grid, reference[down][::-1], travel[down][::-1])
    rising = np.interp(grid, reference[up], travel[up])
    return falling - rising, grid


def test_a_full_cycle_of_the_stack_travels_45_um_and_opens_by_8_4_um(rig_of, held):
    """Closed form of ten play operators, thesis Fig. C.28, without lags: half the opening is .5 w sum of 2 r_i = 25 w.

    Away from the middle it closes towards both ends. A hundredth of a micron: the reference is sampled.
    """
    values = {"actuators.sensitivity": "2.82 um/V", "actuators.reference_limit": "6 V"}
    plant = rig_of("voltage", values | LOOP | NO_LAG)
    rest = float(plant.start(0.0, 0.6e6).w[plant.assembly.rig.rest])
    samples = 2000
    reference = np.clip(triangle(samples, 6.0), -rest, 10 - rest)
    travel = pin_under(plant, held, reference)
    cycle = travel[2 * samples :]
    assert np.ptp(cycle) == pytest.approx(45.0e-6, abs=1e-8)
    volts = reference + rest
    down, up = slice(3 * samples, 4 * samples), slice(4 * samples, 5 * samples)
    at = [np.interp(5.0, v, y) for v, y in ((volts[down][::-1], travel[down][::-1]), (volts[up], travel[up]))]
    assert at[0] - at[1] == pytest.approx(8.40e-6, abs=1e-8)
    assert opening(reference, travel, samples)[0].max() == pytest.approx(8.40e-6, abs=1e-8)


def test_the_loop_counts_from_the_rest_of_an_alternating_voltage(rig_of, held):
    """At rest the pin is at its bias, and two equal steps of opposite sign move it by the same distance."""
    plant = rig_of("voltage", {"actuators.sensitivity": "2.82 um/V"} | LOOP | NO_LAG)
    travels = [pin_under(plant, held, np.full(50, step)) for step in (0.8, -0.8)]
    assert plant.start(0.0, 0.6e6).w[plant.assembly.rig.pin] == pytest.approx(22.5e-6, abs=1e-8)
    assert travels[0][-1] - 22.5e-6 == pytest.approx(22.5e-6 - travels[1][-1], abs=2e-7)


def test_the_pd_loop_takes_most_of_the_hysteresis_out(rig_of, held):
    """A slow triangle of +-4 V of reference, .2 Hz: the pin's loop is below .8 um against 5 um without the loop.

    The law's gain at zero frequency is P z / p = 18, which leaves 1/19 of an opening and of a lag.
    """
    samples = 12500
    reference = triangle(samples, 4.0)
    values = {"actuators.sensitivity": "2.82 um/V"} | LOOP
    closed, _ = opening(reference, pin_under(rig_of("reference", values), held, reference), samples)
    open_, _ = opening(reference, pin_under(rig_of("voltage", values), held, reference), samples)
    assert np.abs(open_).max() > 4e-6
    assert np.abs(closed).max() < 0.8e-6


def creep_left(seconds):
    """Sum of the three elements' answers to a step, each 1 - exp(-t/T_j)."""
    return sum(1 - np.exp(-seconds / (3.0 * factor)) for factor in (0.1, 1.0, 10.0))


def test_creep_continues_for_seconds_after_a_step(rig_of, held):
    """gamma of the step in each of three elements: closed form, .1 % for substeps of 50 us and the lags."""
    values = {"effects.creep.gain": 0.012} | NO_LAG
    plant = rig_of("voltage", values)
    travel = pin_under(plant, held, np.full(25000, 1.0))
    step = travel[2] - 22.5e-6
    for seconds in (0.1, 1.0, 4.0):
        grown = travel[round(seconds / SAMPLE)] - travel[2]
        assert grown == pytest.approx(0.012 * step * creep_left(seconds), rel=0.01)


def test_the_pd_loop_takes_creep_out(rig_of, held):
    """Four seconds after a step of 1 V the pin has moved on by less than a tenth of what it does without the loop."""
    values = {"effects.creep.gain": 0.012, "actuators.sensitivity": "4.5 um/V"}
    moved = []
    for mode in ("voltage", "reference"):
        travel = pin_under(rig_of(mode, values), held, np.full(20000, 1.0))
        moved.append(travel[-1] - travel[500])
    assert moved[0] > 5e-8
    assert abs(moved[1]) < 0.1 * moved[0]


def test_a_dead_zone_loses_its_width_about_the_bias(rig_of, held):
    """Below half the lost motion nothing moves; beyond it the pin is that much behind the stack, either way."""
    plant = rig_of("voltage", {"effects.dead_zone.half_width": "1 um"} | NO_LAG)
    per_volt = plant.machine.actuators.sensitivity
    for volts in (0.2, 1.0, -0.2, -1.0):
        moved = pin_under(plant, held, np.full(20, volts))[-1] - 22.5e-6
        expected = np.sign(volts) * max(abs(volts) * per_volt - 1e-6, 0.0)
        assert moved == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize("mode", ["ideal", "voltage", "reference"])
def test_the_drive_of_one_pin_moves_that_pin_alone_by_its_gain(rig_of, held, mode):
    """Without hysteresis a pin is linear in its reference: 20 % less of it everywhere, whatever drives it."""
    runs = []
    for error in (0.0, -0.2):
        plant = rig_of(mode, {"effects.actuator_gain": {"injector": 1, "error": error}})
        rows = held(200, 0.0, 0.6e6)
        rows[:, 3] = np.sin(0.1 * np.arange(200))
        runs.append(plant.start(0.0, 0.6e6).advance(rows)[:, PIN : PIN + 4])
    rest = runs[0][0, 0]
    assert np.ptp(runs[0][:, 0]) > 5e-6
    assert runs[1][:, 0] - rest == pytest.approx(0.8 * (runs[0][:, 0] - rest), abs=1e-12)
    assert np.array_equal(runs[1][:, 1:], runs[0][:, 1:])


def test_the_linear_model_has_the_gains_of_the_drives(rig_of, held):
    """Displacements of two runs with references held either way, 0.1 V apart: straight within a percent."""
    speed, pressure, tables = 300.0, 0.6e6, [{"injector": 1, "error": -0.2}, {"injector": 0, "error": 0.1}]
    plant = rig_of("ideal", {"effects.actuator_gain": tables, "effects.actuator_delay": {"delay": "1 ms"}})
    found, measured = plant.linearise(speed, pressure).static_gain, np.zeros((2, 2))
    for axis in range(2):
        for volt in (0.05, -0.05):
            rows = held(2500, speed, pressure)
            rows[:, 2 + axis] = volt
            measured[:, axis] += np.sign(volt) * plant.start(speed, pressure).advance(rows)[-1, :2] / 0.1
    assert found == pytest.approx(measured, abs=0.01 * np.abs(measured).max())
    right = rig_of("ideal").linearise(speed, pressure).static_gain
    assert found[:, 0] == pytest.approx(1.1 * right[:, 0], rel=1e-9)  # both pins along x
    assert found[1, 1] < 1.05 * right[1, 1]  # one of those along y travels by 0.88


@pytest.mark.parametrize("mode", ["ideal", "reference"])
def test_late_references_move_the_pins_later_by_samples_and_their_parts(rig_of, held, mode):
    """Three samples: the same pins three samples later. Half a sample more: the mean of both. Tables add up."""
    rows = held(200, 0.0, 0.6e6)
    rows[20:, 2:4] = np.sin(0.1 * np.arange(180))[:, None] * [1.0, -0.5]

    def pins(*tables):
        plant = rig_of(mode, {"effects.actuator_delay": [{"delay": f"{own} s", "injector": k} for own, k in tables]})
        return plant.start(0.0, 0.6e6).advance(rows)[:, PIN : PIN + 4]

    punctual, late, later = pins((0.0, 0)), pins((3 * SAMPLE, 0)), pins((3.5 * SAMPLE, 0))
    assert np.ptp(punctual, axis=0).min() > 1e-6
    assert late[3:] == pytest.approx(punctual[:-3], abs=1e-15)
    assert later[4:] == pytest.approx((punctual[:-4] + punctual[1:-3]) / 2, abs=1e-12)
    assert pins((SAMPLE, 0), (2 * SAMPLE, 2))[3:, 1] == pytest.approx(punctual[:-3, 1], abs=1e-15)


@pytest.mark.parametrize("mode", ["voltage", "reference"])
def test_a_slow_amplifier_is_one_with_that_time_constant(rig_of, held, mode):
    rows = held(200, 0.0, 0.6e6)
    rows[:, 3] = np.sin(0.1 * np.arange(200))
    own = rig_of(mode).machine.injectors[0].amplifier_lag
    slow = rig_of(mode, {"injectors.0.amplifier_lag": f"{1.7 * own} s"})
    found = rig_of(mode, {"effects.amplifier_lag": {"injector": 1, "change": 0.7}})
    tables = [plant.start(0.0, 0.6e6).advance(rows) for plant in (slow, found)]
    assert tables[0].tobytes() == tables[1].tobytes()


SIGNATURES = {
    "hysteresis": test_a_full_cycle_of_the_stack_travels_45_um_and_opens_by_8_4_um,
    "creep": test_creep_continues_for_seconds_after_a_step,
    "actuator_gain": test_the_drive_of_one_pin_moves_that_pin_alone_by_its_gain,
    "actuator_delay": test_late_references_move_the_pins_later_by_samples_and_their_parts,
    "amplifier_lag": test_a_slow_amplifier_is_one_with_that_time_constant,
    "dead_zone": test_a_dead_zone_loses_its_width_about_the_bias,
}
