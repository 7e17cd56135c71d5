"""`rotorsim design` and `rotorsim verify` from the command line, with bad input."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import identification as idn
from identification import load_model
from rotorsim.base import display
from rotorsim.control import design as make, load_law

MODEL = Path(__file__).parent.parent / "control" / "rig_model.json"
BROKEN = Path(__file__).parent / "no_model.json"


def test_a_design_becomes_a_law_with_a_report(run, tmp_path):
    out = tmp_path / "hinf.json"
    code, text, err = run("design", "hinf", MODEL, "--preset", "rig", "--out", out, "--report", "--json")
    assert (code, err) == (0, "")
    result = json.loads(text)
    assert result["unstable_points"] == "0 of 600"
    assert result["gamma"] == pytest.approx(1.02 * result["optimal_gamma"])
    assert load_law(out).order == 12
    assert "Sensitivities" in out.with_suffix(".html").read_text()


def test_a_terminal_shows_the_steps_of_a_long_design_and_a_pipe_none(run, tmp_path, monkeypatch):
    command = ("design", "lpv", MODEL, "--spec", "grid=3x3", "--spec", "table=3x3", "--spec", "validation=3x3")
    _, _, err = run(*command, "--spec", "bound=1e-3", "--out", tmp_path / "law.json")
    assert "inequalities ..." not in err and err.startswith("lpv: no Y(q)")
    monkeypatch.setattr(display, "on_terminal", lambda: True)
    _, _, err = run(*command, "--spec", "bound=1e-3", "--out", tmp_path / "law.json")
    assert "design lpv: smallest gamma: " in err and err.split("\r")[-1].startswith("\x1b[Klpv: no Y(q)")


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("hinv", MODEL), "did you mean 'hinf'"),
        (("mpc", MODEL), "is made in Python alone, with no law file: rs.control.mpc.design("),
        (("hinf", "nothing.json"), "is not there"),
        (
            ("hinf", MODEL, "--spec", "speed=12000 rpm"),
            "12000 rpm, 0.5 MPa lies outside the 0 to 6000 rpm, 0.3 to 0.7 MPa it was identified at",
        ),
        (("hinf", MODEL, "--spec", "weights.k_1=3"), "no field 'k_1'"),
        (("p", MODEL, "--spec", "low_pass=100 kHz"), "exceeds 10/Ts"),
        (("hinf", MODEL, "--spec", "Ts=0.1 s"), "Ts = 100 ms: the controller's fastest pole, 2.72e+03 rad/s, exceeds"),
        (("p", MODEL, "--spec", "kappa_x=-1.125"), "the loop with the model is unstable"),
        (("p", MODEL, "--bias", "9 V,0 V"), "leaves no room below the limit"),
        (("p", MODEL, "--bias", "nan V,0 V"), "is not a pair of voltages"),
        (("p", MODEL, "--bias", "0.5,0"), "is not a pair of voltages; write e.g. --bias '0.5 V,0 V'"),
        (("p", MODEL, "--zero-dc", "5"), "--zero-dc: '5' has no unit; write e.g. '5 Hz'"),
        (("p", MODEL, "--zero-dc", "1250 Hz"), "less than 1250 Hz"),
        (("p",), "no model; give the file that 'rotorsim identify' wrote"),
        (("hinf", MODEL, "--spec", "weights.omega_b=100"), "'100' has no unit; write e.g. '100 rad/s'"),
        (("hinf", MODEL, "--spec", "weights.zeta_1=0.2 %"), "write e.g. 0.002"),
        (("p", MODEL, "--bias", "much"), "is not a pair of voltages"),
        (("lead", MODEL, "--preset", "medium"), "known are softening, hardening"),
        (("lqr", MODEL, "--preset", "mild"), "it has none, change fields"),
        (("hinf", MODEL, "--spec", "speed=4000"), "'4000' has no unit; write e.g. '4000 rpm'"),
        (("hinf", BROKEN), "is not a model (it has no 'A')"),
        (("lqr", MODEL, "--spec", "Ts=0 s"), "'0 s' must be above 0; write e.g. '0.2 ms'"),
        (("hinf", MODEL, "--spec", "weights.zeta_1=-3"), "W_p and its inverse are stable above 0"),
        (("hinf", MODEL, "--spec", "weights.over_M_b=0"), "some reference costs nothing at high frequency"),
        (("lpv", MODEL, "--spec", "grid=3x3", "--spec", "bound=1e-3"), "no Y(q) keeps its inequality"),
        (("lpv", MODEL, "--spec", "speed_rate=-60 krpm/s"), "must be above 0; write e.g. '60000 rpm/s'"),
        (("lpv", MODEL, "--spec", "pressure_rate=2"), "'2' has no unit; write e.g. '2 MPa/s'"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(run, tmp_path, arguments, word):
    code, out, err = run("design", *arguments, "--out", tmp_path / "law.json")
    assert (code, out) == (2, "")
    assert word in err
    assert "Traceback" not in err
    assert not (tmp_path / "law.json").exists()


@pytest.mark.parametrize(("row", "word"), [("B", "uncontrollable"), ("C", "unobservable"), ("y", "1 outputs")])
def test_a_model_that_cannot_be_controlled_is_refused(run, tmp_path, row, word):
    one = load_model(MODEL).at(314.0, 0.5e6)
    A, C, D = one.A.copy(), one.C.copy(), one.D
    if row == "B":
        A[2:4, 4:6] = 0
    elif row == "C":
        C[1], A[2, [1, 3, 5]] = 0, 0
    else:
        C, D = C[:1], D[:1]
    replace(one, A=A, C=C, D=D).save(tmp_path / "model.json")
    code, _, err = run("design", "hinf", tmp_path / "model.json", "--out", tmp_path / "law.json")
    assert code == 2
    assert word in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("name", ["p", "lead", "lqr", "placement", "hinf"])
@pytest.mark.parametrize(("field", "point"), [("speed=90000 rpm", "90000 rpm"), ("pressure=60 bar", "6 MPa")])
def test_a_model_of_one_point_takes_designs_at_this_point(run, tmp_path, name, field, point):
    load_model(MODEL).at(400.0, 0.6e6).save(tmp_path / "one.json")
    command = ("design", name, tmp_path / "one.json", "--out", tmp_path / "law.json")
    code, _, err = run(*command, "--spec", field)
    assert (code, err.count("\n")) == (2, 1)
    assert point in err and "lies outside the 3820 rpm, 0.6 MPa it was identified at" in err
    assert not (tmp_path / "law.json").exists()
    assert run(*command)[0] == 0
    at_point = make(name, load_model(tmp_path / "one.json"), ["speed=3819.718634205488 rpm", "pressure=0.6 MPa"])
    for matrix in "ABCD":
        np.testing.assert_array_equal(getattr(load_law(tmp_path / "law.json"), matrix), getattr(at_point, matrix))


def test_the_operating_point_is_shown_in_rpm(run, tmp_path):
    load_model(MODEL).at(400.0, 0.6e6).save(tmp_path / "one.json")
    point = ("--spec", "speed=3820 rpm", "--spec", "pressure=6 bar")
    _, text, _ = run("design", "lqr", tmp_path / "one.json", *point, "--json", "--out", tmp_path / "law.json")
    assert json.loads(text)["operating_point"] == "3820 rpm, 0.6 MPa"


def test_the_fields_of_a_specification_are_listed(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    code, text, err = run("design", "hinf", "--fields")
    assert (code, err) == (0, "")
    row = next(line for line in text.splitlines() if line.startswith("weights.zeta_1"))
    assert row.split()[1:4] == ["0.3", "above", "0"]
    assert any(line.split()[:3] == ["speed", "rpm", "3000"] for line in text.splitlines())


def test_corner_and_bias_take_units(run, tmp_path):
    out = tmp_path / "law.json"
    code, _, err = run("design", "lqr", MODEL, "--zero-dc", "5 Hz", "--bias", "500 mV,0 V", "--out", out)
    assert (code, err) == (0, "")
    assert load_law(out).bias == (0.5, 0.0)
    assert load_law(out).about["zero_dc"] == 5.0


def test_a_law_for_three_channels_is_refused(run, tmp_path):
    run("design", "p", MODEL, "--out", tmp_path / "p.json")
    result = json.loads((tmp_path / "p.json").read_text())
    result["B"] = [[[[*row, 0.0] for row in block] for block in line] for line in result["B"]]
    (tmp_path / "p.json").write_text(json.dumps(result))
    for command in (("verify", tmp_path / "p.json"), ("fmu", "export", "--law", tmp_path / "p.json")):
        code, _, err = run(*command)
        assert code == 2
        assert "3 measured and 2 driven channels" in err


def test_a_law_for_another_sampling_time_is_not_verified(run, tmp_path):
    run("design", "p", MODEL, "--out", tmp_path / "p.json")
    load_law(tmp_path / "p.json").with_(Ts=1e-4).save(tmp_path / "p.json")
    code, _, err = run("verify", tmp_path / "p.json", "--out", tmp_path / "v")
    assert code == 2
    assert "the plant samples every 0.2 ms" in err


def test_a_law_for_another_machine_runs_with_a_warning(run, tmp_path):
    run("design", "p", MODEL, "--out", tmp_path / "p.json")
    law = load_law(tmp_path / "p.json")
    law.with_(about=law.about | {"machine": "my_rig 0123456789abcdef"}).save(tmp_path / "p.json")
    short = ("--duration", "0.1 s", "--pressure", "0.6 MPa", "--no-report", "--json")
    code, text, err = run("experiment", "controlled", "--law", tmp_path / "p.json", *short)
    assert code == 0 and json.loads(text)["parameters"]["law_machine"] == "my_rig 0123456789abcdef"
    lines = [line for line in err.splitlines() if not line.startswith("compiling ")]
    assert lines == [
        "law p: was designed on a model of my_rig, and the machine is dtu_gas_bearing: a test of robustness; design it "
        "on a model of this machine to use it there"
    ]


@pytest.mark.slow
def test_a_law_is_verified_on_the_machine(run, tmp_path):
    run("design", "lqr", MODEL, "--out", tmp_path / "lqr.json")
    short = ("--duration", "0.2 s", "--pressure", "0.6 MPa", "--no-report", "--json")
    code, text, err = run("experiment", "controlled", "--law", tmp_path / "lqr.json", *short)
    law = load_law(tmp_path / "lqr.json")
    assert code == 0 and json.loads(text)["parameters"]["law_hash"] == law.hash, err
    quick = ("--quick", "--safe-speed", "--json", "--out", tmp_path / "v")
    code, text, err = run("verify", tmp_path / "lqr.json", *quick)
    result = json.loads(text)
    safe = result["safe_speed"]
    assert safe["ratio"] == pytest.approx(safe["closed_rpm"] / safe["open_rpm"]) and safe["ratio"] > 2
    assert safe["last_checked_rpm"] == pytest.approx(6000) and safe["times_checked"] > 2
    assert safe["beyond"][0].startswith("above 6000 rpm: ")
    assert "times that, is not checked" in (tmp_path / "v" / "report.html").read_text()
    rows = {row["check"]: row for row in result["rows"]}
    assert [line for line in err.splitlines() if not line.startswith("compiling ")] == []
    assert code == (0 if result["passed"] else 1)
    assert rows["impact response, worst point"]["measured"] < 0.9
    assert rows["no contact in the hits"]["passed"]
    assert "Impact responses" in (tmp_path / "v" / "report.html").read_text()
    assert result["edited"] == []
    table = tmp_path / "v" / "table.json"
    table.write_text(table.read_text().replace('"worst": 1.0', '"worst": 2.0'))
    sentence = "worst: 2.0 at the first verification here, 1.0 now"
    for _ in range(2):  # once more, by the same bounds: what was edited stays stated
        code, text, err = run("verify", tmp_path / "lqr.json", "--quick", "--json", "--force", "--out", tmp_path / "v")
        assert json.loads(text)["edited"] == [sentence]
    assert sentence in (tmp_path / "v" / "report.html").read_text()


@pytest.mark.parametrize(("name", "mark", "fits"), [("rig", "aa", True), ("rig", "bb", False), ("other", "aa", False)])
def test_the_runout_table_of_another_machine_is_refused_also_where_both_have_one_name(run, tmp_path, name, mark, fits):
    """A machine is its name and its fingerprint: a copy that was changed, of its runout for one, is another."""
    model, slow, law = (tmp_path / file for file in ("model.json", "slow.nc", "law.json"))
    model.write_text(json.dumps(json.loads(MODEL.read_text()) | {"machine": "rig aa"}))
    time = 2e-4 * np.arange(9001)
    record = idn.from_arrays(time, np.zeros((9001, 2)), np.zeros((9001, 2)), angle=10.5 * time, speed=10.5)
    idn.save(record.assign_attrs(machine=f'name = "{name}"', machine_hash=mark), slow)
    code, _, err = run("design", "p", model, "--runout", slow, "--out", law)
    assert (code, law.exists()) == ((0, True) if fits else (2, False))
    assert fits or f"is a slow roll of {name} ({mark}), and the model is one of rig (aa)" in err
