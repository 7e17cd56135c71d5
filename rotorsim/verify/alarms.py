"""Alarms of a law in the runs of a verification: in which run, in how many samples, which."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from rotorsim.control.designs.plants import point_text
from rotorsim.verify.criteria import Criteria, Row, at_most
from rotorsim.verify.impacts import ImpactResponse
from rotorsim.verify.running import Run


@dataclass(frozen=True)
class Alarms:
    """Bad samples of a law in a run: how many of how many, a sentence with the last alarm, whether sensors are sound.

    Examples
    --------
    >>> Alarms("run-up", 40, 4000, "40 bad samples").share
    0.01
    """

    run: str
    bad: int
    samples: int
    sentence: str
    sound: bool = True

    @property
    def share(self) -> float:
        """Part of the samples in which the law was suspended."""
        return self.bad / self.samples if self.samples else 0.0

    @property
    def text(self) -> str:
        """Run, number, alarm."""
        return f"{self.run}: of {self.samples} samples {self.sentence}"


def of_run(name: str, run: Run, sound: bool = True) -> Alarms:
    """Alarms of a run of a verification."""
    return Alarms(name, *run.alarms, sound)


def of_hits(found: Iterable[ImpactResponse], machine: str = "") -> Iterator[Alarms]:
    """Alarms of the hits at each operating point."""
    for one in found:
        where = ", ".join(filter(None, (point_text(one.speed, one.pressure), machine)))
        yield Alarms(f"hits at {where}", one.bad, one.samples, one.alarm)


def row(found: Iterable[Alarms], criteria: Criteria) -> Row:
    """Largest part of a run with sound sensors in which the law was suspended."""
    sound = [one for one in found if one.sound]
    worst = max(sound, key=lambda one: one.share)
    runs = sum(one.bad > 0 for one in sound)
    remark = f"in {runs} of {len(sound)} runs; {worst.text}" if runs else ""
    most = None if criteria.suspended is None else 100 * criteria.suspended
    return at_most("suspended by alarms, sound sensors", 100 * worst.share, most, "% of a run", remark)
