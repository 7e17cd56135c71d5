"""Campaign store: reproducible records, crash-safe index, locking, full disks."""

import json
import os
import resource
import signal
import sqlite3
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr

from identification import validate
from refusals import refused
from rotorsim.base.files import BusyError, Lock
from rotorsim.campaign import collect, open_store, write_table
from rotorsim.campaign.read_plan import make_plan
from rotorsim.campaign.simulate_case import StorageError, solve
from rotorsim.campaign.store import DONE, FAILED, PENDING, StoreError, make_store, parts_folder, record_path
from rotorsim.experiments import EXPERIMENTS, run
from rotorsim.machine import Machine
from rotorsim.plant import Plant

RIG = "[set]\n'grid.n_theta' = 16\n'grid.n_z' = 4\n'solver.time_step' = '0.2 ms'\n"
PLAN = (
    "machine = 'dtu_gas_bearing'\n{}" + RIG + "[experiment]\nkind = 'prbs'\nduration = '0.6 s'\npressure = '0.6 MPa'\n"
    "[axes.speed]\ngrid = ['0 rpm', '3000 rpm']\npoints = 3\n"
)


@pytest.fixture
def store(tmp_path):
    return make_store(make_plan(PLAN.format("")), tmp_path / "store")


def solved(store, number=1):
    """Run a case here, as a worker does; its key and row."""
    case = store.plan.case(number).case
    row = solve(store.folder, case, next(iter(store.plan.machines.values())), store.plan.summary)
    return case, row


def test_a_record_is_what_the_experiment_gives_and_fits_the_schema(store):
    case, row = solved(store)
    machine = Machine.from_text(next(iter(store.plan.machines.values())))
    for path, value in case.set:
        machine = machine.replace(path, value)
    expected = run(Plant(machine), EXPERIMENTS[case.kind](**dict(case.parameters)), case.seed)
    with xr.open_dataset(record_path(store.folder, case.key), engine="h5netcdf") as record:
        validate(record)
        for name in expected.data_vars:
            assert np.array_equal(record[name].values, expected[name].values), name
            assert record[name].dims == expected[name].dims and record[name].attrs == expected[name].attrs
        assert record.attrs["campaign_key"] == case.key and record.attrs["ended"] == "complete"
        assert Machine.from_text(record.attrs["machine"]) == machine
        assert record.sizes["snapshot"] >= 2 and record["film_pressure"].attrs["units"] == "Pa"
        assert json.loads(record.attrs["campaign_row"]) == row["summary"]
    assert row["summary"]["numbers.samples"] == 3000


def test_the_bytes_of_a_record_depend_on_the_case_alone(store, tmp_path):
    other = make_store(make_plan(PLAN.format("").replace("points = 3", "points = 5")), tmp_path / "other")
    case, _ = solved(store, 1)
    time.sleep(1.1)  # a time stamp in the file would show
    solved(other, 0)
    same, _ = solved(other, 2)
    assert same == case
    code = (
        "import sys; from pathlib import Path; from rotorsim.campaign import open_store\n"
        "from rotorsim.campaign.simulate_case import solve\n"
        "s = open_store(Path(sys.argv[1])); c = s.plan.case(1).case\n"
        "(s.folder / 'cases' / c.key[:2] / f'{c.key}.nc').unlink()\n"
        "solve(s.folder, c, next(iter(s.plan.machines.values())), s.plan.summary)\n"
    )
    first = record_path(store.folder, case.key).read_bytes()
    subprocess.run([sys.executable, "-c", code, str(store.folder)], check=True)
    assert first == record_path(store.folder, case.key).read_bytes()
    assert first == record_path(other.folder, case.key).read_bytes()


def test_only_what_is_kept_is_in_the_record_and_the_summary_is_whole(tmp_path):
    store = make_store(make_plan(PLAN.format("keep = ['disc', 'film_pressure']\n")), tmp_path / "few")
    case, row = solved(store)
    with xr.open_dataset(record_path(store.folder, case.key), engine="h5netcdf") as record:
        assert set(record.data_vars) == {"disc", "film_pressure", "snapshot_time", "snapshot_speed"}
    assert row["summary"]["numbers.smallest_film_um"] > 1
    nothing = make_store(make_plan(PLAN.format("keep = []\n")), tmp_path / "none")
    _, other = solved(nothing)
    assert other["summary"] == row["summary"] and other["bytes"] == 0
    assert not list(nothing.folder.glob("cases/*/*"))


