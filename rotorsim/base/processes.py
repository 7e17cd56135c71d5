"""Child processes that call functions: the one parallel engine next to Dask, of sweeps, maps, studies and campaigns.

A `Child` has one thread of linear algebra, does not receive the Ctrl-C of the terminal, can be ended alone, and ends
with its pipe: none outlives a parent that was killed. Calls and results are pickles in pipes, so nothing listens on a
port, which every user of the computer could reach. Run as a program, this file is the child.

No library's pool: after SIGKILL of the parent in a case of 20 s, these processes end within 0.1 s; all four of loky 3.7
were alive after 25 s, those of Pebble 5.2 worked to the end of their case. concurrent.futures ends all its processes
with the one that dies or takes too long, and a campaign goes on with the others.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import lru_cache
from multiprocessing import spawn
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import TYPE_CHECKING, Any

from rotorsim.base.errors import RotorsimError

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Variables of the environment that limit the threads of libraries loaded later."""
Each = Callable[[Callable[[Any], Any], Iterable[Any]], Iterator[Any]]
"""Function that maps another over values, as `map` does."""
PATIENCE = 5.0
"""Time [s] between the end of a process's results and its own."""
ROOT = str(Path(__file__).resolve().parents[2])
"""Folder of the packages."""


class ProcessDiedError(BrokenExecutor):
    """Raised for a child process that ended during a call; the text is a predicate, `code` its exit code."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class NoProcessError(RotorsimError):
    """The system starts no more processes."""


class Child:
    """Child process that calls functions one after the other, for one thread of this process at a time.

    Raises NoProcessError where the system allows no more processes.
    """

    def __init__(self) -> None:
        paths = filter(None, (ROOT, os.environ.get("PYTHONPATH")))
        environment = os.environ | dict.fromkeys(THREADS, "1") | {"PYTHONPATH": os.pathsep.join(paths)}
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        try:
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-m", "rotorsim.base.processes"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                stderr=self._stderr, env=environment, start_new_session=True,
            )  # fmt: skip
        except BlockingIOError as error:
            reason = "processes: the system allows no more of them"
            raise NoProcessError(f"{reason} ({error.strerror}); raise the limit (ulimit -u)") from error

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self.process.poll() is None

    def call(self, function: Callable[..., Any], *arguments: Any, limit: float | None = None) -> Any:
        """Result of a function of a module, which may take `limit` seconds.

        Raises TimeoutError if it took longer (the process has been ended), ProcessDiedError if the process ended, for
        example for want of memory, and whatever the function raised.
        """
        call = pickle.dumps((function, arguments))
        late = threading.Event()

        def expire() -> None:
            late.set()
            self.process.kill()

        timer = threading.Timer(limit or 0.0, expire)
        timer.daemon = True
        if limit is not None:
            timer.start()
        try:
            assert self.process.stdin is not None and self.process.stdout is not None
            pickle.dump(call, self.process.stdin)
            self.process.stdin.flush()
            good, result = pickle.load(self.process.stdout)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError) as error:  # ValueError: killed from elsewhere
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(PATIENCE)
            self.kill()
            if late.is_set():
                raise TimeoutError(f"took longer than {limit:g} s") from error
            raise ProcessDiedError(self._cause(), self.process.returncode) from error
        except BaseException:  # Ctrl-C: the result would be taken for that of the next call
            self.kill()
            raise
        finally:
            timer.cancel()
        if not good:
            raise result
        return result

    def _cause(self) -> str:
        """End of the process as a predicate: its signal, or its exit code and last line of errors."""
        code = self.process.returncode
        self._stderr.seek(max(self._stderr.seek(0, os.SEEK_END) - 2000, 0))
        last = (self._stderr.read().decode(errors="replace").strip().splitlines() or [""])[-1][:200]
        if code < 0:
            with suppress(ValueError):
                return f"was ended by {signal.Signals(-code).name}"
        return f"ended with code {code}" + (f" ({last})" if last else "")

    def kill(self) -> None:
        """End the process now."""
        self.process.kill()
        self.close()

    def close(self) -> None:
        """End the process, which waits for a call."""
        for pipe in (self.process.stdin, self.process.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()
        self.process.wait()


class Processes(ThreadPoolExecutor):
    """Pool of child processes: an exception in its `with` block, Ctrl-C too, ends the calls under way at once.

    A call whose process dies raises ProcessDiedError; the others go on.
    """

    def __init__(self, workers: int) -> None:
        super().__init__(workers, "rotorsim worker")
        self._own, self._children, self._ended = threading.local(), list[Child](), False

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Give a call of a module's function to the next process that is free."""
        return super().submit(self._call, fn, *args, **kwargs)

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        child: Child | None = getattr(self._own, "child", None)
        if self._ended:
            raise CancelledError
        if child is None or not child.alive:
            child = self._own.child = Child()
            self._children.append(child)
            if self._ended:  # asked after the others know this child
                child.kill()
            child.call(spawn.prepare, _main_program())
        return child.call(function, *arguments)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended = kind is not None
        for child in list(self._children) if self._ended else ():
            child.process.kill()
        try:
            self.shutdown(cancel_futures=self._ended)
        finally:
            for child in self._children:
                child.kill()


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def spread(function: Callable[..., Any], calls: Sequence[tuple], workers: int) -> Iterator[tuple[int, Any]]:
    """(number, result) of calls of a module's function, in the order of completion; in this process for one worker.

    Where the system allows no more threads and processes, it is one.
    """
    if workers <= 1 or not _more_allowed():
        with one_thread():  # the matrices are small: more threads only wait for each other
            for number, arguments in enumerate(calls):
                yield number, function(*arguments)
        return
    with Processes(min(workers, len(calls))) as pool:
        numbers = {pool.submit(function, *arguments): number for number, arguments in enumerate(calls)}
        for future in as_completed(numbers):
            yield numbers[future], future.result()


