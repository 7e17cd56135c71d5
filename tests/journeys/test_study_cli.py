"""`rotorsim study identification-vs-physics`: from a machine to the report, on a grid of four points."""

import json

import pytest

import identification as idn
from rotorsim.base.constants import RPM
from rotorsim.commands.study import identification_vs_physics
from rotorsim.reproduction.plans import Layout

SMALL = Layout((0.0, 3000 * RPM), (0.4e6, 0.6e6), duration=3.0)  # where the orbit of the imbalance is small


@pytest.mark.slow
def test_a_study_of_four_points_ends_in_claims_models_and_a_report(run, tmp_path, monkeypatch):
    monkeypatch.setattr(identification_vs_physics, "QUICK", SMALL)
    out = tmp_path / "study"
    command = ("study", "identification-vs-physics", "--quick", "--surfaces", "1", "--out", out, "--jobs", "1")
    code, text, err = run(*command, "--json")
    assert code == 0, err
    result = json.loads(text)
    assert [claim["number"] for claim in result["claims"]] == [f"I{n}" for n in range(1, 14)]
    assert result["errors"]["Model 2"]["frequency, largest"] < 1.0
    assert result["errors"]["Model 2"]["zeta, largest"] < 15.0
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Model 3, point by point" in page
    lpv = idn.load_model(out / "model.json")
    assert lpv.points.shape == (4, 2)
    # the same records by hand: the index states roles and operating points
    code, text, err = run(
        "identify", *sorted(out.glob("grid-*")), "--surfaces", "1", "--out", tmp_path / "m.json", "--json"
    )
    assert code == 0, err
    assert len(json.loads(text)["records"]) == 8
    again = idn.load_model(tmp_path / "m.json")
    assert again.points.shape == (4, 2)


def test_a_rotor_without_actuators_is_no_machine_of_the_whole_study(run, tmp_path):
    code, out, err = run("study", "whole", "plain_rotor", "--out", tmp_path / "study")
    assert (code, out) == (2, "")
    assert "has no actuators in a gas film; there is nothing to identify or control" in err
    assert not (tmp_path / "study").exists()


def test_a_folder_without_the_right_records_ends_in_a_sentence(run, tmp_path):
    code, _, err = run(
        "study", "identification-vs-physics", "--campaign", tmp_path / "nothing", "--out", tmp_path / "study"
    )
    assert code == 2
    assert "nothing" in err
    assert err.count("\n") == 1


def test_an_experiment_on_a_claim_ends_in_tables_numbers_and_a_report(run, tmp_path):
    command = ("study", "experiments", "--only", "I4", "--out", tmp_path / "e", "--jobs", "1")
    code, text, err = run(*command, "--json")
    assert code == 0, err
    (found,) = json.loads(text)["experiments"]
    figure = found["figures"]["I4.before"]
    assert figure["values"]["1"] < 9 < figure["values"]["2"]
    assert 1.5 < figure["reached"] < 1.8
    assert found["broken"] == []
    assert "| I4 | unbalance of the disc |" in (tmp_path / "e" / "experiments.md").read_text(encoding="utf-8")
    assert "unbalance of the disc" in (tmp_path / "e" / "report.html").read_text(encoding="utf-8")
    code, again, _ = run(*command)
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
    code, out, err = run("study", "experiments", *more, "--out", tmp_path / "e")
    assert (code, out) == (2, "")
    assert words in err
    assert not (tmp_path / "e").exists()
