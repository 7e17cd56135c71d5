"""Records of the live rig: valid in the schema, replayed as displayed."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import identification as idn
from coarse_rig import RPM, make_rig, ran
from rotorsim.base.errors import DataError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.live.laws import StabilityVerdict
from rotorsim.live.records import Replay
from rotorsim.live.runner import Runner


def test_a_record_is_of_the_schema_and_replays_the_frames_of_the_run(tmp_path):
    runner = Runner(make_rig(speed=3000 * RPM))
    runner.record(tmp_path / "r.nc")
    runner._obey()
    shown = []
    for k in range(60):
        if k == 20:
            runner.set("unbalance.me", 2e-5)
            runner.strike(0)
            runner._obey()
        runner._part(50)
        frame = runner.frame()
        shown.append({name: frame[name] for name in ("orbit", "trace", "spectrum", "now", "centre")})
    last = runner.rig.history.last(3000).copy()
    runner.close()
    record = idn.read(tmp_path / "r.nc")
    idn.validate(record)
    changes = json.loads(record.attrs["changes"])
    assert ["unbalance.me", 2e-5] in [change[1:] for change in changes]
    replay = Replay(tmp_path / "r.nc")
    commands = [-6, -5]  # of speed and pressure: what came of them is recorded
    assert np.delete(replay.rows, commands, axis=1).tobytes() == np.delete(last, commands, axis=1).tobytes()
    for k in range(60):
        replay.advance(50)
        frame = replay.frame()
        assert {name: frame[name] for name in shown[k]} == shown[k]
        if replay.at % 250 == 0:
            assert len(frame["film"]) == 16 * 8


def test_a_record_names_its_controller_and_notes_when_the_rig_switched_it_off(tmp_path):
    runner = Runner(make_rig())
    runner.rig.switch_on("P", StabilityVerdict())
    runner._record(tmp_path / "r.nc")
    ran(runner, 5000)
    runner.close()
    record = idn.read(tmp_path / "r.nc")
    changes = [change for change in json.loads(record.attrs["changes"]) if change[1] == "controller"]
    assert [change[2] for change in changes] == ["P", "off"] and 0.0 < changes[1][0] < 1.0
    assert not record["reference"].values[round(changes[1][0] / RIG_SAMPLE) :].any()
    with pytest.raises(idn.UnfitError, match=r"made in closed loop \(P\)"):
        idn.identify(record)


def test_a_replayed_film_is_the_one_that_was_shown(tmp_path):
    runner = Runner(make_rig(speed=3000 * RPM))
    runner.record(tmp_path / "r.nc")
    runner._obey()
    for _ in range(10):
        runner._part(50)
    shown = runner.frame()["film"]
    runner.close()
    replay = Replay(tmp_path / "r.nc")
    replay.advance(500)
    assert replay.frame()["film"] == shown


def test_a_record_without_a_machine_cannot_be_replayed(tmp_path):
    time = np.arange(100) * RIG_SAMPLE
    record = idn.from_arrays(time, np.zeros((100, 2)), np.zeros((100, 2)))
    record.to_netcdf(tmp_path / "r.nc", engine="h5netcdf")
    with pytest.raises(DataError, match="carries no machine"):
        Replay(tmp_path / "r.nc")


def test_a_film_on_another_grid_is_not_drawn_and_that_is_reported(tmp_path):
    runner = Runner(make_rig(speed=3000 * RPM))
    runner.record(tmp_path / "r.nc")
    runner._obey()
    runner._part(500)
    runner.close()
    replay = Replay(tmp_path / "r.nc")
    replay.advance(500)
    assert replay.frame()["film"] is not None
    other = Runner(make_rig())
    other.geometry = replace(other.geometry, theta=other.geometry.theta[::2])
    other.play(replay)
    other._obey()
    assert "its film is on another grid" in other.rig.messages[-1][1]
    assert other.replay is replay and "film" not in other.frame()
    other.close()


def test_records_are_datasets_that_xarray_opens(tmp_path):
    runner = Runner(make_rig())
    runner.record(tmp_path / "r.nc")
    runner._obey()
    runner._part(50)
    runner.close()
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as record:
        assert record.sizes["time"] == 50 and record["disc"].attrs["units"] == "m"


def test_pins_are_shown_and_recorded_as_their_sensors_read_them(tmp_path):
    runner = Runner(make_rig(speed=0.0))
    runner.set("pin_sensor.gain", 0.1)
    runner.set("pin_sensor.lag", 0.0)
    runner.set("reference_x", 1.0)
    runner.record(tmp_path / "r.nc")
    runner._obey()
    ran(runner, 1000)
    shown = runner.frame()["trace"]["pin_2"]
    runner.close()
    record = idn.read(tmp_path / "r.nc")
    assert record["pin_measured"].values == pytest.approx(1.1 * record["pin"].values, rel=1e-14)
    assert shown[-1] == pytest.approx(record["pin_measured"].values[-2, 1] * 1e6, abs=0.02)
    assert shown[-1] > record["pin"].values[-2, 1] * 1e6 + 1.0
