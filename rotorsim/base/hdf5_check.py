"""Check of foreign HDF5 files in a child process, because damaged files can crash or hang libhdf5."""

from __future__ import annotations

import atexit
import json
import os
import signal
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

SECONDS, PER_BYTE = 10.0, 1e-7
"""Computing time [s] that a file may take, and more per byte: hundreds of times what an undamaged one takes."""
LARGEST, DENSEST = 2e9, 2000.0
"""Bytes that a file may claim to hold, or more per byte of the file: gzip packs zeros by 1 : 1032."""
TIMED_OUT = (-signal.SIGXCPU, -signal.SIGKILL) if os.name == "posix" else (1,)
READER = Path(__file__).with_name("hdf5_reader.py")
_lock = threading.Lock()
_child: subprocess.Popen[str] | None = None
_owner = 0
_sound: dict[Path, tuple[int, ...]] = {}


def check_hdf5(path: Path) -> str | None:
    """Read a file as a whole in a child process.

    Parameters
    ----------
    path : Path
        An HDF5 or netCDF-4 file.

    Returns
    -------
    str or None
        What is wrong with it, as the predicate of a sentence, if libhdf5 crashes on it, does not end, or takes too much
        memory; None otherwise, also where it answers with an exception.
    """
    with _lock:
        if _sound.get(path.absolute()) == _stamp(path):
            return None
        wrong = _ask(path)
    if wrong is None:
        trust_hdf5(path)
    return wrong


def trust_hdf5(path: Path) -> None:
    """Mark a file in its present state as undamaged, because this process has just written it."""
    _sound[path.absolute()] = _stamp(path)


def _stamp(path: Path) -> tuple[int, ...]:
    found = path.stat()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns


def _ask(path: Path) -> str | None:
    size = path.stat().st_size
    seconds = SECONDS + PER_BYTE * size
    child = _started()
    try:
        answer = _answer(child, [os.fspath(path.absolute()), seconds, max(LARGEST, DENSEST * size)], 10 * seconds)
    except BaseException:  # of the user: its answer would be taken for that of the next file
        child.kill()
        _stop(child)
        raise
    if answer == "ok":
        return None
    if answer == "memory":
        return "claims to hold more than fits into memory; it is damaged: copy it again"
    if _stop(child) in TIMED_OUT:
        return f"is damaged: reading it has not ended after {seconds:.0f} s; copy it again"
    return "is damaged: reading it crashes the HDF5 library; copy it again"


def _answer(child: subprocess.Popen[str], request: list[Any], patience: float) -> str:
    """The child's answer, empty if it ended without one."""
    assert child.stdin is not None and child.stdout is not None
    guard = threading.Timer(patience, child.kill)  # where the child cannot limit its own computing time
    guard.daemon = True
    if os.name != "posix":
        guard.start()
    try:
        child.stdin.write(json.dumps(request) + "\n")
        child.stdin.flush()
        return child.stdout.readline().strip()
    except OSError:
        return ""
    finally:
        guard.cancel()


def _started() -> subprocess.Popen[str]:
    """The child of this process, which serves many files."""
    global _child, _owner
    if _child is None or _owner != os.getpid() or _child.poll() is not None:
        _child, _owner = _start(), os.getpid()
        atexit.register(_stop, _child)
    return _child


def _start() -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-P", str(READER)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,  # Ctrl-C is the parent's business
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )


def _stop(child: subprocess.Popen[str]) -> int:
    """End a child by the end of its input; its exit code."""
    atexit.unregister(_stop)
    for pipe in (child.stdin, child.stdout):
        with suppress(OSError):  # it has ended with something unread
            if pipe is not None:
                pipe.close()
    return child.wait()
