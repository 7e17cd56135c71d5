"""Command line `rotorsim COMMAND`; errors are printed as sentences. The commands are in `rotorsim.commands`."""

import gc
import io
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from rotorsim.base.display import VisibleStream
from rotorsim.base.errors import NoCache, NotCarried, OtherMachine, PackageLeftOut, RotorsimError, UnstableLaw, Unusual
from rotorsim.base.files import WriteError, write_error
from rotorsim.base.interrupt import interrupted, leave, watched

STDOUT = "standard output"
YOUNG = 20_000
"""New objects after which a command collects garbage: its imports make half a million that stay."""
LIMITS: dict[type[Exception], str] = {
    MemoryError: "memory: this needs more than there is; make the grid, the shaft or the record coarser, or free some",
    RecursionError: "input: something in it is nested too deeply; make it flatter",
    BrokenExecutor: "workers: the system has ended a process, as it does for want of memory; free some, or use fewer",
    UnicodeEncodeError: "a name or text has half a character, which no file takes; rename the file or correct it",
}
"""Errors that Python raises for an input that is too much for it."""


def main(arguments: list[str] | None = None, app: Any = None) -> None:
    """Run a command, by default that of this process; ends in SystemExit. `app` stands for rotorsim's own commands.

    A user's error ends as a sentence on stderr and exit code 2, without a traceback, Ctrl-C as one with exit code 130.
    """
    if arguments is not None:
        command(arguments, app)
        return
    gc.set_threshold(YOUNG)
    with watched():
        try:
            _careful_streams()
            command(sys.argv[1:], app)
        except KeyboardInterrupt:  # during the imports
            interrupted()
        except SystemExit as ended:
            leave(ended.code)


def command(arguments: list[str], app: Any = None) -> None:
    """Run a command of these words."""
    debug, yes = "--debug" in arguments, "--yes" in arguments
    try:
        with warnings.catch_warnings(), printed():
            warnings.showwarning = partial(_show, warnings.showwarning)
            program = "rotorsim" if app is None else app.info.name
            if app is None:
                from rotorsim.commands.registry import app

            warnings.simplefilter("ignore" if yes else "error", Unusual)
            app(args=[a for a in arguments if a not in ("--debug", "--yes")], prog_name=program)
    except BrokenPipeError:
        _print_no_more()
        sys.exit(1)
    except (RotorsimError, OSError, Unusual, MemoryError, RecursionError, BrokenExecutor, UnicodeEncodeError) as error:
        if debug:
            raise
        print(as_option(sentence(error), arguments), file=sys.stderr)
        sys.exit(2)


def _show(usual: Callable[..., None], message: Warning | str, category: type[Warning], *where: Any) -> None:
    """Show a warning: one of ours as its sentence."""
    if issubclass(category, (PackageLeftOut, NoCache, NotCarried, OtherMachine, UnstableLaw)):
        print(message, file=sys.stderr)
    else:
        usual(message, category, *where)


@contextmanager
def printed() -> Iterator[None]:
    """Write out all that was printed, which the interpreter would do at its end, with a traceback on a full disk.

    Raises WriteError for standard output if it takes no more.
    """
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        if error.filename != STDOUT:
            raise
        _print_no_more()
        raise write_error(Path(STDOUT), error, space=False) from error


class _Stdout(io.FileIO):
    """Standard output whose errors name it."""

    def write(self, data: Any, /) -> int:
        try:
            return super().write(data)
        except OSError as error:
            error.filename = STDOUT
            raise


def _careful_streams() -> None:
    """Let standard output and error take every text: what the encoding lacks is replaced, what acts is shown.

    An error of standard output names it: no other file's errors come without a name.
    """
    now: Any = sys.stdout
    before: Any = getattr(now, "buffer", None)
    if type(getattr(before, "raw", before)) is io.FileIO:
        own: Any = _Stdout(now.fileno(), "wb", closefd=False)
        sys.stdout = io.TextIOWrapper(
            io.BufferedWriter(own) if hasattr(before, "raw") else own,  # without a buffer under PYTHONUNBUFFERED
            now.encoding, "replace", line_buffering=now.line_buffering, write_through=now.write_through,
        )  # fmt: skip
    shown: Any = VisibleStream(sys.stdout), VisibleStream(sys.stderr)
    sys.stdout, sys.stderr = shown


def _print_no_more() -> None:
    """Send standard output nowhere, so that the flush at the end of the interpreter stays silent."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def as_option(text: str, arguments: list[str]) -> str:
    """A sentence that begins with the name of an argument of a Python call, with that of the option that was given."""
    option = "--" + text.partition(":")[0].replace("_", "-")
    return f"--{text}" if option in (word.partition("=")[0] for word in arguments) else text


def sentence(error: Exception) -> str:
    """Message to the user about an error."""
    if isinstance(error, Unusual):
        return "\n".join(f"{line}; add --yes to run with it" for line in str(error).splitlines())
    for kind, text in LIMITS.items():
        if isinstance(error, kind):
            return text
    if not isinstance(error, OSError) or isinstance(error, WriteError):
        return str(error)
    file = error.filename2 or error.filename
    where = f"{file}: " if file else ""
    reason = (error.strerror or str(error)).lower()
    return f"{where}{reason}; check that the folder exists and is writable, or choose another path"
