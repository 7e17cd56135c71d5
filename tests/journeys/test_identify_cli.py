"""`rotorsim identify`: from files to a model, and messages for bad data."""

import json
from functools import partial

import numpy as np
import pytest

import identification as idn
import model3


@pytest.fixture
def run(run):
    """`rotorsim identify`."""
    return partial(run, "identify")


def csv_of(record, path):
    """A rig's file with foreign names and units."""
    columns = [record.time.values, *(record.disc_measured.values.T * 1e6), *record.reference.values.T]
    np.savetxt(path, np.column_stack(columns), delimiter=",", header="t,px,py,rx,ry", comments="", fmt="%.9g")
    channels = {"disc_measured": ("px", "py", "um"), "reference": ("rx", "ry", "V")}
    text = '[time]\ncolumn = "t"\nunit = "s"\n'
    for name, (x, y, unit) in channels.items():
        for axis, column in (("x", x), ("y", y)):
            text += f'[channels.{name}.{axis}]\ncolumn = "{column}"\nunit = "{unit}"\n'
    path.with_suffix(".toml").write_text(text + '[constants]\npressure = "0.3 MPa"\nspeed = "0 rpm"\n')


def test_a_measured_file_becomes_a_model_without_a_machine(run, tmp_path):
    csv_of(model3.record(0, seconds=3.0), tmp_path / "rig.csv")
    mapping, out = tmp_path / "rig.toml", tmp_path / "model.json"
    code, text, err = run(tmp_path / "rig.csv", "--mapping", mapping, "--out", out)
    assert (code, err) == (0, "")
    assert "LinearModel written" in text
    found = idn.load_model(out)
    np.testing.assert_allclose(found.wn, model3.model().wn, rtol=3e-3)
    code, _, err = run(tmp_path / "rig.csv", "--mapping", mapping, "--out", out)
    assert code == 2
    assert "is there already" in err


def test_a_folder_of_records_becomes_a_parameter_varying_model(run, tmp_path):
    for i, (w, p) in enumerate((w, p) for w in (0.0, 300.0, 600.0) for p in (3e5, 5e5, 7e5)):
        theta = model3.TRUTH * np.r_[np.full(4, 1 + p / 4e6), np.ones(10)]
        (tmp_path / "sub").mkdir(exist_ok=True)
        data = model3.record(i, seconds=2.0, theta=theta, speed=w, pressure=p)
        idn.save(data, tmp_path / "sub" / f"{i}.nc")
    out = tmp_path / "model.json"
    code, text, err = run(tmp_path, "--surfaces", "1", "--out", out, "--json")
    assert (code, err) == (0, "")
    result = json.loads(text)
    assert result["kind"] == "LpvModel"
    assert len(result["records"]) == 9
    lpv = idn.load_model(out)
    assert lpv.at(100.0, 4e5).wn[0] == pytest.approx(model3.model().wn[0] * np.sqrt(1.1), rel=3e-3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere.nc"], "is not there"),
        (["{folder}"], "no .nc record in it"),
        (["{folder}/short.csv", "--mapping", "{folder}/short.toml"], "with excitation"),
        (["{folder}/short.csv", "--mapping", "{folder}/short.toml", "--model", "7"], "one of 1, 2, 2-rate, 3"),
        (["{folder}/short.csv", "--surfaces", "many"], "choose one of 1, 2, 3, hold-out"),
        (["{folder}/short.csv", "--refine", "much"], "choose one of none, frequency, global"),
        (["{folder}/short.csv", "--runout", "both"], "choose one of harmonic, table, none"),
        (["{folder}/short.csv", "--median", "4"], "--median: 4 samples; give an odd number"),
        (["{folder}/short.csv", "--dead-time", "4"], "--dead-time"),
        (["{folder}/short.csv", "--mapping", "{folder}/short.toml", "--dead-time", "9 ms"], "give 1e-05 to 0.005 s"),
        (["{folder}/short.csv", "--mapping", "{folder}/short.toml", "--advice"], "with excitation"),
        (["{folder}/short.csv", "--model", "2", "--order", "4"], "identify.order: 4 for model 2; only model blackbox"),
        (["{folder}/short.csv", "--order", "6"], "identify.order: 6 for model 3; only model blackbox has an order"),
        (["{folder}/short.csv", "--advice", "--compare", "m.json"], "one at a time"),
        (["{folder}/short.csv", "--compare", "{folder}/none.json"], "is not there"),
    ],
)
def test_bad_input_ends_as_one_sentence_and_exit_code_2(run, tmp_path, arguments, words):
    csv_of(model3.record(0, seconds=0.6), tmp_path / "short.csv")
    given = [a.format(folder=tmp_path) for a in arguments]
    code, _, err = run(*given, "--out", tmp_path / "m.json")
    assert code == 2
    assert words in err
    assert err.count("\n") == 1
    assert "Traceback" not in err


def test_the_warnings_of_a_record_are_printed_once_and_name_no_variable(run, tmp_path):
    record = model3.record(0, seconds=2.0).assign_attrs({"controller": "Law", "law": "lqr"})
    idn.save(record, tmp_path / "loop.nc")
    code, text, err = run(tmp_path / "loop.nc", "--method", "pem", "--out", tmp_path / "m.json")
    assert (code, err) == (0, "")
    assert text.count("made in closed loop (lqr)") == 1 and "record: made" not in text


