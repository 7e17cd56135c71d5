"""`rotorsim map`, `modes` and `machine calibrate`: files, JSON numbers, messages."""

import csv
import json
import sys

import numpy as np
import pytest
import xarray as xr

from rotorsim.commands.options import note_unfed, print_json
from rotorsim.machine import load_machine
from rotorsim.report.scenes import lacking

RIG = ["--grid", "16x4", "--set", "actuators.mode=ideal"]


def test_a_map_ends_in_a_file_a_report_and_numbers(run, tmp_path):
    options = ["--speed", "0 rpm:6000 rpm:3", "--pressure", "0.4 MPa, 0.6 MPa", "--lift-off", "--campbell", "--json"]
    code, out, _ = run("map", *RIG, *options, "--out", "m")
    result = json.loads(out)
    assert code == 0 and result["points"] == result["lifted"] == 6
    assert 0.1 < result["lift_off_mpa"][0] < 0.3
    with xr.open_dataset(tmp_path / "m" / "map.nc", engine="h5netcdf") as found:
        assert found.sizes["speed"] == 3 and found["wn"].attrs["units"] == "rad/s"
        assert found["crossing_speed"].sizes["order"] == 3 and "dtu_gas_bearing" in found.attrs["machine"]
    page = (tmp_path / "m" / "report.html").read_text()
    assert "Campbell diagram" in page and "Operating map" in page
    code, _, message = run("map", *RIG, *options, "--out", "m")
    assert code == 2 and "m: map.nc and report.html are there already" in message


def test_a_varied_machine_has_its_own_onset_lift_off_and_crossings(run, tmp_path):
    """Without the axis all of them would be those of the file: one lift-off pressure for both clearances."""
    over = ["--over", "bearings.1.clearance=25 um, 40 um", "--lift-off", "--whirl-onset", "--campbell"]
    code, out, _ = run("map", *RIG, "--speed", "0 rpm, 18000 rpm", "--pressure", "0.5 MPa", *over, "--json",
                       "--out", "m")  # fmt: skip
    result = json.loads(out)
    assert code == 0
    with xr.open_dataset(tmp_path / "m" / "map.nc", engine="h5netcdf") as found:
        for name in ("lift_off_pressure", "onset_speed", "crossing_speed"):
            assert found[name].dims[0] == "bearings_1_clearance" and found[name].attrs["units"]
        onset, damping = found["onset_speed"].values[:, 0], found["zeta_least"].values[:, 0, 1]
        assert [(o < 18000 * np.pi / 30) == (d < 0) for o, d in zip(onset, damping, strict=True)] == [True, True]
    assert result["lift_off_mpa"][0][0] != result["lift_off_mpa"][1][0] and len(result["whirl_onset_rpm"]) == 2
    assert "Whirl onset and lift-off" in (tmp_path / "m" / "report.html").read_text()


@pytest.mark.parametrize(("asked", "noted"), [([], False), (["--pressure", "0.5 MPa, 0.7 MPa"], True)])
def test_a_machine_without_feed_is_mapped_at_one_pressure(run, tmp_path, asked, noted):
    code, out, message = run(
        "map", "plain_rotor", "--speed", "0 rpm, 100 rpm", *asked, "--jobs", "1", "--no-report", "--json", "--out", "m"
    )
    assert code == 0 and json.loads(out)["points"] == 2 and ("no pressure changes it" in message) is noted
    with xr.open_dataset(tmp_path / "m" / "map.nc", engine="h5netcdf") as found:
        assert found["pressure"].values.tolist() == [0.0]


@pytest.mark.parametrize("machine", ["plain_rotor", "grooved_turbo_rotor", "dtu_gas_bearing"])
@pytest.mark.parametrize("given", [True, False])
def test_a_pressure_that_nothing_feels_is_noted(capsys, machine, given):
    loaded = load_machine(machine)
    note_unfed(loaded, given)
    assert bool(capsys.readouterr().err) is (given and not loaded.fed)


@pytest.mark.parametrize("command", [
    ("response", "--speeds", "100 rpm, 200 rpm", "--no-report"), ("modes", "--speed", "100 rpm", "--no-pictures"),
])  # fmt: skip
@pytest.mark.parametrize("asked", [(), ("--pressure", "0.5 MPa")])
def test_linear_analyses_of_a_machine_without_feed_note_a_pressure(run, command, asked):
    name, *options = command
    code, _, err = run(name, "plain_rotor", *options, *asked)
    assert code == 0 and ("no pressure changes it" in err) is bool(asked)


