"""Variable table of a unit: units, limits set by the effects, fixed and tunable parameters."""

from pathlib import Path

import numpy as np
import pytest

from fmu.export import file_names
from fmu.variables import display_unit, exponents, fmi_name, limits
from reynolds.addressed_calls import ADDRESS
from rotorsim.base.units import TABLE
from rotorsim.effects import REGISTRY
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.calls import CALLS


@pytest.mark.parametrize(
    ("unit", "expected"),
    [
        ("N*m", {"kg": 1, "m": 2, "s": -2}),
        ("m/s^2", {"m": 1, "s": -2}),
        ("Pa*s/kg", {"m": -1, "s": -1}),
        ("J/(kg*K)", {"m": 2, "s": -2, "K": -1}),
        ("kg/(s*Pa^2)", {"kg": -1, "m": 2, "s": 3}),
        ("1/K", {"K": -1}),
        ("rad/s", {"s": -1, "rad": 1}),
    ],
)
def test_units_are_taken_apart_into_base_units(unit, expected):
    assert exponents(unit) == expected


def test_every_unit_of_machine_files_has_a_name_and_exponents():
    for unit in set(TABLE) - {"1"}:
        assert fmi_name(unit) and (exponents(unit) or unit == "rad")


def test_people_read_micrometres_and_revolutions():
    assert display_unit("m", 1e-5) == "um" and display_unit("rad/s", 600.0) == "rpm" and display_unit("V", 1.0) is None


def test_effects_draw_their_own_limits():
    machine = load_machine("dtu_gas_bearing").replace("effects.weak_injector.injector", 2)
    machine = machine.replace("effects.journal_tilt.x", "0 mrad").replace("effects.clearance_growth.temperature", "0 K")

    def found(name, field, half=True):
        return limits(machine, machine.effects[name][0], field, half)

    assert found("weak_injector", "injector") == (1.0, 4.0)
    assert found("journal_tilt", "x") == (0.0, 0.0)
    assert found("journal_tilt", "x", half=False)[1] == 2e-3
    low = found("clearance_growth", "temperature")[0]
    assert -200.0 <= low < 0.0
    assert not type(machine.effects["clearance_growth"][0])(temperature=low).problems(machine)


def test_counts_of_effects_are_whole(model):
    whole = {v.name for v in model.variables if v.kind == "integer"}
    assert "effects.encoder.counts" in whole and "effects.unbalance.me" not in whole


def test_every_parameter_of_every_effect_of_the_machine_is_a_variable(model):
    from dataclasses import fields

    names = {v.name for v in model.variables}
    for effect, entries in model.plant.machine.effects.items():
        for field in fields(REGISTRY[effect]):
            assert len(entries) == 1
            assert f"effects.{effect}.{field.name}" in names or field.name == "bearing"  # of all films


def test_start_values_lie_within_the_limits_and_in_the_record(model):
    record = model.assembly.numbers
    for v in model.variables:
        if v.store == "parameter":
            assert v.low <= v.start <= v.high and record[v.index] == v.start, v.name


def test_addresses_of_this_process_stay_out_of_a_unit():
    """A run writes them into the record, whose numbers as doubles a unit carries."""
    plant = Plant("plain_rotor")
    before = plant.assembly.numbers
    plant.start(100.0).advance(np.tile([100.0, 101325.0, 0.0, 0.0, 0.0, 0.0], (2, 1)))
    a = plant.assembly
    assert a.record[CALLS][0][:, ADDRESS].any() and np.array_equal(a.numbers, before)
    of_calls = a.numbers.view(a.record.dtype)[CALLS]
    assert of_calls.size and not of_calls.any()


def test_a_unit_file_ends_in_fmu():
    assert file_names(Path("fm"), [3]) == {3: Path("fm.fmu")}
    assert file_names(Path("a.b"), [2, 3]) == {2: Path("a.b_fmi2.fmu"), 3: Path("a.b_fmi3.fmu")}


