"""Shipped machines: the calibrations of the rig, a measured kit and the plain rotor."""

import math
import subprocess
import sys

import pytest

import rotorsim as rs
from rotorsim.machine import GasFilm, load_machine, machine_text, shipped_machines
from rotorsim.machine.schema import Machine

CALIBRATIONS = ("dtu_gas_bearing", "dtu_gas_bearing_b", "dtu_gas_bearing_c", "dtu_gas_bearing_d")
RIGS = ("dtu_first_assembly", *CALIBRATIONS, "dtu_paper_a")


def test_the_shipped_machines_are_a_rotor_kit_three_assemblies_of_the_rig_designs_and_a_plain_rotor():
    others = ("foil_turbo_rotor", "grooved_turbo_rotor", "plain_rotor", "pump_on_tables", "rigid_rotor_self_acting")
    assert shipped_machines() == ("aerostatic_spindle", "bently_rk4", *RIGS, *others)


@pytest.mark.parametrize("name", shipped_machines())
def test_a_shipped_machine_loads_and_its_canonical_text_gives_it_back(name):
    machine = load_machine(name)
    assert machine.name == name
    assert Machine.from_text(machine.text) == machine
    assert Machine.from_text(machine.text).hash == machine.hash


@pytest.mark.parametrize("name", RIGS)
def test_the_shaft_of_the_rig_weighs_what_the_thesis_states(name):
    """DTU thesis, App. H: 2.04 kg; half a unit of the last digit."""
    shaft = load_machine(name).shaft
    assert shaft.mass == pytest.approx(2.04, abs=0.005)
    assert shaft.length == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize("name", RIGS)
def test_disc_and_gas_bearing_of_the_rig_are_where_the_thesis_has_them(name):
    """Disc at the shaft's end, gas bearing at 0.625 of its distance, amid the journal (DTU thesis)."""
    machine = load_machine(name)
    distance = machine.discs[0].position
    before, journal, _ = machine.shaft.sections
    assert machine.shaft.end == pytest.approx(distance, abs=1e-12)
    assert machine.film.position == pytest.approx(0.625 * distance, abs=1e-12)
    centre = machine.shaft.start + before.length + journal.length / 2
    assert machine.film.position == pytest.approx(centre, abs=1e-12)
    assert journal.outer_diameter == machine.film.diameter


def test_the_rig_has_four_injectors_each_driven_by_the_voltage_of_its_axis():
    """DTU thesis, eq. (C.1): r_p1 = r0 + ry, r_p2 = r0 + rx, r_p3 = r0 - ry, r_p4 = r0 - rx."""
    found = [(round(math.degrees(i.angle)), i.reference) for i in load_machine("dtu_gas_bearing").injectors]
    assert found == [(90, "+y"), (0, "+x"), (-90, "-y"), (180, "-x")]


def test_calibration_c_takes_the_loss_factor_form():
    injection = load_machine("dtu_gas_bearing_c").injection
    assert (injection.law, injection.pin_discharge) == ("loss_factor", None)
    assert injection.loss_factor > 0


def test_the_plain_rotor_has_no_gas_film():
    machine = load_machine("plain_rotor")
    assert not any(isinstance(b, GasFilm) for b in machine.bearings)
    assert machine.film is None and machine.injectors == ()


def test_a_shipped_machine_needs_no_pint_and_importing_rotorsim_is_silent_and_light():
    code = (
        "import sys, rotorsim; assert 'numpy' not in sys.modules and 'pydantic' not in sys.modules;"
        "rotorsim.load_machine('dtu_gas_bearing'); assert 'pint' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_an_effect_at_neutral_values_is_named_as_one_without_effect():
    """A table of gravity without its acceleration makes the rotor weightless."""
    text = machine_text("plain_rotor").replace('acceleration = "9.81 m/s^2"', "")
    shown = rs.machine.summary(Machine.from_text(text))
    assert "effects: unbalance" in shown and shown.endswith("without effect: gravity")
