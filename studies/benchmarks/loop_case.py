"""Loops of the parts `decide` and `ties`, and seeds that were drawn and rejected, as lines of a file."""

import json
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.base.files import write_text
from rotorsim.discrepancy.verdict import NOTHING, SURE


@dataclass(frozen=True)
class LoopCase:
    """A loop's outcome: the most probable explanation after each step, its probability and whether it is right.

    truths : probability of the hidden one after each step
    expected : chance of a decision, if an effect is missing, that the plan gave for the run before a step; first NaN
    """

    number: int
    hidden: tuple[str, ...]
    times: float
    tops: tuple[tuple[str, float, bool], ...]
    truths: tuple[float, ...]
    expected: tuple[float, ...]
    experiments: tuple[str, ...]
    end: str
    status: str

    @property
    def decided(self) -> int | None:
        """Experiments after which the hidden explanation had 95 %; None if it never had."""
        return next((k for k, p in enumerate(self.truths) if p >= SURE), None)

    @property
    def tie(self) -> bool:
        """Whether no explanation had 95 % before the first experiment."""
        return bool(self.tops) and self.tops[0][1] < SURE

    @property
    def wrong(self) -> bool:
        """Whether another explanation ever had 95 %; nothing missing counts at the end: records may not show it yet."""
        ever = any(p >= SURE and not right for name, p, right in self.tops if name != NOTHING)
        return ever or any(p >= SURE and not right for _, p, right in self.tops[-1:])


@dataclass(frozen=True)
class Rejected:
    """A seed without a loop that counts, kept so that it is not run again."""

    number: int
    rejected: str
    """Why."""


Case = LoopCase | Rejected


def counted(
    run: Callable[[int], Case], count: int, seed: int, done: dict[int, Case], path: Path | None = None
) -> Iterator[LoopCase]:
    """The first `count` loops from seed on; seeds that are `done` are not run again, others are added to the file."""
    found, number = 0, seed
    while found < count:
        if number not in done:
            done[number] = run(number)
            write_cases(done.values(), path)
        if isinstance(case := done[number], LoopCase):
            found += 1
            yield case
        number += 1


def write_cases(cases: Iterable[Case], path: Path | None) -> None:
    """Write one line for each case, in one step; nothing without a path. Raises WriteError."""
    if path is not None:
        write_text(path, "".join(json.dumps(asdict(case)) + "\n" for case in cases))


def read_cases(path: Path | None) -> dict[int, Case]:
    """Cases by number that are in a file; none if it does not exist.

    Raises DataError for a line of something else.
    """
    lines = path.read_text(encoding="utf-8-sig").splitlines() if path is not None and path.exists() else []
    done: dict[int, Case] = {}
    for number, line in enumerate(lines, 1):
        try:
            case = _case(json.loads(line))
            done[case.number] = case
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            text = f"{path}: line {number} is not a case of the part decide; name another file"
            raise DataError(text, argument="line", value=line) from error
    return done


def _case(row: dict[str, Any]) -> Case:
    if "rejected" in row:
        return Rejected(**row)
    lists = {name: value for name, value in row.items() if isinstance(value, list)}
    return LoopCase(**(row | {k: tuple(map(tuple, v)) if k == "tops" else tuple(v) for k, v in lists.items()}))


__all__ = ["LoopCase", "Rejected", "counted", "read_cases", "write_cases"]
