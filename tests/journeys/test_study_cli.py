"""`rotorsim study identification-vs-physics`: from a machine to the report, on a grid of four points."""

import json

import pytest

import identification as idn
from rotorsim.base.units import RPM
from rotorsim.study.identify_records import StudyGrid

SMALL = StudyGrid((0.0, 3000 * RPM), (0.4e6, 0.6e6), duration=3.0)  # where the orbit of the imbalance is small


@pytest.mark.slow
def test_a_study_of_four_points_ends_in_models_and_a_report(run, tmp_path, monkeypatch):
    monkeypatch.setattr("rotorsim.study.identify_records.QUICK", SMALL)
    out = tmp_path / "study"
    command = ("study", "identification-vs-physics", "--quick", "--surfaces", "1", "--out", out, "--jobs", "1")
    code, text, err = run(*command, "--json")
    assert code == 0, err
    result = json.loads(text)
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


def test_a_folder_without_the_right_records_ends_in_a_sentence(run, tmp_path):
    code, _, err = run(
        "study", "identification-vs-physics", "--campaign", tmp_path / "nothing", "--out", tmp_path / "study"
    )
    assert code == 2
    assert "nothing" in err
    assert err.count("\n") == 1


def test_a_machine_without_pins_is_refused_before_any_record(run, tmp_path):
    out = tmp_path / "study"
    code, text, err = run("study", "identification-vs-physics", "plain_rotor", "--out", out)
    assert (code, text) == (2, "") and "plain_rotor" in err
    assert not list(out.rglob("*.nc"))
