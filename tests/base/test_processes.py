"""Worker pool: terminated by an exception in the parent, unaffected by the terminal's Ctrl-C."""

import signal
import sys
import time
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool

import pytest
import typer

from rotorsim.base.processes import Processes, sigint_blocked
from rotorsim.commands.options import resumable


def test_work_under_way_ends_with_an_exception():
    """Work that was waited for instead would give its result."""
    with pytest.raises(KeyboardInterrupt), Processes(1) as pool:
        pool.submit(abs, -1).result()
        running = pool.submit(time.sleep, 600)
        raise KeyboardInterrupt
    with pytest.raises((CancelledError, BrokenProcessPool)):
        running.result()


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_process_does_not_hear_ctrl_c_and_we_do():
    with Processes(1) as pool:
        for _ in range(2):
            assert signal.SIGINT in pool.submit(signal.pthread_sigmask, signal.SIG_BLOCK, ()).result()
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_signal_that_comes_meanwhile_is_received_afterwards():
    received = []
    before = signal.signal(signal.SIGINT, lambda number, frame: received.append(number))
    try:
        with sigint_blocked():
            signal.raise_signal(signal.SIGINT)
            assert received == []
        assert received == [signal.SIGINT]
    finally:
        signal.signal(signal.SIGINT, before)


def test_an_interrupted_command_states_that_it_continues(capsys):
    @resumable
    def command():
        raise KeyboardInterrupt

    with pytest.raises(typer.Exit) as ended:
        command()
    assert ended.value.exit_code == 130 and "the same command continues" in capsys.readouterr().err
