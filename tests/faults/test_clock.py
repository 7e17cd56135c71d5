"""Commands that write files while the wall clock jumps."""

import os
import time

import numpy as np

from fault_injection.cases import ALL, NIGHTLY, TRIES
from fault_injection.trials import CLOCK, dated, seed_of, tally

pytestmark = NIGHTLY
JUMPS = 6
"""Times that it is set during a command."""


@ALL
def test_a_clock_that_jumps(command, trials, reference):
    """The clock is set by an hour, forward and back, at random moments."""
    rng, known, found = seed_of(command.name, "clock"), reference(command), []
    tries = max(TRIES // 7, 1)
    for k in range(tries):
        jumps = time.monotonic() + np.sort(rng.uniform(0, known.seconds, JUMPS))
        paths = os.pathsep.join(filter(None, (str(CLOCK), os.environ.get("PYTHONPATH"))))
        environment = {"PYTHONPATH": paths, "ROTORSIM_CLOCK_JUMPS": " ".join(map(str, jumps))}
        trial = trials(command, environment)
        found += dated(trial.found(trial.run(), {command.code}, known), f"clock {k}")
    tally(command, "clock jumps", tries, found)
