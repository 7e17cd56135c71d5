"""Campaigns with killed processes: the next run completes every case once, with the same bits."""

import errno
import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import psutil
import pytest
import xarray as xr

from refusals import refused
from rotorsim.base.processes import ProcessDiedError
from rotorsim.campaign import Settings, open_store, run_campaign
from rotorsim.campaign.read_plan import make_plan
from rotorsim.campaign.scheduler import ClusterError, Tls
from rotorsim.campaign.simulate_case import PHYSICS
from rotorsim.campaign.store import DONE, FAILED, PENDING, StoreError, make_store, part_path, record_path
from rotorsim.campaign.worker import prepare, solve
from waiting import PATIENCE, until

pytestmark = [pytest.mark.skipif(sys.platform == "win32", reason="kills by the signals of POSIX")]
SLEEPING = "machine = 'plain_rotor'\nrepeats = {}\n[experiment]\nkind = 'steady'\nduration = '{}'\n"
REAL = "machine = 'plain_rotor'\nrepeats = 6\n[experiment]\nkind = 'steady'\nspeed = '600 rpm'\nduration = '0.5 s'\n"
RUN = """
import json, sys
from pathlib import Path
from rotorsim.campaign import Settings, load_plan, run_campaign
from rotorsim.base.errors import RotorsimError
if __name__ == "__main__":
    try:
        outcome = run_campaign(load_plan(sys.argv[1]), Path(sys.argv[2]), Settings(**json.loads(sys.argv[3])))
    except RotorsimError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    print(json.dumps(outcome.__dict__))
"""


