"""Recorder of the live rig without a browser: samples kept after a full disk, a removed folder and a kill."""

import shutil
import signal
import subprocess
import sys

import pytest
import xarray as xr

from fault_injection.checks import SAMPLE
from fuzzing.disk import largest_file
from rotorsim.base.files import WriteError
from rotorsim.experiments.recording import recover
from rotorsim.live.records import Recorder
from rotorsim.live.rig import Rig
from rotorsim.machine import load_machine

pytestmark = [pytest.mark.slow, pytest.mark.nightly]
PART = 500
KILLED = """
import os, signal, sys
from pathlib import Path
from rotorsim.experiments import recording
from rotorsim.live.records import Recorder
from rotorsim.live.rig import Rig
from rotorsim.machine import load_machine
recording.FLUSH = 0.0
rig = Rig(load_machine("plain_rotor"), {}, 0)
recorder = Recorder(rig, Path(sys.argv[1]))
for _ in range(25):
    recorder.write(rig.advance(500))
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_full_disk_keeps_what_fits(tmp_path):
    rig = Rig(load_machine("plain_rotor"), {}, 0)
    with largest_file(1_000_000):
        recorder = Recorder(rig, tmp_path / "live.nc")
        with pytest.raises(WriteError, match="larger than a file may be there"):
            for _ in range(100):
                recorder.write(rig.advance(PART))
        with pytest.raises(WriteError):
            recorder.close()
    with xr.open_dataset(tmp_path / "live.nc", engine="h5netcdf") as record:
        assert record.sizes["time"] >= 5000
        assert float(record["time"][-1]) == pytest.approx((record.sizes["time"] - 1) * SAMPLE)
    assert [path.name for path in tmp_path.iterdir()] == ["live.nc"]


def test_a_folder_that_is_removed_comes_back_with_the_record(tmp_path):
    rig = Rig(load_machine("plain_rotor"), {}, 0)
    recorder = Recorder(rig, tmp_path / "live" / "live.nc")
    recorder.write(rig.advance(PART))
    shutil.rmtree(tmp_path / "live")
    with pytest.raises(WriteError, match="was removed"):
        for _ in range(20):
            recorder.write(rig.advance(PART))
    with pytest.raises(WriteError):
        recorder.close()
    with xr.open_dataset(tmp_path / "live" / "live.nc", engine="h5netcdf") as record:
        assert record.sizes["time"] == 2 * PART


@pytest.mark.skipif(sys.platform == "win32", reason="kills by a signal of POSIX")
def test_a_kill_leaves_what_was_flushed(tmp_path):
    done = subprocess.run([sys.executable, "-c", KILLED, tmp_path / "live.nc"], capture_output=True, text=True)
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert recover(tmp_path) == [(tmp_path / "live-killed.nc", 12_500)]
    with xr.open_dataset(tmp_path / "live-killed.nc", engine="h5netcdf") as record:
        assert record.attrs["ended"] == "killed" and record.sizes["time"] == 12_500
