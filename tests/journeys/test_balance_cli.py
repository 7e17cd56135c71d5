"""`rotorsim balance`: the measured rotor kit, from tables to weights, and bad input."""

import json
from pathlib import Path

import pytest

RK4 = Path(__file__).parents[2] / "docs" / "rk4"
MAPPING = (RK4 / "balance.toml").read_text(encoding="utf-8")


def test_the_measured_kit_within_the_errors_that_are_stated(run, tmp_path):
    out = tmp_path / "b"
    code, text, err = run(
        "balance", "bently_rk4", RK4 / "open.csv", RK4 / "unlabelled.csv", "--mapping", RK4 / "balance.toml",
        "--out", out, "--json",
    )  # fmt: skip
    found = json.loads(text)
    assert code == 0 and err == ""
    best = found["methods"]["influence coefficients"]
    assert best["vector_rms_gmm"] < 2.0 and best["magnitude_error_gmm"] < 1.5
    assert 0.8 <= best["share_in_90_percent_regions"] <= 0.97 and best["contradicted_labels"] == []
    assert found["methods"]["physical model"]["vector_rms_gmm"] < 9.0
    assert len(found["unbalance"]) == 56
    assert (out / "report.html").exists()
    printed, kept = (p.read_text().splitlines() for p in (out / "unbalance.csv", RK4.parent / "rk4_prediction.csv"))
    for a, b in zip(printed, kept, strict=True):
        assert a.split(",")[0] == b.split(",")[0]
        if not a.startswith("id"):
            assert [float(x) for x in a.split(",")[1:]] == pytest.approx([float(x) for x in b.split(",")[1:]], abs=0.02)


@pytest.mark.parametrize(
    ("change", "shown"),
    [
        (("[readings.p1x]", "[reading.p1x]"), "unknown table [reading]; did you mean 'readings'?"),
        (('unit = "mil"', 'units = "mil"'), "[readings.p1x] has no entry 'units'"),
        (('real = "p1x_1x_re_mil"', 'real = "p9x"'), "no column 'p9x'"),
        (('position = "120 mm"', 'position = "120"'), "mapping: '120'"),
        (('amount = "U1_gmm"', 'amount = "role"'), "column 'role' holds 'baseline', which is not a number"),
        (('position = "160 mm"', 'position = "900 mm"'), "disc_1: 900 mm is not on the shaft"),
        (("[conditions]", "[conditions"), "not a mapping"),
        (('unit = "mil"', "unit = 3"), "[readings.p1x] unit = 3 must be text"),
        (('column = "rpm"', "column = 9"), "[speed] column = 9 must be text"),
        (('radius = "30 mm"', 'radius = "30 mm"\nholes = 2'), "holes = 2 must be a whole number of at least 3"),
        (("[conditions]", "readings = 1\n[conditions]"), "mapping"),
    ],
)
def test_a_wrong_mapping_ends_in_one_sentence(run, tmp_path, change, shown):
    mapping = tmp_path / "m.toml"
    mapping.write_text(MAPPING.replace(*change, 1))
    code, out, err = run("balance", "bently_rk4", RK4 / "open.csv", "--mapping", mapping, "--out", tmp_path / "b")
    assert code == 2 and out == "" and shown in err and err.count("\n") == 1
    assert not (tmp_path / "b").exists()


def test_records_without_a_label_and_unknown_conditions_are_refused(run, tmp_path):
    line = ("balance", "bently_rk4", RK4 / "unlabelled.csv", "--mapping", RK4 / "balance.toml", "--out", tmp_path / "b")
    assert run(*line)[0] == 2 and "no condition has a known unbalance" in run(*line)[2]
    line = ("balance", "bently_rk4", RK4 / "open.csv", "--mapping", RK4 / "balance.toml", "--out", tmp_path / "b")
    assert "--correct: no condition 'A999'" in run(*line, "--correct", "A999")[2]


PHASED = """
[conditions]
column = "run"
[speed]
column = "rpm"
[readings.X]
amplitude = "um"
phase = "deg"
unit = "um"
[planes.left]
amount = "L"
angle = "L_deg"
unit = "g*mm"
radius = "40 mm"
[planes.right]
amount = "R"
angle = "R_deg"
unit = "g*mm"
"""
RUNS = "run,rpm,um,deg,L,L_deg,R,R_deg\nfirst,3000,20,30,0,0,0,0\na,3000,{},{},50,0,0,0\nb,3000,27,300,0,0,50,90\n"


def test_three_runs_and_planes_without_positions_give_weights(run, tmp_path):
    (tmp_path / "runs.csv").write_text(RUNS.format(25, 80))
    reading = '[readings.Y]\namplitude = "um"\nphase = "L_deg"\nunit = "um"\n[planes.left]'
    (tmp_path / "m.toml").write_text(PHASED.replace("[planes.left]", reading))
    code, text, _ = run(
        "balance", "plain_rotor", "runs.csv", "--mapping", "m.toml", "--out", "b", "--json", "--no-report"
    )
    found = json.loads(text)
    assert code == 0 and len(found["correction"]["weights"]) == 2 and found["physical_model_left_out"]
    assert min(found["changes_by_trial_weights"]) > 0.1


def test_a_trial_weight_that_changed_nothing_is_refused_with_the_number(run, tmp_path):
    (tmp_path / "runs.csv").write_text(RUNS.format(20.1, 30.2))
    (tmp_path / "m.toml").write_text(PHASED)
    code, _, err = run("balance", "plain_rotor", "runs.csv", "--mapping", "m.toml", "--out", "b")
    assert code == 2 and "left: the trial weight of 50 g mm changed the vectors by 0.6" in err and err.count("\n") == 1


def test_amplitudes_alone_give_weights_or_a_sentence(run, tmp_path):
    mapping = PHASED.replace('phase = "deg"\n', "").split("[planes.right]")[0]
    (tmp_path / "m.toml").write_text(mapping)
    rows = ["run,rpm,um,L,L_deg", "first,3000,8,0,0", "a,3000,10.2,10,0", "b,3000,11.4,10,120", "c,3000,4.1,10,240"]
    (tmp_path / "four.csv").write_text("\n".join(rows))
    code, text, _ = run("balance", "plain_rotor", "four.csv", "--mapping", "m.toml", "--out", "b", "--json")
    assert code == 0 and json.loads(text)["estimates_by"] == "amplitudes alone"
    (tmp_path / "three.csv").write_text("\n".join(rows[:-1]))
    code, _, err = run("balance", "plain_rotor", "three.csv", "--mapping", "m.toml", "--out", "c")
    assert code == 2 and "two answers" in err and err.count("\n") == 1
