"""The wrapper under the address and undefined-behaviour sanitisers, driven by a C program."""

import subprocess
from pathlib import Path

import pytest

FLAGS = ["-std=c11", "-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


def has_sanitisers(folder):
    """Return whether gcc can build and run with them."""
    (folder / "t.c").write_text("int main(void) { return 0; }")
    built = subprocess.run(["gcc", *FLAGS, "t.c", "-o", "t"], cwd=folder, capture_output=True)
    return built.returncode == 0 and subprocess.run([folder / "t"], capture_output=True).returncode == 0


def test_the_sanitisers_find_nothing(model, tmp_path):
    from fmu.binaries import SOURCES, fmi_headers, write_sources
    from fmu.kernel_object import ObjectTarget
    from fmu.targets import host

    if not has_sanitisers(tmp_path):
        pytest.skip("gcc has no sanitisers here")
    target = ObjectTarget(host().triple, "x86-64" if host().name.startswith("x86") else "generic")
    write_sources(model, {"kernels": target}, tmp_path)
    driver = Path(__file__).with_name("driver.c")
    subprocess.run(
        ["gcc", *FLAGS, "-I.", f"-I{fmi_headers()}", *SOURCES, "tables.c", driver, "kernels.o", "-o", "driver", "-lm"],
        cwd=tmp_path,
        check=True,
    )
    done = subprocess.run([tmp_path / "driver"], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-3000:]
    assert done.stdout.splitlines()[-1] == "clean" and not done.stderr
