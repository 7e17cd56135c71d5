"""Notice on stderr while kernels compile, also in a pipe; stdout unchanged."""

import json
import time

import numpy as np
import pytest

from reynolds.kernel_cache import KernelCache
from rotorsim.commands.diagnosis import QUIET, STAGES, Stages, _print_note
from rotorsim.commands.options import note_compiling
from rotorsim.discrepancy import calibration
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from rotorsim.plant.compose import FILM_ENTRIES

LINE = "compiling plain_rotor (rotor, 2 effects); later runs find it in the cache\n"
PLAN = 'name = "p"\nmachine = "plain_rotor"\n[experiments.steady]\nkind = "steady"\nduration = "2 ms"\n'
COMMANDS = [
    ["experiment", "steady", "plain_rotor", "--duration", "2 ms", "--no-report"],
    ["runup", "plain_rotor", "--stop", "1 rpm", "--rate", "10 rpm/s", "--no-report"],
    ["modes", "plain_rotor", "--no-pictures"],
    ["map", "plain_rotor", "--speed", "0 rpm", "--pressure", "0 Pa", "--no-report"],
    ["campaign", "plan.toml", "--workers", "1"],
]


@pytest.fixture(scope="module")
def assembly():
    """A machine whose kernels are on disk and in this process."""
    plant = Plant("plain_rotor")
    plant.simulate(0.001)
    return plant.assembly


@pytest.fixture
def empty(assembly, monkeypatch):
    """A cache without any machine code; what this process has it keeps."""
    monkeypatch.setattr(KernelCache, "is_filled", lambda cache: False)


def test_what_is_on_disk_is_not_announced(assembly, capsys):
    note_compiling(assembly, "settle", "run")
    assert capsys.readouterr() == ("", "")


def test_the_film_is_compiled_once_for_all_effects(rig, monkeypatch):
    a, b = rig().assembly, rig({"effects.crack.loss": "1 kN/m"}).assembly
    compiled = set()
    monkeypatch.setattr(KernelCache, "is_filled", lambda cache: cache in compiled)
    assert "(film, rotor, " in a.compile_note("run")
    compiled |= {getattr(a.module, kernel)._cache for kernel in FILM_ENTRIES}
    assert " (rotor, " in b.compile_note("run")


def test_the_law_of_the_injectors_is_a_number_and_no_other_machine_code(rig):
    other = {"injection.law": "loss_factor", "injection.loss_factor": "4e-16 kg/(s*Pa^2)"}
    a, b = rig().assembly, rig(other).assembly
    assert a.machine.injection.law != b.machine.injection.law
    assert (a.module.newton, a.module.run) == (b.module.newton, b.module.run)


@pytest.mark.usefixtures("empty")
@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: words[0])
def test_every_command_notes_it_in_a_pipe_and_its_json_stays_whole(run, tmp_path, words):
    (tmp_path / "plan.toml").write_text(PLAN)
    code, out, message = run(*words, "--json", "--out", "o")
    assert code == 0 and message == LINE and json.loads(out)


def test_a_diagnosis_notes_it_before_it_compiles_anything(monkeypatch):
    order = []
    monkeypatch.setattr(calibration, "is_compiled", lambda module: False)
    monkeypatch.setattr(calibration, "other_law", lambda twin: order.append("equilibrium"))
    calibration.CompiledModels.of(load_machine("plain_rotor"), progress=lambda stage, most=0: order.append(stage))
    assert order == ["compile", "equilibrium"]


def test_a_diagnosis_notes_in_a_pipe_each_stage_once_and_again_where_it_lasts(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    stages = Stages()
    for stage in [*STAGES, *STAGES]:
        stages.show(stage)
        stages.show(stage)
    texts = [f"{text} ({number} of {len(STAGES)})" for number, text in enumerate(STAGES.values(), 1)]
    assert capsys.readouterr() == ("", "".join(f"{text}\n" for text in texts))
    now[0] = QUIET + 1
    stages.show("experiment")
    stages.show("experiment")
    assert capsys.readouterr() == ("", f"{texts[-1]}: step 3, 31 s\n")
    now[0] += QUIET + 1
    stages.show("check", 40)
    assert "step 1 of at most 40, 62 s" in capsys.readouterr().err


def test_a_note_of_the_next_diagnosis_of_a_loop_stands_on_a_line_of_its_own(capsys, monkeypatch):
    monkeypatch.setattr("rotorsim.base.display.on_terminal", lambda: True)
    monkeypatch.setattr("rotorsim.commands.diagnosis.on_terminal", lambda: True)
    Stages().show("check")
    _print_note("a table")
    assert capsys.readouterr().err.endswith("\nnote: a table\n")


def test_the_numbers_of_stages_rise_and_begin_anew_with_the_next_diagnosis_of_a_loop(capsys, monkeypatch):
    monkeypatch.setattr(time, "monotonic", iter(np.arange(0.0, 1e6, QUIET + 1)).__next__)
    stages, numbers = Stages(), []
    for stage in ("check", "calibrate", "name", "calibrate", "show", "prove", "experiment", "check", "calibrate"):
        stages.show(stage, {"calibrate": 12, "name": 60}.get(stage, 0))
        numbers.append(list(STAGES).index(stages.stage))
    own = {name: number for number, name in enumerate(STAGES)}
    shown = ("check", "calibrate", "name", "name", "show", "show", "experiment", "check", "calibrate")
    assert numbers == [own[name] for name in shown]
    # the limit of the earlier stage is not that of the one in which its step counts
    assert f"{STAGES['name']} (6 of {len(STAGES)}): step 2, " in capsys.readouterr().err