def distinct(number, v):
    """Return a value of a variable, within its limits, that no other of its size has."""
    low, high = (float(end or sign * 1e30) for end, sign in ((v.min, -1), (v.max, 1)))
    start = float(v.start) if v.type != "Boolean" else 1.0
    if v.type != "Float64":
        return start
    value = start * (1 + 1e-5 * (number + 1)) if start else 1e-9 * (number + 1)
    return value if low <= value <= high else start * (1 - 1e-5 * (number + 1))


@pytest.mark.parametrize("kind", ["plant", "law", "linear"])
def test_the_addresses_for_calibration_tools_are_where_the_values_lie(files, kind, gcc, tmp_path):
    """Each address of the A2L file, read in an instance's memory, has the value that FMI gives."""
    import ctypes
    import re
    import zipfile

    from law_models import scheduled_law
    from lpv_models import make_lpv

    from fmu.export import choose, export
    from fmu.importer import ImportedUnit
    from fmu.linear_units import LawUnit, LinearUnit

    unit = LawUnit(scheduled_law()) if kind == "law" else LinearUnit(make_lpv("2"), "bearing", 300.0, 5e5)
    file = files[3] if kind == "plant" else export(unit, tmp_path / "unit.fmu", (3,), choose("host"))[3]
    with zipfile.ZipFile(file) as archive:
        text = archive.read(next(name for name in archive.namelist() if name.endswith(".a2l"))).decode()
    rows = re.findall(r'/begin (\w+) (\S+) "(?:[^"\\]|\\.)*" .*?(0x[0-9A-F]+)', text)
    assert len(rows) == text.count("/begin MEASUREMENT") + text.count("/begin CHARACTERISTIC") >= 6
    places = {name: int(place, 16) for _, name, place in rows}
    with ImportedUnit(file) as loaded:
        scalars = {name: v for name, v in loaded.variables.items() if not v.dimensions}
        inputs = {name for name, v in scalars.items() if v.causality == "input" and v.type != "Clock"}
        tunable = {name for name, v in scalars.items() if v.causality == "parameter" and v.variability == "tunable"}
        assert {name for word, name, _ in rows if word == "CHARACTERISTIC"} == inputs | tunable
        assert {name for word, name, _ in rows if word == "MEASUREMENT"} == set(loaded.names("output"))
        instance = loaded.instance()
        instance.initialise()
        given = {name: distinct(k, scalars[name]) for k, name in enumerate([*inputs, *tunable])}
        instance.set(given)
        instance.step(0.0, 2e-4)
        for name, place in places.items():
            value = ctypes.c_double.from_address(instance.slave.component + place).value
            assert value == instance.get([name])[0] == given.get(name, value), name
        assert len({given[name] for name in given if scalars[name].type == "Float64"}) > len(inputs) // 2
        instance.close()


def test_a_parameter_written_at_its_address_acts_from_the_next_step_on(units, files):
    import ctypes
    import re
    import zipfile

    name, unit = "effects.unbalance.me", units[3]
    with zipfile.ZipFile(files[3]) as archive:
        text = archive.read(next(one for one in archive.namelist() if one.endswith(".a2l"))).decode()
    place = int(re.search(rf"{re.escape(name)} .* VALUE (0x[0-9A-F]+)", text)[1], 16)
    rows = {}
    for way in ("nothing", "address", "FMI"):
        instance = unit.instance()
        instance.initialise({"shaft.speed_ref": 300.0})
        instance.step(0.0, 2e-4)
        before = instance.get(["disc.x"])[0]
        if way == "address":
            ctypes.c_double.from_address(instance.slave.component + place).value = 3e-6
        if way == "FMI":
            instance.set({name: 3e-6})
        assert instance.get(["disc.x"])[0] == before
        instance.step(2e-4, 2e-4)
        rows[way] = instance.get(["disc.x"])[0]
        instance.close()
    assert rows["address"] == rows["FMI"] != rows["nothing"]
