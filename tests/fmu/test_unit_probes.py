"""Probes as outputs of a plant unit: the bits of the Python plant."""

import numpy as np
import pytest

from fmu.check import plant_outputs
from fmu.importer import reference_inputs
from rotorsim.machine import Machine, machine_text
from rotorsim.plant import Plant

SAMPLE = 2e-4
PROBE = """
[[probes]]
name = "{}"
angle = "{} deg"
quantity = "{}"
{}
"""
PLACE = 'position = "133 mm"'
AROUND = '\n[effects.base_vibration]\nx = "2 m/s^2"\nfrequency = "47 Hz"\n' + "".join(
    PROBE.format(*row)
    for row in (
        ("DE_x", 45, "relative_displacement", PLACE + '\nsensitivity = "7.87 V/mm"'),
        ("DE_y", 135, "absolute_displacement", PLACE + '\nsense = "-"'),
        ("V", 30, "housing_velocity", ""),
        ("A", 60, "housing_acceleration", 'sensitivity = "100 mV/g"'),
    )
)
UNITS = {"meas.probe_DE_x": "V", "meas.probe_DE_y": "m", "meas.probe_V": "m/s", "meas.probe_A": "V"}


@pytest.fixture(scope="module", params=[pytest.param("plain_rotor", marks=pytest.mark.slow), "dtu_gas_bearing"])
def probed(request, gcc, tmp_path_factory):
    """Model of a machine with probes and its loaded unit; the rig's sleeve is on a pedestal."""
    from fmu.export import choose, export, plant_unit
    from fmu.importer import ImportedUnit

    text = machine_text(request.param) + AROUND
    if request.param == "dtu_gas_bearing":
        text = text.replace(
            '[effects.base_vibration]\nx = "2 m/s^2"\nfrequency = "47 Hz"', "[effects.pedestal]\nmass_ratio = 0.3"
        )
    model = plant_unit(Plant(Machine.from_text(text), n_theta=16, n_z=8, dt=2e-4), 0.0)
    files = export(model, tmp_path_factory.mktemp("units") / "probed.fmu", (3,), choose("host"))
    with ImportedUnit(files[3]) as unit:
        yield model, unit


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
