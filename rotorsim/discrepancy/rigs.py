"""Rigs of a loop: a hidden machine that is simulated, or a folder into which measured records are put."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from rotorsim.base.errors import DataError
from rotorsim.discrepancy.data.changes import known_changes
from rotorsim.discrepancy.hidden_machine import read_truth, record_of, truth_twin
from rotorsim.discrepancy.plan.experiments import ExperimentOption, PlannedRecord
from rotorsim.discrepancy.twin.parameters import ParameterPoint
from rotorsim.discrepancy.twin.plant import Twin
from rotorsim.machine import Machine

if TYPE_CHECKING:
    import xarray as xr

VIRTUAL = "virtual:"
"""Prefix of the folder of a hidden machine."""
FIRST_NOISE = 1000
"""Number of the noise of the first new record: those of `hide` are lower."""
LOOK = 1.0
"""Time [s] between two looks into a folder."""
READABLE = (".nc", ".csv", ".mat", ".wav", ".tdms", ".uff", ".unv")
"""Endings of files that may be records."""


class ExperimentRig(Protocol):
    """Rig that makes the records of a loop."""

    @property
    def name(self) -> str:
        """Name of the rig, as the command line gives it."""

    def check(self, out: str | Path | None) -> None:
        """Raise DataError where the rig is not there, or where results in `out` would be among its records."""

    def begin(self, given: Sequence[Any]) -> list[Any]:
        """Records to begin with, as Datasets or absolute paths, where others are `given`."""

    def arrived(self) -> list[Any]:
        """Absolute paths of records that have come since the last call of any of these, without being waited for."""

    def run(self, option: ExperimentOption, number: int, waiting: Callable[[], None]) -> list[Any]:
        """Records of an experiment, the loop's one of this number from 1; none if none came in time."""


@dataclass(frozen=True)
class VirtualRig:
    """A machine that `hide` has made: its records to begin with, its hidden truth for new ones."""

    folder: Path
    machine: Machine

    @property
    def name(self) -> str:
        """Name of the rig, as the command line gives it."""
        return f"{VIRTUAL}{self.folder.resolve()}"

    def check(self, out: str | Path | None) -> None:
        """Raise DataError if the truth is missing, or if `out` lies in the folder of the hidden machine."""
        refuse_same(out, self.folder)
        self.truth  # noqa: B018  (found missing before hours of work)

    def begin(self, given: Sequence[Any]) -> list[Any]:
        """The records that are given, else those that were hidden with the truth."""
        if given:
            return list(given)
        found = sorted((self.folder / "records").resolve().glob("*.nc"))
        if not found:
            raise DataError(f"{self.folder}: has no folder 'records'; give the folder that rotorsim hide has made")
        return list(found)

    @cached_property
    def truth(self) -> Any:
        """Sealed truth, which the diagnosis never reads."""
        return read_truth(self.folder / "sealed" / "truth.json")

    @cached_property
    def twin(self) -> Twin:
        """Plant of the hidden machine."""
        return truth_twin(self.machine)

    def arrived(self) -> list[Any]:
        """No records: the machine is recorded by experiments alone."""
        return []

    def run(self, option: ExperimentOption, number: int, waiting: Callable[[], None]) -> list[Any]:
        """Record of an experiment on the hidden machine."""
        waiting()
        return [record_on(self.machine, self.twin, self.truth.point, self.truth.seed, option, number)]


def record_on(
    machine: Machine, twin: Twin, point: ParameterPoint, seed: int, option: ExperimentOption, number: int
) -> xr.Dataset:
    """Record of an experiment on a hidden machine, which states what was changed on purpose."""
    stated = option.changes(machine)
    planned = PlannedRecord(f"next_{number}", "fit", option.experiment, FIRST_NOISE + number)
    changes = known_changes(machine, stated, "next")
    record = record_of(twin, planned, point, seed, tiled=True, changes=changes)
    return record.assign_attrs(changes=json.dumps(stated)) if stated else record


@dataclass(frozen=True)
class FolderRig:
    """A folder into which records are put, one after another, as their experiments were made."""

    folder: Path
    longest: float = 8 * 3600.0
    """Time [s] to wait for a record."""
    taken: set[Path] = field(default_factory=set)

    @property
    def name(self) -> str:
        """Absolute path of the folder."""
        return str(self.folder.resolve())

    def check(self, out: str | Path | None) -> None:
        """Raise DataError if the folder is missing, or if `out` is not given or lies in it."""
        if not self.folder.is_dir():
            raise DataError(f"--rig: {self.folder} is not a folder; make it and put the records there are into it")
        if out is None:
            raise DataError("decide: a rig that is a folder needs out, where the plan of the next experiment is put")
        refuse_same(out, self.folder)

    def begin(self, given: Sequence[Any]) -> list[Any]:
        """The records that are given and those that are there and complete."""
        self.taken.update(self._complete())
        return [*given, *sorted(self.taken - {r for r in given if isinstance(r, Path)})]

    def arrived(self) -> list[Any]:
        """New records that are complete; one that still grows is waited for."""
        new = self._complete() - self.taken
        self.taken.update(new)
        return sorted(new)

    def run(self, option: ExperimentOption, number: int, waiting: Callable[[], None]) -> list[Any]:
        """New records, as soon as there are any that do not grow any more."""
        end = time.monotonic() + self.longest
        while time.monotonic() < end:
            waiting()
            if new := self.arrived():
                return new
        return []

    def _complete(self) -> set[Path]:
        """Absolute paths of the records, once none of them grows any more."""
        while True:
            before = self._sizes()
            time.sleep(LOOK if set(before) - self.taken else 0.2 * LOOK)
            if before == self._sizes():
                return {path for path, size in before.items() if size > 0}

    def _sizes(self) -> dict[Path, int]:
        found = {}
        for path in self.folder.resolve().rglob("*"):
            with suppress(FileNotFoundError):
                if path.suffix.lower() in READABLE and path.is_file():
                    found[path] = path.stat().st_size
        return found


def refuse_same(out: str | Path | None, folder: Path) -> None:
    """Raise DataError for results in a rig's folder, where they would be taken for records."""
    if out is not None and Path(out).resolve().is_relative_to(folder.resolve()):
        raise DataError(f"--out: {out} is in the folder of the rig, {folder}; give another one")


def open_rig(text: str, machine: Machine, longest: float = 8 * 3600.0) -> ExperimentRig:
    """Rig from its text: virtual:FOLDER of `hide`, or a folder of records; raises DataError for neither."""
    if text.startswith(VIRTUAL):
        return VirtualRig(Path(text.removeprefix(VIRTUAL)), machine)
    if ":" in text and not Path(text).exists():
        raise DataError(f"--rig: '{text}' is neither virtual:FOLDER (of rotorsim hide) nor a folder; give one of these")
    return FolderRig(Path(text), longest)
