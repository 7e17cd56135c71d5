"""Cost of campaigns: parallel efficiency, overhead per case, memory with very many cases."""

import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from rotorsim.campaign.plan import Plan
from rotorsim.campaign.read_plan import load_plan, make_plan
from rotorsim.campaign.records import collect
from rotorsim.campaign.run import CampaignOutcome, Settings, run_campaign
from rotorsim.campaign.store import open_store
from studies.benchmarks.result import Figure

REAL = """
machine = "dtu_gas_bearing"
keep = ["reference", "disc_measured"]
[experiment]
kind = "prbs"
duration = "2 s"
pressure = "0.6 MPa"
[axes.speed]
grid = ["0 rpm", "6000 rpm"]
points = 50
"""
STUB = "machine = 'plain_rotor'\nrepeats = {}\n[experiment]\nkind = 'steady'\nduration = '0.2 ms'\n"
ROUNDS = 3
MANY = 100_000


def efficiency() -> Iterator[Figure]:
    """Two workers against one, in turns: medians of the wall time of a case of 2 s, from the first one on.

    When the first is there every worker has done about one, so the rest of the time is that of `count - workers`.
    """
    plan = make_plan(REAL)
    run_of(make_plan(REAL.replace("points = 50", "points = 2")), 1)
    runs = [(run_of(plan, 1), run_of(plan, 2)) for _ in range(ROUNDS)]
    one, two = (
        statistics.median(run[workers - 1][0].busy / (len(plan) - workers) for run in runs) for workers in (1, 2)
    )
    cpu = [statistics.median(run[side][1] for run in runs) for side in (0, 1)]
    yield Figure("campaign: wall time of a case, one worker", one, "s")
    yield Figure("campaign: wall time of a case, two workers", two, "s")
    yield Figure("  efficiency lost", 1 - one / (2 * two), "1", 0.1)
    yield Figure("  processor time of a case, one worker", cpu[0], "s")
    yield Figure("  processor time of a case, two workers", cpu[1], "s")


def overhead() -> Iterator[Figure]:
    """Time of a worker for a case without physics, its small record included, and processor time of everything."""
    for workers in (1, 2):
        spent = []
        for _ in range(ROUNDS):
            before = os.times()
            few = run_of(make_plan(STUB.format(2)), workers, "stub")[0]
            middle = os.times()
            many = run_of(make_plan(STUB.format(1002)), workers, "stub")[0]
            after = os.times()
            cpu = (sum(after[:4]) - sum(middle[:4])) - (sum(middle[:4]) - sum(before[:4]))
            spent.append((workers * (many.busy - few.busy), cpu))
        wall, cpu = (statistics.median(values) for values in zip(*spent, strict=True))
        yield Figure(f"campaign: overhead of a case, {workers} workers", wall, "ms", 20.0)
        yield Figure("  processor time, all processes", cpu, "ms")


def thesis() -> Iterator[Figure]:
    """The shipped plan on two workers, from the command to the prompt, machine code compiled."""
    with tempfile.TemporaryDirectory() as folder:
        before, begin = os.times(), time.perf_counter()
        command = [
            sys.executable,
            "-P",
            "-m",
            "rotorsim",
            "campaign",
            "thesis",
            "--out",
            folder + "/s",
            "--workers",
            "2",
        ]
        subprocess.run(command, check=True, capture_output=True)
        seconds = time.perf_counter() - begin
        yield Figure("campaign of the thesis, two workers", seconds, "s", 120.0)
        yield Figure("  processor time, all processes", sum(os.times()[:4]) - sum(before[:4]), "s")
        with closing(open_store(Path(folder) / "s").index()) as index:
            yield Figure("  cases not done", len(load_plan("thesis")) - index.counts()["done"], "1", 0.0)


def many(cases: int = MANY) -> Iterator[Figure]:
    """Cases without physics: memory of this process on the way, time to ask the index and to collect."""
    plan = make_plan(STUB.format(cases))
    with tempfile.TemporaryDirectory() as name, _memory() as seen:
        folder = Path(name) / "store"
        outcome = run_campaign(plan, folder, Settings(workers=2, physics="stub"))
        yield Figure(f"campaign: {cases} cases without physics", outcome.seconds, "s")
        yield Figure("  cases left or failed", cases - outcome.done, "1", 0.0)
        quarter, last = seen[-1 - int(0.75 * outcome.busy)], statistics.median(seen[-5:])
        yield Figure("  memory, a quarter done", quarter, "MB")
        yield Figure("  more at the end, per case", (last - quarter) / (0.75 * cases) * 1e3, "kB", 0.2)
        begin = time.perf_counter()
        with closing(open_store(folder).index()) as index:
            index.counts(), index.totals()
        yield Figure("  status", time.perf_counter() - begin, "s", 2.0)
        begin = time.perf_counter()
        collect(folder, variables=[])
        yield Figure("  collect, table of all cases", time.perf_counter() - begin, "s", 30.0)
        begin = time.perf_counter()
        float(collect(folder, variables=["disc"])["disc"][cases // 2, 3, 0])
        yield Figure("  collect, one number of one record", time.perf_counter() - begin, "s", 60.0)


def run_of(plan: Plan, workers: int, physics: str = "rotorsim") -> tuple[CampaignOutcome, float]:
    """A campaign in a folder that goes away: its outcome and the mean processor time [s] of a case."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "store"
        outcome = run_campaign(plan, folder, Settings(workers=workers, physics=physics))
        with closing(open_store(folder).index()) as index:
            return outcome, statistics.fmean(row.cpu or 0.0 for row in index.rows())


@contextmanager
def _memory() -> Iterator[list[float]]:
    """Memory [MB] of this process, every second."""
    import psutil

    seen, over, here = [psutil.Process().memory_info().rss / 1e6], threading.Event(), psutil.Process()

    def look() -> None:
        while not over.wait(1.0):
            seen.append(here.memory_info().rss / 1e6)

    watch = threading.Thread(target=look, daemon=True)
    watch.start()
    try:
        yield seen
    finally:
        over.set()
        watch.join()
