"""Faulty machine files: one sentence per problem with path, value, limit, remedy."""

import re
import tomllib
from pathlib import Path

import pytest

from rotorsim import machine
from rotorsim.base.errors import MachineFileError
from rotorsim.machine import load_machine, machine_text
from rotorsim.machine.part import Part
from rotorsim.machine.schema import Machine

RIG = machine_text("dtu_gas_bearing")

CASES = tomllib.loads(Path(__file__).with_name("bad_machines.toml").read_text(encoding="utf-8"))["case"]


@pytest.mark.parametrize("case", CASES, ids=[c["sentence"].partition(":")[0] for c in CASES])
def test_one_wrong_value_gives_one_sentence_that_states_what_to_write(case):
    assert case["old"] in RIG
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(RIG.replace(case["old"], case["new"], 1))
    assert len(caught.value.problems) == 1
    assert caught.value.problems[0].startswith(case["sentence"])


def test_several_problems_are_all_listed_each_on_its_line():
    text = (
        RIG.replace('"-121.3 mm"', "0").replace("n_z = 16", "n_z = 15").replace('force_2x = "4 N"', 'force_2x = "1 kg"')
    )
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(text.replace('clearance = "25 um"', ""))
    paths = [problem.split(":")[0] for problem in caught.value.problems]
    assert paths == ["shaft.start", "bearings.1.clearance", "grid.n_z", "effects.coupling.force_2x"]


@pytest.mark.parametrize("path", ["bearings.1.clearence", "grid.n_teta", "shaf", "discs.0.masss"])
def test_a_misspelt_field_is_one_problem(path):
    wrong = path.rpartition(".")[2]
    meant = {"clearence": "clearance", "n_teta": "n_theta", "shaf": "shaft", "masss": "mass"}[wrong]
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(re.sub(rf"(?m)^(\[?){meant}\b", rf"\1{wrong}", RIG, count=1))
    assert caught.value.problems == (f"{path}: unknown field; did you mean '{meant}'?",)


PLAIN = machine_text("plain_rotor")


BAD = {
    "injectors: there is no film to inject into": f'{PLAIN}\n[[injectors]]\nangle = "0 deg"\nreference = "none"\n',
    "effects.contact: acts in a gas film, but there is none": f"{PLAIN}\n[effects.contact]\n",
    "discs.1.position: missing": f"{PLAIN}\n[[discs]]\n\n",
    "probe.position: [] is not a length": f"{PLAIN}\n[probe]\nposition = []\n",
    "effects.coupling.x: unknown field; known are ": f"{PLAIN}\n[effects.coupling.x]\n",
    "bearings: empty; give at least one": "bearings = []",
    "bearings.0: 1 is not a table": "bearings = [1]",
    "bearings: 1 is not a list of tables; write a [[header]] for each": "bearings = 1",
    "shaft: 3 is not a table; write its fields below a [header]": "shaft = 3",
    "effects: 3 is not a set of tables; write e.g. [effects.unbalance]": "effects = 3",
    "effects.unbalance: [] is not a table": "effects = {unbalance = []}",
    "effects.unbalance.0: 7 is not a table": "effects = {unbalance = [7]}",
    "not a TOML file: Invalid value (at line 1, column 7); correct that line": "name =\nb = 1",
    "not a TOML file: brackets are nested deeper than 100 levels": "a = " + 2000 * "[",
    "not a TOML file: ": "a = " + 5000 * "1",
    "the machine file is empty; 'rotorsim machine new PATH' writes one": " \n",
}


@pytest.mark.parametrize("sentence", BAD)
def test_a_file_of_the_wrong_shape_or_of_what_a_rotor_without_a_film_has_not_is_refused(sentence):
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(BAD[sentence])
    assert sentence in str(caught.value)


def test_a_second_gas_film_stands_apart_from_the_first():
    film = RIG[RIG.index("[[bearings]]                     # active") : RIG.index("[gas]")]
    assert len(Machine.from_text(RIG + film.replace("236.6875", "200")).films) == 2
    with pytest.raises(MachineFileError, match=r"bearings\.2"):
        Machine.from_text(RIG + film)


SECOND = """
[[bearings]]
kind = "gas_film"
position = 200
diameter = "40 kg"
"""
FAULTS = {
    'start = "-121.3 mm"': "start = 0", "poisson_ratio = 0.3": "poisson_ratio = 3", 'mass = "1.5 kg"': 'mass = "0 kg"',
    'kxx = "50 MN/m"': "kxx = 5", 'clearance = "25 um"': "", 'seat_gap = "40.2 um"': 'seat_gap = "0.4 um"',
    "pin_discharge = 0.1244": "", 'pin_bias = "22.5 um"': "", 'mode = "reference"': 'mode = "other"',
    "n_theta = 32": "n_theta = 31", 'force_2x = "4 N"': 'force_2x = "4 kg"', "[effects.creep]": "[effects.crep]",
    'length = "50 mm"': 'length = "50 mm"\ninner_diameter = "60 mm"',
}  # fmt: skip


