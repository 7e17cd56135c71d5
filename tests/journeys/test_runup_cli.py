"""`rotorsim runup`: from a machine file to record and report; bad input ends in one sentence."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import typer
import xarray as xr

from identification import validate
from rotorsim.commands.options import leave_if_empty
from rotorsim.experiments import Outcome
from waiting import until

SHORT = ["--stop", "600 rpm", "--rate", "1000 rpm/s"]


@pytest.fixture
def rotorsim(run):
    """A command in this process, with what a process of its own would have ended with."""

    def call(*arguments):
        code, out, err = run(*arguments)
        return SimpleNamespace(returncode=code, stdout=out, stderr=err)

    return call


def test_a_run_up_leaves_table_record_and_a_page_that_needs_no_network(rotorsim, tmp_path):
    done = rotorsim("runup", *SHORT, "--grid", "32x8")
    assert done.returncode == 0, done.stderr
    assert rotorsim("data", "check", "runup/runup.nc").returncode == 0
    assert "Smallest film thickness" in done.stdout
    with xr.open_dataset(tmp_path / "runup" / "runup.nc", engine="h5netcdf") as record:
        assert validate(record).sizes["time"] == 3000
        assert record.attrs["ended"] == "complete"
        assert record["speed"].values[-1] == pytest.approx(20 * np.pi, rel=1e-3)
    page = (tmp_path / "runup" / "report.html").read_text()
    assert not re.findall(r'(?:src|href)\s*=\s*["\']https?:', page.split("</script>")[-1])
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["report.html", "runup", "runup.nc"]


def test_a_plain_rotor_is_an_equally_good_machine_and_json_is_for_scripts(rotorsim, tmp_path):
    assert rotorsim("machine", "new", "rotor.toml", "--from", "plain_rotor").returncode == 0
    change = "effects.unbalance.me=20 g*mm"
    done = rotorsim("runup", "rotor.toml", *SHORT, "--json", "--no-report", "--set", change)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["ended"] == "complete" and summary["samples"] == 3000
    assert summary["smallest_film"] is None


def test_a_run_up_to_a_limit_keeps_its_record_and_ends_with_the_reason_and_code_2(rotorsim, tmp_path):
    """The rim of the disc, 80 mm, passes 4 m/s at 477.5 rpm; the page has the reason too."""
    limit = ["--set", "limits.tip_speed=4 m/s"]
    done = rotorsim("runup", "plain_rotor", *SHORT, *limit)
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith("ended at 478 rpm: the rim of discs.0, radius 80 mm, moves at 4.0")
    assert "what was simulated is in runup/runup.nc" in done.stderr
    with xr.open_dataset(tmp_path / "runup" / "runup.nc", engine="h5netcdf") as record:
        assert float(record["speed"][-1]) <= 50.0 and record.attrs["ended"].startswith("ended at 478 rpm")
    assert "above limits.tip_speed 4 m/s" in (tmp_path / "runup" / "report.html").read_text()
    done = rotorsim("runup", "plain_rotor", *SHORT, *limit, "--start", "500 rpm", "--out", "b")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1) and "begin lower or raise it" in done.stderr
    assert not (tmp_path / "b").exists()


def test_json_and_table_state_what_is_beyond_the_checked_range(rotorsim, tmp_path):
    ramp = ["--start", "5900 rpm", "--stop", "6100 rpm", "--rate", "1000 rpm/s", "--grid", "32x8", "--no-report"]
    done = rotorsim("runup", *ramp, "--json")
    (text,) = json.loads(done.stdout)["beyond_checked_range"]
    assert done.returncode == 0 and text.startswith("above 6000 rpm: 6100 rpm, 1.02 times the highest speed")
    done = rotorsim(
        "experiment", "steady", "--speed", "7000 rpm", "--duration", "0.1 s", "--grid", "32x8", "--no-report"
    )
    assert done.returncode == 0 and "Beyond the checked range" in done.stdout


def test_a_second_run_does_not_touch_the_first(rotorsim, tmp_path):
    for _ in range(2):
        assert rotorsim("runup", "plain_rotor", *SHORT, "--no-report").returncode == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["runup", "runup-2"]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--pressure", "0.05 MPa"], "no lift-off: at 0.05 MPa gauge"),
        (["--set", "limits.tip_speed=-3 m/s"], "limits.tip_speed: '-3 m/s' must be above 0"),
        (["--set", "limits.tipspeed=3 m/s"], "limits.tipspeed: unknown field; did you mean 'tip_speed'?"),
        (["--set", "limits.choked_feeds=2"], "limits.choked_feeds: 2"),
        (["--pressure", "0.3"], "--pressure: '0.3' has no unit"),
        (["--pressure", "3 kg"], "--pressure: '3 kg' is not a pressure"),
        (["--rate", "0 rpm/s"], "rate = 0 rpm/s: must be positive"),
        (["--stop", "0 rpm"], "start and stop are the same speed"),
        (["--grid", "33x16"], "grid.n_theta: 33"),
        (["--grid", "fine"], "--grid: 'fine' is not n_theta x n_z"),
        (["--set", "effects.unbalance.me=20 g"], "effects.unbalance.me: '20 g' is not a mass*length"),
        (["--set", "effects.unbalance"], "--set: 'effects.unbalance' is not PATH=VALUE"),
        (["--set", "effects.gremlin.size=1 m"], "effects.gremlin: unknown effect"),
        (["no_such_machine"], "'no_such_machine' is neither a shipped machine"),
        (["--out", "file/below"], "file/below: cannot be written: part of the path is a file"),
    ],
)
def test_bad_input_ends_in_one_sentence_and_leaves_nothing_behind(rotorsim, tmp_path, arguments, sentence):
    (tmp_path / "file").write_text("in the way")
    done = rotorsim("runup", "--grid", "32x8", *SHORT, *arguments)
    assert done.returncode == 2
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.skipif(sys.platform == "win32", reason="a console interrupt cannot be sent to one process there")
def test_an_interrupt_keeps_what_was_simulated(tmp_path):
    """The run would take hours of computing; it is interrupted once the growing file is there."""
    command = [sys.executable, "-m", "rotorsim", "runup", "--grid", "32x8", "--rate", "0.01 rpm/s", "--no-report"]
    run = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    until(lambda: any(p.stat().st_size > 1e6 for p in tmp_path.rglob("*.part")), run)
    run.send_signal(signal.SIGINT)
    _, message = run.communicate()
    assert run.returncode == 130
    assert "interrupted:" in message and "Traceback" not in message
    with xr.open_dataset(tmp_path / "runup" / "runup.nc", engine="h5netcdf") as record:
        assert record.sizes["time"] > 1000
        assert record.attrs["ended"] == "interrupted"
    assert not list(tmp_path.rglob("*.part"))


def test_past_the_whirl_threshold_the_run_reports_growth_and_does_not_fail(rotorsim, tmp_path):
    """From 17 to 19 krpm at 0.3 MPa, some 2 krpm above the onset: the whirl at about half the speed fills the film."""
    speeds = ["--start", "17 krpm", "--stop", "19 krpm", "--rate", "1 krpm/s", "--grid", "32x8"]
    done = rotorsim("runup", *speeds, "--json", "--no-report")
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert 0.4 < summary["sub_synchronous"]["ratio"] < 0.55
    assert summary["smallest_film"]["um"] < 5


@pytest.mark.parametrize(("samples", "which"), [(0, "first"), (1, "second")])
def test_a_run_that_is_interrupted_before_it_has_samples_reports_it(capsys, samples, which):
    with pytest.raises(typer.Exit) as ended:
        leave_if_empty(Outcome(samples, 100, "interrupted", {}), Path("runup.nc"))
    assert ended.value.exit_code == 130
    assert capsys.readouterr().err == f"interrupted before the {which} sample; the same command starts again\n"


@pytest.mark.parametrize(("option", "value"), [("--pressure", "0.3 MPa"), ("--grid", "32x8")])
def test_an_option_of_the_film_is_refused_without_a_film(rotorsim, tmp_path, option, value):
    done = rotorsim("runup", "plain_rotor", option, value)
    assert done.returncode == 2 and not list(tmp_path.iterdir())
    assert done.stderr == f"{option}: plain_rotor has no gas film; leave the option out\n"
