"""Runs the command line in this process and checks the outcome that every command guarantees."""

import contextlib
import io
import json
import os
import signal
import tempfile
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import NoReturn

import numpy as np
import xarray as xr

from identification import validate
from rotorsim.cli import main

LIMIT = 600.0
"""Longest processor time [s] of one command: a hang and nothing less, so that a busy or slow computer fails nothing."""


@dataclass(frozen=True)
class Ended:
    """Exit code, what was printed, warnings."""

    code: int
    out: str
    err: str
    warned: tuple[str, ...]


@contextlib.contextmanager
def folder() -> Iterator[Path]:
    """A fresh current folder."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        try:
            yield Path(name)
        finally:
            os.chdir(before)


@contextlib.contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Fail after some seconds of work: compiled code when it returns, and LLVM when it is done, as it cannot be cut."""

    def stop(number: int, frame: FrameType | None) -> None:
        while frame is not None:
            if "/numba/" in frame.f_code.co_filename:
                return
            frame = frame.f_back
        raise AssertionError(f"longer than {seconds:g} s")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def command(arguments: Sequence[str], limit: float = LIMIT) -> Ended:
    """Run `rotorsim` with these arguments; streams are as strict about text as those of a terminal."""
    out = io.TextIOWrapper(io.BytesIO(), "utf-8", "strict", write_through=True)
    err = io.TextIOWrapper(io.BytesIO(), "utf-8", "backslashreplace", write_through=True)
    code = 0
    with (
        warnings.catch_warnings(record=True) as warned,
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        warnings.simplefilter("always")
        try:
            with time_limit(limit):
                main([*arguments, "--yes"])  # what is unusual is run, not questioned
        except SystemExit as error:
            code = error.code if isinstance(error.code, int) else int(error.code is not None)
    texts = [stream.buffer.getvalue().decode() for stream in (out, err)]  # type: ignore[attr-defined]
    return Ended(code, *texts, tuple(str(w.message) for w in warned))


def files() -> set[str]:
    """Everything below the current folder."""
    return {str(path) for path in Path().rglob("*")}


def checked(arguments: Sequence[str], codes: Sequence[int] = (0, 2), limit: float = LIMIT) -> Ended:
    """Run a command and check all that holds for every command."""
    before = files()
    ended = command(arguments, limit)
    added = files() - before
    assert ended.code in codes, (ended.code, ended.err)
    assert "Traceback" not in ended.err + ended.out, ended.err
    assert not ended.warned, ended.warned
    assert not [name for name in added if name.endswith((".part", ".tmp")) or "/." in f"/{name}"], added
    if ended.code == 2:
        assert ended.err.strip() and ended.err.strip() != "None", "an error without a sentence"
    return ended


def check_run(ended: Ended, arguments: Sequence[str], before: set[str]) -> None:
    """A run kept a whole record, or left nothing."""
    added = files() - before
    records = sorted(name for name in added if name.endswith(".nc"))
    if ended.code == 0 and "--help" not in arguments:
        assert len(records) == 1, added
    if not records:
        assert not added, f"left behind: {added}"
        return
    assert "what was simulated is in" in ended.err or ended.code == 0, ended.err
    check_record(Path(records[0]), complete=ended.code == 0)
    if "--json" in arguments:
        assert json.loads(ended.out, parse_constant=_refuse)["samples"] > 0


def check_record(path: Path, complete: bool) -> None:
    """A record opens, fits the schema, holds finite numbers and states how it ended."""
    with xr.open_dataset(path, engine="h5netcdf") as record:
        validate(record)
        for name, variable in record.variables.items():
            if variable.dtype.kind == "f":
                assert np.all(np.isfinite(variable.values)), f"{name} holds NaN or inf"
        for name, value in record.attrs.items():
            assert not isinstance(value, float) or np.isfinite(value), f"attribute {name} = {value}"
        assert (record.attrs["ended"] == "complete") == complete, record.attrs["ended"]


def _refuse(word: str) -> NoReturn:
    raise AssertionError(f"{word} in JSON")
