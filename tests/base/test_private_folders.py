"""Folders of what is executed: another user can neither fill nor replace them, nor block their owner."""

import json
import os
import shutil
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from rotorsim.base import cache
from rotorsim.base.cache import ROOT, OpenFolderError, in_cache, private_folder
from rotorsim.base.files import ORDER, Lock, _node, finish_sets, write_text

pytestmark = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="folders have no owner and mode there")
two_users = pytest.mark.skipif(
    getattr(os, "geteuid", lambda: 1)() != 0 or shutil.which("setpriv") is None,
    reason="needs a second user, hence root and setpriv",
)
US, OTHER = 61001, 61002
IN_CACHE = "from rotorsim.base.cache import in_cache; print(in_cache('plants'))"
MODULE = """
from rotorsim.plant.calls import load_module
made = load_module("planted", lambda: "value = 'ours'\\n")
print(made.value, made.__file__)
"""
KERNEL = """
from rotorsim.plant.calls import load_module
text = "from reynolds.jit import kernel\\n@kernel\\ndef twice(x):\\n    return 2.0 * x\\n"
import rotorsim.control.law_kernel
print(load_module("kernel_of_us", lambda: text).twice(3.0))
"""


@pytest.fixture
def shared():
    """A folder as that for temporary files, in which every user can make folders, and none remove another's."""
    folder = Path(tempfile.mkdtemp(prefix="two-users-", dir="/tmp"))
    folder.chmod(0o1777)
    yield folder
    shutil.rmtree(folder)


def as_user(uid, code, shared, cache_dir="/nowhere/at/all"):
    """Output lines and errors of Python code that another user runs, whose home takes nothing."""
    environment = {
        "PATH": os.environ["PATH"], "HOME": "/nowhere", "TMPDIR": str(shared), "ROTORSIM_CACHE_DIR": str(cache_dir),
        "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip
    reading = [f"--{which}-caps=+dac_read_search" for which in ("inh", "ambient")]  # of Python, in root's home
    user = ["setpriv", f"--reuid={uid}", f"--regid={uid}", "--clear-groups", *reading]
    done = subprocess.run(
        [*user, sys.executable, "-c", code], env=environment, cwd="/", text=True, capture_output=True
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.split(), done.stderr


def planted(shared):
    """A module of another user in a folder that anybody can write to; its value shows that it ran."""
    folder = shared / f"rotorsim-{US}"
    (folder / "plants").mkdir(parents=True)
    body = "value = 'theirs'\n"
    from rotorsim.plant.calls import CHECK

    (folder / "plants" / "planted.py").write_text(f"{body}{CHECK}{cache.key_of(body)}\n")
    for path in (folder, folder / "plants", folder / "plants" / "planted.py"):
        path.chmod(0o777)
        os.chown(path, OTHER, OTHER)


def link(shared):
    """A link of another user to a folder of theirs."""
    (shared / "theirs").mkdir(mode=0o777)
    os.chown(shared / "theirs", OTHER, OTHER)
    (shared / f"rotorsim-{US}").symlink_to(shared / "theirs")
    os.lchown(shared / f"rotorsim-{US}", OTHER, OTHER)


def file(shared):
    """A file of another user in the place of the folder."""
    (shared / f"rotorsim-{US}").touch()
    os.chown(shared / f"rotorsim-{US}", OTHER, OTHER)


def nothing(shared):
    """Nothing was prepared."""


@two_users
@pytest.mark.parametrize("prepare", [planted, link, file, nothing])
def test_another_user_neither_fills_nor_blocks_the_folder_of_temporary_files(shared, prepare):
    prepare(shared)
    (found,), warned = as_user(US, IN_CACHE, shared)
    folder = Path(found)
    assert folder.parent.parent == shared.resolve() and (folder.parent.name == f"rotorsim-{US}") == (prepare is nothing)
    assert warned.count("NoCache") == (0 if prepare is nothing else 1)
    if prepare is nothing:
        assert as_user(US, IN_CACHE, shared)[0] == [found], "it is kept for the next run"
        assert [stat.S_IMODE(one.stat().st_mode) for one in (folder, folder.parent)] == [0o700, 0o700]
    else:
        assert not folder.parent.exists(), "the folder of a process goes with it"


@two_users
def test_a_module_that_another_user_has_prepared_is_not_run(shared):
    planted(shared)
    assert as_user(US, MODULE, shared)[0][0] == "ours"


@two_users
def test_kernels_compile_where_no_folder_of_the_user_takes_any(shared):
    """The kernels of the identification asked numba for a folder, and its refusal was a traceback."""
    file(shared)
    assert as_user(US, KERNEL, shared)[0] == ["6.0"]


@two_users
@pytest.mark.parametrize("mode", [0o777, 0o775])
def test_a_cache_that_others_can_write_to_is_not_used(shared, mode):
    (shared / "cache").mkdir()
    (shared / "cache").chmod(mode)
    os.chown(shared / "cache", US, OTHER)
    (found,), _ = as_user(US, IN_CACHE, shared, shared / "cache")
    assert Path(found).parent == (shared / f"rotorsim-{US}").resolve()


def test_no_folder_on_the_way_may_be_replaced_by_others(tmp_path):
    open_one = tmp_path / "open"
    (open_one / "mine").mkdir(parents=True)
    assert private_folder(open_one / "mine") == (open_one / "mine").resolve()
    open_one.chmod(0o777)
    with pytest.raises(OpenFolderError, match="others can write to it"):
        private_folder(open_one / "mine")
    open_one.chmod(0o1777)  # sticky: what is ours stays
    assert private_folder(open_one / "mine" / "new") == (open_one / "mine" / "new").resolve()
    with pytest.raises(OpenFolderError):
        private_folder(open_one)


def test_a_folder_of_the_cache_is_closed_whatever_the_umask(tmp_path, monkeypatch):
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path / "a" / "b"))
    before = os.umask(0)
    try:
        found = in_cache("plants")
        assert {stat.S_IMODE(one.stat().st_mode) for one in (found, found.parent, found.parent.parent)} == {0o700}
        found.chmod(0o755)
        assert stat.S_IMODE(in_cache("plants").stat().st_mode) == 0o700
    finally:
        os.umask(before)


