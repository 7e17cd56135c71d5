"""Limits of a plant's unit: the machine's, in the description and in a run; the end of the physics; names of units."""

from math import pi

import numpy as np
import pytest

from fmu.contents import page
from fmu.export import law_unit, named, plant_unit
from fmu.model import identifier
from rotorsim.base.errors import DataError
from rotorsim.machine import Limits
from rotorsim.machine.limits import check_speed, first_passed, speed_limit
from rotorsim.plant import Plant

SAMPLE = 2e-4
RIM = 0.07
"""Radius [m] of the rig's disc."""


def logged(unit):
    """Return an initialised instance and the list of (status, sentence) that it logs, with debug logging off."""
    from fmpy import fmi2

    from fmu.importer import Instance, fmi2_callbacks

    found = []

    class Logged(Instance):
        def _log3(self, environment, status, category, message):
            found.append((status, message.decode()))

        def _load(self, common, options, kind):
            if self.unit.is_3:
                super()._load(common, options, kind)
                self.slave.setDebugLogging(False, [])
                return
            self.slave = fmi2.FMU2Slave(**common)
            self.kept = fmi2_callbacks(lambda text: None)
            self.log2 = fmi2.fmi2CallbackLoggerTYPE(
                lambda environment, name, status, category, message: found.append((status, message.decode()))
            )
            self.kept.logger = self.log2
            self.slave.instantiate(callbacks=self.kept, loggingOn=False)

    instance = Logged(unit, "logged", None, {})
    instance.initialise()
    return instance, found


def test_the_limits_of_the_machine_stand_in_the_description(unit):
    speed, reference = unit.variables["shaft.speed_ref"], unit.variables["piezo.ref_x"]
    assert float(speed.max) == pytest.approx(500.0 / RIM, rel=1e-12) and float(speed.min) == -float(speed.max)
    assert (float(reference.min), float(reference.max)) == (-5.0, 5.0)
    assert float(unit.variables["injection.pressure"].min) == pytest.approx(-101325.0, abs=1.0)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        (
            "shaft.speed_ref",
            1e5,
            "shaft.speed_ref = 100000 rad/s (954930 rpm): outside -7142.86 to 7142.86, the rim of",
        ),
        ("shaft.speed_ref", -7200.0, "shaft.speed_ref = -7200 rad/s"),
        ("piezo.ref_x", 100.0, "piezo.ref_x = 100 V: outside -5 to 5, the actuators take actuators.reference_limit"),
        ("piezo.ref_y", -5.001, "piezo.ref_y = -5.001 V: outside -5 to 5"),
    ],
)
def test_what_a_simulation_refuses_is_an_error_that_leaves_the_state(unit, name, value, words):
    instance, log = logged(unit)
    before = instance.get(["disc.x", "shaft.speed", "film.h_min"])
    good = instance.get([name])[0]
    instance.set({name: value})
    with pytest.raises(Exception, match="status 3"):
        instance.step(0.0, SAMPLE)
    assert log[-1][0] == 3 and log[-1][1].startswith(words)
    assert instance.get(["disc.x", "shaft.speed", "film.h_min"]).tobytes() == before.tobytes()
    instance.set({name: good})
    instance.step(0.0, SAMPLE)
    instance.close()


def test_an_rpm_number_in_rad_per_s_is_warned_of_once(unit):
    instance, log = logged(unit)
    instance.set({"shaft.speed_ref": 628.5})  # within 0.1 % of the highest checked speed
    instance.step(0.0, 0.02)
    assert log == []
    for k in range(3):
        instance.set({"shaft.speed_ref": 6000.0 - k})
        instance.step(0.02 + 100 * k * SAMPLE, 100 * SAMPLE)
    assert [status for status, _ in log] == [1]
    assert log[0][1].startswith("shaft.speed_ref = 6000 rad/s (57295.8 rpm): is beyond 628.319 rad/s (6000 rpm)")
    assert log[0][1].endswith("this input is in rad/s")
    instance.set({"injection.pressure": 0.9e6})
    instance.step(0.02 + 300 * SAMPLE, SAMPLE)
    assert [status for status, _ in log] == [1, 1] and "checked pressures (0.3 to 0.7 MPa" in log[1][1]
    instance.slave.reset()
    instance.initialise({"shaft.speed_ref": 700.0})
    assert len(log) == 3
    instance.close()


def test_the_run_ends_where_the_journal_is_deeper_in_its_sleeve_than_the_clearance(unit):
    instance, log = logged(unit)
    instance.set({"disc.force_x": 1e5})
    with pytest.raises(Exception, match="status 3"):
        instance.step(0.0, 0.2)
    assert log[-1][0] == 3 and "the journal is inside its sleeve, deeper than 25 um" in log[-1][1]
    instance.slave.freeInstance()


def test_a_start_beyond_the_limits_is_refused_before_anything_is_compiled():
    plant = Plant("dtu_gas_bearing")
    with pytest.raises(DataError, match=r"speed: 71619\.7 rpm is above 68209\.3 rpm"):
        plant_unit(plant, 7500.0, 0.3e6)
    with pytest.raises(DataError, match="a turn has"):
        plant_unit(plant, 1e5, 0.3e6)


def test_a_pressure_is_refused_where_gas_is_supplied_to_no_film():
    plant = Plant("plain_rotor")
    with pytest.raises(DataError, match="no input for it"):
        plant_unit(plant, 0.0, 0.5e6)
    text = page(plant_unit(plant))
    assert "injection.pressure" not in text and "injectors: pin" not in text
    assert "injection.pressure (0.3 MPa)" in page(plant_unit(Plant("dtu_gas_bearing")))


@pytest.mark.parametrize(
    "change",
    [
        {"limits": Limits(tip_speed="42 m/s")},
        {"limits": Limits(temperature="80 degC")},
        {"limits": Limits(tip_speed="2000 m/s")},
    ],
)
def test_the_limit_of_the_speed_is_where_a_run_ends_or_is_refused(change):
    machine = Plant("dtu_gas_bearing").machine.replace("effects.gas_heating.heating", "50 K").with_(change)
    limit, why = speed_limit(machine)

    def refused(speed):
        try:
            check_speed(machine, speed)
        except DataError:
            return True
        return first_passed(machine, np.array([speed])) is not None

    assert not refused(limit * (1 - 1e-8)) and refused(limit * (1 + 1e-8)), why


def test_without_samples_in_a_turn_there_is_no_speed():
    machine = Plant("dtu_gas_bearing").machine.with_({"limits": Limits(tip_speed="2000 m/s")})
    assert speed_limit(machine)[0] == pytest.approx(2 * pi / (4 * SAMPLE))


def test_a_unit_is_named_by_its_subject_and_its_kind(model):
    from law_models import scheduled_law

    assert identifier(model) == "dtu_gas_bearing_plant"
    law = law_unit(scheduled_law(), 300.0, 0.5e6)
    assert identifier(law) == f"{law.name}_law" and identifier(named(law, "my_law_2")) == "my_law_2"
    for wrong in ("", "2nd", "a b", "ä", "a/../b", "x" * 61):
        with pytest.raises(DataError, match="not a name of a unit"):
            named(model, wrong)


def test_the_name_is_that_of_description_and_library(units, files):
    import zipfile

    assert {unit.description.modelName for unit in units.values()} == {"dtu_gas_bearing_plant"}
    for path in files.values():
        with zipfile.ZipFile(path) as archive:
            assert any(name.endswith("/dtu_gas_bearing_plant.so") for name in archive.namelist())
