"""Completion of values in the shell: machines, effects, experiments, designs."""

import os
import subprocess
import sys

import pytest

from rotorsim.commands import options
from rotorsim.control import DESIGNS
from rotorsim.effects import REGISTRY
from rotorsim.machine import shipped_machines


def completed(words, folder):
    """Words that the shell offers for the last one."""
    setting = {"_ROTORSIM_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    program = "from rotorsim.cli import main; import sys; sys.argv = ['rotorsim']; main()"
    ran = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=folder, env=os.environ | setting
    )
    return ran.stdout.split()


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("rotorsim runup bent", ["bently_rk4"]),
        ("rotorsim machine effects unb", ["unbalance"]),
        ("rotorsim experiment co", ["coastdown", "controlled"]),
        ("rotorsim design h", ["h2_scheduled", "hinf"]),
        ("rotorsim machine new my.toml --from pl", ["plain_rotor"]),
    ],
)
def test_the_shell_offers_the_names_that_begin_so(words, offered, tmp_path):
    assert completed(words, tmp_path) == offered


def test_every_shipped_machine_effect_and_design_is_offered(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert options.machines("") == sorted(shipped_machines())
    assert options.effects("") == sorted(REGISTRY)
    assert options.designs("") == sorted(DESIGNS)


def test_machine_files_and_folders_are_offered_and_others_not(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("mine.toml", "more.txt"):
        (tmp_path / name).write_text("")
    (tmp_path / "many").mkdir()
    assert options.machines("m") == ["many/", "mine.toml"]
    assert options.machines("nowhere/x") == []


def test_parameters_of_an_effect_follow_its_dot():
    assert options.parameters("runout.amplitude_2") == ["runout.amplitude_2x"]
    assert options.parameters("runou") == ["runout"]
    assert options.parameters("no_effect.x") == []
