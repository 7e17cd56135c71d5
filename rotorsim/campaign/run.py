"""Execution of a campaign: pending cases go to the workers, their results into the index; progress and log.

A sweep of a machine runs as a campaign too: a case for each of its cells.
"""

import json
import logging
import signal
import time
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from rotorsim.analysis.sweep import SweepResult, result_of
from rotorsim.analysis.sweep_definition import REASON, WHAT, Over, SweepDefinition, make_sweep
from rotorsim.base.display import BAR, Update, bar, visible
from rotorsim.base.files import write_text
from rotorsim.base.interrupt import Interrupt
from rotorsim.base.units import show
from rotorsim.campaign.plan import Plan
from rotorsim.campaign.read_plan import make_plan
from rotorsim.campaign.scheduler import ClusterError, Pump, Tls, cluster, local_workers
from rotorsim.campaign.store import (
    DONE,
    FAILED,
    PENDING,
    Index,
    Store,
    StoreError,
    clear_parts,
    make_store,
    mismatch,
    open_store,
    parts_folder,
    versions,
)
from rotorsim.machine import Machine
from rotorsim.plant import Plant

RECENT = 60.0
"""Time [s] over which the rate is averaged."""
COMPILING = "the first case compiles its machine, if it is new"
COLUMNS = (
    "{task.completed} of {task.total} cases",
    BAR,
    "{task.percentage:.0f} %",
    "{task.fields[rate]}",
    "{task.fields[left]}",
    "{task.fields[failed]}",
)
FIRST = {"rate": COMPILING, "left": "", "failed": ""}
COMMIT = 1.0
"""Time [s] between two writes of the index."""
LOG_EVERY = 30.0
"""Time [s] between two lines of progress in the log."""
NAME = "machine"
"""Name of the machine in the plan."""
UNITS = {"speed": "rad/s", "pressure": "Pa", "highest_speed": "rad/s"}


class CaseRate:
    """Recent rate in cases per second, counted from the first finished case, before which kernels may compile."""

    def __init__(self) -> None:
        self._marks: list[tuple[float, int]] = []

    def note(self, done: int) -> None:
        """Count what is done by now."""
        now = time.monotonic()
        if done and (len(self._marks) < 2 or now - self._marks[-1][0] >= 0.5):
            self._marks.append((now, done))
        while len(self._marks) > 2 and now - self._marks[1][0] > RECENT:
            self._marks.pop(0)

    @property
    def value(self) -> float:
        """Cases per second."""
        if not self._marks:
            return 0.0
        (begin, first), (end, last) = self._marks[0], self._marks[-1]
        return (last - first) / max(end - begin, 1e-9) if last > first else 0.0


