"""Commands that write while their folder is removed or a second process writes there."""

import shutil
import threading
import time

from fault_injection.cases import ALL, NIGHTLY, TRIES
from fault_injection.trials import dated, seed_of, tally

pytestmark = NIGHTLY


@ALL
def test_a_folder_that_is_removed(command, trials, reference):
    """As soon as something is in it, and at random moments after that."""
    rng, known, found = seed_of(command.name, "removed"), reference(command), []
    tries = max(TRIES // 4, 1)
    for k in range(tries):
        trial = trials(command)
        prepared = set(trial.out.rglob("*"))

        later = rng.uniform(0, 0.3 * known.seconds) if k else 0.0

        def remove(running, trial=trial, prepared=prepared, later=later):
            if running.until(lambda: set(trial.out.rglob("*")) - prepared) and running.wait(later):
                shutil.rmtree(trial.out, ignore_errors=True)

        ended = trial.run(remove)
        found += dated(trial.found(ended, {2, command.code}, known), f"removed, try {k}")
        trial.begin() if not any(trial.out.glob("*")) else None
        found += dated(trial.again(known), f"again after removal, try {k}")
    tally(command, "folder removed", tries, found)


@ALL
def test_two_processes_in_one_folder(command, trials, reference):
    """Begun up to a tenth of the time apart: one writes, the other is refused or finds the results there."""
    rng, known, found = seed_of(command.name, "two"), reference(command), []
    tries = max(TRIES // 4, 1)
    for k in range(tries):
        trial, ends = trials(command), []
        threads = [threading.Thread(target=lambda trial=trial, ends=ends: ends.append(trial.run())) for _ in range(2)]
        for thread in threads:
            thread.start()
            time.sleep(rng.uniform(0, 0.1 * known.seconds))
        for thread in threads:
            thread.join()
        here = [one for end in ends for one in trial.found(end, {2, command.code}, known)]
        assert any(end.code == command.code for end in ends), [end.stderr for end in ends]
        found += dated(here + trial.again(known), f"two, try {k}")
    tally(command, "two at once", tries, found)