def test_records_of_one_operating_point_become_one_model(run, tmp_path):
    for i in range(2):
        idn.save(model3.record(i, seconds=2.0), tmp_path / f"{i}.nc")
    out = tmp_path / "model.json"
    code, text, err = run(tmp_path, "--out", out, "--json")
    assert (code, err) == (0, "")
    result = json.loads(text)
    assert [row["record"] for row in result["records"]] == ["0.nc", "1.nc", "2 together"]
    assert any("2 records in one fit" in note for note in result["records"][2]["notes"])
    sd = [row["parameters"]["K_xx"][1] for row in result["records"]]
    assert sd[2] < 0.8 * min(sd[:2])
    assert idn.load_model(out).wn == pytest.approx(result["records"][2]["wn"])


def test_records_of_one_name_are_told_apart_by_their_folders(run, tmp_path):
    for i in range(2):
        (tmp_path / f"r{i}").mkdir()
        idn.save(model3.record(i, seconds=2.0), tmp_path / f"r{i}" / "prbs.nc")
    paths, names = [tmp_path / f"r{i}" / "prbs.nc" for i in range(2)], ["r0/prbs.nc", "r1/prbs.nc"]
    code, text, err = run(*paths, "--model", "1", "--out", tmp_path / "model.json")
    assert (code, err) == (0, "") and all(f"\n{name} " in text for name in names) and "\n2 together " in text
    code, text, _ = run(*paths, "--advice", "--json")
    assert code == 0 and [row["record"] for row in json.loads(text)["records"]] == names


@pytest.mark.parametrize(("given", "found"), [("0", [0.0, 0.0]), ("0.6 ms", [6e-4, 6e-4])])
def test_records_fitted_together_have_the_dead_time_that_is_given(run, tmp_path, given, found):
    for i in range(2):
        one = model3.record(i, seconds=2.0, theta=model3.DELAYED, kind="3-delay")
        idn.save(one, tmp_path / f"{i}.nc")
    code, text, _ = run(tmp_path, "--dead-time", given, "--out", tmp_path / "model.json", "--json")
    rows = json.loads(text)["records"]
    assert code == 0 and len(rows) == 3
    assert all(row["dead_time"] == pytest.approx(found) for row in rows)


def test_a_file_with_gaps_is_fitted_and_the_report_states_them(run, tmp_path):
    csv_of(model3.record(0, seconds=3.0), tmp_path / "rig.csv")
    lines = (tmp_path / "rig.csv").read_text().splitlines()
    kept = [line for k, line in enumerate(lines) if not 5000 <= k < 5200]
    kept[9000] = kept[9000].split(",")[0] + ",nan,nan,nan,nan"
    (tmp_path / "rig.csv").write_text("\n".join(kept) + "\n")
    code, text, err = run(tmp_path / "rig.csv", "--mapping", tmp_path / "rig.toml", "--out", tmp_path / "model.json")
    assert (code, err) == (0, "")
    assert "note: 201 of 15000 samples (1.3 %) left out; whole stretches: 3" in text
    np.testing.assert_allclose(idn.load_model(tmp_path / "model.json").wn, model3.model().wn, rtol=5e-3)


def test_a_closed_loop_is_fitted_in_two_stages(run, tmp_path):
    u, external, y = model3.looped_model3(0, 1e5, n=20000)
    idn.save(model3.made(u, y, reference_external=external).assign_attrs(law="p"), tmp_path / "loop.nc")
    code, text, err = run(tmp_path / "loop.nc", "--out", tmp_path / "model.json")
    assert (code, err) == (0, "")
    assert "Model 3, two-stage" in text and "note: two-stage: the external reference explains" in text
    code, _, err = run(tmp_path / "loop.nc", "--method", "oe", "--out", tmp_path / "other.json")
    assert code == 2 and "choose method 'auto'" in err


def test_a_dead_time_is_found_given_or_none_and_intervals_state_their_bias(run, tmp_path):
    idn.save(model3.record(0, seconds=2.0, theta=model3.DELAYED, kind="3-delay"), tmp_path / "late.nc")
    found = {}
    for name, words in (("free", ()), ("given", ("--dead-time", "0.6 ms")), ("none", ("--dead-time", "0"))):
        out = tmp_path / f"{name}.json"
        code, text, err = run(tmp_path / "late.nc", *words, "--out", out, "--json")
        assert (code, err) == (0, "")
        found[name] = json.loads(text)["records"][0]
    np.testing.assert_allclose(found["free"]["dead_time"], [4e-4, 8e-4], rtol=0.1)
    assert found["given"]["dead_time"] == pytest.approx([6e-4, 6e-4])
    assert found["none"]["dead_time"] == [0.0, 0.0]
    gain = next(one for one in found["none"]["intervals"] if one["name"] == "gain_yy")
    assert gain["low"] < 1e6 * model3.model().static_gain[1, 1] < gain["high"]
    assert abs(gain["bias"]) > 3 * gain["sd"]
    models = [word for name in found for word in ("--compare", tmp_path / f"{name}.json")]
    code, text, err = run(tmp_path / "late.nc", *models)
    assert (code, err) == (0, "")
    assert text.index("free") < text.index("given") < text.index("none")
    code, text, err = run(tmp_path / "late.nc", *models, "--json")
    rows = json.loads(text)["records"][0]["rows"]
    assert [row["name"] for row in rows] == ["free", "given", "none"]


def test_advice_fits_nothing(run, tmp_path):
    idn.save(model3.record(0, seconds=2.0), tmp_path / "run.nc")
    code, text, err = run(tmp_path / "run.nc", "--advice", "--out", tmp_path / "m.json")
    assert (code, err) == (0, "")
    assert "take model 3" in text
    assert not (tmp_path / "m.json").exists()
    code, text, err = run(tmp_path / "run.nc", "--advice", "--json")
    assert json.loads(text)["records"][0]["model"] == "3"
