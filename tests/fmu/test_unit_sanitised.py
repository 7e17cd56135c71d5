"""The wrapper under the address and undefined-behaviour sanitisers, driven by a C program."""

import ctypes
import subprocess
import sys
from pathlib import Path

import pytest
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


@pytest.fixture(params=["plant", "linear"])
def unit_model(request, model):
    """Return a plant and an identified model."""
    from fmu.linear_model import LinearUnit

    return model if request.param == "plant" else LinearUnit(make_lpv("2"), "bearing", 300.0, 5e5)


@pytest.mark.skipif(sys.platform != "linux", reason="the driver is built for Linux")
def test_the_sanitisers_find_nothing(gcc, unit_model, tmp_path):
    from fmu.binaries import fmi_headers
    from fmu.kernel_object import ObjectTarget
    from fmu.kinds import write_sources
    from fmu.targets import host

    if not has_sanitisers(gcc, tmp_path):
        pytest.skip("gcc has no sanitisers here")
    target = ObjectTarget(host().triple, "x86-64" if host().name.startswith("x86") else "generic")
    sources = write_sources(unit_model, {"kernels": target}, tmp_path)
    (tmp_path / "driver.c").write_bytes(Path(__file__).with_name("driver.c").read_bytes())
    subprocess.run(
        [gcc, *FLAGS, "-I.", f"-I{fmi_headers()}", *sources, "driver.c", *(o.name for o in tmp_path.glob("*.o")),
         "-o", "driver", "-lm"],
        cwd=tmp_path,
        check=True,
    )  # fmt: skip
    done = run(tmp_path / "driver")
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-3000:]
    assert done.stdout.splitlines()[-1] == "clean" and not done.stderr
