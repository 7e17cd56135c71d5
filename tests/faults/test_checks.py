"""Self-test of the fault checks: each fault is detected."""

import json
import os
import zipfile

import numpy as np
import pytest
import xarray as xr

from fault_injection.checks import SAMPLE, files, left_over, messages, reported_length
from fault_injection.running import Ended


def ended(code=0, err="", left=()):
    """End of a command."""
    return Ended(code, "", err, 1.0, left)


def record(path, samples=100, values=None):
    """A record of a run."""
    path.parent.mkdir(exist_ok=True)
    time = np.arange(samples) * SAMPLE
    disc = np.arange(samples, dtype=float) if values is None else values
    xr.Dataset({"disc": ("time", disc)}, {"time": time}, {"experiment": "x", "ended": "y"}).to_netcdf(
        path, engine="h5netcdf"
    )


@pytest.mark.parametrize(
    ("end", "kinds"),
    [
        (ended(), []),
        (ended(2, "a.nc: cannot be written: the disk is full\n"), []),
        (ended(1, "Traceback (most recent call last):\n  rotorsim/cli.py\n"), ["traceback", "other"]),
        (ended(0, "Exception ignored in: <function>\n"), ["traceback"]),
        (ended(-11), ["segfault"]),
        (ended(3), ["other"]),
        (ended(2, "one\ntwo\nthree\nfour\n"), ["other"]),
        (ended(2, "compiling the kernels\none\ntwo\nthree\n"), []),
        (ended(0, "", ("a worker",)), ["other"]),
        (ended(1, "Traceback\n runpy\nKeyboardInterrupt\n"), []),
        (ended(1, "Traceback\n File /x/rotorsim/cli.py\nKeyboardInterrupt\n"), ["traceback", "other"]),
    ],
)
def test_messages(end, kinds):
    assert [fault.kind for fault in messages(end, {0, 2})] == kinds


@pytest.mark.parametrize("name", ["a.nc", "a.html", "a.json", "a.toml", "a.fmu", "a.csv"])
def test_a_file_that_is_cut_is_half(tmp_path, name):
    path = tmp_path / "out" / name
    record(path)
    if name == "a.fmu":
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", "x" * 1000)
    elif name != "a.nc":
        texts = {"a.html": "<html></html>\n", "a.json": json.dumps({"a": [1, 2]}), "a.toml": 'a = "b"\n',
                 "a.csv": "a,b\n1,2\n"}  # fmt: skip
        path.write_text(texts[name])
    assert files(tmp_path / "out", tmp_path / "none") == []
    os.truncate(path, path.stat().st_size - 3)
    assert [fault.kind for fault in files(tmp_path / "out", tmp_path / "none")] == ["half"]


def test_a_record_is_the_beginning_of_that_of_an_undisturbed_run(tmp_path):
    record(tmp_path / "whole" / "a.nc")
    record(tmp_path / "out" / "a-killed-2.nc", 50)
    assert files(tmp_path / "out", tmp_path / "whole") == []
    record(tmp_path / "out" / "a-killed-2.nc", 50, np.ones(50))
    assert [fault.kind for fault in files(tmp_path / "out", tmp_path / "whole")] == ["half"]


def test_a_record_that_is_shorter_than_what_is_reported_has_lost_samples(tmp_path):
    record(tmp_path / "a.nc", 5000)
    assert reported_length(ended(2, "interrupted: 1.0 s of 9.0 s are in a.nc\n"), tmp_path / "a.nc") == []
    for seconds, name in (("1.2", "a.nc"), ("1.0", "b.nc")):
        found = reported_length(ended(2, f"interrupted: {seconds} s of 9.0 s are in a.nc\n"), tmp_path / name)
        assert [fault.kind for fault in found] == ["lost"]


def test_what_is_left_over_is_found(tmp_path):
    assert left_over(tmp_path) == []
    (tmp_path / ".report.html.lock").touch()
    assert [fault.kind for fault in left_over(tmp_path)] == ["other"]
