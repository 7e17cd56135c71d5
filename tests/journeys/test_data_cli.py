"""`rotorsim data`: from a rig's file to a record of the schema, and messages for bad files."""

import json
from functools import partial

import numpy as np
import pytest

import identification as idn
import rotorsim
from rotorsim.base.errors import DataError
from rotorsim.discrepancy.records import make_trials
from rotorsim.discrepancy.run_ups import is_table, make_sweeps, with_tables
from rotorsim.machine import load_machine

MAPPING = """
[time]
column = "t"
unit = "ms"
[channels]
disc_measured.x = {column = "X probe", unit = "um"}
disc_measured.y = {column = "Y probe", unit = "um"}
reference.x = {column = "U1", unit = "V"}
reference.y = {column = "U2", unit = "V"}
speed = {column = "n", unit = "rpm"}
[constants]
pressure = "0.3 MPa"
"""


@pytest.fixture
def run(run):
    """`rotorsim data`."""
    return partial(run, "data")


@pytest.fixture
def rig(tmp_path):
    """Write a rig's file with foreign names, and its mapping."""
    rng = np.random.default_rng(0)
    rows = np.column_stack([np.arange(100) * 0.2, rng.normal(size=(100, 4)), np.full(100, 6000), np.ones(100)])
    lines = [",".join(f"{value:.10g}" for value in row) for row in rows]
    (tmp_path / "run.csv").write_text("\n".join(["t,X probe,Y probe,U1,U2,n,spare", *lines]) + "\n")
    (tmp_path / "rig.toml").write_text(MAPPING)
    return tmp_path / "run.csv", tmp_path / "rig.toml"


def test_a_rigs_file_is_drafted_checked_and_converted(run, rig, tmp_path):
    file, mapping = rig
    code, draft, _ = run("mapping", file)
    assert code == 0 and '# column = "X probe"' in draft and "from 0 to 19.8" in draft
    code, out, err = run("check", file, "--mapping", mapping)
    assert (code, err) == (0, "")
    assert "time series, 100 samples, 5000 Hz, 0.02 s" in out
    assert (
        "identification: refused" in out
        and "record longer" in out
        and "runout filter: lacks angle_measured or angle" in out
    )
    assert "columns not used: 'spare'" in out and "6000" in out and "rpm" in out
    for name in ("run.nc", "run.mat", "out.csv"):
        code, out, _ = run("convert", file, tmp_path / name, "--mapping", mapping)
        assert code == 0 and "written, 100 time x 2 axis" in out
        record = idn.read(tmp_path / name)
        assert record["speed"].values[0] == pytest.approx(200 * np.pi) and record["pressure"].values[0] == 3e5
        assert run("check", tmp_path / name)[0] == 0


def test_json_gives_si_numbers(run, rig):
    code, out, _ = run("check", rig[0], "--mapping", rig[1], "--json")
    found = json.loads(out)
    assert code == 0 and found["usable"] and found["samples"] == 100 and found["unused_columns"] == ["spare"]
    assert found["sample_rate"] == pytest.approx(5000) and found["uses"]["identification"] == ""