@contextmanager
def running(tmp_path, plan, folder, **settings):
    """A campaign in a process of its own."""
    (tmp_path / "plan.toml").write_text(plan)
    (tmp_path / "run.py").write_text(RUN)
    process = subprocess.Popen(
        [sys.executable, tmp_path / "run.py", tmp_path / "plan.toml", folder, json.dumps(settings)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        yield process
    finally:
        for one in [*descendants(process), process]:
            with suppress(psutil.Error, ProcessLookupError):
                one.kill()
        process.communicate()


def descendants(process):
    with suppress(psutil.Error):
        return psutil.Process(process.pid).children(recursive=True)
    return []


def cells(process):
    """Processes of cases, each below its worker."""
    found = []
    for one in descendants(process):
        with suppress(psutil.Error):
            found += [one] if "rotorsim.base.processes" in one.cmdline() else []
    return found


def records(folder):
    """Bytes of every record by its key."""
    return {path.stem: path.read_bytes() for path in Path(folder).glob("cases/*/*.nc")}


def assert_whole(folder, undisturbed):
    """Every case is done, once, its file opens, and all bits are those of a run that nothing disturbed."""
    store = open_store(Path(folder))
    with closing(store.index()) as index:
        assert index.counts() == {DONE: len(store.plan), FAILED: 0, PENDING: 0}
        keys = [row.key for row in index.rows()]
    found = records(folder)
    assert len(set(keys)) == len(keys) == len(store.plan) and set(found) == set(keys)
    assert found == undisturbed
    assert not list((Path(folder) / "parts").iterdir())
    for key in keys:
        with xr.open_dataset(record_path(Path(folder), key), engine="h5netcdf") as record:
            assert record.attrs["campaign_key"] == key and record.load().sizes["time"] > 0


def solved_here(plan, folder, physics):
    """Records of the same cases, one after the other in this process, without workers."""
    store, solve = make_store(make_plan(plan), folder), PHYSICS[physics][1]
    for one in store.plan.cases():
        solve(folder, one.case, next(iter(store.plan.machines.values())), store.plan.summary)
    return records(folder)


def gone(process):
    """Whether a process has ended, reaped or not."""
    try:
        return not process.is_running() or process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


@pytest.mark.slow
def test_processes_of_cases_that_are_killed_cost_no_case(tmp_path):
    """The processes of two cases are killed one after the other in the middle; another campaign must wait."""
    plan, folder = SLEEPING.format(14, "1 s"), tmp_path / "store"
    with running(tmp_path, plan, folder, workers=2, physics="stub") as process:
        cell = until(lambda: len(records(folder)) >= 1 and len(cells(process)) == 2 and cells(process)[0], process)
        cell.kill()
        until(lambda: gone(cell))
        other = until(lambda: next((one for one in cells(process) if one != cell), None), process)
        other.kill()
        with refused(StoreError, "folder", folder):
            run_campaign(make_plan(plan), folder)
        out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, err
    result = json.loads(out)
    assert (result["done"], result["failed"], result["pending"]) == (14, 0, 0)
    assert_whole(folder, solved_here(plan, tmp_path / "here", "stub"))


def test_a_campaign_whose_process_is_killed_continues_with_the_same_bits(tmp_path):
    """SIGKILL takes the process that gives out the cases; none of theirs is left, the same plan finishes the rest."""
    folder = tmp_path / "store"
    with running(tmp_path, REAL, folder, workers=1) as process:
        until(lambda: records(folder), process)
        below = descendants(process)
        process.kill()
        _, alive = psutil.wait_procs(below, timeout=PATIENCE)
        assert not alive
    before = records(folder)
    outcome = run_campaign(make_plan(REAL), folder, Settings(workers=1))
    assert outcome.done == 6 and outcome.run >= 6 - len(before)
    undisturbed = solved_here(REAL, tmp_path / "here", "rotorsim")
    assert before.items() <= undisturbed.items()
    assert_whole(folder, undisturbed)


WORKER = """
import asyncio, sys
from distributed import Security, Worker
from rotorsim.campaign import store
address, numba, *tls = sys.argv[1:]
if numba != "same":
    store._versions = lambda known=store._versions(): tuple({**dict(known), "numba": numba}.items())
names = ("tls_ca_file", "tls_worker_cert", "tls_worker_key")
security = Security(require_encryption=bool(tls), **dict(zip(names, tls)))
async def main():
    async with Worker(address, nthreads=1, host="127.0.0.1", dashboard_address=None, security=security) as worker:
        await worker.finished()
asyncio.run(main())
"""


@contextmanager
def scheduler(tmp_path, versions, tls=()):
    """A Dask scheduler with one worker, whose version of numba may be another; `tls`: authority, certificate, key."""
    file = tmp_path / "scheduler.json"
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    command += ["--no-dashboard", "--scheduler-file", str(file)]
    if tls:
        command += ["--protocol", "tls", "--tls-ca-file", tls[0], "--tls-cert", tls[1], "--tls-key", tls[2]]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started = [subprocess.Popen(command, **quiet)]
    try:
        address = until(lambda: _address(file), started[0])
        started.append(subprocess.Popen([sys.executable, "-c", WORKER, address, versions, *tls], **quiet))
        yield address, started[0]
    finally:
        for process in started:
            for one in descendants(process):
                one.kill()
            process.kill()
            process.wait()


def _address(file):
    with suppress(OSError, ValueError, KeyError):
        return json.loads(file.read_text())["address"]
    return None


@pytest.mark.slow
def test_ctrl_c_of_a_terminal_reaches_every_process_and_is_one_sentence(tmp_path):
    plan = SLEEPING.format(12, "0.2 s")
    (tmp_path / "plan.toml").write_text(plan)
    process = subprocess.Popen(
        [sys.executable, "-m", "rotorsim", "campaign", tmp_path / "plan.toml", "--out", tmp_path / "store"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    until(lambda: cells(process), process)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert err.splitlines()[-1].startswith("stopped: ") and "Traceback" not in err
    run_campaign(make_plan(plan), tmp_path / "store", Settings(show=False))
    assert_whole(tmp_path / "store", solved_here(plan, tmp_path / "alone", "rotorsim"))


@pytest.mark.slow
def test_a_scheduler_that_is_killed_ends_in_a_sentence_and_the_rest_runs_elsewhere(tmp_path):
    plan, folder = SLEEPING.format(5, "0.5 s"), tmp_path / "store"
    with (
        scheduler(tmp_path, "same") as (address, process),
        running(tmp_path, plan, folder, scheduler=address, physics="stub") as client,
    ):
        until(lambda: len(records(folder)) >= 2, client)
        process.kill()
        _, err = client.communicate(timeout=PATIENCE)
    assert client.returncode == 2
    assert err.startswith("scheduler: the connection is lost") and "what is done is kept" in err
    assert err.count("\n") == 1, err
    outcome = run_campaign(make_plan(plan), folder, Settings(workers=1, physics="stub"))
    assert outcome.done == 5
    assert_whole(folder, solved_here(plan, tmp_path / "here", "stub"))


def test_workers_with_other_versions_are_refused_and_tls_asks_for_a_certificate(tmp_path, monkeypatch):
    plan, folder = make_plan(SLEEPING.format(2, "1 ms")), tmp_path / "store"
    if shutil.which("openssl") is None:
        pytest.skip("no openssl to make certificates with")
    files = [str(tmp_path / name) for name in ("cert.pem", "key.pem")]
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1"]
    make = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-out", files[0], "-keyout", files[1]]
    subprocess.run([*make, *subject], check=True, capture_output=True)
    with scheduler(tmp_path, "0.1", (files[0], *files)) as (address, _):
        assert address.startswith("tls://127.0.0.1:")
        tls = Tls(Path(files[0]), Path(files[0]), Path(files[1]))
        sentence = r"worker tls://127.0.0.1:\d+: other versions \(numba 0.1 there, .* here\); install the same"
        with pytest.raises(ClusterError, match=sentence):
            run_campaign(plan, folder, Settings(scheduler=address, tls=tls))
        with refused(ClusterError, "scheduler", address.replace("tls", "tcp")):
            run_campaign(plan, folder, Settings(scheduler=address.replace("tls", "tcp"), tls=tls))
        monkeypatch.setattr("rotorsim.campaign.scheduler.CONNECT", 1.0)
        for wrong in (address, address.replace("tls", "tcp")):
            with pytest.raises(ClusterError, match="cannot be reached within 1 s"):
                run_campaign(plan, folder, Settings(scheduler=wrong))


def test_a_scheduler_that_cannot_be_reached_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr("rotorsim.campaign.scheduler.CONNECT", 1.0)
    for address in ("tcp://127.0.0.1:9", "no address", "tls://127.0.0.1:9"):
        with refused(ClusterError, "scheduler", address) as caught:
            run_campaign(make_plan(SLEEPING.format(2, "1 ms")), tmp_path / "s", Settings(scheduler=address))
        assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_cases_that_raise_or_take_too_long_are_recorded_and_the_rest_is_run(tmp_path):
    """The time limit counts for each case; the case that never ends is killed, the others have their results."""
    folder = tmp_path / "store"
    plan = "time_limit = '20 s'\nmachine = 'plain_rotor'\n[experiment]\nkind = 'steady'\n"
    plan += "[axes.duration]\nlist = ['1 ms', '1 h', '2 ms', '3 ms']\n"
    outcome = run_campaign(make_plan(plan), folder, Settings(workers=1, physics="stub"))
    assert (outcome.done, outcome.failed, outcome.pending) == (3, 1, 0)
    with closing(open_store(folder).index()) as index:
        (failed,) = index.rows(FAILED)
        assert failed.error.startswith("case: took longer than the time limit of 20 s") and failed.number == 1
        assert failed.duration == 20.0 and failed.host and failed.attempts == 1
    assert len(records(folder)) == 3
    assert "case 1 failed: case: took longer" in (folder / "campaign.log").read_text()


def order(folder, number, physics="rotorsim"):
    store = open_store(folder)
    return {
        "physics": physics, "folder": str(folder), "case": store.plan.case(number).case.text, "time_limit": 60.0,
        "summary": store.plan.summary,
    }  # fmt: skip


def run_order(one):
    return prepare(one) or solve(one)


def test_a_case_that_raises_has_its_sentence_and_a_fault_of_the_program_its_trace(tmp_path, monkeypatch):
    plan = "machine = 'dtu_gas_bearing'\n[set]\n'grid.n_theta' = 16\n'grid.n_z' = 4\n'solver.time_step' = '0.2 ms'\n"
    plan += "[experiment]\nkind = 'steady'\nduration = '20 ms'\n[axes.pressure]\nlist = ['0.01 MPa', '0.6 MPa']\n"
    make_store(make_plan(plan), tmp_path / "store")
    failed, done = (run_order(order(tmp_path / "store", number)) for number in (0, 1))
    assert failed["status"] == "failed" and "lift" in failed["error"] and "\n" not in failed["error"]
    assert "trace" not in failed and done["status"] == "done" and done["bytes"] > 0
    monkeypatch.setitem(PHYSICS, "stub", (PHYSICS["stub"][0], lambda *arguments: 1 / 0))
    fault = run_order(order(tmp_path / "store", 0, "stub"))
    assert fault["status"] == "failed" and fault["error"].startswith("ZeroDivisionError: division by zero; this is a")
    assert "1 / 0" in fault["trace"]


@pytest.mark.slow
def test_a_disk_that_fills_up_ends_the_campaign_and_the_rest_runs_when_there_is_room(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=600k", "tmpfs", disk], capture_output=True).returncode:
        pytest.skip("mounting a tmpfs is not permitted here")
    plan, settings = make_plan(SLEEPING.format(120, "1 ms")), Settings(workers=1, physics="stub")
    try:
        with pytest.raises(StoreError, match=r"free some (space )?and run the same command"):
            run_campaign(plan, disk / "store", settings)
        assert 0 < len(records(disk / "store")) < 120
        subprocess.run(["mount", "-o", "remount,size=20m", disk], check=True)
        assert run_campaign(plan, disk / "store", settings).done == 120
        assert_whole(disk / "store", solved_here(plan.text, tmp_path / "here", "stub"))
    finally:
        subprocess.run(["umount", "-l", disk], check=True)


def sockets(process):
    """Sockets of a process and all below it that another user could reach: of the internet, or with a name."""
    found = []
    for one in (psutil.Process(process.pid), *descendants(process)):
        with suppress(psutil.Error):
            found += one.net_connections("inet") + [c for c in one.net_connections("unix") if c.laddr]
    return found


@pytest.mark.slow
def test_no_process_of_a_campaign_on_this_computer_has_a_socket_that_others_can_reach(tmp_path):
    """A scheduler listened on the loopback, where any user could give it code that ran as the campaign's."""
    with running(tmp_path, SLEEPING.format(3, "1 s"), tmp_path / "store", workers=2, physics="stub") as process:
        until(lambda: len(cells(process)) == 2, process)
        while process.poll() is None:
            with suppress(psutil.NoSuchProcess, subprocess.TimeoutExpired):
                assert sockets(process) == []
                process.wait(0.1)
        out, err = process.communicate()
    assert process.returncode == 0, err
    assert json.loads(out)["done"] == 3


def test_a_process_that_cannot_be_started_ends_the_campaign_in_one_sentence(tmp_path, monkeypatch):
    def none(*arguments, **options):
        raise OSError(errno.EAGAIN, "Resource temporarily unavailable")

    monkeypatch.setattr("rotorsim.base.processes.subprocess.Popen", none)
    with pytest.raises(ClusterError, match=r"cannot be started on this machine .*temporarily unavailable"):
        run_campaign(make_plan(SLEEPING.format(2, "1 ms")), tmp_path / "s", Settings(workers=1, physics="stub"))


def test_what_a_process_that_died_was_writing_is_removed(tmp_path, monkeypatch):
    from rotorsim.campaign import worker

    store = make_store(make_plan(SLEEPING.format(1, "1 h")), tmp_path / "store")
    cell, versions = worker.child_of("mine")
    left, another = (part_path(store.folder, name, pid) for name, pid in (("a", cell.process.pid), ("b", 1)))
    left.touch()
    another.touch()
    cell.process.kill()
    order = {"run": "mine", "folder": str(store.folder), "versions": versions, "time_limit": 60.0}
    monkeypatch.setattr(worker, "child_of", lambda run: (cell, versions))
    assert worker._attempt(order)["status"] == "died"
    assert not left.exists() and another.exists()


def test_a_run_that_ends_while_a_process_begins_waits_for_no_case(tmp_path, monkeypatch):
    """The process is known to nobody until it has begun: the end of the run must find it then."""
    from rotorsim.campaign import worker

    monkeypatch.setattr(worker, "_ended_runs", {"mine"})
    monkeypatch.setattr(worker._thread, "child", None, raising=False)
    with pytest.raises(ProcessDiedError, match="SIGKILL"):
        worker.child_of("mine")


def test_a_stopped_run_leaves_the_cases_of_other_runs_alone():
    """Two campaigns with two stores may share a cluster: the end of one ends its own processes only."""
    from rotorsim.campaign import worker

    cell, _ = worker.child_of("stopped")
    worker.end_run("another")
    assert cell.process.poll() is None
    assert worker.run_orders(json.dumps([{"run": "another", "number": 1}])) == "[]"
    worker.end_run("stopped")
    assert cell.process.poll() == -signal.SIGKILL


@pytest.mark.slow
def test_rows_that_the_index_lost_are_taken_from_the_records(tmp_path):
    """A power cut may cost rows of the index, not records: the rows come back without a simulation."""
    plan, settings, folder = make_plan(SLEEPING.format(3, "1 ms")), Settings(workers=1, physics="stub"), tmp_path / "s"
    assert run_campaign(plan, folder, settings).done == 3
    stamps = {path: path.stat().st_mtime_ns for path in folder.glob("cases/*/*.nc")}
    with closing(sqlite3.connect(folder / "index.sqlite")) as db, db:
        db.execute("UPDATE cases SET status = 'pending', summary = NULL, bytes = NULL WHERE number > 0")
    assert run_campaign(plan, folder, settings).run == 2
    assert stamps == {path: path.stat().st_mtime_ns for path in folder.glob("cases/*/*.nc")}
    with closing(open_store(folder).index()) as index:
        assert all(row.summary["numbers.disc.rms_um.x"] > 0 for row in index.rows(DONE))
