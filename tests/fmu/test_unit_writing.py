"""Interrupted exports: full and read-only disks, Ctrl-C; one sentence and no partial file."""

import os
import signal
import subprocess
import sys
from contextlib import contextmanager

import pytest
from law_models import scheduled_law
from lpv_models import make_lpv

from rotorsim.base.errors import DataError
from rotorsim.cli import main
from waiting import until

CLI = [sys.executable, "-m", "rotorsim", "fmu"]


@contextmanager
def disk(folder, options):
    """A small disk mounted at a folder, for as long as the block lasts."""
    folder.mkdir(exist_ok=True)
    if subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", folder], capture_output=True).returncode:
        pytest.skip("mounting a tmpfs is not permitted here")
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", folder], check=True)


@pytest.fixture
def lpv(gcc, tmp_path):
    """Return the file of an identified model, which is exported within a second."""
    make_lpv("3").save(tmp_path / "lpv.json")
    return tmp_path / "lpv.json"


def ended(*arguments, **environment):
    """Return code and stderr of a command in a process of its own."""
    words = [*CLI, *map(str, arguments)]
    done = subprocess.run(words, capture_output=True, text=True, env=os.environ | environment)
    assert "Traceback" not in done.stderr
    return done.returncode, done.stderr.strip()


def files(folder):
    """Return the names of all files below a folder."""
    return sorted(path.name for path in folder.rglob("*"))


def test_a_full_disk_leaves_no_unit_and_reports_it(lpv, tmp_path):
    with disk(tmp_path / "disk", "size=20k") as folder:
        code, message = ended("export", "--model", lpv, "--out", folder / "unit.fmu")
        assert files(folder) == []
    assert code == 2 and message.startswith(f"{folder / 'unit.fmu'}: cannot be written: the disk is full")
    assert len(message.splitlines()) == 1


@pytest.mark.slow
def test_a_full_disk_leaves_the_unit_that_was_there(lpv, tmp_path):
    with disk(tmp_path / "disk", "size=20k") as folder:
        (folder / "unit.fmu").write_bytes(b"an older unit")
        code, message = ended("export", "--model", lpv, "--out", folder / "unit.fmu", "--force")
        assert "the disk is full" in message
        assert code == 2 and (folder / "unit.fmu").read_bytes() == b"an older unit" and len(files(folder)) == 1


@pytest.mark.parametrize("size", ["60k", *(pytest.param(size, marks=pytest.mark.slow) for size in ("4k", "120k"))])
def test_a_full_disk_of_temporary_files_is_named(lpv, tmp_path, size):
    with disk(tmp_path / "disk", f"size={size}") as folder:
        code, message = ended("export", "--model", lpv, "--out", tmp_path / "unit.fmu", TMPDIR=str(folder))
        assert files(folder) == []
    assert code == 2 and len(message.splitlines()) == 1 and not (tmp_path / "unit.fmu").exists()
    assert "temporary files cannot be written" in message or "No space left" in message


@pytest.mark.slow
def test_a_full_disk_of_temporary_files_is_not_blamed_on_the_unit(files_of_plant, tmp_path):
    with disk(tmp_path / "disk", "size=40k") as folder:
        code, message = ended("check", files_of_plant, TMPDIR=str(folder))
        assert files(folder) == []
    assert code == 2 and "temporary files cannot be written: no space left on device" in message


@pytest.fixture
def files_of_plant(files):
    """Return the plant's unit of FMI 3.0."""
    return files[3]


@pytest.mark.parametrize("command", ["export", "system"])
def test_a_read_only_disk_is_refused_before_anything_is_compiled(command, tmp_path, capsys, monkeypatch):
    """Compiling would end in another sentence."""
    for home in ("fmu.kernel_object._compile", "rotorsim.plant.simulation.settle"):
        monkeypatch.setattr(home, lambda *_: pytest.fail("compiled"))
    scheduled_law().save(tmp_path / "law.json")
    words = ["export", "--grid", "20x8"] if command == "export" else ["system", str(tmp_path / "law.json")]
    with disk(tmp_path / "disk", "size=1m,ro") as folder, pytest.raises(SystemExit) as refused:
        main(["fmu", *words, "--out", str(folder / "new.fmu")])
    assert refused.value.code == 2
    message = f"{folder / 'new.fmu'}: cannot be written: the disk is read-only; choose another place"
    assert capsys.readouterr().err.strip() == message


def child_of(process):
    """Return whether a process has a child that compiles the kernels."""
    found = subprocess.run(["ps", "--ppid", str(process.pid), "-o", "args="], capture_output=True, text=True).stdout
    return "fmu.kernel_object" in found


def test_compiling_is_announced_once_nothing_else_forbids_the_export(model, files, tmp_path, monkeypatch):
    from fmu import export as exporting, kernel_object
    from fmu.export import COMPILING, choose, export

    received = []
    export(model, tmp_path / "kept.fmu", (3,), choose("host"), announce=received.append)
    assert received == []

    class StoppedError(Exception):
        """Raised in place of the compiler, which would take a minute."""

    def stop(*arguments):
        raise StoppedError

    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path / "empty"))
    monkeypatch.setattr(kernel_object, "_compile", stop)
    with pytest.raises(DataError):
        export(model, tmp_path / "no folder" / "new.fmu", (3,), choose("host"), announce=received.append)
    monkeypatch.setattr(exporting.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(DataError, match="need zig"):
        export(model, tmp_path / "new.fmu", (3,), choose("host,x86_64-windows"), announce=received.append)
    assert received == []
    monkeypatch.undo()
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path / "empty"))
    monkeypatch.setattr(kernel_object, "_compile", stop)
    with pytest.raises(StoppedError):
        export(model, tmp_path / "new.fmu", (3,), choose("host"), announce=received.append)
    assert received == [COMPILING]


@pytest.mark.parametrize(
    "whole_group", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["terminal", "process"]
)
def test_ctrl_c_while_kernels_compile_ends_at_once_and_leaves_nothing(gcc, tmp_path, whole_group):
    (tmp_path / "tmp").mkdir()
    (tmp_path / "out").mkdir()
    words = [*CLI, "export", "--grid", "20x8", "--out", str(tmp_path / "out" / "unit.fmu")]
    environment = os.environ | {"TMPDIR": str(tmp_path / "tmp"), "ROTORSIM_CACHE_DIR": str(tmp_path / "cache")}
    pipe = subprocess.PIPE
    process = subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True, env=environment, start_new_session=True)
    until(lambda: child_of(process), process)
    (os.killpg if whole_group else os.kill)(process.pid, signal.SIGINT)
    _, message = process.communicate()
    assert process.returncode == 130 and "Traceback" not in message
    assert message.splitlines()[-1].startswith("interrupted") and len(message.splitlines()) <= 2
    assert files(tmp_path / "out") == files(tmp_path / "tmp") == []
    left = subprocess.run(["ps", "-s", str(process.pid), "-o", "stat="], capture_output=True, text=True).stdout
    assert all(state.startswith("Z") for state in left.split())
