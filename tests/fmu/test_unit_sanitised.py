"""C wrapper under the address and undefined-behaviour sanitisers: every call in every state, then random masters."""

import ctypes
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from law_models import scheduled_law
from lpv_models import make_lpv

FLAGS = ["-std=c11", "-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
ADDR_NO_RANDOMIZE = 0x0040000


def at_fixed_addresses():
    """Let the child's addresses be no random ones: with many random bits the sanitiser's own memory may be taken."""
    ctypes.CDLL(None).personality(ADDR_NO_RANDOMIZE)


def run(program):
    """Run a sanitised program."""
    return subprocess.run([program], capture_output=True, text=True, preexec_fn=at_fixed_addresses)


def has_sanitisers(gcc, folder):
    """Return whether gcc can build and run with them."""
    (folder / "t.c").write_text("int main(void) { return 0; }")
    built = subprocess.run([gcc, *FLAGS, "t.c", "-o", "t"], cwd=folder, capture_output=True)
    return built.returncode == 0 and run(folder / "t").returncode == 0


def build(command, unit_model, name, folder):
    """Build tests/fmu/NAME.c with the C files of a unit."""
    from fmu.export import fmi_headers, host, write_sources
    from fmu.kernel_object import ObjectTarget

    target = ObjectTarget(host().triple, "x86-64" if host().name.startswith("x86") else "generic")
    sources = write_sources(unit_model, {"kernels": target}, folder)
    shutil.copy(Path(__file__).with_name(f"{name}.c"), folder)
    objects = [file.name for file in folder.glob("*.o")]
    words = [*command, "-I.", f"-I{fmi_headers()}", *sources, f"{name}.c", *objects, "-o", name, "-lm"]
    subprocess.run(words, cwd=folder, check=True)


def make_unit(kind, plant):
    """A plant, an identified model of continuous or of sampled time, or a law without or with a clock."""
    from fmu.linear_units import LawUnit, LinearUnit

    if kind == "plant":
        return plant
    if kind in ("law", "clocked"):
        return LawUnit(scheduled_law(), clocked=kind == "clocked")
    return LinearUnit(make_lpv("2" if kind == "linear" else "blackbox"), "bearing", 300.0, 5e5)


DRIVERS, SLOW = ("driver", "state_machine"), ("linear", "sampled", "law")
DRIVEN = [
    *(("plant", driver) for driver in DRIVERS),
    *(pytest.param(kind, driver, marks=pytest.mark.slow) for kind in SLOW for driver in DRIVERS),
    pytest.param("clocked", "driver", marks=pytest.mark.slow),
]
"""Kinds of units and what drives them; the state machines are those of units without a clock."""


@pytest.mark.skipif(sys.platform != "linux", reason="the drivers are built for Linux")
@pytest.mark.parametrize(("kind", "driver"), DRIVEN)
def test_a_driver_finishes_and_the_sanitisers_find_nothing(gcc, model, tmp_path, kind, driver):
    if not has_sanitisers(gcc, tmp_path):
        pytest.skip("gcc has no sanitisers here")
    build([gcc, *FLAGS], make_unit(kind, model), driver, tmp_path)
    done = run(tmp_path / driver)
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-3000:]
    assert done.stdout.splitlines()[-1] == "clean" and not done.stderr


RUNS = 3_000
"""Random masters of a unit."""
LONGEST = 300
"""Time [s] by the clock after which a master hangs; it takes milliseconds where the computer is free."""
ARTEFACTS = ("crash", "leak", "timeout", "oom", "slow-unit")
"""Beginnings of the files in which libFuzzer keeps a master that found something."""


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform != "linux", reason="the drivers are built for Linux")
@pytest.mark.parametrize("kind", ["plant", "linear", "sampled", "law", "clocked"])
def test_random_masters_find_nothing(model, tmp_path, kind):
    """Coverage-guided: libFuzzer chooses the calls, references and values that reach more of the C files."""
    clang = shutil.which("clang")
    if not clang:
        pytest.skip("clang is not installed")
    options = ["-g", "-O1", "-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all"]
    build([clang, "-std=c11", *options], make_unit(kind, model), "fuzz", tmp_path)
    limits = [
        "-max_len=600",
        "-len_control=0",
        "-rss_limit_mb=4096",
        f"-timeout={LONGEST}",
        f"-report_slow_units={LONGEST}",
    ]
    words = [tmp_path / "fuzz", f"-runs={RUNS}", "-seed=1", *limits]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, preexec_fn=at_fixed_addresses)
    assert done.returncode == 0, done.stderr[-4000:]
    found = [file.name for word in ARTEFACTS for file in tmp_path.glob(f"{word}-*")]
    assert not found
    assert f"Done {RUNS} runs" in done.stderr
