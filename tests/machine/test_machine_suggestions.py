"""Advice in machine-file messages: every advised text is valid."""

import re
from dataclasses import fields

import pytest

from rotorsim.base.errors import MachineFileError
from rotorsim.base.quantity import quantity_of
from rotorsim.base.units import parse
from rotorsim.effects import REGISTRY
from rotorsim.machine import Machine, bearings, gas_film, load_machine, machine_text, numerics, rotor, shipped_machines
from rotorsim.machine.part import Part
from rotorsim.machine.plausibility import question, range_of, ranges

PARTS = [
    kind for room in (rotor, bearings, gas_film, numerics) for kind in vars(room).values()
    if isinstance(kind, type) and issubclass(kind, Part) and kind is not Part
]  # fmt: skip
HOMES = {
    "ShaftMaterial": "shaft.material", "Section": "shaft.sections.0", "ShaftPiece": "shaft.sections.0",
    "Layer": "shaft.layers.0", "Shaft": "shaft", "ShaftMode": "shaft.modes.0",
    "Disc": "discs.0", "LumpedMass": "point_masses.0",
    "LinearBearing": "bearings.0", "BearingCoefficients": "bearings.0", "BearingPart": "bearings.0",
    "BearingMass": "bearings.0",
    "Support": "bearings.0.support",
    "TableBearing": "bearings.2", "Point": "bearings.2.points.0", "Probe": "probe", "GasFilm": "bearings.1",
    "Gas": "gas", "Injection": "injection",
    "Orifices": "bearings.1.orifices.0", "Lobes": "bearings.1.lobes", "Steps": "bearings.1.steps.0",
    "Grooves": "bearings.1.grooves", "Foil": "bearings.1.foil",
    "ThrustBearing": "thrust_bearings.0", "SpiralGrooves": "thrust_bearings.0.grooves",
    "RingFeed": "thrust_bearings.0.feed",
    "PinnedInjector": "injectors.0", "Actuators": "actuators", "Drive": "drive", "Grid": "grid",
    "Solver": "solver", "Limits": "limits", "Checked": "checked",
    "ProbePart": "probes.0", "ShaftProbe": "probes.0", "HousingPart": "probes.1", "HousingVelocity": "probes.1",
    "HousingAcceleration": "probes.2",
}  # fmt: skip
FIELDS = {
    f"{HOMES[kind.__name__]}.{name}": quantity
    for kind in PARTS for name, info in kind.model_fields.items() if (quantity := quantity_of(info)) is not None
} | {
    f"shaft.{pieces}.0.material.{name}": quantity_of(info)
    for pieces in ("sections", "layers") for name, info in rotor.ShaftMaterial.model_fields.items()
} | {
    f"effects.{effect}.{f.name}": quantity
    for effect, kind in REGISTRY.items() for f in fields(kind) if (quantity := quantity_of(f)) is not None
}  # fmt: skip
WRONG = ["x", True, [], "5 parsec", "3 V*s*kg", 0, 1, -1, 33.5, *(10.0**k for k in range(-12, 13, 3)), "1e999", 25, 511]


def advised(quantity, value):
    """Value that the error message advises; None where the value is right."""
    try:
        quantity.parse(value)
    except ValueError as error:
        message = re.search(r"write (e\.g\.|at least|at most) (.+)$", str(error))
        assert message, str(error)
        return message[1], message[2].strip("'")
    return None


def read(quantity, text):
    """The advice, read as a machine file would."""
    return quantity.parse(text if quantity.unit != "1" else int(text) if quantity.multiple else float(text))


@pytest.mark.parametrize("path", FIELDS)
def test_what_is_advised_is_valid_for_the_field_and_an_example_is_usual(path):
    quantity = FIELDS[path]
    extreme = [f"{sign}{size} {quantity.unit}".replace("1e300 1", "1e300") for sign in "+-" for size in ("1e300",)]
    for value in [*WRONG, *extreme]:
        found = advised(quantity, value)
        if found is not None:
            number = read(quantity, found[1])
            digits = isinstance(value, (int, float)) and not isinstance(value, bool)
            if found[0] == "e.g." and not digits:
                assert question(path, number, quantity.unit) is None, (value, found)


def test_a_missing_value_is_advised_in_the_size_of_the_field():
    text = machine_text("dtu_gas_bearing").replace('pin_bias = "22.5 um"', "")
    with pytest.raises(MachineFileError, match=r"injection\.pin_bias: missing .*; write e\.g\. '22\.5 um'$"):
        Machine.from_text(text)


ADVICE = {
    "clearance = 25": "'25 um'",
    "clearance = 0.000025": "'2.5e-05 m'",
    'clearance = "-5 mm"': "'25 um'",
    'clearance = "25 bananas"': "'25 um'",
    "youngs_modulus = 210": "'210 GPa'",
    "mass = 1500": "'1500 g'",
    "n_theta = 511": "512",
}


