"""Parameters of the fault tests: commands, signals, number of trials."""

import os
import signal
import sys

import pytest

from fault_injection.commands import COMMANDS
from fault_injection.trials import can_mount

NIGHTLY = [
    pytest.mark.slow,
    pytest.mark.nightly,
    pytest.mark.skipif(sys.platform == "win32", reason="signals and disks of POSIX"),
]
TRIES = int(os.environ.get("ROTORSIM_FAULT_TRIES", "20"))
"""Random moments of a signal; other faults are tried in proportion."""
SHARES = (0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99)[:: 1 if TRIES >= 20 else 2]
"""Sizes of a disk as a share of what is to be written."""


def name(command):
    """Name after which a test is called."""
    return command.name.replace(" ", "-")


ALL = pytest.mark.parametrize("command", COMMANDS, ids=name)
COMPILING = pytest.mark.parametrize(
    "command", [one for one in COMMANDS if one.name in ("runup", "map", "campaign run", "fmu export")], ids=name
)
"""Commands that compile in this process, in processes of a campaign, and for use outside Python."""
SIGNALS = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["SIGINT", "SIGKILL"])
DISK = pytest.mark.skipif(not can_mount(), reason="needs root to make a disk")
