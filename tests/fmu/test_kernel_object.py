"""Compilation of kernels to native objects: a one-line function, foreign symbols, failing effects."""

import ctypes
import math
import subprocess
import sys

import pytest

from fmu.kernel_object import KernelExportError, foreign_symbols

SCRIPT = """
import ctypes, math, os, subprocess, sys
from pathlib import Path
from fmu.kernel_object import ISOLATED, emit, entry_ir, host_target
os.environ.update(ISOLATED)
import numba
def f(x):
    return math.exp(x) * math.sin(x) + x
kernel = numba.njit(error_model="numpy", _nrt=False)(f)
Path(sys.argv[1], "f.o").write_bytes(emit(entry_ir(kernel, (numba.float64,), "f_entry"), "f_entry", host_target()))
"""


def test_a_function_computes_the_same_bits_in_and_outside_python(gcc, tmp_path):
    subprocess.run([sys.executable, "-c", SCRIPT, tmp_path], check=True)
    (tmp_path / "g.c").write_text(
        "#include <stdint.h>\nextern int32_t f_entry(double *, void **, double);\n"
        "double g(double x) { double y = 0; void *e = 0; f_entry(&y, &e, x); return y; }\n"
    )
    subprocess.run([gcc, "-shared", "-fPIC", "-o", "g.so", "g.c", "f.o", "-lm"], cwd=tmp_path, check=True)
    g = ctypes.CDLL(str(tmp_path / "g.so")).g
    g.restype, g.argtypes = ctypes.c_double, [ctypes.c_double]
    for x in (0.0, 0.3, -2.5, 7.0):
        assert g(x) == math.exp(x) * math.sin(x) + x


def test_symbols_of_python_are_distinguished_from_those_of_the_c_library():
    assert foreign_symbols(["sin", "memset", "_exp", "PyErr_SetString", "NRT_Allocate"]) == {
        "PyErr_SetString",
        "NRT_Allocate",
    }


def test_an_effect_that_does_not_compile_is_reported_in_one_sentence(tmp_path):
    from fmu.kernel_object import ObjectTarget, _compile

    with pytest.raises(KernelExportError, match="fmu: the kernels do not compile outside Python"):
        _compile("nonsense", [], {"host": ObjectTarget("x86_64-unknown-linux-gnu")}, tmp_path)
