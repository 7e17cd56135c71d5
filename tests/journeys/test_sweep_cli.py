"""`rotorsim sweep`, `response` and `campbell`: files, JSON numbers, resumption, messages."""

import csv
import json

import pytest
import xarray as xr

RIG = ["--grid", "16x4", "--set", "actuators.mode=ideal"]
OVER = ["--over", "bearings.1.clearance=24 um, 26 um", "--over", "pressure=0.4 MPa, 0.6 MPa"]


def test_a_sweep_ends_in_files_with_units_and_its_best_points_and_continues(run, tmp_path):
    line = [
        "sweep",
        "dtu_gas_bearing",
        *RIG,
        *OVER,
        "--what",
        "lift_off,flow",
        "--workers",
        "1",
        "--json",
        "--out",
        "s",
    ]
    code, out, _ = run(*line)
    result = json.loads(out)
    assert code == 0 and result["complete"] and result["without_result"] == {}
    assert result["best"]["flow"]["at"] == {"bearings.1.clearance": "24 um", "pressure": "0.4 MPa"}
    head, *rows = csv.reader((tmp_path / "s" / "sweep.csv").open())
    assert head == ["bearings.1.clearance [um]", "pressure [MPa]", "lift_off [MPa]", "flow [mg/s]"] and len(rows) == 4
    with xr.open_dataset(tmp_path / "s" / "sweep.nc", engine="h5netcdf") as found:
        assert found["flow"].dims == ("bearings_1_clearance", "pressure") and found["flow"].attrs["units"] == "kg/s"
    assert "Lift-off pressure" in (tmp_path / "s" / "report.html").read_text()
    again = json.loads(run(*line)[1])
    assert again["best"] == result["best"]
    code, _, message = run(*[text.replace("0.6 MPa", "0.7 MPa") for text in line])
    assert code == 2 and "of another plan" in message


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ([], "no axis is given"),
        (["--over", "bearings.1.clearance=20 um:30 um:0"], "is not FROM:TO:COUNT"),
        (["--over", "bearings.1.clearance=20 um:30 um:10000000"], "is not FROM:TO:COUNT"),
        (["--over", "bearings.1.clearence=20 um:30 um:3"], "did you mean 'clearance'"),
        (["--over", "bearings.1.clearance=20:30:3"], "20 has no unit"),
        (["--over", "bearings.1.clearance=30 um:20 um:3"], "is not above the one before it"),
        (["--over", "bearings.1.clearance=0 um:20 um:3"], "must be above 0"),
        ([*OVER, "--what", "onst"], "did you mean 'onset'"),
        ([*OVER, "--highest-speed", "0 rpm"], "highest_speed"),
    ],
)
def test_bad_axes_end_in_one_sentence_and_code_2_and_nothing_is_written(run, tmp_path, arguments, sentence):
    code, _, message = run("sweep", "dtu_gas_bearing", *RIG, *arguments)
    assert code == 2 and sentence in message and len(message.strip().splitlines()) == 1, message
    assert not list(tmp_path.iterdir())


def test_the_response_of_a_machine_file_is_written_with_units(run, tmp_path):
    line = ["response", "plain_rotor", "--speeds", "500 rpm:4000 rpm:20", "--unbalance", "10 g*mm", "--disc", "0"]
    code, out, _ = run(*line, "--json", "--out", "r")
    assert code == 0 and json.loads(out)["peaks"]["disc 0"]["um"] > 1
    head = next(csv.reader((tmp_path / "r" / "response.csv").open()))
    assert head[0] == "speed [rpm]" and "disc 0 x [um 0-pk]" in head
    code, out, _ = run(*line, "--out", "s")
    assert code == 0 and "on steps of 184 rpm" in " ".join(out.split())  # 3500 rpm in 19 steps
    code, _, message = run(*line[:-1], "7")
    assert code == 2 and "there is no disc 7" in message


def test_a_campbell_diagram_has_the_modes_that_were_asked_for(run, tmp_path):
    code, out, _ = run("campbell", "plain_rotor", "--speeds", "0 rpm:6000 rpm:7", "--modes", "6", "--critical-map",
                       "--json", "--out", "c")  # fmt: skip
    printed = json.loads(out)
    assert code == 0 and [round(one["rpm"]) for one in printed["criticals"] if one["order"] == 1] == [2647, 2647]
    assert printed["missing"] == [0] * 7 and {one["direction"] for one in printed["criticals"]} == {"falls below"}
    with xr.open_dataset(tmp_path / "c" / "campbell.nc", engine="h5netcdf") as found:
        assert found["wn"].shape == (6, 7) and "undamped_critical_speed" in found
    assert "Critical speeds over the bearings" in (tmp_path / "c" / "report.html").read_text()


def test_random_machines_leave_their_table_their_page_and_the_probability_of_a_miss(run, tmp_path):
    options = ["--random", "12", "--vary", "discs.0.mass=+- 5 %", "--what", "criticals", "--highest-speed", "4000 rpm",
               "--require", "critical_1 > 2600 rpm", "--workers", "1", "--json", "--out", "r"]  # fmt: skip
    code, out, _ = run("sweep", "plain_rotor", *options)
    found = json.loads(out)
    assert code == 0 and found["machines"] == 12 and 0 <= found["misses"]["critical_1 > 2600 rpm"]["low"] < 1
    assert len((tmp_path / "r" / "random.csv").read_text().splitlines()) == 13
    assert "Probability of a miss" in (tmp_path / "r" / "report.html").read_text()
    for wrong in (
        ["--vary", "discs.0.mass=+- 5 %"],
        ["--random", "5"],
        ["--random", "5", "--over", "pressure=1 bar"],
        ["--random", "0", "--vary", "discs.0.mass=+- 5 %"],
    ):
        code, _, message = run("sweep", "plain_rotor", *wrong, "--out", "other")
        assert code == 2 and "--random" in message and message.count("\n") == 1


def test_a_search_for_the_best_machine_leaves_its_path_and_its_page(run, tmp_path):
    given = ["--over", "discs.0.mass=3 kg, 5 kg", "--objective", "critical_1", "--highest-speed", "4000 rpm"]
    code, out, _ = run("optimise", "plain_rotor", *given, "--json", "--out", "o")
    found = json.loads(out)
    assert code == 0 and found["best"] == {"discs.0.mass": "3 kg"}
    assert len((tmp_path / "o" / "path.csv").read_text().splitlines()) == 1 + len(found["path"])
    assert "Step by step" in (tmp_path / "o" / "report.html").read_text()
    code, _, message = run("optimise", "plain_rotor", *given, "--require", "critical_1 > 3900 rpm", "--out", "none")
    assert code == 2 and "limit" in message
