"""Rigs of a loop: a hidden machine that is simulated, or a folder into which measured records are put."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from rotorsim.base.errors import DataError
from rotorsim.discrepancy.blind_test.design import Planned
from rotorsim.discrepancy.blind_test.hide import read_truth, record_of, truth_twin
from rotorsim.discrepancy.data.changes import known_changes
from rotorsim.discrepancy.plan.options import Option
from rotorsim.discrepancy.residuals.comparison import Point
from rotorsim.discrepancy.twin.twin import Twin
from rotorsim.machine import Machine

if TYPE_CHECKING:
    import xarray as xr

VIRTUAL = "virtual:"
"""Prefix of the folder of a hidden machine."""
FIRST_NOISE = 1000
"""Number of the noise of the first new record: those of `hide` are lower."""
LOOK = 1.0
"""Seconds between two looks into a folder."""
READABLE = (".nc", ".csv", ".mat", ".wav", ".tdms", ".uff", ".unv")


class Rig(Protocol):
    """What makes the records of a loop."""

    @property
    def name(self) -> str:
        """As it is given."""

    def begin(self, given: Sequence[Any]) -> list[Any]:
        """Records to begin with, as Datasets or paths, where others are `given`."""

    def run(self, option: Option, number: int, waiting: Callable[[], None]) -> list[Any]:
        """Records of an experiment, the loop's one of this number from 1; none if none came in time."""


@dataclass(frozen=True)
class VirtualRig:
    """A machine that `hide` has made: its records to begin with, its hidden truth for new ones."""

    folder: Path
    machine: Machine

    @property
    def name(self) -> str:
        """As it is given."""
        return f"{VIRTUAL}{self.folder}"

    def begin(self, given: Sequence[Any]) -> list[Any]:
        """The records that are given, else those that were hidden with the truth."""
        self.truth  # noqa: B018  (found missing before hours of work)
        if given:
            return list(given)
        if not (self.folder / "records").is_dir():
            raise DataError(f"{self.folder}: has no folder 'records'; give the folder that rotorsim hide has made")
        return [self.folder / "records"]

    @cached_property
    def truth(self) -> Any:
        """The sealed truth, which the diagnosis never sees."""
        return read_truth(self.folder / "sealed" / "truth.json")

    @cached_property
    def twin(self) -> Twin:
        """Plant of the hidden machine."""
        return truth_twin(self.machine)

    def run(self, option: Option, number: int, waiting: Callable[[], None]) -> list[Any]:
        """Record of an experiment on the hidden machine."""
        waiting()
        return [record_on(self.machine, self.twin, self.truth.point, self.truth.seed, option, number)]


def record_on(machine: Machine, twin: Twin, point: Point, seed: int, option: Option, number: int) -> xr.Dataset:
    """Record of an experiment on a hidden machine, which states what was changed on purpose."""
    stated = option.changes(machine)
    planned = Planned(f"next_{number}", "fit", option.experiment, FIRST_NOISE + number)
    changes = known_changes(machine, stated, "next")
    record = record_of(twin, planned, point, seed, tiled=True, changes=changes)
    return record.assign_attrs(changes=json.dumps(stated)) if stated else record


@dataclass(frozen=True)
class FolderRig:
    """A folder into which records are put, one after another, as their experiments were made."""

    folder: Path
    longest: float = 8 * 3600.0
    """Seconds to wait for a record."""
    taken: set[Path] = field(default_factory=set)

    @property
    def name(self) -> str:
        """As it is given."""
        return str(self.folder)

    def begin(self, given: Sequence[Any]) -> list[Any]:
        """The records that are given and those that are there."""
        if not self.folder.is_dir():
            raise DataError(f"--rig: {self.folder} is not a folder; make it and put the records there are into it")
        self.taken.update(self._there())
        return [*given, *sorted(self.taken)]

    def run(self, option: Option, number: int, waiting: Callable[[], None]) -> list[Any]:
        """New records, as soon as there are any that do not grow any more."""
        end = time.monotonic() + self.longest
        while time.monotonic() < end:
            waiting()
            sizes = {path: path.stat().st_size for path in self._there() - self.taken}
            time.sleep(LOOK)
            complete = [p for p, size in sizes.items() if p.exists() and p.stat().st_size == size > 0]
            if complete and len(complete) == len(sizes):
                self.taken.update(complete)
                return sorted(complete)
        return []

    def _there(self) -> set[Path]:
        return {p for p in self.folder.rglob("*") if p.suffix.lower() in READABLE and p.is_file()}


def open_rig(text: str, machine: Machine, longest: float = 8 * 3600.0) -> Rig:
    """Rig from its text: virtual:FOLDER of `hide`, or a folder of records; raises DataError for neither."""
    if text.startswith(VIRTUAL):
        return VirtualRig(Path(text.removeprefix(VIRTUAL)), machine)
    if ":" in text and not Path(text).exists():
        raise DataError(f"--rig: '{text}' is no rig; give virtual:FOLDER (of rotorsim hide) or a folder for records")
    return FolderRig(Path(text), longest)


__all__ = ["FolderRig", "Rig", "VirtualRig", "open_rig"]
