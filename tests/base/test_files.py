"""Atomic file writes: complete or unchanged on full disks, missing folders, links and devices."""

import errno
import os
import pickle
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from fuzzing.disk import largest_file
from rotorsim.base.files import WriteError, left_behind, replacing, sweep, temporary, write_json, write_text
from rotorsim.base.hdf5 import write_netcdf


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_written_with_unix_line_ends_and_nothing_else_is_left(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "one\ntwo µm\n")
    assert (tmp_path / "a.txt").read_bytes() == "one\ntwo µm\n".encode()
    assert names(tmp_path) == ["a.txt"]


def test_a_full_disk_leaves_the_old_file_and_no_temporary_one(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    write_json(path, [1])
    with largest_file(1000), pytest.raises(WriteError) as raised:
        write_json(path, ["x" * 5000])
    assert path.read_text() == "[\n 1\n]\n"
    assert names(tmp_path) == ["a.json"]
    assert raised.value.errno == errno.EFBIG
    assert str(raised.value) == (
        f"{path}: cannot be written: it is larger than a file may be there; raise the limit (ulimit -f) or choose "
        "another place"
    )


def test_an_exception_in_the_block_leaves_the_old_file_and_is_not_changed(tmp_path: Path) -> None:
    write_text(tmp_path / "a", "old")
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path / "a") as part:
        part.write_text("half")
        raise KeyboardInterrupt
    with pytest.raises(FileNotFoundError, match="missing"), replacing(tmp_path / "a"):
        (tmp_path / "missing").read_text()
    assert names(tmp_path) == ["a"]
    assert (tmp_path / "a").read_text() == "old"


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        ("missing/a.txt", "its folder is not there; make the folder"),
        ("file/a.txt", "part of the path is a file"),
        ("folder", "it is a folder; choose the name of a file"),
        ("x" * 300, "the name is too long"),
        ("pipe", "it is not a file"),
    ],
)
def test_a_place_that_takes_no_file_is_named_with_reason_and_way_out(tmp_path: Path, place: str, reason: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(WriteError, match="cannot be written: ") as raised:
        write_text(tmp_path / place, "text")
    assert reason in str(raised.value)
    assert names(tmp_path) == ["file", "folder", "pipe"]


def test_a_device_is_not_replaced_by_a_file() -> None:
    with pytest.raises(WriteError, match="it is not a file"):
        write_text("/dev/full", "text")
    assert Path("/dev/full").is_char_device()


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").touch()
    (tmp_path / "link").symlink_to("real")
    write_text(tmp_path / "link", "text")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "text"


def test_the_longest_name_that_the_disk_takes_can_be_written(tmp_path: Path) -> None:
    write_text(tmp_path / ("x" * 255), "text")
    assert len(names(tmp_path)) == 1


def test_the_error_goes_from_process_to_process_as_it_is() -> None:
    error = WriteError(errno.ENOSPC, "cannot be written: the disk is full", "a.nc")
    copy = pickle.loads(pickle.dumps(error))
    assert (type(copy), str(copy), copy.errno) == (WriteError, str(error), errno.ENOSPC)


def test_what_a_killed_process_left_is_removed_and_what_a_living_one_writes_is_not(tmp_path: Path) -> None:
    code = (
        "import os, pathlib, signal; from rotorsim.base.files import replacing\n"
        f"with replacing(pathlib.Path({str(tmp_path)!r}) / 'a.nc') as part:\n"
        "    part.write_text('half'); os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", code], check=False)
    ours = temporary(tmp_path / "a.nc")
    ours.touch()
    (tmp_path / "a.nc.part").touch()
    left = left_behind(tmp_path)
    assert len(left) == 1
    assert sweep(tmp_path) == left
    assert names(tmp_path) == sorted([ours.name, "a.nc.part"])


def dataset() -> xr.Dataset:
    """Numbers and texts, some hundred kilobytes."""
    rng = np.random.default_rng(1)
    data = {"a": (("time", "axis"), rng.normal(size=(9000, 2))), "name": ("n", np.array(["x", "yy"]))}
    return xr.Dataset(data, {"axis": ["x", "y"]}, {"note": "µm"})


