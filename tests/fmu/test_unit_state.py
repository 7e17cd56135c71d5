"""States, instances and events of a unit."""

import threading

import numpy as np
import pytest

from fmu.check import plant_outputs
from fmu.importer import reference_inputs
from rotorsim.machine import load_machine
from rotorsim.plant import Plant

SAMPLE = 2e-4
OUTPUTS = ["disc.x", "disc.y", "meas.disc_x", "meas.speed", "meas.pressure", "film.h_min"]


def part(inputs, first, last):
    """Return a part of the rows."""
    return {name: values[first:last] for name, values in inputs.items()}


def test_a_state_continues_bitwise_also_in_another_instance(unit, running, model):
    inputs = reference_inputs(model, 200, SAMPLE)
    running.run(part(inputs, 0, 100), SAMPLE, OUTPUTS)
    saved = running.save()
    rows = [running.run(part(inputs, 100, 200), SAMPLE, OUTPUTS, 100)]
    running.restore(saved)
    rows.append(running.run(part(inputs, 100, 200), SAMPLE, OUTPUTS, 100))
    other = unit.instance("other")
    other.initialise({"shaft.speed_ref": 50.0})
    other.restore(saved)
    rows.append(other.run(part(inputs, 100, 200), SAMPLE, OUTPUTS, 100))
    other.close()
    assert rows[0].tobytes() == rows[1].tobytes() == rows[2].tobytes()


@pytest.mark.slow
def test_random_forces_and_a_wandering_speed_are_those_of_the_plant_and_part_of_the_state(exported_plant):
    values = {"broadband_force.density": "0.01 N^2/Hz", "speed_wander.sd": 0.01, "speed_wander.time": "20 ms"}
    machine = load_machine("plain_rotor")
    for path, value in values.items():
        machine = machine.replace(f"effects.{path}", value)
    model, unit = exported_plant(Plant(machine), 250.0)
    inputs = reference_inputs(model, 200, SAMPLE)
    truth = plant_outputs(model, inputs, SAMPLE, seed=3)
    instance = unit.instance()
    instance.initialise({"noise.seed": 3.0})
    rows = instance.run(part(inputs, 0, 100), SAMPLE, list(truth))
    saved = instance.save()
    instance.run(part(inputs, 100, 150), SAMPLE, list(truth), 100)
    instance.restore(saved)
    rows = np.concatenate([rows[:-1], instance.run(part(inputs, 100, 200), SAMPLE, list(truth), 100)])
    instance.close()
    for k, (name, (found, good)) in enumerate(truth.items()):
        assert found[good].tobytes() == rows[good, k].tobytes(), name
    speed = truth["shaft.speed"][0]
    assert np.abs(speed / 250.0 - 1).max() > 1e-3


def test_a_reset_unit_starts_again_from_its_start_values(unit, running, model):
    inputs = reference_inputs(model, 100, SAMPLE)
    first = running.run(inputs, SAMPLE, OUTPUTS)
    running.slave.reset()
    running.initialise()
    assert running.run(inputs, SAMPLE, OUTPUTS).tobytes() == first.tobytes()


def test_the_seed_moves_the_measured_values_and_nothing_else(unit, model):
    inputs, rows = reference_inputs(model, 50, SAMPLE), []
    for seed in (0, 1):
        instance = unit.instance()
        instance.initialise({"noise.seed": seed})
        rows.append(instance.run(inputs, SAMPLE, ["disc.x", "meas.disc_x"]))
        instance.close()
    assert rows[0][:, 0].tobytes() == rows[1][:, 0].tobytes()
    assert not np.array_equal(rows[0][:, 1], rows[1][:, 1])


def test_eight_instances_in_eight_threads_give_what_one_gives(unit, model):
    inputs = reference_inputs(model, 300, SAMPLE)
    instances = [unit.instance(f"n{k}") for k in range(8)]
    for instance in instances:
        instance.initialise()
    found = [None] * 8

    def run(k):
        found[k] = instances[k].run(inputs, SAMPLE, OUTPUTS)

    threads = [threading.Thread(target=run, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    alone = unit.instance("alone")
    alone.initialise()
    expected = alone.run(inputs, SAMPLE, OUTPUTS).tobytes()
    assert all(rows.tobytes() == expected for rows in found)
    for instance in (*instances, alone):
        instance.close()


def test_touchdown_is_an_event_that_ends_a_step_early(units):
    instance = units[3].instance(eventModeUsed=True, earlyReturnAllowed=True)
    instance.initialise()
    instance.slave.enterStepMode()
    instance.set({"disc.force_x": 600.0})
    event, _, early, reached = instance.step(0.0, 0.05)
    assert event and early and 0.0 < reached < 0.05
    assert reached == pytest.approx(round(reached / SAMPLE) * SAMPLE, abs=1e-12)
    assert instance.get(["film.touchdown", "time"]).tolist() == [1.0, reached]
    assert "the journal touches its sleeve" in instance.messages
    instance.slave.enterEventMode()
    assert instance.slave.updateDiscreteStates()[0] is False
    instance.slave.enterStepMode()
    instance.step(reached, SAMPLE)
    instance.close()


def test_without_event_mode_a_touchdown_is_a_flag(unit, running):
    running.set({"disc.force_x": 600.0})
    running.step(0.0, 0.02)
    assert running.get(["film.touchdown"])[0] == 1.0
    running.step(0.02, SAMPLE)


def resident():
    """Return the memory of this process [kB]."""
    from pathlib import Path

    words = [line.split() for line in Path("/proc/self/status").read_text().splitlines()]
    return next(int(w[1]) for w in words if w[0] == "VmRSS:")


@pytest.mark.slow
def test_a_million_steps_and_a_thousand_instances_leave_no_memory_behind(units):
    unit = units[2]
    instance = unit.instance()
    instance.initialise()

    def steps(first, n):
        for k in range(first, first + n):
            instance.slave.doStep(currentCommunicationPoint=k * SAMPLE, communicationStepSize=SAMPLE)

    steps(0, 10_000)
    before = resident()
    steps(10_000, 1_000_000)
    instance.close()
    for _ in range(1000):
        other = unit.instance()
        other.initialise()
        other.restore(other.save())
        other.close()
    assert resident() - before < 4000
