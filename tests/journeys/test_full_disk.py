"""Commands on a full disk: one sentence, exit code 2, simulated samples kept as far as they fit."""

import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import identification as idn

KB, MB = 1000, 1_000_000
RUNUP = ("runup", "plain_rotor", "--stop", "3000 rpm", "--out", "a")


def rotorsim(*arguments: str, cwd: Path, largest: int) -> subprocess.CompletedProcess[str]:
    """Run a command none of whose files may grow beyond `largest` [byte]."""
    return subprocess.run(
        [sys.executable, "-m", "rotorsim", *arguments], cwd=cwd, capture_output=True, text=True, check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest, resource.RLIM_INFINITY)),
    )  # fmt: skip


def sentences(done: subprocess.CompletedProcess[str]) -> list[str]:
    """Lines on stderr, but for that of compiling."""
    return [line for line in done.stderr.splitlines() if not line.startswith("compiling ")]


def names(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("megabytes", [1, pytest.param(5, marks=pytest.mark.slow)])
def test_a_run_keeps_what_fits(tmp_path: Path, megabytes: int) -> None:
    """The whole record has 6.7 MB; a fault of libhdf5 here ended the process with a segmentation fault."""
    done = rotorsim(*RUNUP, "--rate", "200 rpm/s", cwd=tmp_path, largest=megabytes * MB)
    assert done.returncode == 2
    assert len(sentences(done)) == 1
    assert "runup.nc: it is larger than a file may be there; " in done.stderr
    assert names(tmp_path) == ["a/runup.nc"]
    with xr.open_dataset(tmp_path / "a" / "runup.nc", engine="h5netcdf") as record:
        seconds = record.sizes["time"] * 2e-4
        assert f"; {seconds:.1f} s of 15.0 s are in it; " in done.stderr
        assert record.attrs["ended"] == "it is larger than a file may be there"
        assert (tmp_path / "a" / "runup.nc").stat().st_size > 0.85 * megabytes * MB
        assert np.all(np.diff(record["time"].values) > 0)


def test_a_run_that_leaves_nothing_leaves_nothing(tmp_path: Path) -> None:
    done = rotorsim(*RUNUP, "--rate", "3000 rpm/s", cwd=tmp_path, largest=20 * KB)
    assert (done.returncode, len(sentences(done))) == (2, 1)
    assert "a/runup.nc: cannot be written: it is larger" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_report_that_does_not_fit_leaves_its_record(tmp_path: Path) -> None:
    """A page holds the library of its figures and is larger than the record."""
    done = rotorsim(*RUNUP, "--rate", "3000 rpm/s", cwd=tmp_path, largest=2 * MB)
    assert (done.returncode, len(sentences(done))) == (2, 1)
    assert "a/report.html: cannot be written: it is larger" in done.stderr
    assert done.stderr.endswith("; the record is kept: a/runup.nc\n")
    assert names(tmp_path) == ["a/runup.nc"]


@pytest.mark.parametrize(
    "arguments",
    [
        ("machine", "new", "mine.toml"),
        ("data", "convert", "run.csv", "converted.nc"),
        *(
            pytest.param(words, marks=pytest.mark.slow)
            for words in (
                ("data", "convert", "run.csv", "converted.mat"),
                ("data", "convert", "run.nc", "converted.csv"),
                ("map", "plain_rotor", "--speed", "100 rpm:200 rpm:2", "--pressure", "0 MPa", "--out", "m"),
                ("modes", "plain_rotor", "--no-pictures", "--out", "modes"),
                ("campaign", "run", "plan.toml", "--workers", "1", "--out", "store"),
            )
        ),
    ],
)
def test_a_command_that_cannot_write_reports_it_in_one_sentence(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    record = idn.from_arrays(np.arange(900) / 5e3, np.ones((900, 2)), np.random.default_rng(1).normal(size=(900, 2)))
    for name in ("run.csv", "run.nc"):
        idn.save(record, tmp_path / name)
    (tmp_path / "plan.toml").write_text("machine = 'plain_rotor'\n[experiment]\nkind = 'steady'\nduration = '1 s'\n")
    before = names(tmp_path)
    done = rotorsim(*arguments, cwd=tmp_path, largest=KB)
    assert done.returncode == 2, done.stderr
    assert len(sentences(done)) == 1
    assert "cannot be written" in done.stderr
    assert not [name for name in names(tmp_path) if name not in before and not name.startswith("store/")]
    assert not [name for name in names(tmp_path) if name.endswith((".part", ".nc")) and name.startswith("store/")]