def test_data_that_is_fit_for_nothing_is_described_and_ends_with_3(run, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time,angle,speed\n0,0,1\n1,1,1\n2,nan,1\n9,3,1\n")
    code, out, err = run("check", path)
    assert (code, err) == (3, "")
    assert "problem: time: 1 gaps in samples 1 s apart" in out and "problem: angle: 1 NaN or infinite" in out
    code, out, _ = run("check", path, "--json")
    assert code == 3 and json.loads(out)["usable"] is False and len(json.loads(out)["problems"]) == 2
    code, out, err = run("convert", path, tmp_path / "a.nc")
    assert (code, out) == (2, "") and not (tmp_path / "a.nc").exists()
    assert err.startswith(f"{path}: record.time: 1 gaps") and err.count("\n") == 1


def test_a_unit_that_must_be_wrong_ends_with_3_and_one_that_few_rigs_have_with_0(run, rig):
    file, mapping = rig
    mapping.write_text(MAPPING.replace('"um"', '"mm"').replace('unit = "rpm"', 'unit = "Hz"'))
    code, out, _ = run("check", file, "--mapping", mapping)
    assert code == 3 and "identification: once the unit or the angle is corrected" in out
    mapping.write_text(MAPPING.replace("0.3 MPa", "3 MPa"))
    code, out, _ = run("check", file, "--mapping", mapping)
    assert code == 0 and "perhaps bar or psi taken for MPa" in out and "identification: refused" in out


def test_gaps_that_identify_leaves_out_are_fit_for_it_alone(run, tmp_path):
    rng = np.random.default_rng(0)
    table = np.column_stack([np.arange(3000) / 1000, rng.normal(size=(3000, 2)), 1e-6 * rng.normal(size=(3000, 3))])
    table[700:720, 3] = np.nan
    np.savetxt(tmp_path / "a.csv", table, "%.9g", ",", comments="",
               header="time,reference_x,reference_y,disc_measured_x,disc_measured_y,angle")  # fmt: skip
    (tmp_path / "a.csv").write_text((tmp_path / "a.csv").read_text().replace("nan", ""))
    code, out, _ = run("check", tmp_path / "a.csv")
    assert code == 0 and "identification: fit without its gaps: 20 of 3000 samples (0.67 %) left out" in out
    assert "runout filter: once the problems are corrected" in out
    with pytest.raises(idn.SchemaError, match=r"cut it with 'rotorsim data cut', or read it with identification\.load"):
        idn.read(tmp_path / "a.csv")
    assert idn.load(tmp_path / "a.csv").sizes["time"] == 3000


def test_run_up_vectors_are_checked(run, tmp_path, vectors_file="v.csv"):
    path = tmp_path / vectors_file
    head = "speed [rpm],amplitude_1X_x [um],phase_1X_x [deg],amplitude_1X_y [um],phase_1X_y [deg]"
    path.write_text(head + "\n600,1,10,2,20\n1200,2,20,3,40\n")
    code, out, _ = run("check", path)
    assert code == 0 and "run-up vectors at 2 speeds" in out and "run-up analysis: fit" in out
    assert run("convert", path, tmp_path / "v.nc")[0] == 0


def test_gaps_are_cut_out_and_dead_probes_said(run, tmp_path):
    t = np.arange(3000) / 1000
    table = np.column_stack([np.where(t > 1, t + 1, t), np.sin(300 * t), np.full_like(t, -5.0), np.cos(300 * t)])
    np.savetxt(tmp_path / "a.csv", table, "%.9g", ",", header="t,A,B,C", comments="")
    probe = "[probes.{0}]\ncolumn = '{0}'\nunit = 'mil'\nangle = '{1} deg'\n"
    mapping = "[time]\ncolumn = 't'\nunit = 's'\n" + "".join(
        probe.format(n, a) for n, a in {"A": 0, "B": 45, "C": 90}.items()
    )
    (tmp_path / "m.toml").write_text(mapping)
    given = (tmp_path / "a.csv", tmp_path / "a.nc", "--mapping", tmp_path / "m.toml")
    code, out, _ = run("check", given[0], *given[2:])
    assert code == 3 and "problem: time: 1 gaps" in out and "warning: probe B is dead (constant at -5 mil)" in out
    code, out, err = run("cut", *given)
    assert (code, err) == (0, "") and "a.nc: written, 1999 samples, cut: samples 1002 to 3000 of 3000" in out
    assert "1 gaps in time, the first after 1 s" in out
    assert idn.read(given[1]).sizes["time"] == 1999
    code, out, _ = run("cut", *given, "--all")
    assert code == 0 and (tmp_path / "a-1.nc").exists() and (tmp_path / "a-2.nc").exists()
    code, _, err = run("cut", *given, "--force", "--shortest", "5 s")
    assert code == 2 and err.startswith(f"{given[0]}: record: no whole stretch of 5 s") and err.count("\n") == 1
    assert run("cut", *given, "--force", "--shortest", "5")[0] == 2
    assert run("cut", given[1], given[1], "--force")[0] == 2


def test_a_mapping_is_proposed_and_never_replaced_unasked(run, rig, tmp_path):
    file, _ = rig
    out = tmp_path / "proposed.toml"
    file.write_text(file.read_text().replace("X probe,Y probe", "X probe [um],Y probe [um]"))
    code, text, _ = run("check", file, "--propose", out)
    assert (
        code == 0
        and "6 of 7 columns proposed (1 left out or incomplete" in text
        and f"rotorsim data check {file} --mapping {out}" in text
    )
    assert run("check", file, "--mapping", out)[0] == 0
    code, _, err = run("check", file, "--propose", out)
    assert code == 2 and "is there already" in err
    assert run("check", file, "--propose", out, "--force")[0] == 0
    code, _, err = run("check", file, "--propose", file, "--force")
    assert code == 2 and "is the file to check" in err
    code, _, err = run("check", file)
    assert code == 2 and "'rotorsim data check FILE --propose mapping.toml' proposes one" in err


def test_clipped_signals_are_shown_and_refused(run, tmp_path):
    t = np.arange(3000) / 1000
    x = np.clip(np.sin(60 * t), -2, 0.9)
    np.savetxt(tmp_path / "a.csv", np.column_stack([t, x, x]), "%.9g", ",", comments="",
               header="time,disc_measured_x [um],disc_measured_y [um]")  # fmt: skip
    code, out, _ = run("check", tmp_path / "a.csv")
    assert code == 3 and "problem: clipped: disc_measured x: rests at 0.9 um" in out
    code, _, err = run("convert", tmp_path / "a.csv", tmp_path / "a.nc")
    assert code == 2 and "clipped signal: disc_measured x: rests at 0.9 um for 15 %" in err and err.count("\n") == 1


def test_nothing_is_overwritten_unasked(run, rig, tmp_path):
    file, mapping = rig
    out = tmp_path / "a.csv"
    out.write_text("mine")
    code, _, err = run("convert", file, out, "--mapping", mapping)
    assert (code, out.read_text()) == (2, "mine") and "is there already; choose another name or add --force" in err
    assert run("convert", file, out, "--mapping", mapping, "--force")[0] == 0
    code, _, err = run("convert", out, out, "--force")
    assert code == 2 and "is the file to convert; choose another name" in err
    (tmp_path / "link.csv").symlink_to(out)
    assert run("convert", out, tmp_path / "link.csv", "--force")[0] == 2


BAD = {
    "missing": (None, "is not there; give the path of a record"),
    "formula": (
        "time,angle\n0,1\n1,=cmd|' /C calc'!A0\n",
        "line 3, column 'angle': \"=cmd|' /C calc'!A0\" is not a number",
    ),
    "foreign": ("t,x\n0,1\n1,2\n", "no column is named like a channel ('t', 'x'); give a mapping"),
    "empty": ("", "is empty; record or export it again"),
}


@pytest.mark.parametrize("command", ["check", "convert", "mapping"])
@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_ends_with_a_sentence_and_exit_code_2(run, tmp_path, case, command):
    content, sentence = BAD[case]
    path = tmp_path / "bad.csv"
    if content is not None:
        path.write_text(content)
    if case in ("foreign", "formula") and command == "mapping":
        return
    code, out, err = run(command, path, *([tmp_path / "out.nc"] if command == "convert" else []))
    assert (code, out) == (2, "")
    assert err.startswith(f"{path}: ") and err.count("\n") == 1 and sentence in err
    assert not (tmp_path / "out.nc").exists()


def test_a_bad_mapping_and_a_missing_folder_are_named(run, rig, tmp_path):
    file, mapping = rig
    mapping.write_text(MAPPING.replace('unit = "rpm"', 'unit = "furlong"'))
    code, _, err = run("check", file, "--mapping", mapping)
    assert code == 2 and "channels.speed: unit 'furlong' is not a known unit of rotational speed" in err
    mapping.write_text(MAPPING)
    code, _, err = run("convert", file, tmp_path / "none" / "a.nc", "--mapping", mapping)
    assert code == 2 and "cannot be written: its folder is not there; make the folder" in err
    code, _, err = run("convert", file, tmp_path / "a.xls", "--mapping", mapping)
    assert code == 2 and "unknown suffix '.xls'; write .csv, .mat or .nc" in err


def test_a_virtual_record_is_checked_and_converted_like_a_measured_one(run, tmp_path):
    plant = rotorsim.Plant(rotorsim.load_machine("plain_rotor"))
    idn.save(plant.simulate(0.1, speed=100.0, pressure=3e5), tmp_path / "v.nc")
    assert run("check", tmp_path / "v.nc")[0] == 0
    assert run("convert", tmp_path / "v.nc", tmp_path / "v.csv")[0] == 0
    first, second = idn.read(tmp_path / "v.nc"), idn.read(tmp_path / "v.csv")
    assert first.equals(second) and first.attrs.keys() == second.attrs.keys()


@pytest.mark.parametrize("command", ["check", "convert", "mapping"])
def test_every_help_page_has_an_example(run, command):
    code, out, _ = run(command, "--help")
    assert code == 0 and f"Example: rotorsim data {command}" in out


RECORDS = {
    "whole": ({}, ""), "sampled at 4 kHz": ({"rate": 4000.0}, "4000 Hz"), "short": ({"n": 300}, "0.7 s"),
    "run-up": ({"rise": 50.0, "driven": False}, ""), "run-up with a reference": ({"rise": 50.0}, "constant speed"),
}  # fmt: skip


@pytest.mark.parametrize("name", RECORDS)
def test_the_check_says_of_a_diagnosis_what_a_diagnosis_says(run, tmp_path, name):
    """The other side is the diagnosis' own reading of the record."""
    change, why = RECORDS[name]
    idn.save(turning(**change), tmp_path / "one.nc")
    code, out, _ = run("check", tmp_path / "one.nc")
    (line,) = [line for line in out.splitlines() if line.startswith("diagnosis: ")]
    assert code == 0 and why in line
    try:
        ((_, taken),) = with_tables([("one", idn.read(tmp_path / "one.nc"))])
        read = make_sweeps(taken, "one", True) if is_table(taken) else make_trials(
            load_machine("dtu_gas_bearing"), [("one", taken)], None)  # fmt: skip
    except DataError as error:
        assert line == f"diagnosis: refused: {str(error).removeprefix('one: ')}"
    else:
        assert line == "diagnosis: fit" and read


def turning(rate=5000.0, n=10_000, rise=0.0, driven=True):
    """A round orbit of 1 um at 600 rad/s, with an acceleration [rad/s^2] and a random reference."""
    rng, t = np.random.default_rng(0), np.arange(n) / rate
    angle = 600.0 * t + 0.5 * rise * t**2
    orbit = 1e-6 * np.column_stack([np.cos(angle), np.sin(angle)]) + 1e-8 * rng.normal(size=(n, 2))
    values = {"disc_measured": orbit, "angle": angle, "speed": 600.0 + rise * t, "pressure": np.full(n, 5e5)}
    return idn.make_record(t, values | ({"reference": rng.choice([-1.0, 1.0], (n, 2))} if driven else {}))
