"""Full disk below standard output: one sentence, whether output is buffered or not."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

FULL = "standard output: cannot be written: the disk is full; free some space or choose another place\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a disk that is always full")
@pytest.mark.parametrize("unbuffered", ["", "1"], ids=["buffered", "unbuffered"])
@pytest.mark.parametrize(
    "command", [("--help",), ("machine", "show", "plain_rotor"), ("machine", "effects", "--json")], ids=" ".join
)
def test_a_full_disk_below_standard_output_is_named(command, unbuffered):
    """It was "no space left on device; check that the folder exists", or a traceback of the interpreter's end."""
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "rotorsim", *command], stdout=full, stderr=subprocess.PIPE, text=True,
            env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
        )  # fmt: skip
    assert (done.returncode, done.stderr) == (2, FULL)


def test_a_reader_that_ends_early_is_silent():
    command = f"{sys.executable} -m rotorsim machine effects | head -1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True)
    assert done.returncode == 0 and done.stderr == ""