def test_every_problem_comes_in_one_round():
    """A second film, seventeen faults of values, and what is wrong between values that can be read."""
    text = RIG.replace("[gas] ", f"{SECOND}\n[gas] ")
    for old, new in FAULTS.items():
        assert old in text
        text = text.replace(old, new, 1)
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(text)
    problems = caught.value.problems
    between = ("injection.pin_discharge: missing, but law", "injection.minimum_gap: '0.5 um' is not below seat_gap")
    for begin in (*between, "shaft.sections.1.inner_diameter: '60 mm' is not below", "bearings.1.clearance: missing"):
        assert any(p.startswith(begin) for p in problems), begin
    assert len(problems) == len(set(problems)) == 4 + len(FAULTS)


def test_a_fault_does_not_make_others_that_are_none():
    """A wrong value does not let others look wrong: an unknown kind is no missing film."""
    for old, new in (('kind = "gas_film"', 'kind = "gas_fim"'), ("[effects.gravity]", "[effects.gravty]")):
        with pytest.raises(MachineFileError) as caught:
            Machine.from_text(RIG.replace(old, new, 1))
        assert len(caught.value.problems) == 1
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(PLAIN.replace("[effects.gravity]", '[effects.crack]\nloss = "1 N/m"\n[effects.gravty]'))
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize(("bearing", "problems"), [(None, 1), (1, 2)])
def test_injectors_are_in_the_film_that_is_stated_while_another_kind_is_mistyped(bearing, problems):
    """The first film, whose kind is mistyped, has the injectors; or the second one, too short, by its number."""
    machine = load_machine("dtu_gas_bearing")
    first = "\n".join(f"{key} = {value}" for key, value in {
        "kind": '"gas_fim"', "position": '"60 mm"', "diameter": '"40 mm"', "length": '"40 mm"', "clearance": '"25 um"',
    }.items())  # fmt: skip
    own = {"bearings.1.length": "10 mm", "injectors.0.offset": "0 mm"}
    text = machine.with_(own).text.replace('offset = "0 mm"', 'offset = "8 mm"', 1)
    before = text.partition("[[bearings]]")[2].partition("[[bearings]]")[0]
    text = text.replace(before, f"\n{first}\n\n", 1)
    if bearing is not None:
        text = text.replace("[injection]", f"[injection]\nbearing = {bearing}", 1)
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(text)
    assert len(caught.value.problems) == problems
    assert problems == 1 or caught.value.problems[1].startswith("injectors.0.offset: '8 mm'")


def test_injectors_without_injection_are_refused():
    text = RIG[: RIG.index("[injection]")] + RIG[RIG.index("[[injectors]]") :]
    with pytest.raises(MachineFileError, match="injection: missing, but there are injectors; add"):
        Machine.from_text(text)


def test_unbalance_without_a_plane_needs_a_disc():
    text = PLAIN[: PLAIN.index("[[discs]]")] + PLAIN[PLAIN.index("[[bearings]]") :]
    with pytest.raises(MachineFileError, match=r"effects\.unbalance\.position: missing, and there is no disc"):
        Machine.from_text(text)


def test_an_unknown_name_lists_the_shipped_machines():
    with pytest.raises(
        MachineFileError,
        match=r"'rig' is neither a shipped machine \(aerostatic_spindle, bently_rk4, dtu_first_assembly, .* or a path",
    ):
        load_machine("rig")


PARTS = sorted(
    name for name in dir(machine) if isinstance(kind := getattr(machine, name), type) and issubclass(kind, Part)
)


@pytest.mark.parametrize("name", PARTS)
def test_a_part_built_in_python_names_its_unknown_field(name):
    assert len(PARTS) > 20
    with pytest.raises(MachineFileError) as caught:
        getattr(machine, name)(clearence="25 um")
    assert any(line.startswith(f"{name}.clearence: ") for line in caught.value.problems)
    assert not any("pydantic" in line for line in caught.value.problems)


def test_a_part_built_in_python_states_its_wrong_value():
    with pytest.raises(MachineFileError) as caught:
        machine.Foil(stiffness="-1 GN/m^3")
    assert caught.value.argument == "Foil.stiffness" and len(caught.value.problems) == 1


def test_a_part_does_not_change():
    rig = load_machine("dtu_gas_bearing")
    for part, field in ((rig, "name"), (rig.grid, "n_theta"), (rig.discs[0], "mass")):
        with pytest.raises(MachineFileError) as caught:
            setattr(part, field, 3)
        assert caught.value.argument == field
