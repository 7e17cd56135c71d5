"""Probes as outputs of a plant unit: the bits of the Python plant."""

import numpy as np
import pytest

from fmu.check import plant_outputs
from fmu.importer import reference_inputs
from rotorsim.machine import Machine, machine_text
from rotorsim.plant import Plant

SAMPLE = 2e-4
UNITS = {"meas.probe_DE_x": "V", "meas.probe_DE_y": "m", "meas.probe_V": "m/s", "meas.probe_A": "V"}


@pytest.fixture(scope="module", params=["plain_rotor", pytest.param("dtu_gas_bearing", marks=pytest.mark.slow)])
def probed(request, probed_rotor, exported_plant, probes):
    """Model of a machine with probes and its loaded unit; the rig's sleeve is on a pedestal."""
    if request.param == "plain_rotor":
        return probed_rotor
    machine = Machine.from_text(machine_text(request.param) + "\n[effects.pedestal]\nmass_ratio = 0.3\n" + probes)
    return exported_plant(Plant(machine, n_theta=16, n_z=8, dt=2e-4), 0.0)


def test_probes_of_a_unit_have_the_bits_of_the_plant(probed):
    model, unit = probed
    inputs = reference_inputs(model, 300, SAMPLE)
    truth = plant_outputs(model, inputs, SAMPLE)
    instance = unit.instance()
    instance.initialise()
    rows = instance.run(inputs, SAMPLE, list(truth))
    instance.close()
    for k, (name, (values, good)) in enumerate(truth.items()):
        assert values[good].tobytes() == rows[good, k].tobytes(), name
    for name in UNITS:
        values, good = truth[name]
        assert good.all() and np.ptp(values) > 0, name


def test_probes_of_a_unit_state_unit_direction_and_place(probed):
    model, _ = probed
    known = {v.name: v for v in model.variables}
    assert {name: known[name].unit for name in UNITS} == UNITS
    assert known["probes.DE_x.angle"].start == pytest.approx(np.pi / 4)
    assert known["probes.DE_x.position"].start == 0.133
    assert "probes.A.position" not in known
