"""Every bad machine file gets one sentence per problem: path, value, limit, way out."""

import pytest
from rotorsim.errors import MachineFileError
from rotorsim.machine import load_machine, machine_text
from rotorsim.machine.schema import Machine

RIG = machine_text("dtu_gas_bearing")

CASES = [
    ("[gas] ", "[gass] ", "gass: unknown field; did you mean 'gas'?"),
    ("_ratio = 1.4", "_ration = 1.4", "gas.heat_capacity_ration: unknown field; did you mean 'heat_capacity_ratio'?"),
    ('mass = "1.5 kg"', "", "discs.0.mass: missing (Mass); write e.g. '1.5 kg'"),
    ('name = "dtu_gas_bearing"', "", "name: missing (Short name); add it"),
    ('name = "dtu_gas_bearing"', "name = 5", "name: 5 is not text; write it in quotes"),
    ('"-121.3 mm"', "0", "shaft.start: 0 has no unit; write e.g. '0 mm'"),
    ('"-121.3 mm"', "true", "shaft.start: true is not a length; write e.g. '25 mm'"),
    ('"60 g*mm"', '"20 g"', "effects.unbalance.me: '20 g' is not a mass*length; write e.g. '10 g*mm'"),
    ('"60 g*mm"', '"-1 g*mm"', "effects.unbalance.me: '-1 g*mm' is below the limit; write at least '0 g*mm'"),
    ('"60 g*mm"', '"1 kg*m"', "effects.unbalance.me: '1 kg*m' is above the limit; write at most '10000 g*mm'"),
    ("friction = 0.15", "friction = nan", "effects.contact.friction: nan is not a number; write e.g. 0.5"),
    ("damping_ratio = 0.012", "damping_ratio = inf", "shaft.damping_ratio: inf is not a number; write e.g. 0.5"),
    ('clearance = "25 um"', 'clearance = "-25 um"', "bearings.1.clearance: '-25 um' must be above 0; write e.g. '25 um'"),
    ('"378.7 mm"            # L_d', '"500 mm" # L_d', "discs.0.position: '500 mm' is outside the shaft (-121.3 mm to 378.7 mm)"),
    ('"378.7 mm"            # at', '"-1 m" # at', "probe.position: '-1000 mm' is outside the shaft"),
    ('me = "60 g*mm"', 'me = "60 g*mm"\nposition = "1 m"', "effects.unbalance.position: '1000 mm' is outside the shaft"),
    ('position = "0 mm"', 'position = "236.6875 mm"', "bearings.1.position: '236.6875 mm' is where bearings.0 is"),
    ('kind = "linear"', 'kind = "spring"', "bearings.0.kind: 'spring' is not known; write 'linear' or 'gas_film'"),
    ('kind = "linear"', "", "bearings.0.kind: missing; write 'linear' or 'gas_film'"),
    ('kind = "linear"', "kind = []", "bearings.0.kind: [] is not known; write 'linear' or 'gas_film'"),
    ("n_theta = 32", "n_theta = 31", "grid.n_theta: 31 is not a multiple of 4; write e.g. 32"),
    ("n_theta = 32", "n_theta = 4", "grid.n_theta: 4 is below the limit; write at least 8"),
    ("n_theta = 32", "n_theta = 32.5", "grid.n_theta: 32.5 is not a whole number; write e.g. 32"),
    ("n_z = 16", "n_z = 15", "grid.n_z: 15 is not even; write e.g. 16"),
    ("n_z = 16", "n_z = 100000", "grid.n_z: 100000 is above the limit; write at most 256"),
    ('"0.1 ms"', '"0.15 ms"', "solver.time_step: '0.15 ms' does not divide the sampling time 0.2 ms; write e.g. '0.1 ms'"),
    ('"0.25 um"', '"30 um"', "solver.minimum_film: '30 um' is not below the clearance '25 um'; make it smaller"),
    ("[effects.gravity]", "[effects.gravty]", "effects.gravty: unknown effect; did you mean 'gravity'? known effects: contact,"),
    ("[effects.gravity]", "[effects.magic]", "effects.magic: unknown effect; known effects: contact, coupling, gravity"),
    ("third =", "thirds =", "effects.coupling.thirds: unknown field; did you mean 'third'?"),
    ('reference = "+y"', 'reference = "up"', "injectors.0.reference: 'up' is not known; write '+x', '-x', '+y', '-y' or 'none'"),
    ('reference = "+y"', 'reference = "+y"\noffset = "19.5 mm"', "injectors.0.offset: '19.5 mm' puts the orifice outside the film; write at most '19 mm'"),
    ("pin_discharge = 0.1244", "", "injection.pin_discharge: missing, but law 'orifice' needs it"),
    ('law = "orifice"', 'law = "loss_factor"', "injection.loss_factor: missing, but law 'loss_factor' needs it"),
    ('minimum_gap = "0.5 um"', 'minimum_gap = "50 um"', "injection.minimum_gap: '50 um' is not below seat_gap '40.2 um'"),
    ('outer_diameter = "40 mm"', 'outer_diameter = "40 mm"\ninner_diameter = "50 mm"', "shaft.sections.1.inner_diameter: '50 mm' is not below outer_diameter '40 mm'"),
    ('max_element_length = "25 mm"', 'max_element_length = "1 um"', "shaft.max_element_length: '1 um' needs over 1000 elements; write e.g. '25 mm'"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "sentence"), CASES)
