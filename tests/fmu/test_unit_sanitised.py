"""C wrapper under the address and undefined-behaviour sanitisers: every call in every state."""

import ctypes
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


@pytest.fixture(
    params=["plant", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("linear", "sampled", "law"))]
)
def unit_model(request, model):
    """Return a plant, identified models of continuous and of sampled time, and a law."""
    from fmu.linear_units import LawUnit, LinearUnit

    if request.param == "plant":
        return model
    if request.param == "law":
        return LawUnit(scheduled_law())
    return LinearUnit(make_lpv("2" if request.param == "linear" else "blackbox"), "bearing", 300.0, 5e5)


@pytest.mark.skipif(sys.platform != "linux", reason="the drivers are built for Linux")
@pytest.mark.parametrize("driver", ["driver", "state_machine"])
def test_a_driver_finishes_and_the_sanitisers_find_nothing(gcc, unit_model, tmp_path, driver):
    from fmu.export import fmi_headers, host, write_sources
    from fmu.kernel_object import ObjectTarget

    if not has_sanitisers(gcc, tmp_path):
        pytest.skip("gcc has no sanitisers here")
    target = ObjectTarget(host().triple, "x86-64" if host().name.startswith("x86") else "generic")
    sources = write_sources(unit_model, {"kernels": target}, tmp_path)
    program = f"{driver}.c"
    (tmp_path / program).write_bytes(Path(__file__).with_name(program).read_bytes())
    subprocess.run(
        [gcc, *FLAGS, "-I.", f"-I{fmi_headers()}", *sources, program, *(o.name for o in tmp_path.glob("*.o")),
         "-o", driver, "-lm"],
        cwd=tmp_path,
        check=True,
    )  # fmt: skip
    done = run(tmp_path / driver)
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-3000:]
    assert done.stdout.splitlines()[-1] == "clean" and not done.stderr
