"""`rotorsim warm`: kernels compiled ahead of the first run."""

import json

from rotorsim.commands.warm import compile_kernels
from rotorsim.plant import Plant
from rotorsim.plant.compose import is_compiled


def test_what_is_compiled_is_named_once_and_then_there(run):
    code, out, err = run("warm", "plain_rotor", "--json")
    assert code == 0 and json.loads(out)["seconds"].keys() == {"plain_rotor"} and "plain_rotor: compiled" in err
    assert is_compiled(Plant("plain_rotor").assembly.module)
    assert run("warm", "plain_rotor") == (0, "", "plain_rotor: compiled already\n")


def test_a_wrong_name_compiles_nothing(run):
    code, out, err = run("warm", "plain_rotor", "nothing")
    assert code == 2 and out == "" and err.startswith("'nothing' is neither a shipped machine")


def test_compiling_leaves_the_plant_as_it_was():
    plant = Plant("plain_rotor")
    before = plant.assembly.w.copy()
    compile_kernels(plant)
    assert (plant.assembly.w == before).all()
