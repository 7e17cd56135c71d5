"""`rotorsim experiment`: record, table, JSON numbers; bad input ends in one sentence."""

import json
import signal
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

from identification import validate
from rotorsim.experiments import Prbs
from waiting import until

RIG = ["--grid", "16x4", "--time-step", "0.2 ms", "--pressure", "0.6 MPa", "--no-report"]
NAMES = [
    "runup",
    "coastdown",
    "steady",
    "slow_roll",
    "staircase",
    "prbs",
    "chirp",
    "multisine",
    "impact",
    "shock",
    "controlled",
]


def rotorsim(*arguments, cwd):
    return subprocess.run([sys.executable, "-m", "rotorsim", *arguments], cwd=cwd, capture_output=True, text=True)


SHORT = {
    "runup": ["--stop", "300 rpm", "--rate", "1 krpm/s"],
    "coastdown": ["--start", "1000 rpm", "--stop", "900 rpm", "--rate", "1 krpm/s"],
    "steady": ["--duration", "0.2 s"],
    "slow_roll": ["--speed", "600 rpm", "--revolutions", "2"],
    "staircase": ["--amplitude", "1 V", "--hold", "40 ms", "--axis", "both"],
    "prbs": ["--duration", "0.6 s", "--amplitude", "0.5 V", "--seed", "3"],
    "chirp": ["--duration", "0.4 s", "--amplitude", "500 mV", "--high", "0.3 kHz"],
    "multisine": ["--period", "0.2 s", "--periods", "2", "--low", "10 Hz"],
    "shock": ["--rest", "0.2 s", "--peak", "5 m/s^2"],
    "impact": ["--hits", "2", "--spacing", "0.2 s", "--angle", "90 deg", "--peak", "5 N"],
    "controlled": ["--duration", "0.3 s", "--hit", "5 N", "--dither", "0.2 V", "--gain-x", "0.1 V/um"],
}
QUICK = ("runup", "prbs", "controlled")
"""Experiments whose command runs in the quick tests: one of the speed, one of the references, a closed loop."""


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in NAMES])
def test_every_experiment_leaves_a_valid_record_and_numbers(run, tmp_path, name):
    code, out, err = run("experiment", name, *RIG, *SHORT[name], "--json", "--out", "here")
    assert code == 0, err
    result = json.loads(out)
    assert ("largest_orbit_um" in result) != ("largest_orbit" in result)
    assert result["experiment"] == name and result["ended"] == "complete" and result["contact_samples"] == 0
    with xr.open_dataset(tmp_path / "here" / f"{name}.nc", engine="h5netcdf") as record:
        assert validate(record).sizes["time"] == result["samples"]
        assert record.attrs["experiment"] == name
        assert record.attrs["seed"] == (3 if name == "prbs" else 0)
    assert [p.name for p in (tmp_path / "here").iterdir()] == [f"{name}.nc"]


def test_numbers_of_a_staircase_and_of_hits_are_in_the_summary(run):
    code, out, _ = run("experiment", "staircase", *RIG, *SHORT["staircase"], "--json")
    gains = json.loads(out)["static_gain"]
    assert code == 0 and 2 < gains["x"]["gain_um_per_v"][0] < 5 and 2 < gains["y"]["gain_um_per_v"][1] < 5
    code, out, _ = run("experiment", "impact", *RIG, *SHORT["impact"], "--json")
    assert json.loads(out)["impulse_n_s"] == pytest.approx([0, 2 * 2 * 5e-3 / np.pi])


def test_the_table_names_what_came_out(run):
    code, out, _ = run("experiment", "coastdown", *RIG, *SHORT["coastdown"])
    assert code == 0
    for label in ("Deceleration", "Smallest film thickness", "Contact", "record: coastdown/coastdown.nc"):
        assert label in out


