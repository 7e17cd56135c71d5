"""Handling of Ctrl-C: a command ends at once, a run that keeps its samples ends between two steps.

Python raises KeyboardInterrupt only between two instructions of the main thread, and code that was called there may
swallow it (a callback from compiled code, a destructor, an import that is tried). Hence three parts:

- `Interrupt`: the first signal is only noted, for a run that reads `asked` between two steps;
- `apart`: long calls of compiled code run in a thread of their own, so that the main thread receives the signal;
- `watched`: ends a command that has not ended some seconds after the signal.
"""

from __future__ import annotations

import atexit
import contextvars
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType, TracebackType
from typing import Any, NoReturn, TypeVar

Result = TypeVar("Result")

CODE = 130
"""Exit code of a command that Ctrl-C ended: 128 + SIGINT, as in a shell."""
PATIENCE = 3.0
"""Time [s] that a command has from Ctrl-C to its end."""
TICK = 0.05
"""Time [s] between two looks at `Interrupt.asked` while a thread is waited for."""
APART = "rotorsim apart"
"""Name of the threads of `apart`."""
SENTENCE = "interrupted before the end; the same command starts again"
KEPT = "interrupted: what was computed is kept, and the same command continues"
ALONE = "the system allows no more threads (ulimit -u): one process does all, and Ctrl-C waits for a call to end"


class Interrupt:
    """Deferred Ctrl-C: the first signal only sets `asked` to its number; a second raises KeyboardInterrupt.

    Outside the main thread, which alone receives signals, it does nothing.
    """

    active: Interrupt | None = None

    def __init__(self, *numbers: int) -> None:
        self.asked = 0
        self._numbers = numbers or (signal.SIGINT,)
        self._before: dict[int, Any] = {}
        self._outer: Interrupt | None = None

    def __enter__(self) -> Interrupt:
        if threading.current_thread() is threading.main_thread():
            self._outer, Interrupt.active = Interrupt.active, self
            for number in self._numbers:
                self._before[number] = signal.signal(number, self._note)
        return self

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = number

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        if self._before:
            Interrupt.active = self._outer


def asked() -> bool:
    """True if Ctrl-C was received during the active `Interrupt`."""
    return Interrupt.active is not None and Interrupt.active.asked > 0


def apart(function: Callable[..., Result], *arguments: Any) -> Result:
    """Result of a function called in its own thread; Ctrl-C raises KeyboardInterrupt here at once.

    It does so inside an `Interrupt` too. The call itself cannot be stopped: the process has to end with `leave`.
    Where the system allows no more threads the call is made in this one, and Ctrl-C waits for its end.
    """
    if threading.current_thread() is not threading.main_thread():
        return function(*arguments)
    done = threading.Event()
    result: list[Result] = []
    errors: list[BaseException] = []

    def call() -> None:
        try:
            result.append(function(*arguments))
        except BaseException as error:
            errors.append(error)
        finally:
            done.set()

    try:
        threading.Thread(target=contextvars.copy_context().run, args=(call,), name=APART).start()
    except RuntimeError:
        return function(*arguments)
    while not done.wait(TICK):
        if asked():
            raise KeyboardInterrupt
    for error in errors:
        raise error
    return result[0]


_last_acts: list[Callable[[], object]] = []


def at_end(act: Callable[[], object]) -> None:
    """Call a function at the end of the process, also where `leave` skips the interpreter's shutdown."""
    _last_acts.append(act)
    atexit.register(act)


def leave(code: Any) -> NoReturn:
    """End the process, without the interpreter's shutdown after a command's `done` or during a call of `apart`."""
    if (_done.is_set() and _watched.is_set()) or any(thread.name == APART for thread in threading.enumerate()):
        for act in _last_acts:
            act()
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(code or 0)
    sys.exit(code)


def interrupted() -> NoReturn:
    """End a command after Ctrl-C with one sentence."""
    finishing()
    print(SENTENCE, file=sys.stderr)
    leave(CODE)


_finishing, _done, _watched, _keeping = threading.Event(), threading.Event(), threading.Event(), threading.Event()


def done() -> None:
    """Note that all output is written, so that the interpreter's slow shutdown can be skipped."""
    _done.set()


def finishing() -> None:
    """Note that the command ends by itself and may exceed `PATIENCE` while it writes or removes its data."""
    _finishing.set()


@contextmanager
def undoing() -> Iterator[None]:
    """Let what is around the block remove what it began, however long that takes, once Ctrl-C has ended the block."""
    try:
        yield
    except KeyboardInterrupt:
        finishing()
        raise


@contextmanager
def keeping() -> Iterator[None]:
    """End a command on SIGTERM as on Ctrl-C, and state then that what it computed is kept (`KEPT`)."""
    before = signal.getsignal(signal.SIGTERM)
    own = threading.current_thread() is threading.main_thread() and before is signal.SIG_DFL
    if own:
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        _keeping.set()
    try:
        yield
    finally:
        if own:
            _keeping.clear()
            signal.signal(signal.SIGTERM, before)


@contextmanager
def watched() -> Iterator[None]:
    """End the process `PATIENCE` after Ctrl-C if it has not ended by itself; for a main program.

    The signal's number goes through a pipe to a thread, which needs no turn of the main thread. Where the system allows
    no more threads, a sentence states that Ctrl-C waits.
    """
    _watched.set()
    if signal.getsignal(signal.SIGINT) is signal.SIG_DFL:  # during the first imports
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if os.name != "posix":
        yield
        return
    read, write = os.pipe()
    os.set_blocking(write, False)
    signal.set_wakeup_fd(write, warn_on_full_buffer=False)
    sys.unraisablehook = _unraisable
    try:
        threading.Thread(target=_watch, args=(read,), daemon=True).start()
    except RuntimeError:
        print(ALONE, file=sys.stderr)
        os.environ["OPENBLAS_NUM_THREADS"] = "1"  # it sends SIGINT where it gets fewer threads than it asks for
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        finishing()


def _unraisable(found: sys.UnraisableHookArgs) -> None:
    """Send the signal again that a destructor or a callback has swallowed; other errors are shown as ever."""
    if not isinstance(found.exc_value, KeyboardInterrupt):
        sys.__unraisablehook__(found)
        return
    again = threading.Timer(TICK, os.kill, (os.getpid(), signal.SIGINT))
    again.daemon = True
    again.start()


def _watch(read: int) -> None:
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    while not _ends(os.read(read, 64)) or Interrupt.active is not None or _finishing.wait(PATIENCE):
        pass
    with suppress(OSError):
        os.write(2, f"{KEPT if _keeping.is_set() else SENTENCE}\n".encode())
    os._exit(CODE)


def _ends(numbers: bytes) -> bool:
    """Whether signals end the command: Ctrl-C does, SIGTERM where `keeping` receives it."""
    return signal.SIGINT in numbers or (signal.SIGTERM in numbers and _keeping.is_set())
