"""Probes in machine files: what is read, and one sentence for each fault."""

import pytest

from rotorsim.base.errors import MachineFileError
from rotorsim.machine import Machine, load_machine, machine_text

PROBES = """
[[probes]]
name = "DE_x"
position = "150 mm"
angle = "45 deg"
quantity = "relative_displacement"
sensitivity = "200 mV/mil"

[[probes]]
name = "DE_y"
position = "150 mm"
angle = "135 deg"
quantity = "relative_displacement"
sense = "-"
"""
TEXT = load_machine("plain_rotor").text + PROBES
HOUSING = '"housing_velocity" # '
KNOWN = "'relative_displacement', 'absolute_displacement', 'housing_velocity' or 'housing_acceleration'"
FAULTS = [
    ('angle = "45 deg"\n', "", "probes.0.angle: missing (Direction from the shaft to the probe, from x (0) towards y); "
     "write e.g. '45 deg'"),
    ('position = "150 mm"\n', "", "probes.0.position: missing (Coordinate z of its plane); write e.g. '300 mm'"),
    ('"150 mm"', '"700 mm"', "probes.0.position: '700 mm' is outside the shaft (0 mm to 600 mm); "
     "move it or lengthen the shaft"),
    ('quantity = "relative_displacement"\n', "", f"probes.0.quantity: missing; write {KNOWN}"),
    ('"relative_displacement"', '"strain"', f"probes.0.quantity: 'strain' is not known; write {KNOWN}"),
    ('"relative_displacement"', "4", f"probes.0.quantity: 4 is not known; write {KNOWN}"),
    ('"DE_y"', '"DE_x"', "probes.1.name: 'DE_x' is the name of probes.0 too; give each its own"),
    ('"DE_x"', '"1X"', "probes.0.name: '1X' is not a name; write letters, digits and _, a letter first, e.g. 'DE_x'"),
    ('"relative_displacement"\nsensitivity', HOUSING, "probes.0.quantity: 'housing_velocity' needs a housing that "
     "moves; give its bearing a support, add [effects.pedestal] or [effects.base_vibration], "
     "or write 'relative_displacement'"),
    ('"200 mV/mil"', '"0 V/mm"', "probes.0.sensitivity: '0 V/mm' must be above 0; write e.g. '7.87 V/mm'"),
    ('"200 mV/mil"', '"100 mV/g"', "probes.0.sensitivity: '100 mV/g' is not a voltage/length; write e.g. '7.87 V/mm'"),
    ('"200 mV/mil"', "7.87", "probes.0.sensitivity: 7.87 has no unit; write e.g. '7.87 V/mm'"),
    ('sense = "-"', 'sense = "up"', "probes.1.sense: 'up' is not known; write '+' or '-'"),
    ('angle = "45', 'angel = "45', "probes.0.angel: unknown field; did you mean 'angle'?"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "sentence"), FAULTS)
def test_a_fault_of_a_probe_is_one_sentence(old, new, sentence):
    assert TEXT.count(old)
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(TEXT.replace(old, new, 1))
    assert caught.value.problems == (sentence,)


def test_probes_are_read_written_and_changed():
    machine = Machine.from_text(TEXT)
    assert machine.probes[0].sensitivity == pytest.approx(0.2 / 25.4e-6, rel=1e-15)
    assert Machine.from_text(machine.text) == machine
    assert machine.with_({"probes.1.position": 0.2}).probes[1].position == 0.2
    assert machine.replace("probes.1.sensitivity", "8 V/mm").probes[1].sensitivity == 8000.0
    assert machine.with_({"probes": ()}).text == Machine.from_text(machine_text("plain_rotor")).text


def test_an_accelerometer_takes_volts_per_g():
    own = '\n[effects.base_vibration]\n[[probes]]\nname = "A"\nangle = "0 deg"\nquantity = "housing_acceleration"\n'
    machine = Machine.from_text(machine_text("plain_rotor") + own + 'sensitivity = "100 mV/g"\n')
    assert machine.probes[0].sensitivity == pytest.approx(0.1 / 9.80665, rel=1e-15)
    assert machine.probes[0].position is None
    assert Machine.from_text(machine.text) == machine