@contextmanager
def processes(workers: int) -> Iterator[Each]:
    """A `map` over some processes of one thread each; in this process for one worker, and as in `spread`."""
    if workers <= 1 or not _more_allowed():
        yield map
        return
    with Processes(workers) as pool:
        yield pool.map


def _more_allowed() -> bool:
    """Whether the system lets this process start another thread."""
    try:
        threading.Thread(target=int).start()
    except RuntimeError:
        return False
    return True


def _main_program() -> dict[str, Any]:
    """Data by which a child imports what the program of this process has made known, such as effects of its own."""
    data: dict[str, Any] = spawn.get_preparation_data("rotorsim worker")
    return {name: value for name, value in data.items() if name != "authkey"}


def main() -> None:
    """Call functions until the end of the input."""
    from rotorsim.base.errors import PackageLeftOut, Unusual

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    results = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not be taken for a result
    for known in (PackageLeftOut, Unusual):  # the parent has warned or asked
        warnings.simplefilter("ignore", known)
    calls: SimpleQueue[bytes] = SimpleQueue()
    threading.Thread(target=_listen, args=(calls,), daemon=True).start()
    while True:
        results.write(_result(calls.get()))
        results.flush()


def _listen(calls: SimpleQueue[bytes]) -> None:
    """Take calls, also while one is under way, so that the process ends with its input."""
    with suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            calls.put(pickle.load(sys.stdin.buffer))
    os._exit(0)


def _result(call: bytes) -> bytes:
    try:
        function, arguments = pickle.loads(call)
        return pickle.dumps((True, function(*arguments)))
    except Exception as error:
        with suppress(Exception):  # some cannot be pickled, some not be read again
            answer = pickle.dumps((False, error))
            pickle.loads(answer)
            return answer
        return pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))


_LIMITED = ContextVar("limited", default=False)
"""Whether linear algebra has one thread here already."""


@lru_cache(maxsize=1)
def _libraries() -> ThreadpoolController:
    import scipy.linalg  # noqa: F401 - brings its library, which must be loaded to be found
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Context, or decorator, of one thread of linear algebra: for small matrices several only wait for each other.

    Within another one it does nothing: to set the limit costs more than to solve a small system.
    """
    if _LIMITED.get():
        yield
        return
    before = _LIMITED.set(True)
    try:
        with _libraries().limit(limits=1):
            yield
    finally:
        _LIMITED.reset(before)


if __name__ == "__main__":
    main()