def test_long_runs_pass_through_a_file_with_the_same_bytes(store, monkeypatch):
    case, row = solved(store)
    path = record_path(store.folder, case.key)
    first = path.read_bytes()
    path.unlink()
    monkeypatch.setattr("rotorsim.campaign.simulate_case.LONGEST", 0.0)
    assert solved(store) == (case, row)
    assert path.read_bytes() == first
    assert not list(parts_folder(store.folder).iterdir())


def test_every_summary_gives_numbers(tmp_path):
    names = "['numbers', 'modes', 'orders', 'resonances', 'sub_synchronous']"
    store = make_store(make_plan(PLAN.format(f"summary = {names}\n")), tmp_path / "store")
    _, row = solved(store, 2)
    for name in ("modes.f_hz.1", "modes.zeta.4", "modes.gain_um_per_v.x.x", "orders.1x_um.y", "resonances.x.rpm"):
        assert name in row["summary"]
    assert 80 < row["summary"]["modes.f_hz.1"] < 150 and row["summary"]["orders.1x_um.x"] > 0.1
    json.dumps(row, allow_nan=False)


def test_a_record_that_is_there_is_not_simulated_again(store, monkeypatch):
    case, row = solved(store)
    monkeypatch.setattr("rotorsim.campaign.simulate_case.stream", None)
    assert solved(store) == (case, row | {"adopted": True})
    record_path(store.folder, case.key).write_bytes(b"torn")
    with pytest.raises(TypeError):
        solved(store)


def test_a_record_that_was_lost_or_cut_is_run_again(store):
    with store.locked():
        index = store.index(writable=True)
        for number in range(3):
            _, row = solved(store, number)
            index.note(number, row | {"status": DONE})
        index.commit()
        assert index.counts() == {DONE: 3, FAILED: 0, PENDING: 0} and store.damaged(index) == []
        keys = [store.plan.case(number).case.key for number in range(3)]
        record_path(store.folder, keys[0]).unlink()
        os.truncate(record_path(store.folder, keys[2]), 1000)
        assert store.damaged(index) == [0, 2]
        index.close()


def test_killed_between_write_and_rename_nothing_is_half_there(store):
    """The process is killed with the record written and not yet moved; the next run makes the same record."""
    code = (
        "import os, signal, sys; from pathlib import Path; from rotorsim.campaign import open_store\n"
        "from rotorsim.campaign import simulate_case as solve\n"
        "s = open_store(Path(sys.argv[1])); c = s.plan.case(1).case\n"
        "move = os.replace  # kernels that are compiled move their files too\n"
        "kill = lambda: os.kill(os.getpid(), signal.SIGKILL)\n"
        "solve.os.replace = lambda a, b: kill() if str(b).endswith('.nc') else move(a, b)\n"
        "solve.solve(s.folder, c, next(iter(s.plan.machines.values())), s.plan.summary)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(store.folder)], capture_output=True)
    assert done.returncode == -signal.SIGKILL
    assert len(list(parts_folder(store.folder).iterdir())) == 1 and not list(store.folder.glob("cases/*/*.nc"))
    case, _ = solved(store)
    from rotorsim.campaign.store import clear_parts

    assert clear_parts(store.folder) == 1
    with xr.open_dataset(record_path(store.folder, case.key), engine="h5netcdf") as record:
        assert record.sizes["time"] == 3000


def test_killed_between_rename_and_index_the_record_is_adopted(store):
    case, row = solved(store)
    index = store.index()
    assert index.counts()[PENDING] == 3
    index.close()
    assert solved(store)[1]["adopted"]
    assert record_path(store.folder, case.key).stat().st_size == row["bytes"]


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 400 kB: less than one record."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", str(folder)], capture_output=True)
    if mounted.returncode:
        pytest.skip("mounting a tmpfs is not permitted here")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


def test_a_full_disk_is_not_the_cases_fault(small_disk):
    store = make_store(make_plan(PLAN.format("")), small_disk / "store")
    with pytest.raises(StorageError, match=r"the disk is full \(.* MB free\); solve that and run the same command"):
        solved(store)
    assert not list(store.folder.glob("cases/*/*.nc")) and not list(parts_folder(store.folder).iterdir())
    subprocess.run(["mount", "-o", "remount,size=20m", str(small_disk)], check=True)
    case, _ = solved(store)
    with xr.open_dataset(record_path(store.folder, case.key), engine="h5netcdf") as record:
        assert record.sizes["time"] == 3000


