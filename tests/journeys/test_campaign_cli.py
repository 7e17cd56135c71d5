"""`rotorsim campaign`: run, stop, resume, status, collect; bad input ends in one sentence."""

import json
import signal
import subprocess
import sys
import time
from functools import partial

import pytest
import xarray as xr

PLAN = """
name = "small"
machine = "plain_rotor"
repeats = 4
experiment = {kind = "steady", duration = "0.2 s"}
axes.speed = {grid = ["600 rpm", "1200 rpm"], points = 2}
"""


@pytest.fixture
def run(run):
    """`rotorsim campaign`."""
    return partial(run, "campaign")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT of another process there")
def test_a_campaign_is_stopped_continues_and_is_collected(run, tmp_path):
    (tmp_path / "plan.toml").write_text(PLAN)
    command = [sys.executable, "-m", "rotorsim", "campaign", "plan.toml", "--out", "store", "--workers", "1"]
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not list(tmp_path.glob("store/cases/*/*.nc")) and process.poll() is None:
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate()
    if process.returncode == 0:
        assert "8 done" in out  # it was quicker than the signal
    else:
        assert process.returncode == 130 and "the same command continues" in err and "Traceback" not in err
    code, out, _ = run("status", "store", "--json")
    result = json.loads(out)
    assert code == 0 and result["done"] + result["pending"] == 8 and result["failed"] == 0
    code, out, err = run("plan.toml", "--out", "store", "--workers", "1", "--json")
    assert code == 0, err
    assert json.loads(out)["done"] == 8 and json.loads(out)["run"] == result["pending"]
    assert run("status", "store")[1].startswith("small: 8 done, 0 failed, 0 left")
    code, out, _ = run("retry", "store")
    assert code == 0 and out.startswith("store: 8 done, 0 failed, 0 left; 0 run now in ")
    assert run("collect", "store", "--out", "t.csv")[1] == "t.csv: 8 cases\n"
    assert len((tmp_path / "t.csv").read_text().splitlines()) == 9
    code, out, err = run("collect", "store", "--out", "all.nc", "--variables", "disc")
    assert code == 0 and out.startswith("all.nc: 8 case x 1000 time"), err
    with xr.open_dataset(tmp_path / "all.nc", engine="h5netcdf") as data:
        assert data["disc"].dims == ("case", "time", "axis") and bool(data["disc"].notnull().all())
    code, _, err = run("collect", "store", "--out", "all.nc")
    assert code == 2 and "all.nc: is there already; choose another name or add --force" in err
    (tmp_path / "plan.toml").write_text(PLAN.replace("1200", "1300"))
    code, _, err = run("plan.toml", "--out", "store")
    assert code == 2 and "holds a campaign of another plan (axes.speed: 125.66" in err
    assert err.count("\n") == 1


def test_check_shows_what_a_plan_would_run(run):
    code, out, _ = run("check", "thesis")
    assert code == 0 and out.startswith("thesis: 105 cases, 13 min simulated")


BAD = [
    (["nothing", "--out", "s"], "'nothing' is neither a shipped plan"),
    (["thesis", "--out", "s", "--workers", "0"], "--workers: 0 is below 1; give the number of processes"),
    (["thesis", "--out", "s", "--workers", "1", "--scheduler", "tcp://a:1"], "--workers: a scheduler has its own"),
    (["thesis", "--out", "s", "--tls-ca", "a.pem"], "are for a scheduler; add --scheduler tls://host:port"),
    (["thesis", "--out", "s", "--time-limit", "5"], "time-limit"),
    (["thesis", "--out", "s", "--time-limit", "0 s"], "--time-limit: '0 s' is not above 0"),
    (["thesis", "--out", "s", "--scheduler", "tls://a:1", "--tls-ca", "a.pem"], "a.pem: is not a file; give a PEM"),
    (["status", "nowhere"], "nowhere: holds no campaign"),
    (["retry", "nowhere"], "holds no campaign"),
    (["collect", "nowhere"], "holds no campaign"),
    (["collect", "nowhere", "--out", "a.xlsx"], "a.xlsx: is neither .csv nor .nc"),
]


@pytest.mark.parametrize(("arguments", "sentence"), BAD, ids=[" ".join(a)[:50] for a, _ in BAD])
def test_bad_input_is_one_sentence_and_exit_code_2(run, arguments, sentence):
    code, out, err = run(*arguments)
    assert code == 2 and out == "" and sentence in err and err.count("\n") == 1
