"""Commands of the studies: pages, numbers, refusals, interrupts, and scripts that start from any folder."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from studies.benchmarks.command import bench
from studies.thesis.commands import designs, one_number, whole

STUDIES = Path(__file__).parents[2] / "studies"
SCRIPTS = ("benchmarks/measure.py", "thesis/whole.py", "thesis/designs.py", "thesis/one_number.py")


def test_a_rotor_without_actuators_is_no_machine_of_the_whole_study(run, tmp_path):
    code, out, err = run(whole, "plain_rotor", "--out", tmp_path / "study")
    assert (code, out) == (2, "")
    assert "has no actuators in a gas film; there is nothing to identify or control" in err
    assert not (tmp_path / "study").exists()


def test_an_experiment_on_a_claim_ends_in_tables_numbers_and_a_report(run, tmp_path):
    command = ("--only", "I4", "--out", tmp_path / "e", "--jobs", "1")
    code, text, err = run(one_number, *command, "--json")
    assert code == 0, err
    (found,) = json.loads(text)["experiments"]
    figure = found["figures"]["I4.before"]
    assert figure["values"]["1"] < 9 < figure["values"]["2"]
    assert 1.5 < figure["reached"] < 1.8
    assert found["broken"] == []
    assert "| I4 | unbalance of the disc |" in (tmp_path / "e" / "experiments.md").read_text(encoding="utf-8")
    assert "unbalance of the disc" in (tmp_path / "e" / "report.html").read_text(encoding="utf-8")
    code, again, _ = run(one_number, *command)
    assert code == 0
    assert "I4 amplitude before: 6.4" in again


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("plain_rotor",), "has no actuators in a gas film; the claims are of such a machine"),
        (("--only", "I99"), "there is no experiment or claim 'I99'; there are noise"),
    ],
)
def test_experiments_that_cannot_be_made_end_in_a_sentence(run, tmp_path, more, words):
    code, out, err = run(one_number, *more, "--out", tmp_path / "e")
    assert (code, out) == (2, "")
    assert words in err
    assert not (tmp_path / "e").exists()


def test_a_benchmark_without_its_package_is_refused_before_it_measures(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "fmpy", None)
    code, out, message = run(bench, "fmu")
    assert code == 2 and out == "" and message == "bench fmu: needs fmpy; 'pip install fmpy'\n"


def test_ctrl_c_states_that_the_same_command_continues(run, monkeypatch):
    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("studies.thesis.commands.whole_study", interrupted)
    code, _, err = run(whole)
    assert code == 130 and "interrupted: what was computed is kept, and the same command continues" in err


def test_a_model_of_one_point_is_refused(run, tmp_path):
    model = Path(__file__).parents[1] / "journeys" / "no_model.json"
    code, out, err = run(designs, model, "--out", tmp_path / "c")
    assert (code, out) == (2, "") and err.count("\n") == 1


@pytest.mark.parametrize("script", [SCRIPTS[0], *(pytest.param(s, marks=pytest.mark.slow) for s in SCRIPTS[1:])])
def test_a_script_starts_from_any_folder(script, tmp_path):
    ran = subprocess.run([sys.executable, STUDIES / script, "--help"], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0 and f"Example: python studies/{script}" in ran.stdout, ran.stderr