def test_a_full_disk_stops_the_index_and_keeps_what_it_had(small_disk):
    store = make_store(
        make_plan("machine = 'plain_rotor'\nrepeats = 500\n[experiment]\nkind = 'steady'\n"), small_disk / "s"
    )
    filler = small_disk / "filler"
    file = os.open(filler, os.O_WRONLY | os.O_CREAT)
    with pytest.raises(OSError, match="No space left"):
        while True:
            os.write(file, bytes(4096))
    os.close(file)
    index = store.index(writable=True)
    for number in range(500):
        index.note(number, {"status": DONE, "summary": {"numbers.x": number}, "duration": 1.0, "host": "h" * 100})
    with pytest.raises(StoreError, match="free some space and run the same command again"):
        index.commit()
    filler.unlink()
    index.commit()
    assert index.counts()[DONE] == 500
    index.close()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no limits of a process there")
def test_a_quota_is_reported_like_a_full_disk(store):
    code = (
        "import resource, signal, sys; from pathlib import Path; from rotorsim.campaign import open_store\n"
        "from rotorsim.campaign.simulate_case import solve, prepare, StorageError\n"
        "s = open_store(Path(sys.argv[1])); c = s.plan.case(1).case; text = next(iter(s.plan.machines.values()))\n"
        "prepare(c, text); signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "try:\n    solve(s.folder, c, text, s.plan.summary)\n"
        "except StorageError as e:\n    print(e)\n    __import__('os')._exit(9)\n"
    )
    done = subprocess.run([sys.executable, "-c", code, str(store.folder)], capture_output=True, text=True)
    assert done.returncode == 9, done.stderr
    assert "run the same command again" in done.stdout and not list(store.folder.glob("cases/*/*.nc"))
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 100_000


def test_a_store_of_another_plan_is_refused_with_the_difference(store):
    other = make_plan(PLAN.format("").replace("points = 3", "points = 4"))
    with refused(StoreError, "plan", ["axes.speed: 3 values there, 4 here"]):
        make_store(other, store.folder)
    heavier = make_plan(PLAN.format("").replace("[set]", "[set]\n'effects.unbalance.me' = '3 g*mm'"))
    with refused(StoreError, "plan", ["set.effects.unbalance.me is only in this plan"]):
        make_store(heavier, store.folder)
    longer = make_plan("time_limit = '3 h'\n" + PLAN.format(""))
    assert make_store(longer, store.folder).plan.time_limit == 3 * 3600


def test_a_folder_that_is_no_store_is_refused(tmp_path):
    plan = make_plan(PLAN.format(""))
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("kept")
    (tmp_path / "file").write_text("kept")
    for name in ("full", "file"):
        with refused(StoreError, "folder", tmp_path / name):
            make_store(plan, tmp_path / name)
    with refused(StoreError, "folder", tmp_path / "full"):
        open_store(tmp_path / "full")


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"format": 1}', '{"format": 99}'])
def test_a_damaged_store_is_one_sentence(store, damage):
    (store.folder / "store.json").write_text(damage)
    with pytest.raises(StoreError) as caught:
        open_store(store.folder)
    assert "\n" not in str(caught.value)


def test_a_changed_store_is_noticed(store):
    path = store.folder / "store.json"
    path.write_text(path.read_text().replace("3000 rpm", "4000 rpm"))
    with refused(StoreError, "plan", path):
        open_store(store.folder)


def test_a_damaged_index_is_one_sentence(store):
    store.index_path.write_bytes(b"no database" * 1000)
    with pytest.raises(StoreError, match="is not a usable index"):
        store.index()


