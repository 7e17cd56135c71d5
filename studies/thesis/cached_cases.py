"""Parallel cases with cached results: one file per case, named by a hash of its inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from rotorsim.base.cache import Cache
from rotorsim.base.processes import spread

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class CachedCase:
    """A function "module:name" of plain arguments whose result is plain JSON; stage and key name its file."""

    stage: str
    name: str
    key: str
    function: str
    arguments: tuple[Any, ...]

    @property
    def file(self) -> str:
        """Name of its file."""
        return f"{self.stage}-{self.key}"


def run_cases(folder: Path, cases: Iterable[CachedCase], workers: int, progress: Progress) -> dict[str, Any]:
    """Results by the cases' names; what is in `folder` already is read, all else is run and written as it ends."""
    listed = list(cases)
    cache = Cache(folder, required=True)
    found = {case.name: cache.find(case.file) for case in listed}
    left = [case for case in listed if found[case.name] is None]
    done = len(listed) - len(left)
    if workers <= 1 or len(left) <= 1:
        for case in left:
            progress(case.name, done, len(listed))
            found[case.name] = cache.keep(case.file, run_case(case.function, case.arguments))
            done += 1
        return found
    for number, result in spread(run_case, [(case.function, case.arguments) for case in left], workers):
        found[left[number].name] = cache.keep(left[number].file, result)
        done += 1
        progress(left[number].name, done, len(listed))
    return found


def run_case(function: str, arguments: tuple[Any, ...]) -> Any:
    """The result of a case."""
    module, name = function.split(":")
    return getattr(import_module(module), name)(*arguments)