def test_a_lock_follows_no_link(tmp_path):
    """In a folder where all may write, a link in the place of the lock emptied the file that it led to."""
    (tmp_path / "precious").write_text("text")
    (tmp_path / ".run.lock").symlink_to(tmp_path / "precious")
    with pytest.raises(OSError), Lock(tmp_path / ".run.lock", "about"):
        pass
    assert (tmp_path / "precious").read_text() == "text"


def test_a_set_of_files_that_was_left_behind_removes_nothing_elsewhere(tmp_path):
    """Anybody can make a folder that looks like one, where all may write."""
    (tmp_path / "precious").write_text("text")
    out = tmp_path / "out"
    ready = out / f".results.{_node()}-999999999-0.complete.part"
    ready.mkdir(parents=True)
    up = ["../precious"]
    for order in ({"moved": [], "removed": up}, {"moved": up, "removed": []}, [1], {"moved": 1}):
        (ready / ORDER).write_text(json.dumps(order))
        finish_sets(out)
        assert (tmp_path / "precious").read_text() == "text"


@two_users
def test_a_result_is_not_written_through_the_link_of_another_user(tmp_path):
    (tmp_path / "precious").write_text("text")
    for name, owner in (("theirs", OTHER), ("ours", 0)):
        (tmp_path / name).symlink_to(tmp_path / "precious")
        os.lchown(tmp_path / name, owner, owner)
    write_text(tmp_path / "theirs", "a result")
    assert (tmp_path / "precious").read_text() == "text" and (tmp_path / "theirs").read_text() == "a result"
    write_text(tmp_path / "ours", "a result")
    assert (tmp_path / "precious").read_text() == "a result" and (tmp_path / "ours").is_symlink()


@pytest.mark.skipif(getattr(os, "geteuid", lambda: 1)() == 0, reason="root may write everywhere")
def test_a_cache_that_takes_nothing_gives_way_to_temporary_files(tmp_path, monkeypatch):
    (tmp_path / "cache").mkdir(mode=0o500)
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert in_cache("plants").parent == tmp_path.resolve() / f"rotorsim-{os.getuid()}"