def test_two_campaigns_in_one_store_are_refused(store):
    code = (
        "import sys; from pathlib import Path; from rotorsim.campaign import open_store\n"
        "with open_store(Path(sys.argv[1])).locked():\n    print('held', flush=True); sys.stdin.read()\n"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", code, str(store.folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    try:
        assert other.stdout.readline() == "held\n"
        with refused(StoreError, "folder", store.folder), store.locked():
            pass
        index = store.index()  # status and collect need no lock
        assert index.counts()[PENDING] == 3
        index.close()
    finally:
        other.kill()
        other.wait()
    with store.locked():
        pass


def test_a_lock_is_held_by_one_and_names_the_holder(tmp_path):
    with Lock(tmp_path / "lock", "me"), pytest.raises(BusyError, match="me"), Lock(tmp_path / "lock", "you"):
        pass
    with Lock(tmp_path / "lock", "you"):
        pass


def test_versions_that_differ_from_the_stores_are_refused(store, monkeypatch):
    from rotorsim.campaign import run as running

    monkeypatch.setattr(running, "versions", lambda: store.versions | {"numba": "0.1"})
    with refused(StoreError, "versions", lambda text: text.startswith("numba ") and text.endswith(" there, 0.1 here")):
        running.run_campaign(store.plan, store.folder)


def test_collected_records_are_lazy_and_exact(store, tmp_path):
    index = store.index(writable=True)
    rows = {number: solved(store, number) for number in (0, 2)}
    for number, (_, row) in rows.items():
        index.note(number, row | {"status": DONE})
    index.note(1, {"status": FAILED, "error": "no lift-off"})
    index.commit()
    index.close()
    data = collect(store.folder)
    assert data.sizes["case"] == 2 and data["number"].values.tolist() == [0, 2]
    assert data["disc"].dims == ("case", "time", "axis") and data["disc"].chunks is not None
    np.testing.assert_allclose(data["set_speed"].values * 30 / np.pi, [0, 3000])
    for place, (case, row) in enumerate(rows.values()):
        with xr.open_dataset(record_path(store.folder, case.key), engine="h5netcdf") as record:
            for name in record.data_vars:
                assert np.array_equal(data[name].isel(case=place).values, record[name].values), name
        assert data["numbers.largest_orbit_um"].values[place] == row["summary"]["numbers.largest_orbit_um"]
    whole, some = data["disc"].values, [2, 0, 7]
    assert np.array_equal(data["disc"].isel(case=-1, time=slice(10, 20), axis=0), whole[-1, 10:20, 0])
    assert np.array_equal(data["disc"].isel(case=[1, 0], time=slice(None, None, -7)), whole[::-1, ::-7])
    assert np.array_equal(data["disc"].isel(time=some, axis=1), whole[:, some, 1])
    assert np.array_equal(data["disc"].isel(case=0, time=slice(5, 5)), whole[0, 5:5])
    assert "disc" not in collect(store.folder, variables=[]) and list(
        collect(store.folder, variables=["pin"])["pin"].dims
    )
    assert write_table(store.folder, tmp_path / "t.csv") == 3
    lines = (tmp_path / "t.csv").read_text().splitlines()
    assert lines[0].startswith("number,experiment,repeat,seed,set.speed,numbers.") and "no lift-off" in lines[2]
    with pytest.raises(StoreError, match="no variable 'disk'"):
        collect(store.folder, variables=["disk"])
    with refused(StoreError, "experiment", "a"):
        collect(store.folder, "a")


def test_a_cut_record_is_named_when_it_is_collected(store):
    """libhdf5 can crash on it or read it for ever."""
    index = store.index(writable=True)
    case, row = solved(store, 0)
    index.note(0, row | {"status": DONE})
    index.commit()
    index.close()
    path = record_path(store.folder, case.key)
    os.truncate(path, path.stat().st_size - 1)
    with refused(StoreError, "records", [path]):
        collect(store.folder)
    assert collect(store.folder, variables=[]).sizes["case"] == 1


def test_records_of_unlike_length_end_in_nan(tmp_path):
    plan = "machine = 'plain_rotor'\n[experiment]\nkind = 'steady'\n[axes.duration]\nlist = ['10 ms', '20 ms']\n"
    store = make_store(make_plan(plan), tmp_path / "s")
    index = store.index(writable=True)
    for number in range(2):
        index.note(number, solved(store, number)[1] | {"status": DONE})
    index.commit()
    index.close()
    data = collect(store.folder)
    assert data["samples"].values.tolist() == [50, 100]
    assert np.isnan(data["disc"].isel(time=slice(60, 80))[0]).all()
    assert np.isnan(data["disc"].values[0, 50:]).all() and np.isfinite(data["disc"].values[0, :50]).all()


def test_nothing_of_a_store_is_executed(store):
    """Plans and indexes hold text and numbers; a value that looks like code stays one."""
    db = sqlite3.connect(store.index_path)
    db.execute("UPDATE cases SET summary = ?, status = 'done'", (json.dumps({"a": "__import__('os').abort()"}),))
    db.commit()
    db.close()
    data = collect(store.folder, variables=[])
    assert data["a"].values[0] == "__import__('os').abort()"