@pytest.mark.parametrize(("line", "advice"), ADVICE.items())
def test_bare_numbers_get_the_unit_that_makes_sense_of_them(line, advice):
    field = line.partition(" =")[0]
    text = re.sub(rf"(?m)^{field} = [^#\n]*", f"{line} ", machine_text("dtu_gas_bearing"), count=1)
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(text)
    assert caught.value.problems[0].endswith(f"write e.g. {advice}")


def test_an_unbalance_without_a_disc_is_advised_to_stand_on_the_shaft():
    text = machine_text("plain_rotor")
    text = text[: text.index("[[discs]]")] + text[text.index("[[bearings]]") :]
    with pytest.raises(MachineFileError, match=r"no disc to act on; write e\.g\. '300 mm'"):
        Machine.from_text(text)


FILM = """
[[bearings]]
kind = "gas_film"
position = "200 mm"
diameter = "20 mm"
length = "20 mm"
clearance = "20 um"

[effects.weak_injector]
blocked = 0.1
"""


def test_an_effect_on_injectors_is_not_advised_to_take_one_of_none():
    text = machine_text("plain_rotor").replace("[effects.gravity]", f"{FILM}\n[effects.gravity]")
    with pytest.raises(MachineFileError, match=r"effects\.weak_injector: acts in injectors, but there are none"):
        Machine.from_text(text)


@pytest.mark.parametrize("name", shipped_machines())
def test_no_shipped_machine_is_questioned(name, recwarn):
    load_machine(name)
    assert not recwarn.list


def test_every_range_is_of_a_field_an_effect_or_a_parameter_and_holds_its_example():
    from rotorsim.commands.experiment import ClosedLoopSetup
    from rotorsim.experiments import EXPERIMENTS
    from rotorsim.experiments.experiment import parameters

    known = {(re.sub(r"\.\d+", "", path), quantity.unit) for path, quantity in FIELDS.items()}
    known |= {(e.name, p.unit) for kind in (*EXPERIMENTS.values(), ClosedLoopSetup) for e, p in parameters(kind)}
    known |= {("frequency", "Hz"), ("least_film", "m")}  # options of map
    assert set(ranges()) <= known
    for path, quantity in FIELDS.items():
        found = range_of(path, quantity.unit)
        assert found is None or quantity.example is None or found.holds(quantity.example), path


@pytest.mark.parametrize(("length", "meant"), [("50", "50 mm"), ("117.0125", "117.0125 mm"), ("0.05", "0.05 m")])
def test_units_that_no_drawing_has_are_not_advised(length, meant):
    """50 was advised as '50 cm', a shaft ten times too long."""
    text = machine_text("dtu_gas_bearing").replace('length = "50 mm"', f"length = {length}")
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(text)
    assert caught.value.problems == (f"shaft.sections.1.length: {length} has no unit; write e.g. '{meant}'",)


@pytest.mark.parametrize(
    ("given", "meant"),
    [("300 MPa", "300 kPa"), ("3 MPa", "3 bar"), ("5 GPa", "5 bar"), ("0.5 Pa", "0.5 MPa"), ("30 bar", "30 kPa")],
)
def test_the_unit_of_a_question_is_the_one_nearest_to_what_is_typical(given, meant):
    """5 GPa was answered by '5 kPa', 3 MPa by '3 kPa'."""
    assert f"; '{meant}' would be usual" in question("pressure", parse(given, "Pa"), "Pa", given)


BEYOND = {
    "bearings.1.clearance": ("25 mm", "25 um"),
    "injection.pin_bias": ("22.5 mm", "22.5 um"),
    "effects.unbalance.me": ("25 kg*m", "25 g*mm"),
    "shaft.sections.0.length": ("600 m", "600 mm"),
}


@pytest.mark.parametrize("field", BEYOND)
def test_a_value_beyond_its_limit_is_answered_with_the_unit_that_was_meant(field):
    given, meant = BEYOND[field]
    with pytest.raises(
        MachineFileError,
        match=rf"'{re.escape(given)}' is above the limit \(is '{re.escape(meant)}' meant\?\); write at most",
    ):
        load_machine("dtu_gas_bearing").replace(field, given)


def test_unusual_values_are_reported_together_with_what_is_wrong():
    text = machine_text("dtu_gas_bearing").replace('"22.5 um"', '"22.5 mm"').replace('"7850 kg/m^3"', '"7.85 kg/m^3"')
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(text)
    assert [line.split(":")[0] for line in caught.value.problems] == ["injection.pin_bias", "shaft.material.density"]
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text('unusual = ["shaft.material.density"]\n' + text)
    assert [line.split(":")[0] for line in caught.value.problems] == ["injection.pin_bias"]
