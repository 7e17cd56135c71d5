"""Ctrl-C: received during compiled code and imports, never lost; samples of a run are kept."""

import os
import signal
import subprocess
import sys
import threading

import pytest

from fmu.archive import workspace
from rotorsim.base import interrupt
from rotorsim.base.files import replacing, replacing_all
from rotorsim.base.interrupt import ALONE, APART, SENTENCE, Interrupt, apart, keeping
from waiting import PATIENCE, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
PROGRAM = """
import os, signal, sys
from rotorsim.base.interrupt import interrupted, watched
def ask():
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(1000): pass
class Destructor:
    def __del__(self):
        ask()
def destroy():
    Destructor()
def swallow():
    try: ask()
    except BaseException: pass
with watched():
    try:
        {}()
        print("lost", flush=True)
        while True: pass
    except KeyboardInterrupt:
        interrupted()
"""


def test_a_call_apart_gives_its_result_and_its_error():
    assert apart(divmod, 7, 2) == (3, 1)
    with pytest.raises(ZeroDivisionError):
        apart(divmod, 7, 0)


@pytest.mark.parametrize("noted", [False, True], ids=["plain", "inside a run that notes it"])
def test_ctrl_c_ends_the_wait_for_a_call_apart_and_not_the_call(noted):
    begun, go_on = threading.Event(), threading.Event()

    def long() -> None:
        begun.set()
        go_on.wait()

    threading.Thread(target=lambda: (begun.wait(), os.kill(os.getpid(), signal.SIGINT))).start()
    try:
        with pytest.raises(KeyboardInterrupt):
            if noted:
                with Interrupt():
                    apart(long)
            else:
                apart(long)
        assert any(thread.name == APART for thread in threading.enumerate())
    finally:
        go_on.set()


def test_the_first_ctrl_c_is_noted_the_second_stops_and_the_handler_comes_back():
    before = signal.getsignal(signal.SIGINT)
    with Interrupt() as outer:
        with Interrupt() as interrupt:
            signal.raise_signal(signal.SIGINT)
            assert interrupt.asked == signal.SIGINT
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
        assert Interrupt.active is outer and not outer.asked
    assert signal.getsignal(signal.SIGINT) is before and Interrupt.active is None


def test_ctrl_c_during_the_first_imports_ends_a_command_silently():
    """Python printed a traceback: nothing of the command can handle the signal before it is imported."""
    program = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
class Finder:
    def find_spec(self, name, path, target=None):
        if name == "rotorsim.base.interrupt":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
import rotorsim.__main__
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


@pytest.mark.parametrize("place", ["destroy", "swallow"])
def test_ctrl_c_that_a_destructor_or_a_library_swallowed_ends_the_program(place):
    """In the first case it is sent again, in the second the program is ended after a while."""
    program = [sys.executable, "-c", PROGRAM.format(place)]
    done = subprocess.run(program, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 130 and done.stdout == "lost\n"
    assert done.stderr == f"{SENTENCE}\n"


ENDING = """
import atexit
from contextlib import nullcontext
from rotorsim.base.interrupt import at_end, done, leave, watched
atexit.register(print, "shutdown")
at_end(lambda: print("last act"))
with {}:
    done()
    leave(3)
"""


@pytest.mark.parametrize(("block", "printed"), [("watched()", "last act\n"), ("nullcontext()", "last act\nshutdown\n")])
def test_a_command_whose_output_is_written_skips_the_shutdown_and_a_program_that_runs_it_does_not(block, printed):
    program = [sys.executable, "-c", ENDING.format(block)]
    done = subprocess.run(program, capture_output=True, text=True, timeout=PATIENCE)
    assert (done.returncode, done.stdout, done.stderr) == (3, printed, "")


@pytest.mark.parametrize("block", [workspace, lambda: replacing("file"), lambda: replacing_all(".")])
def test_after_ctrl_c_the_removal_of_what_was_begun_may_exceed_the_time_of_a_command(tmp_path, monkeypatch, block):
    """Folders would stay on a slow computer: the command was ended during their removal."""
    noted = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(interrupt, "finishing", lambda: noted.append(True))
    for error, right in ((ValueError, []), (KeyboardInterrupt, [True])):
        with pytest.raises(error), block():
            raise error
        assert noted == right and not list(tmp_path.iterdir())


@pytest.mark.parametrize("handler", [signal.SIG_DFL, signal.SIG_IGN])
def test_a_command_is_kept_only_where_it_receives_the_signal_and_until_the_outer_block_ends(handler):
    before = signal.signal(signal.SIGTERM, handler)
    try:
        with keeping():
            assert interrupt._keeping.is_set() == (handler is signal.SIG_DFL)
            with keeping():
                pass
            assert interrupt._keeping.is_set() == (handler is signal.SIG_DFL)
        assert not interrupt._keeping.is_set() and signal.getsignal(signal.SIGTERM) is handler
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("name", ["modes", *(pytest.param(n, marks=pytest.mark.slow) for n in ("runup", "map"))])
def test_ctrl_c_ends_a_command_that_compiles_its_kernels(tmp_path, name):
    """Sent when the source of the kernels is there, so before the first of them; none may be complete afterwards."""
    cache = tmp_path / "cache"
    command = [sys.executable, "-m", "rotorsim", name, "plain_rotor", "--out", "run"]
    run = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                           env=os.environ | {"ROTORSIM_CACHE_DIR": str(cache)})  # fmt: skip
    until(lambda: any(cache.glob("plants/*.py")), run)
    run.send_signal(signal.SIGINT)
    assert run.communicate(timeout=PATIENCE) == ("", f"{SENTENCE}\n")
    assert run.returncode == 130
    assert not any(cache.rglob("*.run-*.nbi"))
    assert [path.name for path in tmp_path.iterdir()] == ["cache"]


def test_a_system_that_allows_no_more_threads_is_no_error(monkeypatch):
    def refuse(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    assert apart(lambda: threading.current_thread()) is threading.main_thread()


def test_a_command_runs_where_the_system_allows_no_threads(tmp_path):
    """One sentence states it; Ctrl-C still ends the command, once Python has its turn."""
    refuse = "import threading\ndef refuse(thread): raise RuntimeError\nthreading.Thread.start = refuse\n"
    script = f"{refuse}from rotorsim.cli import main\nmain()"
    command = [sys.executable, "-c", script, "warm", "plain_rotor"]
    done = subprocess.run(command, env=os.environ | {"ROTORSIM_CACHE_DIR": str(tmp_path)},
                          capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 0 and done.stderr.splitlines()[0] == ALONE
    assert any(tmp_path.rglob("*.run-*.nbi")) and "Traceback" not in done.stderr
    done = subprocess.run([sys.executable, "-c", refuse + PROGRAM.format("ask")], capture_output=True, text=True)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", f"{ALONE}\n{SENTENCE}\n")
