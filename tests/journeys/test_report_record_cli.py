"""Journey of a measured record to its page: `rotorsim report record`."""

import json

import numpy as np
import pytest

import identification as idn


@pytest.fixture
def run_up():
    """A slow roll of 3 s at 240 rpm, then a run-up to 2400 rpm in 9 s."""
    t = np.arange(12_000) / 1000
    f = np.where(t < 3, 4.0, 4 + 4 * (t - 3))
    angle = 2 * np.pi * np.cumsum(f) / 1000
    motion = 1e-6 * np.column_stack([(4 + f) * np.cos(angle), (4 + f) * np.sin(angle)])
    motion += np.column_stack([2e-7 * f, 0 * f])
    return idn.make_record(t, {"disc_measured": motion, "angle": angle, "speed": 2 * np.pi * f})


def test_the_command_names_what_it_leaves_out(run, tmp_path, run_up):
    idn.save(run_up, tmp_path / "a.nc")
    out = tmp_path / "a.html"
    code, text, err = run("report", "record", tmp_path / "a.nc", "--slow-roll", "300 rpm", "--out", out, "--json")
    found = json.loads(text)
    assert (code, err) == (0, "") and out.exists() and "Shaft centreline" in found["shown"]
    assert found["not_shown"] == {"Spectra": "The speed changes; see the waterfall."}
    assert run("report", "record", tmp_path / "a.nc", "--out", out)[0] == 2
    code, _, err = run("report", "record", tmp_path / "a.nc", "--slow-roll", "10 rpm", "--out", out, "--force")
    assert code == 2 and "never turns slower" in err and err.count("\n") == 1
    assert run("report", "record", tmp_path / "a.nc", "--slow-roll", "10 mm", "--out", out, "--force")[0] == 2
    assert run("report", "record", tmp_path / "b.nc")[0] == 2