@pytest.mark.slow
def test_a_closed_loop_without_the_orbit_states_its_harmonics(run):
    weak = ["--gain-x", "0.1 V/um", "--gain-y", "0.1 V/um", "--duration", "0.5 s", "--without-orbit"]
    code, out, err = run("experiment", "controlled", *RIG, *weak, "--speed", "6000 rpm", "--json")
    assert code == 0 and json.loads(out)["parameters"]["harmonic_1_x"] > 0.05, err
    code, _, err = run("experiment", "controlled", *RIG, *weak)
    assert code == 2 and "the shaft hardly turns and has no orbit" in err


def test_text_with_units_reaches_the_record_in_si(run, tmp_path):
    code, _, err = run("experiment", "chirp", *RIG, *SHORT["chirp"], "--speed", "3 krpm", "--out", "o")
    assert code == 0, err
    with xr.open_dataset(tmp_path / "o" / "chirp.nc", engine="h5netcdf") as record:
        a = record.attrs
        assert (a["amplitude"], a["low"], a["high"], a["pressure"]) == (0.5, 1.0, 300.0, 0.6e6)
        assert a["speed"] == pytest.approx(100 * np.pi)


def test_dither_of_a_closed_loop_has_a_sequence_and_a_clock(run, tmp_path):
    short = ["experiment", "controlled", *RIG, "--duration", "0.1 s", "--dither", "0.2 V", "--out"]
    drawn = {}
    for name, more in {"0": [], "same": ["--sequence", "0", "--hold", "5 ms"], "1": ["--sequence", "1"],
                       "slow": ["--hold", "20 ms"]}.items():  # fmt: skip
        code, _, err = run(*short, name, *more)
        assert code == 0, err
        with xr.open_dataset(tmp_path / name / "controlled.nc", engine="h5netcdf") as record:
            drawn[name] = record["reference_external"].values
            assert record.attrs["excitation_1_sequence"] == (name == "1")
    plain = Prbs(amplitude=0.2, duration=0.1, bias=0.0).rows(0, 500)[:, 2:4]
    assert np.array_equal(drawn["0"], plain) and np.array_equal(drawn["same"], plain)
    assert not np.array_equal(drawn["1"], plain)
    assert set(np.flatnonzero(np.diff(drawn["slow"], axis=0).any(axis=1)) + 1) <= set(range(100, 500, 100))
    for option in (["--sequence", "1"], ["--hold", "20 ms"]):
        code, _, err = run("experiment", "controlled", *RIG, *option, "--out", "none")
        assert code == 2 and err.startswith(f"{option[0]}: is of the dither, which is 0; give e.g. --dither")


def test_a_plain_rotor_can_be_hit(run):
    code, out, err = run("experiment", "impact", "plain_rotor", "--spacing", "0.1 s", "--json", "--no-report")
    assert code == 0, err
    assert json.loads(out)["smallest_film_um"] is None


