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
LATE = {"actuator_delay": {"injector": 3, "delay": "0.7 ms"}, "actuator_gain": {"injector": 3, "error": 0.1}}
READ = [f"meas.pin_{k}" for k in (1, 2, 3, 4)]


@pytest.fixture(scope="module", params=["reference", pytest.param("ideal", marks=pytest.mark.nightly)])
def sensing(request, exported_plant):
    """Model and loaded unit of the rig with a sensor on every pin, those of the first and second with an error each.

    The reference of the third pin is late and has a gain error.
    """
    sensors = [{"injector": 1, "lag": "0.25 ms", "sigma": "20 nm"}, {"injector": 2, "gain": 0.05}]
    text = tomlkit.parse(machine_text("dtu_gas_bearing"))
    text["actuators"]["mode"], text["effects"]["pin_sensor"] = request.param, sensors
    text["effects"] |= LATE
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


@pytest.mark.parametrize("per", [1, 5])
def test_an_ideal_pin_is_not_compared_where_it_jumps_after_a_late_reference(per):
    """A jump at a communication point is in the plant's row there and in the unit's one step later: y steps at 40."""
    text = tomlkit.parse(machine_text("dtu_gas_bearing"))
    text["actuators"]["mode"] = "ideal"
    text["effects"] = {"gravity": {"acceleration": "9.81 m/s^2"}, "pin_sensor": {}, **LATE}
    late = plant_unit(Plant(Machine.from_text(tomlkit.dumps(text)), n_theta=16, n_z=8, dt=2e-4), 0.0, 0.3e6)
    found = plant_outputs(late, reference_inputs(late, 60, per * SAMPLE), per * SAMPLE)
    # 0.7 ms are 3.5 samples: two jumps of half the size, which lie between two points of 1 ms
    jumps = {1: {"1": [], "2": [], "3": [43, 44], "4": []}, 5: {"1": [], "2": [], "3": [], "4": []}}[per]
    for name in ("piezo.position", "meas.pin"):
        for k, more in jumps.items():
            values, good = found[f"{name}_{k}"]
            assert np.flatnonzero(~good)[1:].tolist() == [30, 40, *more] and np.ptp(values) > 1e-6
