"""Files of the product in which something runs for one record, from the command line to the piezo and the page."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "support" / "files_run.py"
MOST_FILES, MOST_ROOMS = 96, 12


@pytest.mark.slow
def test_a_prbs_record_passes_few_files_and_no_room_that_it_has_no_use_for():
    ran = subprocess.run([sys.executable, SCRIPT, "--list"], capture_output=True, text=True, check=True).stdout
    files, rooms = re.search(r"^(\d+) files, \d+ functions, (\d+) rooms", ran, re.MULTILINE).groups()
    assert int(files) <= MOST_FILES and int(rooms) <= MOST_ROOMS
    assert "rotorsim/effects/rotor/unbalance.py" in ran and "rotorsim/effects/rotor/crack.py" not in ran
