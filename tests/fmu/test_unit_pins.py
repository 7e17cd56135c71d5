"""Measured pins as outputs of a plant unit: the bits of the Python plant."""

import numpy as np
import pytest
import tomlkit

from fmu.check import plant_outputs
from fmu.export import plant_unit
from fmu.importer import reference_inputs
from rotorsim.machine import machine_text
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant

SAMPLE = 2e-4
READ = [f"meas.pin_{k}" for k in (1, 2, 3, 4)]


@pytest.fixture(scope="module", params=["reference", pytest.param("ideal", marks=pytest.mark.nightly)])
def sensing(request, exported_plant):
    """Model and loaded unit of the rig with a sensor on every pin, those of the first and second with an error each."""
    sensors = [{"injector": 1, "lag": "0.25 ms", "sigma": "20 nm"}, {"injector": 2, "gain": 0.05}]
    text = tomlkit.parse(machine_text("dtu_gas_bearing"))
    text["actuators"]["mode"], text["effects"]["pin_sensor"] = request.param, sensors
    return exported_plant(Plant(Machine.from_text(tomlkit.dumps(text)), n_theta=16, n_z=8, dt=2e-4), 0.0, 0.3e6)


@pytest.mark.slow
def test_measured_pins_of_a_unit_have_the_bits_of_the_plant(sensing):
    model, unit = sensing
    inputs = reference_inputs(model, 300, SAMPLE)
    truth = plant_outputs(model, inputs, SAMPLE, seed=3)
    instance = unit.instance()
    instance.initialise({"noise.seed": 3.0})
    rows = instance.run(inputs, SAMPLE, list(truth))
    instance.close()
    for k, (name, (values, good)) in enumerate(truth.items()):
        assert values[good].tobytes() == rows[good, k].tobytes(), name
    read = np.array([truth[name][0] for name in READ])
    pins = np.array([truth[f"piezo.position_{k}"][0] for k in (1, 2, 3, 4)])
    assert np.array_equal(read[2:], pins[2:]) and read[1] == pytest.approx(1.05 * pins[1], rel=1e-15)
    assert np.ptp(pins, axis=1).min() > 1e-6 and np.abs(read[0] - pins[0]).max() > 1e-7


def test_only_a_plant_with_sensors_of_its_pins_has_such_outputs(model):
    text = tomlkit.parse(machine_text("dtu_gas_bearing"))
    del text["effects"]["pin_sensor"]
    bare = plant_unit(Plant(Machine.from_text(tomlkit.dumps(text)), n_theta=16, n_z=8, dt=2e-4), 0.0, 0.3e6)
    names, fewer = ({v.name for v in one.variables} for one in (model, bare))
    assert names >= {*READ, "piezo.position_1"} and "piezo.position_1" in fewer and not fewer & set(READ)