def spell(seconds: float) -> str:
    """Time in readable units."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes, hours = seconds / 60, seconds / 3600
    return f"{minutes:.0f} min" if minutes < 100 else f"{hours:.1f} h"


def show_progress(update: Update | None, done: int, rate: float, left: int, failed: int) -> None:
    """Show what is done on a bar of COLUMNS."""
    if update is not None:
        shown = f"{rate:.3g} cases/s" if rate >= 1 else f"{rate * 60:.3g} cases/min"
        update(
            completed=done,
            rate=shown if rate else "" if done else COMPILING,
            left=f"{spell(left / rate)} left" if rate else "",
            failed=f"{failed} failed" if failed else "",
        )


@dataclass(frozen=True)
class CampaignOutcome:
    """Outcome of a campaign run: cases by status, cases run now, time [s], stopping signal or 0.

    `busy` [s] is the time from the first case that came back to the last: without start and compilation.
    """

    done: int
    failed: int
    pending: int
    run: int
    seconds: float
    stopped: int = 0
    busy: float = 0.0


@dataclass(frozen=True)
class Settings:
    """Settings of a campaign run that do not affect its results.

    `mixed` lets versions differ from those the store was begun with; `physics` is 'stub' where only the machinery is
    measured.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.campaign.Settings(workers=2).workers
    2
    """

    workers: int | None = None
    scheduler: str | None = None
    tls: Tls | None = None
    time_limit: float | None = None
    mixed: bool = False
    show: bool = False
    physics: str = "rotorsim"


def run_campaign(plan: Plan, folder: Path, settings: Settings | None = None) -> CampaignOutcome:
    """Run the remaining cases of a plan in the store `folder`, which is created if missing.

    Raises
    ------
    StoreError
        If the store is in use, of another plan or of other versions, or the disk is full.
    ClusterError
        If workers cannot be reached or do not match.

    Examples
    --------
    >>> import rotorsim as rs
    >>> outcome = rs.campaign.run_campaign(rs.campaign.load_plan("plan.toml"), Path("new"))
    """
    folder = folder.absolute()
    store, chosen = make_store(plan, folder), settings or Settings()
    with store.locked(), _logging(folder), closing(store.index(writable=True)) as index:
        _check_versions(store, chosen.mixed)
        _repair(store, index)
        return CampaignRun(store, index, chosen).run()


def retry(folder: Path, settings: Settings | None = None) -> CampaignOutcome:
    """Run the failed and the remaining cases of a store.

    Examples
    --------
    >>> import rotorsim as rs
    >>> outcome = rs.campaign.retry(Path("mine"))
    """
    store = open_store(folder.absolute())
    with store.locked(), closing(store.index(writable=True)) as index:
        index.reset([row.number for row in index.rows(FAILED)])
    return run_campaign(store.plan, folder, settings)


def _check_versions(store: Store, mixed: bool) -> None:
    wrong = mismatch(versions(), store.versions, physics_only=True)
    if wrong and not mixed:
        raise StoreError(
            f"{store.folder}: was begun with other versions ({wrong}); use those, allow mixed versions, "
            "or choose another folder",
            argument="versions",
            value=wrong,
        )


def _repair(store: Store, index: Index) -> None:
    """Make pending what the index believes done and is not there; remove half-written records."""
    left, lost = clear_parts(store.folder), store.damaged(index)
    index.reset(lost)
    if left or lost:
        log.info("%d half-written records removed, %d records that were lost are run again", left, len(lost))


class CampaignRun:
    """Run of all pending cases of a store."""

    def __init__(self, store: Store, index: Index, settings: Settings) -> None:
        self.store, self.index, self.settings = store, index, settings
        self.counts = index.counts()
        self.ran, self.busy = 0, 0.0
        self._id = f"rotorsim-{uuid.uuid4().hex[:8]}"
        self._versions = versions()
        self._mark = " ".join((self._versions["rotorsim"], self._versions["sources"]))
        self._limit = settings.time_limit or store.plan.time_limit

    def run(self) -> CampaignOutcome:
        """Run until nothing is pending or something stops it."""
        begin, numbers = time.monotonic(), self.index.pending()
        log.info("%s: %d of %d cases to run", self.store.plan.name, len(numbers), len(self.store.plan))
        with ExitStack() as stack:
            stop = stack.enter_context(Interrupt(signal.SIGINT, signal.SIGTERM))
            try:
                if numbers:
                    self._run(numbers, stop)
            except (ClusterError, StoreError) as error:
                if not stop.asked:
                    log.error("%s", error)
                    raise
            except KeyboardInterrupt:
                pass
            finally:
                self.index.commit()
                log.info(
                    "%s after %.1f s", ", ".join(f"{n} {s}" for s, n in self.counts.items()), time.monotonic() - begin
                )
        counts, seconds = self.counts, time.monotonic() - begin
        return CampaignOutcome(counts[DONE], counts[FAILED], counts[PENDING], self.ran, seconds, stop.asked, self.busy)

    def _run(self, numbers: list[int], stop: Interrupt) -> None:
        chosen = self.settings
        with (
            _token(parts_folder(self.store.folder) / self._id) as token,
            (
                local_workers(chosen.workers, len(numbers))
                if chosen.scheduler is None
                else cluster(chosen.scheduler, chosen.tls)
            ) as workers,
        ):
            try:
                workers.admit(self.store.folder, token)
                total, done = len(self.store.plan), self.counts[DONE]
                with bar(COLUMNS, show=chosen.show, total=total, completed=done, **FIRST) as update:
                    self._loop(Pump(workers, self._id), iter(numbers), stop, update)
            finally:
                workers.free(self._id)

    def _loop(self, pump: Pump, waiting: Iterator[int], stop: Interrupt, update: Update | None) -> None:
        rate, written, logged = CaseRate(), time.monotonic(), time.monotonic()
        begin, more = 0.0, True
        while (more or len(pump)) and not stop.asked:
            while more and pump.room > 0:
                more = self._give(pump, waiting, pump.size(self.counts[PENDING]))
            for row in pump.rows():
                self._note(row)
            rate.note(self.ran)
            left = self.counts[PENDING]
            show_progress(update, len(self.store.plan) - left, rate.value, left, self.counts[FAILED])
            now = time.monotonic()
            begin = begin or (now if self.ran else 0.0)
            self.busy = now - begin if begin else 0.0
            if now - written > COMMIT:
                self.index.commit()
                written = now
            if now - logged > LOG_EVERY:
                log.info("%d cases left, %.3g cases/s", left, rate.value)
                logged = now

    def _give(self, pump: Pump, waiting: Iterator[int], most: int) -> bool:
        """Give the next cases as a task; returns whether there were any."""
        orders = [self._order(number) for number in islice(waiting, most)]
        if orders:
            pump.give(orders)
        return bool(orders)

    def _order(self, number: int) -> dict[str, Any]:
        return {
            "run": self._id, "number": number, "folder": str(self.store.folder),
            "case": self.store.plan.case(number).case.text, "summary": self.store.plan.summary,
            "time_limit": self._limit, "versions": self._versions, "physics": self.settings.physics,
        }  # fmt: skip

    def _note(self, row: dict[str, Any]) -> None:
        if row["status"] == "storage":
            raise StoreError(row["error"])
        if row["status"] == "versions":
            wrong = mismatch(self._versions, row["versions"])
            raise ClusterError(f"worker {row['host']}: other versions ({wrong}); install the same everywhere")
        self.index.note(row["number"], row | {"versions": self._mark})
        self.counts[row["status"]] += 1
        self.counts[PENDING] -= 1
        self.ran += 1
        if row["status"] == FAILED:
            log.warning(
                "case %d failed: %s%s", row["number"], row["error"], "\n" + row["trace"] if "trace" in row else ""
            )


log = logging.getLogger("rotorsim.campaign")


@contextmanager
def _token(path: Path) -> Iterator[str]:
    """A file by which workers show that they see the store; its name."""
    write_text(path, path.name)
    try:
        yield path.name
    finally:
        path.unlink(missing_ok=True)


class _Log(logging.FileHandler):
    """A log that leaves out what cannot be written; logging itself would print a traceback for each line."""

    def format(self, record: logging.LogRecord) -> str:
        """The line, with names of other people's files made visible."""
        return visible(super().format(record))

    def handleError(self, record: logging.LogRecord) -> None:
        """Do nothing."""


