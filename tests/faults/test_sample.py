"""Short selection of the slow fault tests: two quick commands with kills, interrupts and a file limit."""

import signal
import sys
from functools import partial

import pytest

from fault_injection.commands import COMMANDS
from fault_injection.trials import moments, signalled, tally

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
QUICK = [one for one in COMMANDS if one.name in ("machine new", "data convert")]


@pytest.mark.slow
@pytest.mark.parametrize("command", QUICK, ids=lambda one: one.name.replace(" ", "-"))
def test_a_signal_and_a_full_disk(command, trials, reference):
    known = reference(command)
    for number in (signal.SIGINT, signal.SIGKILL):
        when = moments(command, number, 2, known.seconds)
        tally(command, f"{number.name}, sample", 2, signalled(partial(trials, command), known, number, when))
    trial = trials(command)
    ended = trial.run(largest=known.largest // 2)
    tally(command, "file limit, sample", 1, trial.found(ended, {2}, known) + trial.again(known))
