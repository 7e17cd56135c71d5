"""Disk cache of kernels: one file per signature, concurrent processes, damaged files, full disks."""

import os
import threading

import numpy as np
import pytest
from numba.core import config

from reynolds.jit import cache_digest
from rotorsim.base.cache import in_cache
from rotorsim.plant.compose import is_kept

SOURCE = """
from reynolds.jit import kernel


@kernel
def largest(values):
    found = values[0]
    for value in values:
        found = max(found, value)
    return found
"""


@pytest.fixture
def load(tmp_path, monkeypatch):
    """The kernel as a new process would load it."""
    from rotorsim.plant.calls import load_module

    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))

    def fresh():
        import sys

        sys.modules.pop("kernel_of_a_test", None)
        return load_module("kernel_of_a_test", lambda: SOURCE).largest

    return fresh


FLOATS, COUNTS = np.array([1.5, 2.5]), np.array([4, 3])


def test_a_kernel_is_compiled_once_for_each_signature(load):
    assert (load()(FLOATS), load()(COUNTS)) == (2.5, 4)
    again = load()
    assert (again(FLOATS), again(COUNTS)) == (2.5, 4)
    assert sum(again.stats.cache_hits.values()) == 2 and not again.stats.cache_misses


def test_processes_that_compile_at_once_never_take_each_others_code(load, tmp_path):
    """Both read the index while it is empty; what is written last must not be found under the other's signature."""
    load()(FLOATS)
    index = next(tmp_path.rglob("*.nbi"))
    first = index.read_bytes()
    index.unlink()
    load()(COUNTS)
    index.write_bytes(first)
    again = load()
    assert (again(FLOATS), again(COUNTS)) == (2.5, 4)


def _cut(file):
    os.truncate(file, 20)


def _one_bit(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


@pytest.mark.parametrize(("ending", "damage"), [(".nbi", _cut), (".nbc", _cut), (".nbc", _one_bit)])
def test_a_damaged_file_is_compiled_again_and_replaced(load, tmp_path, ending, damage):
    load()(FLOATS)
    assert is_kept(load())
    damage(next(tmp_path.rglob(f"*{ending}")))
    again = load()
    assert not is_kept(again)
    assert again(FLOATS) == 2.5 and again.stats.cache_misses
    last = load()
    assert last(FLOATS) == 2.5 and last.stats.cache_hits


def test_code_of_another_processor_is_not_run(load, monkeypatch):
    """A home folder that several computers share: each compiles for itself, and finds its own code again."""
    load()(FLOATS)
    monkeypatch.setattr(config, "CPU_NAME", "generic")
    monkeypatch.setattr(config, "CPU_FEATURES", "")
    for misses in (1, 0):
        kernel = load()
        assert is_kept(kernel) == (not misses)
        assert kernel(FLOATS) == 2.5 and sum(kernel.stats.cache_misses.values()) == misses


def test_a_cache_that_takes_nothing_is_no_error(load, tmp_path, monkeypatch):
    kernel = load()
    monkeypatch.setattr(kernel._cache._cache_file, "_cache_path", str(tmp_path / "gone"))
    monkeypatch.setattr(kernel._cache._impl._locator, "_cache_path", "/dev/full/none")
    assert kernel(FLOATS) == 2.5
    assert in_cache("plants") == tmp_path / "plants"


def test_a_line_that_moves_to_another_file_gives_another_cache(tmp_path):
    """The sources have the same text one after the other, cut at another place."""
    first, second = tmp_path / "first.py", tmp_path / "second.py"
    found = set()
    for texts in (("a = 1\nb = 2\n", "c = 3\n"), ("a = 1\n", "b = 2\nc = 3\n"), ("", "a = 1\nb = 2\nc = 3\n")):
        first.write_text(texts[0])
        second.write_text(texts[1])
        found.add(cache_digest([first, second]))
    third = second.rename(tmp_path / "third.py")
    assert len(found | {cache_digest([first, third])}) == 4


def test_a_kernel_is_compiled_where_the_system_allows_no_thread(load, monkeypatch):
    def refuse(_):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    assert load()(FLOATS) == 2.5
