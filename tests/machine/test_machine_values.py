"""Change of a machine's values in SI: exact, checked, and the file's text left alone."""

import pytest

from refusals import refused
from rotorsim.base.errors import MachineFileError
from rotorsim.effects import REGISTRY
from rotorsim.machine import Machine, load_machine

HASHES = {
    "dtu_first_assembly": "1cba6f069ffe1fe3",
    "dtu_gas_bearing": "bf1d56fde8b33469",
    "dtu_gas_bearing_b": "c1c9d47854884c4b",
    "dtu_gas_bearing_c": "e5ffa3696a02f674",
    "dtu_gas_bearing_d": "a5d95fb9aa81cde1",
    "dtu_paper_a": "23c9b8533ff48f63",
    "plain_rotor": "1eb224d7ad7cd992",
}


def test_values_are_those_given_to_the_last_bit_and_text_follows():
    machine = load_machine("dtu_gas_bearing")
    changed = machine.with_(
        {"bearings.1.clearance": 2.4999999999e-05, "grid.n_theta": 16, "effects.unbalance.me": 3e-6}
    )
    assert changed.film.clearance == 2.4999999999e-05
    assert changed.grid.n_theta == 16
    assert changed.effects["unbalance"][0].me == 3e-6
    assert Machine.from_text(changed.text) == changed
    assert load_machine("dtu_gas_bearing") == machine


def test_values_that_fit_only_together_are_changed_together():
    machine = load_machine("dtu_gas_bearing").with_({"injection.law": "loss_factor", "injection.loss_factor": 4e-16})
    assert machine.injection.law == "loss_factor"


def test_a_changed_machine_is_saved_with_its_changes(tmp_path):
    """A copy that kept the text it was read from saved the old values."""
    load_machine("plain_rotor").with_({"discs.0.mass": 2.5}).save(tmp_path / "m.toml")
    assert load_machine(tmp_path / "m.toml").discs[0].mass == 2.5


def test_an_effect_made_in_python_is_checked_as_one_of_a_file():
    machine, effect = load_machine("dtu_gas_bearing"), REGISTRY["weak_injector"]
    with pytest.raises(MachineFileError, match=r"effects\.weak_injector.*injector: 1.5 is not a whole number"):
        machine.with_({"effects": {"weak_injector": (effect(injector=1.5),)}})


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"shaft.damping_ratio": 3.0}, "shaft.damping_ratio: 3 is above the limit; write at most 0.5"),
        ({"discs.0.mass": -1.0}, "discs.0.mass: '-1 kg' must be above 0; write e.g. '1 kg'"),
        ({"discs.4.mass": 1.0}, "discs.4: is not there; known are 0"),
        ({"shaft.dampingratio": 0.1}, "shaft.dampingratio: is not there; did you mean 'damping_ratio'?"),
        ({"effects.unbalance.mee": 1.0}, "effects.unbalance.mee: is not there; did you mean 'me'?"),
        ({"effects.unbalance.me": 1e9}, "effects.unbalance.me: "),
        ({"discs.0.position": 9.0}, "discs.0.position: "),
        ({"grid.n_theta": 33}, "grid.n_theta: 33 is not a multiple of 4; write e.g. "),
        ({"actuators.reference_limit": 1.0}, "actuators: is not in this machine; give the whole part"),
        ({"injectors.0.offset": 0.0}, "injectors: there are none in this machine; give the whole list"),
        ({"name.x": 1.0}, "name: is a value, not a table; check the path"),
        ({"shaft.material.density.x": 1.0}, "shaft.material.density: is a value, not a table; check the path"),
        ({"effects.unbalance.me.x": 1.0}, "effects.unbalance.me: is a value, not a table; check the path"),
        ({"shaft": None}, "shaft: may not be None; give the whole part"),
        ({"discs.0": None}, "discs.0: may not be None; give the whole part"),
        ({"grid.n_theta": None}, "grid.n_theta: None is not a number; write e.g. 32"),
        ({"discs.0.mass": None}, "discs.0.mass: None is not a mass; write e.g. "),
        ({"effects.unbalance.me": None}, "effects.unbalance.me: None is not a mass*length; write e.g. "),
        ({"effects.rub.gap": 1e-5}, "effects.rub: is not in this machine; give the whole effect, or use replace"),
        ({"effects.rubb.gap": 1e-5}, "effects.rubb: unknown effect; did you mean 'rub'?"),
        ({"": 1.0}, "'' is not a path; write e.g. 'effects.unbalance.me'"),
    ],
)
def test_a_value_that_does_not_fit_is_one_sentence(values, sentence):
    with pytest.raises(MachineFileError) as error:
        load_machine("plain_rotor").with_(values)
    assert str(error.value).startswith(sentence), str(error.value)
    assert len(error.value.problems) == 1