def test_a_netcdf_file_is_complete_or_not_there_wherever_the_disk_ends(tmp_path: Path) -> None:
    data, path = dataset(), tmp_path / "a.nc"
    write_netcdf(path, data)
    size, image = path.stat().st_size, path.read_bytes()
    for limit in [0, 1, 100, 2000, *range(4096, size, 17_000), size - 1]:
        with largest_file(limit), pytest.raises(WriteError, match="larger than a file may be"):
            write_netcdf(path, data)
        assert path.read_bytes() == image
        assert names(tmp_path) == ["a.nc"]
    with largest_file(size):
        write_netcdf(path, data)
    assert path.read_bytes() == image
    assert xr.load_dataset(path, engine="h5netcdf").identical(data)


def test_a_disk_that_ends_does_not_end_the_process_by_a_signal(tmp_path: Path) -> None:
    """libhdf5 crashes at the end of a process that has a file open which it could not flush."""
    code = (
        "import resource, signal, sys, numpy as np, xarray as xr; from rotorsim.base.hdf5 import write_netcdf\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN); resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, -1))\n"
        "try: write_netcdf(sys.argv[1], xr.Dataset({'a': ('t', np.zeros(100_000))}))\n"
        "except OSError as error: sys.exit(3)"
    )
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "a.nc"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (3, "")


def test_ctrl_c_while_a_netcdf_file_is_written_waits_for_its_end(tmp_path: Path) -> None:
    class Interrupting(xr.Dataset):
        __slots__ = ()

        def to_netcdf(self, *arguments: object, **options: object) -> None:  # type: ignore[override]
            os.kill(os.getpid(), signal.SIGINT)
            super().to_netcdf(*arguments, **options)  # type: ignore[call-overload]

    with pytest.raises(KeyboardInterrupt):
        write_netcdf(tmp_path / "a.nc", Interrupting({"a": ("t", np.zeros(9))}))
    assert xr.load_dataset(tmp_path / "a.nc", engine="h5netcdf").sizes["t"] == 9
    assert names(tmp_path) == ["a.nc"]


OWN = {
    "rotorsim/plant/calls.py", "rotorsim/base/public.py", "rotorsim/base/cache.py", "rotorsim/base/files.py",
    "rotorsim/base/references.py", "rotorsim/live/folder.py", "rotorsim/report/figure_files.py",
    "rotorsim/commands/results.py", "rotorsim/commands/options.py", "rotorsim/report/browser.py",
    "fmu/law_code.py", "fmu/model.py", "fmu/contents.py", "fmu/kernel_object.py", "identification/readers/hdf5.py",
}  # fmt: skip
"""Files that read what rotorsim wrote, or comes with it, or a text within a binary file."""


def test_texts_of_users_are_read_without_their_byte_order_mark():
    """Each place that reads UTF-8 either strips the mark or reads a text that no user edits."""
    root, plain = Path(__file__).parents[2], re.compile(r'(read_text|open|decode)\(.*"utf-8"')
    sources = [
        path for room in ("rotorsim", "identification", "fe_shaft", "fmu") for path in (root / room).rglob("*.py")
    ]
    assert len(sources) > 100
    found = {
        str(path.relative_to(root))
        for path in sources
        for line in path.read_text(encoding="utf-8").splitlines()
        if plain.search(line) and "files(" not in line and '"w"' not in line
    }
    assert found <= OWN


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems do not say whether a process has ended")
def test_the_file_of_a_killed_process_is_left_behind_before_its_parent_has_waited_for_it(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", "import time; print(1, flush=True); time.sleep(60)"],
                               stdout=subprocess.PIPE)  # fmt: skip
    process.stdout.readline()
    part = temporary(tmp_path / "a.nc")
    part = part.with_name(part.name.replace(f"-{os.getpid()}-", f"-{process.pid}-"))
    part.touch()
    assert left_behind(tmp_path) == []
    process.kill()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    assert left_behind(tmp_path) == [part]
    process.wait()
