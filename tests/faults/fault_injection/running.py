"""Runs a command in its own process and disturbs it by signals or disk limits."""

import os
import resource
import signal
import subprocess
import sys
import time
import uuid
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import psutil

from waiting import PATIENCE

MARK = "ROTORSIM_FAULT_TRY"
"""Environment variable by which all processes of a try are found."""
Disturb = Callable[["Running"], None]


@dataclass(frozen=True)
class Ended:
    """End of a command: exit code (negative: the signal), its output, seconds, processes that it left."""

    code: int
    stdout: str
    stderr: str
    seconds: float
    left: tuple[str, ...] = ()


class Running:
    """A command under way in the folder `cwd`."""

    def __init__(self, line: list[str], cwd: Path, environment: Mapping[str, str], largest: int | None = None) -> None:
        self.mark, self.cwd, self.begin = uuid.uuid4().hex, cwd, time.monotonic()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "rotorsim", *line], cwd=cwd, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True, preexec_fn=partial(_begin, largest),
            env=os.environ | {MARK: self.mark, "COLUMNS": "200"} | environment,
        )  # fmt: skip

    def wait(self, seconds: float) -> bool:
        """Wait so long; whether it still runs."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(seconds)
        return self.process.poll() is None

    def until(self, condition: Callable[[], object]) -> bool:
        """Wait for a condition; whether the command still runs."""
        while self.process.poll() is None and not condition():
            time.sleep(0.005)
        return self.process.poll() is None

    def send(self, number: int, group: bool = False) -> None:
        """Send a signal, to the whole group as a terminal does it, or to the command alone."""
        with suppress(ProcessLookupError):
            (os.killpg if group else os.kill)(self.process.pid, number)

    def ended(self) -> Ended:
        """Wait for the end, of processes that it began too."""
        try:
            out, err = self.process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self.send(signal.SIGABRT, group=True)
            out, err = self.process.communicate()
            err += "\nhangs"
        seconds = time.monotonic() - self.begin
        left = tuple(self._left())
        return Ended(self.process.returncode, out, err, seconds, left)

    def _left(self) -> list[str]:
        """Processes of this try that do not end by themselves (one may be compiling); they are ended."""
        end = time.monotonic() + PATIENCE
        while (alive := marked(self.mark)) and time.monotonic() < end:
            time.sleep(0.05)
        lines = []
        for one in alive:
            with suppress(psutil.Error):
                lines.append(" ".join(one.cmdline())[:150])
                one.kill()
        return lines


def _begin(largest: int | None) -> None:
    if largest is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest, resource.RLIM_INFINITY))


def marked(mark: str) -> list[psutil.Process]:
    """Living processes of a try."""
    found = []
    for one in psutil.process_iter():
        with suppress(psutil.Error):
            if one.environ().get(MARK) == mark and one.status() != psutil.STATUS_ZOMBIE:
                found.append(one)
    return found


def run(line: list[str], cwd: Path, environment: Mapping[str, str] | None = None, disturb: Disturb | None = None,
        largest: int | None = None) -> Ended:  # fmt: skip
    """Run a command, none of whose files may grow beyond `largest` [byte], and disturb it."""
    running = Running(line, cwd, environment or {}, largest)
    if disturb is not None:
        disturb(running)
    return running.ended()