@pytest.mark.parametrize("name", NAMES)
def test_every_help_page_has_an_example(run, name):
    code, out, _ = run("experiment", name, "--help")
    assert code == 0 and f"Example: rotorsim experiment {name}" in out and "--pressure" in out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["prbz"], "experiment: 'prbz' is not known; did you mean 'prbs'?"),
        (["waltz"], "experiment: 'waltz' is not known; known are slow_roll, "),
        (["prbs", "--amplitude", "6 V"], "amplitude: '6 V' is above the limit; write at most '5 V'"),
        (["prbs", "--amplitude", "-1 V"], "must be above 0"),
        (["prbs", "--amplitude", "1"], "--amplitude: '1' has no unit"),
        (["prbs", "--amplitude", "1 N"], "--amplitude: '1 N' is not a voltage"),
        (["prbs", "--duration", "-1 s"], "duration: '-1 s' must be above 0"),
        (["prbs", "--duration", "0 s"], "must be above 0"),
        (["prbs", "--hold", "0.05 ms"], "is shorter than a sample"),
        (["prbs", "--hold", "0.3 ms"], "is not a whole number of samples"),
        (["prbs", "--duration", "30 day"], "prbs: would last 30 days"),
        (["prbs", "--seed", "one"], "--seed: 'one' is not a whole number"),
        (["prbs", "--speed", "-100 rpm"], "is below the limit; write at least '0 rpm'"),
        (["prbs", "--pressure", "-1 bar"], "is below the limit"),
        (["prbs", "--pressure", "50 kPa"], "no lift-off: at 0.05 MPa gauge"),
        (["prbs", "plain_rotor"], "prbs: plain_rotor has no gas film"),
        (["prbs", "nothing.toml"], "'nothing.toml'"),
        (["prbs", "--grid", "fine"], "--grid: 'fine' is not n_theta x n_z"),
        (["chirp", "--high", "3 kHz"], "high: '3000 Hz' is above the limit; write at most '2500 Hz'"),
        (["chirp", "--axis", "z"], "axis: 'z' is not known; choose one of x, y, both"),
        (["multisine", "--low", "10.2 Hz", "--high", "10.8 Hz"], "multisine: fewer than two lines"),
        (["multisine", "--periods", "2.5"], "periods: 2.5 is not a whole number"),
        (["staircase", "--step", "1.5 V"], "step: '1.5 V' does not divide the amplitude of 2 V; give e.g. '2 V'"),
        (["slow_roll", "--speed", "0 rpm"], "must be above 0"),
        (["coastdown", "--stop", "7000 rpm"], "is not below the start"),
        (["controlled", "--controller", "mine:law"], "controller: 'mine:law' is not known; choose one of p"),
        (["controlled", "--law", "none.json"], "none.json"),
        (["controlled", "--law", "file"], "file"),
        (["controlled", "--law", "file", "--gain-x", "1 V/um"], "replaces the built-in one; leave out --gain-x"),
        (["steady", "--out", "file/below"], "file/below: cannot be written: part of the path is a file"),
        (["steady", "--out", "there"], "there/steady.nc: is there already; choose another --out or add --force"),
    ],
)
def test_bad_input_ends_in_one_sentence_and_leaves_nothing_behind(run, tmp_path, arguments, sentence):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "steady.nc").write_text("kept")
    name, *rest = arguments
    code, out, err = run("experiment", name, "--grid", "16x4", "--time-step", "0.2 ms", *rest)
    assert code == 2 and sentence in err and out == ""
    assert err.count("\n") == 1 and "Traceback" not in err
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["file", "steady.nc", "there"]


def test_force_replaces_a_record_and_without_a_folder_each_run_gets_its_own(run, tmp_path):
    for extra in (["--out", "o"], ["--out", "o", "--force"], [], []):
        assert run("experiment", "steady", *RIG, "--duration", "0.1 s", *extra)[0] == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["o", "steady", "steady-2"]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="a console interrupt cannot be sent to one process there")
@pytest.mark.parametrize("name", ["prbs", "controlled"])
def test_an_interrupt_keeps_what_was_simulated(tmp_path, name):
    """The run would take hours of computing; it is interrupted once the growing file is there."""
    command = [sys.executable, "-m", "rotorsim", "experiment", name, *RIG, "--duration", "100000 s", "--yes"]
    run = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until(lambda: any(p.stat().st_size > 1e6 for p in tmp_path.rglob("*.part")), run)
    run.send_signal(signal.SIGINT)
    printed, message = run.communicate()
    assert run.returncode == 130 and "Duration" in printed
    assert "interrupted:" in message and "Traceback" not in message
    with xr.open_dataset(tmp_path / name / f"{name}.nc", engine="h5netcdf") as record:
        assert record.sizes["time"] % 250 == 0 and record.sizes["time"] > 0
        assert record.attrs["ended"] == "interrupted"
    assert not list(tmp_path.rglob("*.part"))


def test_a_new_process_prints_the_sentence_and_no_traceback(tmp_path):
    done = rotorsim("experiment", "prbs", "--amplitude", "6 V", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "--amplitude: '6 V' is above the limit; write at most '5 V'\n"
