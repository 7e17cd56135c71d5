"""Checks after a fault: exit code, messages and files."""

import csv
import json
import re
import sqlite3
import tomllib
import zipfile
from collections.abc import Callable, Iterable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.io
import xarray as xr

from fault_injection.running import Ended

SAMPLE = 2e-4
"""Time [s] of a sample."""
SENTENCES = 3
"""Most lines on stderr."""
TRACES = ("Traceback", "Exception ignored", "Fatal Python error", "Error in atexit")
CRASHES = (-11, -7, -6, -4, 139, 134)
KINDS = ("traceback", "segfault", "lost", "half", "other")


@dataclass(frozen=True)
class Fault:
    """Something that must not be; its kind is one of `KINDS`."""

    kind: str
    text: str


def messages(ended: Ended, codes: Iterable[int]) -> list[Fault]:
    """Faults of exit code and stderr."""
    found, err = [], ended.stderr
    if any(trace in err for trace in TRACES) and not before_us(err):
        found.append(Fault("traceback", err[-1500:]))
    if ended.code in CRASHES or "Segmentation" in err:
        found.append(Fault("segfault", f"code {ended.code}: {err[-500:]}"))
    elif ended.code not in codes and not before_us(err):
        found.append(Fault("other", f"code {ended.code}, not of {sorted(codes)}: {err[-800:]}"))
    if len(sentences(err)) > SENTENCES and not before_us(err):
        found.append(Fault("other", f"{len(sentences(err))} lines: {err[:500]}"))
    return found + [Fault("other", f"lives on: {one}") for one in ended.left]


def before_us(err: str) -> bool:
    """Whether Ctrl-C met the interpreter before it ran anything of ours."""
    return "KeyboardInterrupt" in err and not any(f"/{name}/" in err for name in ("rotorsim", "reynolds", "fmu"))


def sentences(err: str) -> list[str]:
    """Lines on stderr but for those on compiling."""
    return [line for line in err.splitlines() if line.strip() and not line.startswith("compiling the ")]


def files(folder: Path, reference: Path) -> list[Fault]:
    """Files under their own names that are not whole, or hold other numbers than those of an undisturbed run."""
    found = []
    for path in sorted(folder.rglob("*")):
        if path.is_file() and not any(part.startswith(".") for part in path.relative_to(folder).parts):
            if "parts" in path.relative_to(folder).parts:
                continue  # of a campaign: they are removed or replaced
            try:
                WHOLE.get(path.suffix, _anything)(path)
                _compare(path, reference / path.relative_to(folder))
            except Exception as error:
                found.append(Fault("half", f"{path.name}: {type(error).__name__}: {str(error)[:300]}"))
    return found


def _html(path: Path) -> None:
    assert path.read_text(encoding="utf-8").rstrip().endswith("</html>")


def _netcdf(path: Path) -> None:
    with xr.open_dataset(path, engine="h5netcdf") as data:
        data.load()
        if "time" in data.dims and "experiment" in data.attrs:
            time = data["time"].values
            assert len(time) > 1 and np.allclose(np.diff(time), SAMPLE, atol=1e-9), "times are not contiguous"
            assert not any(np.isnan(data[n].values).any() for n in data.data_vars if data[n].dims[:1] == ("time",))


def _zip(path: Path) -> None:
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None and archive.namelist()


def _csv(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    table = [line for line in text.splitlines() if not line.startswith("#")]  # a record's has a head
    assert text.endswith("\n") and len({len(row) for row in csv.reader(table)}) == 1


def _sqlite(path: Path) -> None:
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as db:
        assert db.execute("PRAGMA integrity_check").fetchone() == ("ok",)


def _anything(path: Path) -> None:
    pass


WHOLE: dict[str, Callable[[Path], object]] = {
    ".nc": _netcdf, ".html": _html, ".fmu": _zip, ".ssp": _zip, ".csv": _csv, ".sqlite": _sqlite,
    ".json": lambda path: json.loads(path.read_text(encoding="utf-8")),
    ".toml": lambda path: tomllib.loads(path.read_text(encoding="utf-8")),
    ".mat": scipy.io.loadmat,
}  # fmt: skip


def _compare(path: Path, reference: Path) -> None:
    """Records and tables against an undisturbed run: an interrupted record is its beginning, bit by bit."""
    reference = reference.with_name(re.sub(r"-killed(-\d+)?(?=\.nc$)", "", reference.name))
    if path.suffix == ".csv":
        assert not reference.exists() or len(path.read_bytes()) == len(reference.read_bytes())
    if path.suffix != ".nc" or not reference.exists():
        return
    with xr.open_dataset(path, engine="h5netcdf") as got, xr.open_dataset(reference, engine="h5netcdf") as wanted:
        assert set(got.data_vars) == set(wanted.data_vars) or "ended" in got.attrs, "variables are missing"
        n = {dim: size for dim, size in got.sizes.items() if dim in ("time", "snapshot")}
        first = wanted.isel({dim: slice(size) for dim, size in n.items()})
        for name in got.data_vars:
            np.testing.assert_array_equal(got[name].values, first[name].values, err_msg=str(name))


def reported_length(ended: Ended, record: Path) -> list[Fault]:
    """A record that was cut: as long as the message states, to its last digit."""
    reported = re.search(r"(\d+\.\d) s of \d+\.\d s are in", ended.stderr)
    if reported is None:
        return []
    if not record.exists():
        return [Fault("lost", f"not there: {ended.stderr}")]
    with xr.open_dataset(record, engine="h5netcdf") as data:
        kept = data.sizes["time"] * SAMPLE
    return [] if f"{kept:.1f}" == reported[1] else [Fault("lost", f"{kept:.1f} s are kept: {ended.stderr}")]


def samples(record: Path) -> int:
    """Samples in a record."""
    with xr.open_dataset(record, engine="h5netcdf") as data:
        return int(data.sizes["time"])


def left_over(folder: Path) -> list[Fault]:
    """Temporary files and locks that are there after a run to the end."""
    stray = [path.name for path in folder.rglob(".*") if path.name.endswith((".part", ".lock", ".tmp"))]
    return [Fault("other", f"left over: {stray}")] if stray else []