def test_one_wrong_value_gives_one_sentence_that_says_what_to_write(old, new, sentence):
    assert old in RIG
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(RIG.replace(old, new, 1))
    assert len(caught.value.problems) == 1
    assert caught.value.problems[0].startswith(sentence)


def test_several_problems_are_all_listed_each_on_its_line():
    text = RIG.replace('"-121.3 mm"', "0").replace("n_z = 16", "n_z = 15").replace('"0.6 N"', '"0.6 kg"')
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(text.replace('clearance = "25 um"', ""))
    paths = [problem.split(":")[0] for problem in caught.value.problems]
    assert paths == ["shaft.start", "bearings.1.clearance", "grid.n_z", "effects.coupling.second"]


PLAIN = machine_text("plain_rotor")


@pytest.mark.parametrize(
    ("extra", "sentence"),
    [
        ('[[injectors]]\nangle = "0 deg"\nreference = "none"', "injectors: there is no film to inject into"),
        ("[effects.contact]", "effects.contact: acts in a gas film, but there is none"),
        ("[[discs]]\n", "discs.1.position: missing"),
        ("[probe]\nposition = []", "probe.position: [] is not a length"),
        ("[effects.coupling.x]", "effects.coupling.x: unknown field; known fields: "),
    ],
)
def test_what_does_not_fit_a_rotor_without_a_film_is_refused(extra, sentence):
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(f"{PLAIN}\n{extra}\n")
    assert sentence in str(caught.value)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("bearings = []", "bearings: empty; give at least one"),
        ("bearings = [1]", "bearings.0: 1 is not a table"),
        ("bearings = 1", "bearings: 1 is not a list of tables; write a [[header]] for each"),
        ("shaft = 3", "shaft: 3 is not a table; write its fields below a [header]"),
        ("effects = 3", "effects: 3 is not a set of tables; write e.g. [effects.unbalance]"),
        ("effects = {unbalance = []}", "effects.unbalance: [] is not a table"),
        ("effects = {unbalance = [7]}", "effects.unbalance.0: 7 is not a table"),
        ("name = ", "not a TOML file: Invalid value (at line 1, column 8)"),
        ("a = " + 2000 * "[", "brackets are nested too deeply"),
        ("a = " + 5000 * "1", "not a TOML file: "),
        (" \n", "the machine file is empty; 'rotorsim machine new PATH' writes one"),
    ],
)
def test_a_file_of_the_wrong_shape_is_refused(text, sentence):
    with pytest.raises(MachineFileError) as caught:
        Machine.from_text(text)
    assert sentence in str(caught.value)


def test_a_second_gas_film_is_refused():
    film = RIG[RIG.index("[[bearings]]                     # active") : RIG.index("[gas]")]
    with pytest.raises(MachineFileError, match=r"^bearings\.2: second gas film beside bearings\.1; keep one"):
        Machine.from_text(RIG + film.replace("236.6875", "200"))


def test_injectors_without_injection_are_refused():
    text = RIG[: RIG.index("[injection]")] + RIG[RIG.index("[[injectors]]") :]
    with pytest.raises(MachineFileError, match="injection: missing, but there are injectors; add"):
        Machine.from_text(text)


def test_unbalance_without_a_plane_needs_a_disc():
    text = PLAIN[: PLAIN.index("[[discs]]")] + PLAIN[PLAIN.index("[[bearings]]") :]
    with pytest.raises(MachineFileError, match=r"effects\.unbalance\.position: missing, and there is no disc"):
        Machine.from_text(text)


def test_an_unknown_name_lists_the_shipped_machines():
    with pytest.raises(MachineFileError, match=r"'rig' is no shipped machine \(dtu_gas_bearing, .* or a path"):
        load_machine("rig")
