"""Child processes: ended by an exception, a time limit or the end of their parent; silent and out of reach."""

import errno
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import BrokenExecutor, CancelledError

import psutil
import pytest
import typer

from rotorsim.base import hdf5
from rotorsim.base.errors import MachineFileError, RotorsimError
from rotorsim.base.processes import Child, ProcessDiedError, Processes, processes, spread
from rotorsim.commands.options import resumable
from rotorsim.machine import Machine
from rotorsim.signals import open_record
from waiting import PATIENCE

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@pytest.fixture
def child():
    one = Child()
    yield one
    one.kill()


def test_a_call_gives_its_result_or_its_error_and_the_next_goes_on(child):
    assert child.call(divmod, 7, 2) == (3, 1)
    with pytest.raises(ZeroDivisionError):
        child.call(divmod, 1, 0)
    with pytest.raises(Exception, match="pickle"):
        child.call(lambda: None)
    assert child.call(print, "not a result") is None
    assert child.call(os.getpid) == child.process.pid


def test_a_call_that_takes_too_long_or_dies_is_told_from_one_that_fails(child):
    with pytest.raises(ProcessDiedError, match="ended with code 7") as died:
        child.call(os._exit, 7)
    assert died.value.code == 7 and not child.alive
    with pytest.raises(ProcessDiedError):
        child.call(os.getpid)
    slow = Child()
    with pytest.raises(TimeoutError):
        slow.call(time.sleep, 600, limit=0.1)
    assert not slow.alive


def test_work_under_way_ends_with_an_exception():
    """Work that was waited for instead would give its result."""
    with pytest.raises(KeyboardInterrupt), Processes(1) as pool:
        pool.submit(abs, -1).result()
        running, waiting = pool.submit(time.sleep, 600), pool.submit(abs, -2)
        raise KeyboardInterrupt
    for one in (running, waiting):
        with pytest.raises((BrokenExecutor, CancelledError)):
            one.result()


def test_several_processes_give_what_one_gives():
    calls = [(-3,), (2,), (-1,)]
    for workers in (1, 2):
        assert sorted(spread(abs, calls, workers)) == [(0, 3), (1, 2), (2, 1)]


PROGRAM = """
import sys
from rotorsim.base.processes import Processes
from rotorsim.effects import REGISTRY
REGISTRY["of this program"] = None
if __name__ == "__main__":
    with Processes(1) as pool:
        print(pool.submit(eval, "'of this program' in __import__('rotorsim.effects').effects.REGISTRY").result())
        print(pool.submit(eval, "__import__('os').getpid()").result(), flush=True)
        sys.stdin.read()
"""


@posix
def test_a_process_has_what_its_program_registered_no_socket_and_ends_with_its_parent(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    parent = subprocess.Popen([sys.executable, tmp_path / "program.py"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert parent.stdout.readline() == b"True\n"
    one = psutil.Process(int(parent.stdout.readline()))
    assert one.net_connections("all") == []
    parent.kill()
    parent.communicate()
    assert not psutil.wait_procs([one], timeout=PATIENCE)[1]


@posix
def test_ctrl_c_of_a_terminal_does_not_reach_a_process(child):
    assert child.call(os.getsid, 0) == child.process.pid != os.getsid(0)
    child.process.send_signal(signal.SIGINT)
    assert child.call(os.getpid) == child.process.pid


def test_an_error_of_ours_comes_back_as_it_is_raised_here(child):
    with pytest.raises(MachineFileError) as here:
        Machine.from_text("name = 1")
    with pytest.raises(MachineFileError) as there:
        child.call(Machine.from_text, "name = 1")
    assert str(there.value) == str(here.value) and there.value.where == here.value.where


def test_an_interrupted_command_states_that_it_continues(capsys):
    @resumable
    def command():
        raise KeyboardInterrupt

    with pytest.raises(typer.Exit) as ended:
        command()
    assert ended.value.exit_code == 130 and "the same command continues" in capsys.readouterr().err


def test_calls_are_made_here_where_the_system_allows_no_more(monkeypatch):
    def refuse(_):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    assert list(spread(abs, [(-1,), (2,)], 2)) == [(0, 1), (1, 2)]
    with processes(2) as each:
        assert list(each(abs, [-1])) == [1]


def test_a_file_is_not_called_damaged_where_no_process_can_read_it(monkeypatch, tmp_path):
    def refuse(*_, **__):
        raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")

    path = tmp_path / "record.nc"
    path.write_bytes(b"")
    monkeypatch.setattr(subprocess, "Popen", refuse)
    monkeypatch.setattr(hdf5, "_child", None)
    with pytest.raises(RotorsimError, match="allows no more"):
        open_record(path)
