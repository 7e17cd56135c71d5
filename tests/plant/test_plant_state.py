"""State, inputs and records of a run: bits independent of block size, invalid inputs refused."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import rotorsim
from identification import validate
from rotorsim.base.errors import ConvergenceError, DataError, NoLiftOffError

PRESSURE = 0.3e6
BUSY = {"effects.unbalance.me": "6.5 g*mm", "effects.coupling.force_2x": "4 N"}


def busy_inputs(held, samples=300):
    """Everything moves: speed, supply, both references, a disc force that jumps."""
    k = np.arange(samples)
    inputs = held(samples, 300.0, PRESSURE)
    inputs[:, 0] += 0.2 * k
    inputs[:, 1] += 2e4 * np.sin(0.02 * k)
    inputs[:, 2], inputs[:, 3] = np.sin(0.3 * k), 0.5 * np.cos(0.2 * k)
    inputs[100:110, 4] = 20.0
    return inputs


def test_one_step_calls_equal_block_calls_bitwise(rig, held):
    plant, inputs = rig(BUSY), busy_inputs(held)
    block, single = plant.start(300.0, PRESSURE), plant.start(300.0, PRESSURE)
    table = block.advance(inputs)
    rows = np.concatenate([single.advance(row[None]) for row in inputs])
    assert table.tobytes() == rows.tobytes()
    assert block.w.tobytes() == single.w.tobytes()


def test_a_saved_state_continues_bitwise_also_in_another_simulation(rig, held):
    plant, inputs = rig(BUSY), busy_inputs(held)
    run = plant.start(300.0, PRESSURE)
    run.advance(inputs[:150])
    saved = run.save()
    first = run.advance(inputs[150:])
    run.restore(saved)
    again = run.advance(inputs[150:])
    other = rig(BUSY).start(0.0, PRESSURE)
    other.restore(saved)
    assert first.tobytes() == again.tobytes() == other.advance(inputs[150:]).tobytes()


def test_a_saved_state_holds_whether_the_drive_is_on(rig, held):
    run, driven = rig(BUSY).start(300.0, PRESSURE), held(3, 300.0, PRESSURE)
    coasting = driven.copy()
    coasting[:, 0] = np.nan
    saved = run.save()
    run.advance(coasting)
    off = run.save()
    run.restore(saved)
    assert not run.coasts
    run.restore(off)
    assert run.coasts and run.save().tobytes() == off.tobytes()
    run.advance(driven)
    assert not run.coasts


def test_no_rows_and_refused_rows_leave_the_drive_as_it_is(rig, held):
    run, row = rig(BUSY).start(300.0, PRESSURE), held(1, np.nan, PRESSURE)
    run.advance(row)
    run.advance(np.empty((0, 6)))
    wrong = held(1, 300.0, np.nan)
    with pytest.raises(DataError):
        run.advance(wrong)
    assert run.coasts


def test_a_step_without_a_solution_leaves_the_drive_as_in_the_last_sample_done(rig, held):
    run, driven = rig(BUSY).start(300.0, PRESSURE), held(4, 300.0, PRESSURE)
    run.advance(driven)
    failing = np.concatenate([driven, held(4, np.nan, PRESSURE)])
    failing[4:, 4] = 1e9
    with pytest.raises(ConvergenceError) as failed:
        run.advance(failing)
    assert run.coasts == (len(failed.value.where["table"]) > 4)


SCRIPT = """
import hashlib, sys
import numpy as np
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
n_theta, n_z, samples, force = (int(word) for word in sys.argv[1:])
k = np.arange(samples)
inputs = np.zeros((samples, 6))
inputs[:, 0], inputs[:, 1] = 300 + 0.2 * k, 3e5
inputs[:, 2], inputs[:, 3] = np.sin(0.3 * k), 0.5 * np.cos(0.2 * k)
inputs[samples // 3 : samples // 3 + 10, 4] = force
machine = load_machine("dtu_gas_bearing").replace("effects.unbalance.me", "300 g*mm")
run = Plant(machine, n_theta=n_theta, n_z=n_z, dt=2e-4).start(300.0, 3e5)
table = run.advance(inputs)
assert run.counters["factorisations"] > 10
print(hashlib.sha256(table.tobytes() + run.w.tobytes()).hexdigest())
"""


def digest_of_run(n_theta, n_z, samples=300, force=100, **environment):
    return printed(SCRIPT, n_theta, n_z, samples, force, **environment)


def printed(script, *numbers, **environment):
    folder = str(Path(rotorsim.__file__).parents[1])
    variables = dict(os.environ, PYTHONPATH=os.pathsep.join([folder, os.environ.get("PYTHONPATH", "")]), **environment)
    command = [sys.executable, "-c", script, *map(str, numbers)]
    return subprocess.run(command, capture_output=True, text=True, env=variables, check=True).stdout.strip()


VECTORS = "from studies.benchmarks.step_history import vector_bits; print(vector_bits())"


@pytest.mark.slow
@pytest.mark.parametrize(("processor", "n_z", "bits"), [("generic", 8, "128"), ("x86-64-v3", 16, "256")])
def test_two_kinds_of_processor_compute_the_same_bits(tmp_path, processor, n_z, bits):
    """This computer against the oldest x86-64 and one with vectors of 256 bits: sums are neither reordered nor fused.

    The orbit is large, so that the film is factorised again and again, in lines of four and of eight rows. A processor
    that is named without its features would keep this computer's vectors.
    """
    kind = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": ""}
    assert printed(VECTORS, **kind) == bits
    if printed(VECTORS) == bits:
        pytest.skip(f"this computer has vectors of {bits} bits itself")
    other = digest_of_run(32, n_z, **kind, ROTORSIM_CACHE_DIR=str(tmp_path / processor))
    assert len(other) == hashlib.sha256().digest_size * 2
    assert digest_of_run(32, n_z) == other


@pytest.mark.slow
def test_plain_python_computes_the_bits_of_the_machine_code():
    """A hit that drives the journal into its sleeve, on a coarse grid: film, rotor, contact and parts of steps."""
    hit = {"n_theta": 8, "n_z": 4, "samples": 20, "force": 300}
    assert digest_of_run(**hit, NUMBA_DISABLE_JIT="1") == digest_of_run(**hit)


class Proportional:
    """Positive feedback of the thesis' kind, which keeps what it was given."""

    def __init__(self):
        self.seen = []

    def step(self, measured, speed, pressure):
        self.seen.append((measured.copy(), speed, pressure))
        return 2e4 * measured


def test_a_controller_acts_on_the_sample_after_the_one_it_saw(rig):
    plant, controller, force = rig(), Proportional(), np.zeros((200, 2))
    force[0] = 20.0
    record = plant.simulate(0.04, 300.0, PRESSURE, disc_force=force, controller=controller)
    measured = record["disc_measured"].values
    assert len(controller.seen) == 200
    assert np.array([m for m, _, _ in controller.seen]).tobytes() == measured.tobytes()
    assert all(speed == 300.0 and pressure == PRESSURE for _, speed, pressure in controller.seen)
    assert np.all(record["reference"].values[0] == 0)
    assert record["reference"].values[1:] == pytest.approx(2e4 * measured[:-1], rel=1e-15)
    # the pins follow at once (eq. C.1 of the thesis: +y, +x, -y, -x), 4.194 um/V about their middle
    travel = (record["pin"].values - 22.5e-6) / 4.194e-6
    x, y = record["reference"].values.T
    assert travel == pytest.approx(np.stack([y, x, -y, -x], axis=1), abs=1e-9)


def test_a_record_fits_the_schema_and_names_its_origin(rig):
    plant = rig(BUSY)
    record = validate(plant.simulate(0.02, lambda t: 100 + 50 * t, PRESSURE, reference=(0.5, 0.0), seed=7))
    assert record.sizes == {"time": 100, "axis": 2, "injector": 4}
    assert record["time"].values == pytest.approx(np.arange(100) * 2e-4, abs=1e-12)
    assert record["speed"].values == pytest.approx(100 + 50 * record["time"].values, rel=1e-12)
    assert record["pressure"].values == pytest.approx(PRESSURE, rel=1e-12)
    assert record.attrs["machine"] == plant.machine.text
    assert (record.attrs["machine_hash"], record.attrs["seed"]) == (plant.machine.hash, 7)
    assert record.attrs["sample_rate_hz"] == pytest.approx(5000)
    for name in ("rotorsim_version", "numpy_version", "numba_version"):
        assert record.attrs[name]


def test_a_run_continues_where_another_ended(rig):
    plant = rig(BUSY)
    whole = plant.simulate(0.04, 300.0, PRESSURE)
    run = plant.start(300.0, PRESSURE)
    parts = [plant.simulate(0.02, 300.0, PRESSURE, initial=run) for _ in range(2)]
    assert parts[1]["time"].values[0] == pytest.approx(0.02)
    for name in ("disc", "angle", "film_force", "h_min"):
        joined = np.concatenate([part[name].values for part in parts])
        assert joined.tobytes() == whole[name].values.tobytes()


def test_a_pressure_that_cannot_lift_the_rotor_is_named_with_the_way_out(rig):
    with pytest.raises(
        NoLiftOffError, match=r"no lift-off: at 0\.02 MPa gauge and 0 rpm .* N on it; raise the injection"
    ):
        rig().equilibrium(0.0, 0.02e6)


def test_films_whose_correction_is_nan_do_not_carry():
    """Two films that feed themselves: a correction of NaN does not count as small."""
    with pytest.raises(NoLiftOffError):
        rotorsim.Plant("grooved_turbo_rotor").equilibrium(0.0, 0.0)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"duration": 0.0}, r"duration = 0\.0 s: shorter than one sample"),
        ({"duration": np.nan}, r"duration = nan s"),
        ({"speed": np.ones(7)}, r"speed: shape \(7,\), expected \(51,\)"),
        ({"pressure": np.full(50, np.nan)}, "pressure: holds NaN or infinite values"),
        ({"reference": np.zeros((50, 3))}, r"reference: shape \(50, 3\), expected \(50, 2\)"),
        ({"disc_force": lambda t: (np.inf, 0.0)}, "disc_force: holds NaN or infinite values"),
    ],
)
def test_inputs_that_make_no_sense_are_refused_by_name(rig, arguments, sentence):
    with pytest.raises(DataError, match=sentence):
        rig().simulate(**({"duration": 0.01, "speed": 0.0, "pressure": PRESSURE} | arguments))


def test_texts_with_units_are_read_and_others_refused_in_a_sentence():
    plant = rotorsim.Plant("plain_rotor")
    speed = 3000 * np.pi / 30
    assert np.array_equal(plant.equilibrium("3000 rpm", "0 Pa").disc, plant.equilibrium(speed).disc)
    assert np.array_equal(plant.linearise("3000 rpm").A, plant.linearise(speed).A)
    assert plant.simulate("2 ms", "3000 rpm").equals(plant.simulate(0.002, speed))
    with pytest.raises(DataError, match="speed: '3000' has no unit"):
        plant.equilibrium("3000")
    with pytest.raises(DataError, match="pressure: "):
        plant.linearise(0.0, [])
    with pytest.raises(DataError, match=r"duration: .* is not a whole number of samples"):
        plant.simulate(0.01005)
