"""Records streamed to disk: samples kept after full disks, removed folders and kills."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fuzzing.disk import largest_file
from rotorsim.base.files import WriteError
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.experiments import recording
from rotorsim.experiments.recording import CHUNK, Recording, add_attribute, duration, recover

BLOCKS, SAMPLES = 4, 5000
PATHS = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "support")]
"""Folders in which a child process finds this module and its imports."""


def block(number: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Samples of a run, the same each time."""
    rng, n = np.random.default_rng(number), SAMPLES
    values = {"disc": rng.normal(size=(n, 2)), "angle": rng.normal(size=n), "pin": rng.normal(size=(n, 4))}
    return (number * n + np.arange(n)) * RIG_SAMPLE, values


def recorded(path: Path, after: int | None = None) -> Recording:
    """A record of `BLOCKS` blocks, or of those that the disk takes; raises WriteError if it takes none."""
    with Recording(path, {"ended": "unfinished"}) as file:
        for number in range(BLOCKS):
            file.snapshot(number, 1.0, np.arange(8.0), np.arange(4.0), np.full((8, 4), 1e5))
            try:
                file.write(*block(number))
            except WriteError:
                break
        if file.stopped is None:
            file.note(ended="complete")
    return file


def assert_begins_as(record: xr.Dataset, whole: xr.Dataset) -> None:
    """All samples of a record are those of the whole one."""
    part = whole.isel(time=slice(record.sizes["time"]))
    for name in ("time", "disc", "angle", "pin"):
        assert np.array_equal(record[name].values, part[name].values)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """The record on a disk with room for it; its file's size is the attribute `size`."""
    path = tmp_path_factory.mktemp("whole") / "run.nc"
    recorded(path)
    data = xr.load_dataset(path, engine="h5netcdf")
    assert data.sizes["time"] == BLOCKS * SAMPLES
    assert data.attrs["ended"] == "complete"
    return data.assign_attrs(size=path.stat().st_size)


@pytest.mark.parametrize("share", [0.0, 0.005, 0.02, 0.05, 0.1, 0.2, 0.33, 0.5, 0.6, 0.7, 0.85, 0.95, 0.99, 0.999])
def test_a_disk_that_ends_keeps_what_fits_as_a_valid_record(tmp_path: Path, whole: xr.Dataset, share: float) -> None:
    path, limit = tmp_path / "new" / "run.nc", int(share * whole.attrs["size"])
    per_sample = 8 * (1 + 2 + 1 + 4)
    with largest_file(limit):
        try:
            file = recorded(path)
        except WriteError as error:
            assert error.reason == "it is larger than a file may be there"
            assert not path.parent.exists()
            assert limit < CHUNK * per_sample + 120_000
            return
    record = xr.load_dataset(path, engine="h5netcdf")
    assert record.sizes["time"] == file.samples >= (limit - 120_000) // per_sample // CHUNK * CHUNK
    assert record.attrs["ended"] == file.stopped.reason == "it is larger than a file may be there"
    assert_begins_as(record, whole)
    assert [p.name for p in path.parent.iterdir()] == ["run.nc"]


