"""A study of minutes to hours, disturbed repeatedly: finished records are kept."""

import os
import shutil
import signal

import pytest

from fault_injection.cases import NIGHTLY
from fault_injection.checks import Fault, files, left_over, messages
from fault_injection.commands import OUT, RIG, Command
from fault_injection.trials import at, dated, moments, tally

pytestmark = NIGHTLY
TRIES = int(os.environ.get("ROTORSIM_FAULT_TRIES", "20"))
LENGTH = 60.0
"""Time [s] within which a study is disturbed; the moments of later tries are in later stages."""
STUDIES = (
    Command(("study", "identification-vs-physics"), (RIG, "--quick", "--jobs", "1", "--out", f"{OUT}/study"), ()),
)


def kept(folder):
    """Finished parts of a study: records and results of its stages, with their sizes."""
    names = (*folder.rglob("cases/*/*.nc"), *folder.glob("stages/*.json"))
    return {path.relative_to(folder): path.stat().st_size for path in names}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["SIGINT", "SIGKILL"])
@pytest.mark.parametrize("command", STUDIES, ids=lambda one: one.words[1])
def test_a_study_keeps_what_it_has(command, number, trials, tmp_path):
    trial, found, before = trials(command), [], {}
    codes = {0, 130, -number}
    for k, moment in enumerate(moments(command, number, TRIES, LENGTH)):
        ended = trial.run(at(moment, number, bool(k % 2) and number == signal.SIGINT))
        now = kept(trial.out / "study")
        lost = [Fault("lost", str(path)) for path, size in before.items() if now.get(path) != size]
        here = messages(ended, codes) + files(trial.out, tmp_path) + lost
        found, before = found + dated(here, f"signal {number} at {moment:.2f} s"), now
    tally(command, number.name, TRIES, found)


def test_a_study_in_a_folder_that_cannot_be_made(trials, tmp_path):
    """A file is where the folder should be; it stays."""
    for command in STUDIES:
        trial = trials(command)
        (trial.out / "study").write_text("mine")
        ended = trial.run()
        found = messages(ended, {2}) + left_over(trial.out)
        assert (trial.out / "study").read_text() == "mine"
        tally(command, "a file is there", 1, found)


def test_a_study_on_a_file_limit(trials, tmp_path):
    for command in STUDIES:
        trial = trials(command)
        ended = trial.run(largest=1000)
        tally(command, "file limit", 1, messages(ended, {2}) + files(trial.out, tmp_path))
        shutil.rmtree(trial.work)
