"""Repeats of the numerical tests with other BLAS kernels: environment variables and skipped processors."""

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest
import scipy.linalg  # noqa: F401  (loads the second OpenBLAS)
from threadpoolctl import threadpool_info

pytestmark = pytest.mark.numerical
REPEATS = Path(__file__).parents[2] / ".ci" / "kernels"
NAMES = {"Prescott": {"Prescott", "Katmai"}, "Haswell": {"Haswell"}}
"""Names of OpenBLAS for its kernels: builds without those of Katmai call Prescott's so."""
SHOW = "import json, numpy, scipy.linalg, threadpoolctl; print(json.dumps(threadpoolctl.threadpool_info()))"


def openblas(info):
    """Those of the libraries that are an OpenBLAS."""
    return [one for one in info if one.get("internal_api") == "openblas"]


def flags():
    cpuinfo = Path("/proc/cpuinfo")
    return set(cpuinfo.read_text().split()) if cpuinfo.exists() else set()


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="these kernels are those of x86 processors")
@pytest.mark.skipif(not openblas(threadpool_info()), reason="numpy and scipy use no OpenBLAS here")
@pytest.mark.parametrize(("kernels", "needs"), [("Prescott", set()), ("Haswell", {"avx2", "fma"})])
@pytest.mark.parametrize("threads", [1, 2])
def test_every_openblas_takes_the_kernels_and_threads_that_are_set(kernels, needs, threads):
    if not needs <= flags():
        pytest.skip(f"this processor cannot run the kernels of {kernels}")
    environment = os.environ | {"OPENBLAS_CORETYPE": kernels, "OPENBLAS_NUM_THREADS": str(threads)}
    out = subprocess.run(
        [sys.executable, "-c", SHOW], env=environment, capture_output=True, text=True, check=True
    ).stdout
    found = openblas(json.loads(out))
    assert {one["architecture"] for one in found} <= NAMES[kernels]
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    assert {one["num_threads"] for one in found} <= {threads, min(threads, allowed)}


@pytest.mark.skipif("OPENBLAS_CORETYPE" not in os.environ, reason="no kernels are forced in this run")
def test_a_repeat_runs_with_the_kernels_it_is_for():
    """A typing error in the variable would make the repeats those of the processor's own kernels, and green."""
    kernels = os.environ["OPENBLAS_CORETYPE"]
    assert {one["architecture"] for one in openblas(threadpool_info())} <= NAMES.get(kernels, {kernels})


@pytest.mark.parametrize(
    ("line", "skipped"),
    [
        ("flags : fpu sse2 pni", {"Haswell"}),
        ("flags : fpu pni avx2", {"Haswell"}),
        ("Features : fp asimd", {"Prescott", "Haswell"}),
        ("flags : pni fma avx2", set()),
    ],
)
def test_kernels_that_a_processor_cannot_run_are_skipped_in_a_sentence(tmp_path, line, skipped):
    (tmp_path / "cpuinfo").write_text(line + "\n")
    pytest_found = tmp_path / "pytest"
    pytest_found.write_text('#!/bin/sh\necho "ran $OPENBLAS_CORETYPE $OPENBLAS_NUM_THREADS"\n')
    pytest_found.chmod(0o755)
    env = os.environ | {"CPUINFO": str(tmp_path / "cpuinfo"), "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    out = subprocess.run([REPEATS, "all"], env=env, capture_output=True, text=True, check=True).stdout
    for kernels in ("Prescott", "Haswell"):
        assert (f"kernels of {kernels}: skipped, this processor cannot run them" in out) == (kernels in skipped)
        assert all((f"ran {kernels} {threads}" in out) == (kernels not in skipped) for threads in (1, 2))
    one = subprocess.run([REPEATS], env=env, capture_output=True, text=True, check=True).stdout
    ran = [] if "Prescott" in skipped else ["ran Prescott 1"]
    assert [line for line in one.splitlines() if line.startswith("ran")] == ran