def test_values_by_pressure_have_a_column_each_with_its_pressure(run):
    code, out, _ = run(
        "map", *RIG, "--speed", "0 rpm", "--pressure", "0.5 MPa, 0.7 MPa", "--whirl-onset", "--no-report"
    )
    lines = out.splitlines()
    assert code == 0 and next(k for k in lines if "Whirl onset [rpm]" in k)
    assert any("pressure 0.5 MPa" in k and "pressure 0.7 MPa" in k for k in lines)


def test_rows_and_columns_of_a_varied_machine_are_named_with_their_units(run):
    over = ["--over", "bearings.1.clearance=25 um, 40 um", "--over", "effects.unbalance.me=5 g*mm, 10 g*mm"]
    code, out, _ = run("map", *RIG, "--speed", "0 rpm", "--pressure", "0.5 MPa, 0.7 MPa", *over, "--whirl-onset",
                       "--no-report")  # fmt: skip
    assert code == 0
    rows = [[cell.strip() for cell in line.strip("│┃").replace("┃", "│").split("│")] for line in out.splitlines()]
    heads = ["bearings.1.clearance", "effects.unbalance.me", "pressure 0.5 MPa", "pressure 0.7 MPa"]
    assert rows.count(heads) == 2
    first = rows[rows.index(heads) :]
    assert [row[:2] for row in first if row[0] in ("25 um", "40 um")][:4] == [
        ["25 um", "5 g*mm"], ["25 um", "10 g*mm"], ["40 um", "5 g*mm"], ["40 um", "10 g*mm"],
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["map", "--speed", "3000 rpm, 1000 rpm"], "is not above the one before"),
        (["map", "--speed", ""], "the grid is empty"),
        (["map", "--over", "bearings.1.clearance=20 um:30 mm:3"], "one and the same unit"),
        (["map", "plain_rotor", "--whirl-onset"], "the machine has no gas film"),
        (["map", "plain_rotor", "--lift-off"], "the machine has no injectors"),
        (["map", "--frequency", "120"], "--frequency"),
        (["modes", "--pressure", "0.05 MPa", "--speed", "0 rpm", *RIG], "no lift-off"),
        (
            ["modes", "plain_rotor", "--set", "bearings.0.kxx=0 N/m"],
            "free to fall or to tilt (tilt about x, tilt about y)",
        ),
        (["modes", "plain_rotor", "--set", "discs.0.mass=-1 kg"], "discs.0.mass: '-1 kg' must be above 0"),
        (["modes", "plain_rotor", "--set", "bearings.0.kxx=nan N/m"], "'nan N/m' is not a stiffness"),
        (
            ["machine", "calibrate", "dtu_gas_bearing", "--targets", "none.toml"],
            "neither a shipped file of targets (dtu_first_assembly, dtu_loss_factor, dtu_orifice, dtu_paper_a,",
        ),
    ],
)
def test_bad_input_ends_in_one_sentence_and_code_2(run, tmp_path, arguments, sentence):
    code, _, message = run(*arguments)
    assert code == 2 and sentence in message and len(message.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_modes_are_printed_and_kept(run, tmp_path):
    code, out, _ = run("modes", *RIG, "--no-pictures", "--json", "--out", "modes")
    result = json.loads(out)["modes"]
    assert code == 0 and [m["whirl"] for m in result[:2]] == ["backward", "forward"]
    assert 100 < result[0]["frequency_hz"] < result[1]["frequency_hz"] < 140
    assert (tmp_path / "modes" / "modes.nc").exists()


@pytest.mark.slow
def test_a_picture_of_each_mode_is_drawn(run, tmp_path):
    if missing := lacking():
        pytest.skip(missing)
    code, _, message = run("modes", *RIG, "--count", "1", "--out", "modes")
    if "cannot draw" in message:
        pytest.skip("no off-screen rendering on this computer")
    assert code == 0 and (tmp_path / "modes" / "mode_1.png").stat().st_size > 5000


def test_without_pyvista_the_numbers_are_shown_and_what_is_missing(run, monkeypatch, tmp_path):
    """The base install: nothing asked for is refused, pictures asked for are refused before anything is computed."""
    monkeypatch.setitem(sys.modules, "pyvista", None)  # its import raises ImportError
    code, out, message = run("modes", "plain_rotor", "--count", "2", "--json", "--out", "modes")
    assert code == 0 and len(json.loads(out)["modes"]) == 2
    assert "pictures need pyvista; 'pip install pyvista'" in message and len(message.strip().splitlines()) == 1
    assert (tmp_path / "modes" / "modes.nc").exists()
    code, out, message = run("modes", "plain_rotor", "--count", "1", "--out", "again")
    assert code == 0 and "Hz, damping" in out
    for asked in (["--pictures"], ["--show"], ["--film", "gif"]):
        code, out, message = run("modes", "plain_rotor", *asked, "--out", "none")
        assert code == 2 and out == "" and "pictures need pyvista" in message and not (tmp_path / "none").exists()


@pytest.mark.slow
def test_a_mode_is_filmed(run, tmp_path):
    if missing := lacking():
        pytest.skip(missing)
    code, _, message = run("modes", *RIG, "--count", "1", "--no-pictures", "--film", "gif", "--out", "modes")
    assert code == 0, message
    assert sorted(path.name for path in (tmp_path / "modes").iterdir()) == ["mode_1.gif", "modes.nc"]


def test_another_kind_of_film_is_refused(run, tmp_path, monkeypatch):
    code, _, message = run("modes", *RIG, "--film", "avi")
    assert code == 2 and message == "--film: 'avi' is not known; choose one of gif, mp4\n"
    monkeypatch.setenv("PATH", "")
    code, _, message = run("modes", *RIG, "--film", "mp4")
    assert code == 2 and "needs the program ffmpeg" in message and not list(tmp_path.iterdir())


def test_a_window_needs_a_display_and_reports_it(run, tmp_path, monkeypatch):
    if missing := lacking():
        pytest.skip(missing)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pyvista.OFF_SCREEN", False)
    monkeypatch.setattr("sys.platform", "linux")
    code, _, message = run("modes", *RIG, "--no-pictures", "--show", "--out", "modes")
    assert code == 2 and "there is no display" in message and len(message.strip().splitlines()) == 1


TARGETS = """
operating_points = {speeds = ["0 rpm"], pressures = ["0.5 MPa"]}
parameters."injection.pin_discharge" = {low = 0.1, high = 0.15}
[[targets]]
name = "f"
quantity = "wn_x"
value = "735 rad/s"
tolerance = "1 rad/s"
speed = "0 rpm"
pressure = "0.5 MPa"
"""


def test_a_calibration_writes_a_machine_file_that_meets_its_targets(run, tmp_path):
    (tmp_path / "t.toml").write_text(TARGETS)
    code, out, _ = run("machine", "calibrate", "dtu_gas_bearing", "--targets", "t.toml", "--grid", "16x4", "--json",
                       "--out", "new.toml")  # fmt: skip
    result = json.loads(out)
    assert code == 0 and result["met"] == {"before": 0, "after": 1, "of": 1}
    text = (tmp_path / "new.toml").read_text()
    assert text.startswith("# Calibrated, not predicted") and "# DTU thesis, App. H" in text
    assert 'name = "new"' in text and "# calibrated to 't'" in text
    assert "1 after, of 1, on a film grid of 16 x 4." in text and "n_theta = 32" in text
    assert run("machine", "check", "new.toml")[0] == 0
    code, _, message = run("machine", "calibrate", "dtu_gas_bearing", "--targets", "t.toml", "--out", "new.toml")
    assert code == 2 and "is there already" in message


def test_a_design_review_leaves_a_page_and_a_table_a_section(run, tmp_path):
    options = ["--speed", "3200 rpm:4000 rpm", "--author", "A. Nyquist", "--out", "design", "--json"]
    code, out, _ = run("report", "design", "plain_rotor", *options)
    found = json.loads(out)
    assert code == 0 and found["verdicts"]["met"] > 0 and found["verdicts"]["not looked at"] > 0
    assert sum(found["verdicts"].values()) == len(found["requirements"])
    rows = list(csv.reader((tmp_path / "design" / "criticals.csv").read_text().splitlines()))
    assert len(rows) == 1 + len(found["criticals"]) and rows[0][1] == "speed [rpm]"
    assert "A. Nyquist" in (tmp_path / "design" / "report.html").read_text()
    for table in ("requirements", "criticals", "cases", "unbalances", "clearances", "grades", "zones"):
        for row in found[table]:
            numbers = [v for head, v in row.items() if "[" in head or head in ("asked", "found")]
            assert all(v is None or isinstance(v, (int, float)) for v in numbers) and numbers
    assert {row["unit"] for row in found["requirements"]} >= {"%", "rpm", "um", "g mm"}
    code, _, message = run("report", "design", "aerostatic_spindle", "--speed", "4000 rpm:3000 rpm")
    assert code == 2 and message.startswith("--speed: ") and message.count("\n") == 1
    code, _, message = run("report", "design", "plain_rotor", "--law", "law.json", "--out", "other")
    assert code == 2 and message.startswith("--law: ")


def test_what_is_no_number_is_null_in_json(capsys):
    print_json(
        {"onset": np.array([np.nan, np.inf, -np.inf, 0.1]).tolist(), "peak": np.float64("nan"), "of": np.int64(3)}
    )
    assert json.loads(capsys.readouterr().out) == {"onset": [None, None, None, 0.1], "peak": None, "of": 3}
