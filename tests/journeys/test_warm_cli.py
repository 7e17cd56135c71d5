"""`rotorsim warm`: kernels compiled ahead of the first run."""

import json
import os
import signal
import subprocess
import sys

import pytest

from rotorsim.plant import Plant, compile_kernels
from rotorsim.plant.calls import _is_whole
from rotorsim.plant.compose import is_compiled
from waiting import PATIENCE, until


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


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of Windows are others")
def test_ctrl_c_ends_it_at_once_and_leaves_whole_files(tmp_path):
    """Sent while kernels compile, of which the film takes longer than all before: that is not waited for."""
    process = subprocess.Popen(
        [sys.executable, "-m", "rotorsim", "warm", "dtu_gas_bearing"],
        env=os.environ | {"ROTORSIM_CACHE_DIR": str(tmp_path)}, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stderr is not None
    assert process.stderr.readline().startswith("compiling dtu_gas_bearing (film, rotor, 12 effects); later runs ")
    until(lambda: any(tmp_path.rglob("rotorsim_effect_*.nbi")), process)
    process.send_signal(signal.SIGINT)
    _, message = process.communicate(timeout=PATIENCE)
    assert (process.returncode, message) == (130, "interrupted before the end; the same command starts again\n")
    assert not any(tmp_path.rglob("*.refresh-*.nbi"))
    modules = [path for path in (tmp_path / "plants").iterdir() if path.is_file()]
    assert len(modules) > 3 and all(_is_whole(path) for path in modules)
