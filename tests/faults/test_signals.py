"""Commands that write, interrupted and killed at random moments: no lost or partial files, no traceback.

Counts of tries and faults are added to the file that the environment variable ROTORSIM_FAULT_TABLE names, and
ROTORSIM_FAULT_TRIES is the number of random moments.
"""

from functools import partial

from fault_injection.cases import ALL, COMPILING, NIGHTLY, SIGNALS, TRIES
from fault_injection.trials import moments, signalled, tally

pytestmark = NIGHTLY
COLD = 60.0
"""Time [s] in which kernels are compiled, about."""


@ALL
@SIGNALS
def test_a_signal_at_any_moment(command, number, trials, reference):
    length = reference(command).seconds * 1.05
    found = signalled(partial(trials, command), reference(command), number, moments(command, number, TRIES, length))
    tally(command, number.name, TRIES, found)


@COMPILING
@SIGNALS
def test_a_signal_while_kernels_compile(command, number, trials, reference, tmp_path):
    """In a cache that is empty at first; what killed processes leave in it must not change a result."""
    tries = TRIES if command.name == "runup" else max(TRIES // 5, 1)
    make = partial(trials, command, {"ROTORSIM_CACHE_DIR": str(tmp_path / "cache")})
    when = moments(command, number, tries, reference(command).seconds + COLD / 2)
    tally(command, f"{number.name}, compiling", tries, signalled(make, reference(command), number, when))