def test_a_path_below_another_is_refused_in_either_order():
    machine = load_machine("dtu_gas_bearing")
    given = {"bearings.1.clearance": 26e-6, "bearings": machine.bearings}
    for values in (given, dict(reversed(given.items()))):
        with refused(MachineFileError, "bearings.1.clearance"):
            machine.with_(values)


def test_optional_values_may_be_none_and_an_absent_effect_is_given_whole():
    machine = load_machine("plain_rotor").with_({"effects.unbalance.position": None, "probe": None})
    assert machine.effects["unbalance"][0].position is machine.probe is None
    rub = REGISTRY["rub"](stiffness=1e5)
    added = machine.with_({"effects.rub": rub})
    assert added.effects["rub"] == (rub,) and list(added.effects) == [*machine.effects, "rub"]


def test_an_effect_of_several_tables_is_named_by_its_number():
    two = (REGISTRY["unbalance"](me=1e-6), REGISTRY["unbalance"](me=2e-6))
    machine = load_machine("plain_rotor").with_({"effects.unbalance": two})
    assert machine.with_({"effects.unbalance.1.me": 3e-6}).effects["unbalance"][1].me == 3e-6
    with pytest.raises(MachineFileError, match=r"^effects\.unbalance\.1\.me: "):
        machine.with_({"effects.unbalance.1.me": 1e9})


def test_a_parameter_that_may_not_be_none_is_refused_in_an_effect_made_in_python():
    with pytest.raises(MachineFileError, match=r"^effects\.unbalance\.me: None is not a mass\*length"):
        load_machine("plain_rotor").with_({"effects.unbalance": REGISTRY["unbalance"](me=None)})


def test_a_count_of_an_effect_is_a_float_as_in_a_machine_file():
    machine = load_machine("plain_rotor").replace("effects.encoder.counts", 1000)
    changed = machine.with_({"effects.encoder.counts": 2000})
    assert type(changed.effects["encoder"][0].counts) is float
    assert changed.hash == machine.replace("effects.encoder.counts", 2000).hash


def test_a_machine_takes_an_effect_as_it_is():
    """A check that turned 2000.0 into 2000 changed the hash of a machine, by which stores of campaigns know it."""
    machine, effect = load_machine("plain_rotor"), REGISTRY["encoder"](counts=2000.0)
    assert type(effect.counts) is float
    assert machine.with_({"effects": {"encoder": (effect,)}}).effects["encoder"][0] is effect
    assert type(effect.counts) is float


@pytest.mark.parametrize("name", sorted(HASHES))
def test_shipped_machines_keep_their_hash(name):
    """Stores of campaigns and folders of studies know a machine by it: another one makes them useless."""
    assert load_machine(name).hash == HASHES[name]


@pytest.mark.parametrize(
    ("path", "field"), [("effects.contact", "effects.contact."), ("shaft", "shaft."), ("bearings.0", "bearings.0.")]
)
def test_a_table_in_place_of_a_value_is_answered_with_a_field_that_is_there(path, field):
    machine = load_machine("dtu_gas_bearing")
    with pytest.raises(MachineFileError, match=r"holds several values; name the one to change, e\.g\. '") as caught:
        machine.replace(path, {})
    advice = str(caught.value).split("'")[1]
    assert advice.startswith(field)
    with pytest.raises(MachineFileError) as caught:
        machine.replace(advice, "much")
    assert "unknown field" not in str(caught.value) and "several" not in str(caught.value)