@contextmanager
def _logging(folder: Path) -> Iterator[None]:
    """Write what happens into the store's log, as long as the disk takes it."""
    handler = _Log(folder / "campaign.log", encoding="utf-8", delay=True)
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    log.propagate = False
    try:
        yield
    finally:
        log.removeHandler(handler)
        handler.close()


def plan_of(sweep: SweepDefinition) -> Plan:
    """Plan whose cases are the cells of a sweep."""
    return make_plan("\n".join(_lines(sweep)), machines={NAME: sweep.machine.text})


def _lines(sweep: SweepDefinition) -> Iterator[str]:
    """The plan's text: an experiment for each analysis, and the axes."""
    yield f'name = "sweep"\nmachine = "{NAME}"\nkeep = []\nsummary = []'
    for kind in sweep.kinds:
        yield f'\n[experiments.{kind.name}]\nkind = "{kind.name}"'
        yield from (f'{name} = "{show(value, UNITS[name])}"' for name, value in sweep.fixed(kind).items())
    for field in sweep.fields:
        yield f"\n[axes.{json.dumps(field.path)}]\nlist = {json.dumps(list(field.values))}"


def run_sweep(
    sweep: SweepDefinition, folder: Path, settings: Settings | None = None
) -> tuple[SweepResult, CampaignOutcome]:
    """Run what is left of a sweep in a campaign's folder; the result holds what is done by now."""
    outcome = run_campaign(plan_of(sweep), folder, settings)
    return collect_sweep(sweep, folder), outcome


def collect_sweep(sweep: SweepDefinition, folder: Path) -> SweepResult:
    """Result of a sweep from the rows of its campaign."""
    store = open_store(folder)
    with closing(store.index()) as index:
        rows = [
            (
                row.experiment,
                _place(sweep, store.plan, row.number),
                row.summary if row.status == DONE else {REASON: row.error or row.status},
            )
            for row in index.rows()
            if row.status != PENDING
        ]
    return result_of(sweep, rows)


def _place(sweep: SweepDefinition, plan: Plan, number: int) -> tuple[int, ...]:
    """Place of a case among the axes of its analysis."""
    one = plan.case(number)
    kind = next(kind for kind in sweep.kinds if kind.name == one.experiment)
    known = {axis.name: axis.values for axis in plan.axes}
    return tuple(known[field.path].index(one.values[field.path]) for field in sweep.axes_of(kind))


def sweep_in_folder(
    machine: Plant | Machine | str,
    over: Over,
    folder: str | Path,
    what: str | tuple[str, ...] | list[str] = WHAT,
    speed: float | str = 0.0,
    pressure: float | str = 0.5e6,
    highest_speed: float | str | None = None,
    settings: Settings | None = None,
) -> SweepResult:
    """`rs.analysis.sweep` as a campaign in a folder: nothing is computed twice, and the same call continues.

    Parameters
    ----------
    machine, over, what, speed, pressure, highest_speed
        As of `rs.analysis.sweep`.
    folder : path
        Folder of the campaign; on a cluster, one that all workers see.
    settings : Settings, optional
        Number of workers, or a scheduler.

    Raises
    ------
    DataError, MachineFileError
        As `rs.analysis.sweep`.
    StoreError, ClusterError
        As `run_campaign`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> over = {"pressure": "0.4 MPa, 0.5 MPa"}
    >>> found = rs.campaign.sweep_in_folder("dtu_gas_bearing", over, "my_sweep", "flow")  # doctest: +SKIP
    """
    defined = make_sweep(machine, over, what, speed, pressure, highest_speed)
    return run_sweep(defined, Path(folder), settings)[0]