def test_small_blocks_on_a_disk_that_ends_are_kept_too(tmp_path: Path, whole: xr.Dataset) -> None:
    """As the live rig writes them."""
    path = tmp_path / "run.nc"
    with largest_file(whole.attrs["size"] // 2), Recording(path, {}) as file, pytest.raises(WriteError):
        for number in range(BLOCKS):
            time, values = block(number)
            for start in range(0, SAMPLES, 37):
                part = slice(start, start + 37)
                file.write(time[part], {name: value[part] for name, value in values.items()})
    record = xr.load_dataset(path, engine="h5netcdf")
    assert record.sizes["time"] >= 0.4 * BLOCKS * SAMPLES
    assert_begins_as(record, whole)


def test_an_attribute_that_does_not_fit_leaves_the_record_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "run.nc"
    recorded(path)
    before = path.read_bytes()
    for size in (len(before) // 2, len(before) + 100):
        with largest_file(size), pytest.raises(WriteError) as caught:
            add_attribute(path, "stated", "a sentence")
        assert Path(caught.value.filename) == path
        assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
    add_attribute(path, "stated", "a sentence")
    with xr.open_dataset(path, engine="h5netcdf") as record:
        assert record.attrs == {"ended": "complete", "stated": "a sentence"}
        assert record.sizes["time"] == BLOCKS * SAMPLES


def test_a_disk_that_ends_leaves_the_process_alive_and_silent(tmp_path: Path) -> None:
    code = (
        "import resource, signal, sys; from pathlib import Path; sys.path[:0] = sys.argv[2:]\n"
        "from test_recording import recorded\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN); resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, -1))\n"
        "print(recorded(Path(sys.argv[1])).samples)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, tmp_path / "run.nc", *PATHS], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert int(done.stdout) > 5000


def test_a_folder_that_is_removed_ends_the_record_which_is_kept_in_a_new_folder(
    tmp_path: Path, whole: xr.Dataset
) -> None:
    path = tmp_path / "new" / "run.nc"
    with Recording(path, {}) as file:
        file.write(*block(0))
        shutil.rmtree(path.parent)
        with pytest.raises(WriteError, match="was removed while it was written"):
            file.write(*block(1))
    record = xr.load_dataset(path, engine="h5netcdf")
    assert record.sizes["time"] == 2 * SAMPLES
    assert_begins_as(record, whole)


def test_a_folder_that_is_removed_in_the_last_block_is_made_again(tmp_path: Path) -> None:
    path = tmp_path / "new" / "run.nc"
    with Recording(path, {}) as file:
        file.write(*block(0))
        file.write(*(part[:10] if isinstance(part, np.ndarray) else {k: v[:10] for k, v in part.items()}
                     for part in block(1)))  # fmt: skip
        shutil.rmtree(path.parent)
    assert xr.load_dataset(path, engine="h5netcdf").sizes["time"] == SAMPLES + 10


@pytest.mark.parametrize("place", ["file/run.nc", "folder.nc", "pipe"])
def test_a_place_that_takes_no_record_is_refused_before_anything_is_simulated(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder.nc").mkdir()
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(WriteError, match=f"{place.split('/')[0]}.*: cannot be written: .*; choose"):
        Recording(tmp_path / place, {})
    assert len(list(tmp_path.iterdir())) == 3


KILLED = """
import os, signal, sys, threading
from pathlib import Path
sys.path[:0] = sys.argv[3:]
from test_recording import block
from rotorsim.experiments import recording
from rotorsim.experiments.recording import Recording
recording.FLUSH = 0.0
with Recording(Path(sys.argv[1]), {"ended": "unfinished", "sample_rate_hz": 5000.0}) as file:
    for number in range(int(sys.argv[2])):
        file.write(*block(number))
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("blocks", [0, 1, 3])
def test_a_killed_run_leaves_nothing_under_its_name_and_what_was_flushed_comes_back(
    tmp_path: Path, whole: xr.Dataset, blocks: int
) -> None:
    killed = subprocess.run([sys.executable, "-c", KILLED, tmp_path / "run.nc", str(blocks), *PATHS], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert not (tmp_path / "run.nc").exists()
    found = recover(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["run-killed.nc"][: min(blocks, 1)]
    assert found == [(tmp_path / "run-killed.nc", blocks * SAMPLES)][: min(blocks, 1)]
    if blocks:
        record = xr.load_dataset(tmp_path / "run-killed.nc", engine="h5netcdf")
        assert record.sizes["time"] == blocks * SAMPLES
        assert record.attrs["ended"] == "killed"
        assert duration(tmp_path / "run-killed.nc") == pytest.approx(blocks * SAMPLES / 5000.0)
        assert_begins_as(record, whole)


def test_a_kill_between_two_flushes_costs_what_was_recorded_since_the_first(
    tmp_path: Path, whole: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording, "FLUSH", 0.0)
    with Recording(tmp_path / "run.nc", {}) as file:
        file.write(*block(0))
        monkeypatch.setattr(recording, "FLUSH", np.inf)
        file.write(*block(1))
        (growing,) = tmp_path.iterdir()
        shutil.copy(growing, tmp_path / "killed.nc")
    record = xr.load_dataset(tmp_path / "killed.nc", engine="h5netcdf")
    assert record.sizes["time"] == SAMPLES
    assert_begins_as(record, whole)


def test_a_second_killed_run_does_not_replace_the_first(tmp_path: Path) -> None:
    for _ in range(2):
        subprocess.run([sys.executable, "-c", KILLED, tmp_path / "run.nc", "1", *PATHS], check=False)
        recover(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run-killed-2.nc", "run-killed.nc"]


def test_a_record_that_still_grows_is_left_alone(tmp_path: Path) -> None:
    with Recording(tmp_path / "run.nc", {}) as file:
        file.write(*block(0))
        assert recover(tmp_path) == []
    assert (tmp_path / "run.nc").exists()
