"""`python studies/benchmarks/measure.py diagnose --keep`: file of finished cases, whole and written by one process."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from fuzzing.disk import largest_file
from rotorsim.base.files import WriteError
from rotorsim.commands.results import files
from rotorsim.discrepancy.hidden_machine import truth_twin
from rotorsim.effects import REGISTRY
from rotorsim.machine import load_machine
from studies.benchmarks import hidden_case
from studies.benchmarks.command import bench
from studies.benchmarks.diagnose import keep, kept_cases
from studies.benchmarks.hidden_case import NOT_DRAWN, pick, pool_of
from studies.benchmarks.verdicts import CaseVerdict

ODDS = Path(hidden_case.__file__).with_name("odds.jsonl")


def case(number):
    """A case as a benchmark keeps it."""
    return CaseVerdict(
        number,
        "one",
        ("runout.amplitude_1x",),
        3.0,
        5.0,
        "named",
        ("runout.amplitude_1x",),
        "right",
        1.0,
        0.9,
        1.0,
        2.0,
    )


def test_cases_come_back_as_they_werekept_cases(tmp_path):
    keep([case(1), case(2)], tmp_path / "cases")
    assert kept_cases(tmp_path / "cases") == {1: case(1), 2: case(2)}


def test_a_full_disk_leaves_the_cases_before(tmp_path):
    """A line was appended, and half of it stayed."""
    path = tmp_path / "cases"
    keep([case(1)], path)
    with largest_file(path.stat().st_size + 50), pytest.raises(WriteError):
        keep([case(1), case(2)], path)
    assert kept_cases(path) == {1: case(1)}


def test_the_numbers_of_stored_cases_draw_the_effects_that_are_stored():
    """A case without lift-off is drawn again, so that not every first draw is the stored one."""
    pool = pool_of(truth_twin(load_machine("dtu_gas_bearing")))
    rows = [json.loads(line) for line in ODDS.read_text().splitlines()]
    rows = [row for row in rows if row["hidden"]]
    same = [pick(pool, len(row["hidden"]), np.random.default_rng([row["number"], 11])) == row["hidden"] for row in rows]
    assert len(rows) > 100 and sum(same) > 0.9 * len(rows)


def test_a_file_of_something_else_is_named(run, tmp_path):
    path = tmp_path / "cases"
    path.write_text(json.dumps(asdict(case(1))) + '\n{"number": 2, "ki')
    code, out, err = run(bench, "diagnose", "--keep", path)
    assert (code, out) == (2, "")
    assert err == f"{path}: line 2 is not a case of the part diagnose; name another file\n"


def test_a_file_that_another_benchmark_writes_is_refused(run, tmp_path):
    with files(tmp_path / "cases", force=True):
        code, _, err = run(bench, "diagnose", "--keep", tmp_path / "cases")
    assert code == 2 and "is writing it; wait for its end or choose another --keep" in err


@pytest.mark.skipif(sys.platform == "win32", reason="kills by a signal of POSIX")
def test_a_kill_leaves_whole_cases(tmp_path):
    program = (
        "import sys; from pathlib import Path; from studies.benchmarks.diagnose import keep\n"
        "from studies.benchmarks.verdicts import CaseVerdict\n"
        "one = lambda n: CaseVerdict(n, 'one', ('a',), 3.0, 5.0, 'named', ('a',), 'right', 1.0, 0.9, 1.0, 2.0)\n"
        "for n in range(10**6): keep(map(one, range(n % 100 + 1)), Path(sys.argv[1])); print(n, flush=True)"
    )
    process = subprocess.Popen([sys.executable, "-c", program, tmp_path / "cases"], stdout=subprocess.PIPE)
    assert process.stdout is not None
    for _ in range(50):
        process.stdout.readline()
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    assert len(kept_cases(tmp_path / "cases")) > 0


def test_effects_that_no_case_hides_are_effects():
    assert set(NOT_DRAWN) <= set(REGISTRY) and len(NOT_DRAWN) == 13
