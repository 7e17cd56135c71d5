"""Repeated disturbed runs of a command in its own folder, and a final run to the end."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fault_injection.checks import KINDS, SAMPLE, Fault, files, left_over, messages, reported_length, samples
from fault_injection.commands import OUT, Command
from fault_injection.running import Disturb, Ended, Running, run

BATCH = 5
"""Tries one after the other in one folder, before the command runs to its end in it."""
BLOCK = 5000
"""Samples from one state of a record that survives a kill to the next."""
CLOCK = Path(__file__).parents[1] / "clock"
TABLE = "ROTORSIM_FAULT_TABLE"
"""Environment variable: file to which each test adds a line of JSON with its counts."""


@dataclass(frozen=True)
class Undisturbed:
    """Files that an undisturbed command leaves, and its time [s]."""

    folder: Path
    seconds: float

    @property
    def size(self) -> int:
        """Bytes of its files."""
        return sum(path.stat().st_size for path in self.folder.rglob("*") if path.is_file())

    @property
    def largest(self) -> int:
        """Bytes of its largest file."""
        return max(path.stat().st_size for path in self.folder.rglob("*") if path.is_file())


@dataclass
class CommandTrial:
    """A folder in which a command is tried."""

    command: Command
    inputs: Path
    work: Path
    force: bool
    prepare: Callable[[Path], object] | None = None
    environment: Mapping[str, str] = field(default_factory=dict)

    @property
    def out(self) -> Path:
        """Folder of the results."""
        return self.work / OUT

    def begin(self) -> CommandTrial:
        """Make the folders."""
        self.out.mkdir(parents=True, exist_ok=True)
        if self.prepare is not None:
            self.prepare(self.out)
        return self

    def run(self, disturb: Disturb | None = None, force: bool = False, largest: int | None = None) -> Ended:
        """Run the command."""
        line = self.command.line(str(self.inputs)) + ["--force"] * (force and self.force)
        return run(line, self.work, self.environment, disturb, largest=largest)

    def found(self, ended: Ended, codes: set[int], reference: Undisturbed) -> list[Fault]:
        """Faults of a try: messages, files and the length of a record that was cut."""
        cut = reported_length(ended, self.out / self.command.record) if self.command.record else []
        return messages(ended, codes) + files(self.out, reference.folder) + cut

    def again(self, reference: Undisturbed) -> list[Fault]:
        """Faults of the same command, run to its end afterwards; with --force where it asks for that."""
        self.out.mkdir(exist_ok=True)
        ended = self.run()
        if ended.code == 2 and "--force" in ended.stderr:
            ended = self.run(force=True)
        complete = self.command.kept and ended.code == 2 and "there already" in ended.stderr
        codes = {2} if complete else {self.command.code}
        missing = [name for name in self.command.files if not any(self.out.glob(name))]
        lacks = [Fault("other", f"run again, lacks {missing}: {ended.stderr[-500:]}")] if missing else []
        return self.found(ended, codes, reference) + lacks + left_over(self.out) + self.recovered(ended)

    def recovered(self, ended: Ended) -> list[Fault]:
        """Records of killed runs that are shorter than the message states."""
        found = []
        for seconds, name in re.findall(r"its (\d+\.\d) s are kept in (\S+)", ended.stderr):
            kept = samples(self.work / name) * SAMPLE
            if f"{kept:.1f}" != seconds:
                found.append(Fault("lost", f"{name}: {kept:.1f} s are kept, not {seconds}"))
        return found


def seed_of(*words: object) -> np.random.Generator:
    """Random numbers that belong to a test."""
    return np.random.default_rng(zlib.crc32(repr(words).encode()))


def at(moment: float, number: int, group: bool) -> Disturb:
    """Send a signal after so long [s]."""

    def disturb(running: Running) -> None:
        if running.wait(moment):
            running.send(number, group)

    return disturb


def moments(command: Command, number: int, count: int, length: float) -> list[float]:
    """Random moments, one in each part of the length [s], in random order."""
    rng = seed_of(command.name, number, count)
    parts = (np.arange(count) + rng.uniform(size=count)) / count
    return [float(t) for t in rng.permutation(parts * length)]


Make = Callable[[], CommandTrial]


def signalled(make: Make, reference: Undisturbed, number: int, when: list[float]) -> list[Fault]:
    """A signal at each of these moments [s]; after every few tries a run to the end."""
    found: list[Fault] = []
    trial, owed = make(), 0
    codes = (
        {trial.command.code, -signal.SIGKILL} if number == signal.SIGKILL else {trial.command.code, 130, -signal.SIGINT}
    )  # a shell shows 130 for both
    for k, moment in enumerate(when):
        # alone, or as a terminal sends it, which kills no processes
        ended = trial.run(at(moment, number, bool(k % 2) and number == signal.SIGINT), force=k % BATCH > 0)
        allowed = complete(trial, ended, codes)
        found += dated(trial.found(ended, allowed, reference), f"signal {number} at {moment:.2f} s")
        owed += growing(trial, reference)
        if (k + 1) % BATCH == 0 or k + 1 == len(when) or trial.command.kept:
            found += dated(trial.again(reference), f"again after signal {number} at {moment:.2f} s")
            kept = sum(samples(path) for path in trial.out.rglob("*-killed*.nc"))
            if kept < owed:
                found.append(Fault("lost", f"{kept} samples of killed runs are kept, {owed} were written"))
            trial, owed = make(), 0
    return found


def complete(trial: CommandTrial, ended: Ended, codes: set[int]) -> set[int]:
    """Codes that are allowed: also that of a command that found its results there and never replaces them."""
    return codes | {2} if trial.command.kept and "there already" in ended.stderr else codes


def growing(trial: CommandTrial, reference: Undisturbed) -> int:
    """Samples that a killed run must have committed, by the size of its file; 0 for a file that is known."""
    if not trial.command.record:
        return 0
    whole = reference.folder / trial.command.record
    per_sample = whole.stat().st_size / samples(whole)
    new = [path for path in trial.out.rglob(".*.growing.part") if _fresh(path)]
    return sum(max(int(p.stat().st_size / per_sample) // BLOCK - 1, 0) * BLOCK for p in new)


_seen: set[tuple[str, int]] = set()


def _fresh(path: Path) -> bool:
    key = (str(path), path.stat().st_ino)
    fresh = key not in _seen
    _seen.add(key)
    return fresh


def dated(found: list[Fault], when: str) -> list[Fault]:
    """Faults with the moment at which they came."""
    return [Fault(one.kind, f"{when}: {one.text}") for one in found]


def tally(command: Command, fault: str, tries: int, found: list[Fault]) -> None:
    """Add counts to the table, and fail if there is a fault."""
    if table := os.environ.get(TABLE):
        counts = Counter(one.kind for one in found)
        row = {"command": command.name, "fault": fault, "tries": tries} | {kind: counts[kind] for kind in KINDS}
        with open(table, "a", encoding="utf-8") as file:
            file.write(json.dumps(row | {"texts": [f"{one.kind}: {one.text}" for one in found]}) + "\n")
    assert not found, f"{len(found)} in {tries} tries:\n" + "\n".join(f"[{one.kind}] {one.text}" for one in found)


@contextmanager
def disk(folder: Path, size: int) -> Iterator[Callable[[str], None]]:
    """A disk of so many bytes at a folder; yields a function that changes its options. Needs root."""
    folder.mkdir(parents=True, exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={max(size, 4096)}", "none", folder], check=True)
    try:
        yield lambda options: subprocess.run(["mount", "-o", f"remount,{options}", folder], check=True) and None
    finally:
        subprocess.run(["umount", "-l", folder], check=True)


def can_mount() -> bool:
    """Whether a disk can be made here."""
    return hasattr(os, "geteuid") and os.geteuid() == 0 and shutil.which("mount") is not None and _mounts()


def _mounts() -> bool:
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(["mount", "-t", "tmpfs", "none", folder], capture_output=True, check=False)
        if done.returncode == 0:
            subprocess.run(["umount", folder], check=True)
    return done.returncode == 0
