"""Stored numbers of every shipped machine, held to 1e-9 of each series' largest value.

Bits are compared by `compare_commits.py`: processors differ in the last digits of LAPACK, which grow to 4e-11 here
(OpenBLAS kernels Prescott against Haswell).
"""

import importlib.util
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).parent
TOLERANCE = 1e-9


@lru_cache
def script(name):
    """A script of this folder as a module."""
    spec = importlib.util.spec_from_file_location(name, HERE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def stored():
    with np.load(HERE / "stored_numbers.npz") as numbers:
        return {key: numbers[key] for key in numbers.files}


def deviation(found, expected):
    """Largest difference as a fraction of the largest stored value."""
    return float(np.abs(found - expected).max() / max(np.abs(expected).max(), 1e-300))


@pytest.mark.slow
def test_runs_and_linear_models_of_every_shipped_machine_have_the_stored_numbers(stored):
    found = dict(script("sampled_runs").stored())
    assert found.keys() == stored.keys()
    worst = {key: deviation(found[key], stored[key]) for key in stored if stored[key].size}
    assert {key: value for key, value in worst.items() if not value <= TOLERANCE} == {}


def test_the_stored_machines_are_all_shipped_ones_and_their_effects_the_whole_catalogue():
    from rotorsim.effects import REGISTRY
    from rotorsim.machine import shipped_machines

    assert {*script("sampled_runs").OWN, *script("sampled_runs").DESIGNS} == set(shipped_machines())
    assert set(script("sampled_runs").EVERY_EFFECT) == {
        name for name in REGISTRY if REGISTRY[name].__module__.startswith("rotorsim")
    }


def test_the_comparison_of_commits_names_a_single_changed_bit_and_what_is_missing_or_new():
    values = np.array([1.0, -0.0, 3.0])
    other = np.nextafter(values, 9.0)
    before = {"same": values, "changed": values, "gone": values, "shorter": values}
    after = {"same": values.copy(), "changed": other, "new": values, "shorter": values[:2]}
    lines = script("compare_commits").differences(before, after)
    assert [line.split(":")[0] for line in lines] == ["changed", "gone", "new", "shorter"]
    assert script("compare_commits").differences(before, before) == []
