"""Fixtures of the data tests: a small record and run-up vectors."""

import sys
from pathlib import Path

import numpy as np
import pytest

import identification as idn

sys.path.insert(0, str(Path(__file__).parent))  # for what test_ident_rates.py has for another test file


@pytest.fixture
def record():
    n = 200
    rng = np.random.default_rng(1)
    return idn.from_arrays(
        np.arange(n) / 5000,
        rng.normal(size=(n, 2)),
        rng.normal(size=(n, 2)) * 1e-6,
        angle=np.arange(n) * 0.02,
        pin=rng.normal(size=(n, 4)) * 1e-6,
        speed=100.0,
        pressure=3e5,
        attrs={"machine": 'a = "b"\nµ', "seed": 3, "scale": 0.1},
    )


@pytest.fixture
def vectors():
    rng = np.random.default_rng(2)
    speed = np.linspace(10.0, 500.0, 7)
    return idn.make_vectors(
        speed, rng.random((7, 3, 2)) * 1e-5, rng.normal(size=(7, 3, 2)), orders=(1, 2, 3), attrs={"rig": "A"}
    )


@pytest.fixture
def written(tmp_path):
    """Write bytes or text to a file of the test."""

    def write(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write
