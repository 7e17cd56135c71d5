"""Kernels: allocation refused at compile time, compiled and plain Python results equal."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from numba.core.errors import TypingError

from reynolds.grid import cells
from reynolds.jit import inlined, kernel
from reynolds.newton import find_scales
from reynolds.residual import jacobian
from reynolds.ring import invert_block
from reynolds.vectors import exceed, invert_two

SCRIPT = """
import json
from reynolds import GasBearing, Injector
film = GasBearing(0.02, 0.04, 25e-6, injectors=(Injector(1.5707963267948966),), n_theta=8, n_z=4)
steady = film.steady((3e-6, -2e-6), 300.0, 4e5)
k = film.coefficients((3e-6, -2e-6), 300.0, 500.0, 4e5)
march = film.march(lambda t: (3e-6 + 1e-3 * t, -2e-6), 5e-4, 1e-4, 300.0, 4e5)
answers = (steady.force, steady.plenum, k.K.ravel(), march.force.ravel())
print(json.dumps([answer.tolist() for answer in answers]))
"""


def run(**environment):
    """Flat numbers of the script in a fresh interpreter."""
    env = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))} | environment
    done = subprocess.run([sys.executable, "-c", SCRIPT], env=env, capture_output=True, text=True, check=True)
    return np.concatenate(json.loads(done.stdout))


@pytest.mark.slow
def test_kernels_in_plain_python_give_the_compiled_numbers():
    """The same operations, rounded in another order: 1e-9 is the tolerance of the march."""
    assert run(NUMBA_DISABLE_JIT="1") == pytest.approx(run(), rel=1e-9)


def test_kernel_that_allocates_does_not_compile(tmp_path, monkeypatch):
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))

    @kernel
    def allocating(n):
        return np.zeros(n).sum()

    with pytest.raises(TypingError, match="function zeros"):
        allocating(3)


def test_kernel_that_does_not_allocate_compiles(tmp_path, monkeypatch):
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))

    @kernel
    def harmless(w):
        w[0] += 1.0
        return w[0]

    assert harmless(np.zeros(3)) == 1.0


def test_a_building_block_that_python_calls_compiles_the_kernels_that_it_calls(tmp_path, monkeypatch):
    monkeypatch.setenv("ROTORSIM_CACHE_DIR", str(tmp_path))

    @kernel
    def inner(w):
        w[0] += 1.0
        return w[0]

    @inlined
    def outer(w):
        return inner(w)

    assert outer(np.zeros(3)) == 1.0


@pytest.mark.parametrize("n", [2, 4, 6, 8, 12, 15, 16])
def test_the_inverse_of_a_block_is_its_inverse_in_lanes_of_any_width(n):
    """Blocks as films and shafts have them; lanes of eight, of four and what is left over."""
    block = np.random.default_rng(n).uniform(-1.0, 1.0, (n, n)) + 2.0 * n * np.eye(n)
    w = np.concatenate([[np.nan] * 8, block.T.ravel(), [np.nan] * 8])
    invert_block(w, 8, n)
    found = w[8:-8].reshape(n, n).T
    assert found == pytest.approx(np.linalg.inv(block), rel=1e-13, abs=1e-15)
    assert np.isnan(w[:8]).all()
    assert np.isnan(w[-8:]).all()
    two = np.concatenate([w[:8], block.T.ravel(), 2.0 * block.T.ravel(), w[:8]])
    invert_two(two, 8, 8 + n * n, n)
    assert two[8 : 8 + n * n].tobytes() == w[8:-8].tobytes()
    assert two[8 + n * n : -8] == pytest.approx(0.5 * w[8:-8], rel=1e-14)
    assert np.isnan(two[:8]).all() and np.isnan(two[-8:]).all()


def test_one_large_value_is_found_wherever_it_stands_and_no_other():
    """Lanes of eight, of four and single values; values outside do not count, nor does the limit itself."""
    for n in range(1, 22):
        for place in range(-1, n + 1):
            w = np.full(n + 2, 1e-3)
            w[1 + place] = -2e-3 if place % 2 else 2e-3
            assert exceed(w, 1, n, 1e-3) == (0 <= place < n), (n, place)


@pytest.mark.parametrize("speed", [0.0, 3e4])
def test_rows_are_scaled_by_the_diagonal_of_the_jacobian_then_over_that_of_now(plain, speed):
    """Uniform films of two pressures and gaps: to round-off, at rest and where the shear flow is upwind."""
    bearing = plain(n_theta=16, n_z=8)
    (L, w, _), F, iadt = bearing.model.build(), bearing.model.record()[0], 2e4
    k, diagonals = cells(L), []
    for p, h in ((1.4e5, 20e-6), (0.9e5, 7e-6)):
        w[L.p_frozen + k], w[L.h_frozen + k] = w[L.p + k], w[L.h + k]
        w[L.p : L.p + L.length], w[L.h : L.h + L.length] = p, h
        jacobian.py_func(w, F, L, speed * F.radius, iadt)
        diagonals.append(w[L.diag + k] / w[L.weight + k])
    find_scales(w, F, L, speed * F.radius, iadt)
    whole = w[L.weight + k] == 1.0
    assert w[L.scale + k][whole] == pytest.approx((diagonals[0] / diagonals[1])[whole], rel=1e-12)
