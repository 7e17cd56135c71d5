"""Disk cache of kernels: one file per signature, concurrent processes, damaged files, full disks."""

import os

import numpy as np
import pytest

from rotorsim.base.cache import in_cache

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
    from rotorsim.plant.compose import load_module

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


@pytest.mark.parametrize("ending", [".nbi", ".nbc"])
def test_a_damaged_file_is_compiled_again_and_replaced(load, tmp_path, ending):
    load()(FLOATS)
    file = next(tmp_path.rglob(f"*{ending}"))
    os.truncate(file, 20)
    again = load()
    assert again(FLOATS) == 2.5 and again.stats.cache_misses
    last = load()
    assert last(FLOATS) == 2.5 and last.stats.cache_hits


def test_a_cache_that_takes_nothing_is_no_error(load, tmp_path, monkeypatch):
    kernel = load()
    monkeypatch.setattr(kernel._cache._cache_file, "_cache_path", str(tmp_path / "gone"))
    monkeypatch.setattr(kernel._cache._impl._locator, "_cache_path", "/dev/full/none")
    assert kernel(FLOATS) == 2.5
    assert in_cache("plants") == tmp_path / "plants"
