"""Sets of files: replaced completely or not at all after interrupts and kills."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from fuzzing.disk import largest_file
from rotorsim.base.files import WriteError, finish_sets, replacing_all, sweep, write_text

NAMES = ("gap", "machine", "verdict")
OLD, NEW = dict.fromkeys(NAMES, "old"), {"gap": "new", "verdict": "new"}
KILLED = """
import os, signal, sys
from pathlib import Path
from rotorsim.base.files import replacing_all
left, own = int(sys.argv[2]), dict.fromkeys(("rename", "replace", "unlink"))
def counted(name, call):
    def counting(*arguments, **options):
        global left
        result = call(*arguments, **options)
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return result
    return counting
with replacing_all(sys.argv[1], ("gap", "machine", "verdict")) as part:
    for name in ("gap", "verdict"):
        (part / name).write_text("new")
    for name in own:
        setattr(os, name, counted(name, getattr(os, name)))
    Path.unlink = counted("unlink", Path.unlink)
"""


def names(folder: Path) -> list[str]:
    """Names of all that is in a folder."""
    return sorted(path.name for path in folder.iterdir())


def contents(folder: Path) -> dict[str, str]:
    """Texts of the files that are not temporary."""
    return {path.name: path.read_text() for path in folder.iterdir() if not path.name.startswith(".")}


def test_a_set_of_files_is_replaced_as_a_whole_or_not_at_all(tmp_path: Path) -> None:
    for new in ("new", "newer"):
        with replacing_all(tmp_path / "out") as part:
            write_text(part / "a.txt", new)
            write_text(part / "b.txt", new)
    with pytest.raises(WriteError) as raised, largest_file(1000), replacing_all(tmp_path / "out") as part:
        write_text(part / "a.txt", "newest")
        write_text(part / "b.txt", "x" * 5000)
    assert raised.value.filename == str(tmp_path / "out" / "b.txt")
    assert names(tmp_path / "out") == ["a.txt", "b.txt"]
    assert {(tmp_path / "out" / name).read_text() for name in ("a.txt", "b.txt")} == {"newer"}


def test_a_folder_that_was_made_for_a_set_of_files_goes_with_it(tmp_path: Path) -> None:
    with pytest.raises(WriteError), largest_file(1000), replacing_all(tmp_path / "out") as part:
        write_text(part / "a.txt", "x" * 5000)
    assert names(tmp_path) == []


@pytest.mark.skipif(sys.platform == "win32", reason="kills by a signal of POSIX")
@pytest.mark.parametrize("calls", range(1, 8))
def test_a_set_whose_writer_is_killed_is_the_old_one_the_new_one_or_not_taken_for_one(tmp_path, calls):
    """Killed after each change of a name; the verdict is there only with all that belongs to it."""
    for name in NAMES:
        (tmp_path / name).write_text("old")
    done = subprocess.run([sys.executable, "-c", KILLED, tmp_path, str(calls)], capture_output=True, text=True)
    assert done.returncode in (-signal.SIGKILL, 0), done.stderr
    found = contents(tmp_path)
    assert found in (OLD, NEW) or "verdict" not in found
    finish_sets(tmp_path)
    sweep(tmp_path)
    assert contents(tmp_path) in (OLD, NEW)
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_ctrl_c_during_the_move_comes_too_late(tmp_path, monkeypatch):
    replace = os.replace

    def interrupting(source, target):
        if target == tmp_path / "a":
            signal.raise_signal(signal.SIGINT)
        replace(source, target)

    with replacing_all(tmp_path) as part:
        write_text(part / "a", "new")
        monkeypatch.setattr(os, "replace", interrupting)
    monkeypatch.undo()
    assert contents(tmp_path) == {"a": "new"} and len(list(tmp_path.iterdir())) == 1
