"""Runs of the experiments: figures at every factor, kept by what they follow from, and the factor of the thesis'."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.machine import Machine
from studies.thesis.cached_cases import CachedCase, Progress, run_cases
from studies.thesis.claims.judge import MET, judge_figure
from studies.thesis.claims.rules import ClaimFigure
from studies.thesis.experiments.table import FactorStudy, changed, figure_of
from studies.thesis.stage_key import key_of

HOME = "studies.thesis.experiments.measures"


@dataclass(frozen=True)
class Found:
    """An experiment with its numbers by factor (`failed` by factor: why there are none) and, by the factor that the
    most figures are met at, the rows of Table E.2 that the machine then leaves."""

    experiment: FactorStudy
    numbers: dict[float, dict[str, float]]
    failed: dict[float, str]
    broken: list[str] = field(default_factory=list)

    @property
    def best(self) -> float:
        """Factor at which the most figures are met; of several the nearest to 1."""
        return min(self.experiment.factors, key=lambda factor: (-self.met(factor), abs(factor - 1)))

    def met(self, factor: float) -> int:
        """Number of figures that are met at a factor."""
        return sum(self.verdict(key, factor) == MET for key in self.experiment.figures)

    def verdict(self, key: str, factor: float) -> str:
        """The rules' verdict on a figure at a factor."""
        return judge_figure(figure_of(key), self.value(key, factor))

    def value(self, key: str, factor: float) -> float | None:
        """A figure at a factor."""
        return self.numbers.get(factor, {}).get(key)

    def reached(self, key: str) -> float | None:
        """Factor, nearest to 1, at which the figure is the thesis', by straight lines between the factors."""
        return reached(figure_of(key), [(f, v) for f in sorted(self.numbers) if (v := self.value(key, f)) is not None])


def reached(figure: ClaimFigure, points: Sequence[tuple[float, float]]) -> float | None:
    """Factor, nearest to 1, at which straight lines through (factor, value), ascending, pass the thesis' number.

    Of a one-sided figure the number passed is an end of the interval that it is met in. None where no line does.

    Examples
    --------
    >>> from studies.thesis.experiments.table import figure_of
    >>> reached(figure_of("I4.before"), [(1.0, 6.0), (2.0, 12.0)])
    1.5
    """
    finite = [(f, v) for f, v in points if isfinite(v)]
    wanted = [v for v in (figure.met if figure.one_sided else (figure.thesis,)) if isfinite(v)]
    found = [f for value in wanted for f in _crossings(finite, value)]
    return min(found, key=lambda f: abs(f - 1), default=None)


def _crossings(points: Sequence[tuple[float, float]], value: float) -> Iterator[float]:
    for (f, v), (g, w) in pairwise(points):
        if min(v, w) <= value <= max(v, w) and v != w:
            yield f + (value - v) / (w - v) * (g - f)


def run_experiments(
    machine: Machine, chosen: Sequence[FactorStudy], folder: Path, progress: Progress, workers: int = 1
) -> list[Found]:
    """The experiments on a machine; what is in `folder` already is read.

    Raises
    ------
    DataError
        If a field is no number of the machine, or it has no actuators.
    """
    if machine.actuators is None or machine.injection is None:
        raise DataError(f"{machine.name}: has no actuators in a gas film; the claims are of such a machine")
    texts = {(one.name, f): changed(machine, one, f).text for one in chosen for f in one.factors}
    cases = [_case(machine, one, f, texts[one.name, f]) for one in chosen for f in one.factors]
    results = run_cases(folder, cases, workers, progress)
    found = [_found(one, {f: results[f"{one.name} x {f:g}"] for f in one.factors}) for one in chosen]
    breaks = [_broken(machine, one, texts[one.experiment.name, one.best]) for one in found if one.best != 1]
    rows = run_cases(folder, breaks, workers, progress)
    return [Found(one.experiment, one.numbers, one.failed, rows.get(one.experiment.name, [])) for one in found]


def _case(machine: Machine, one: FactorStudy, factor: float, text: str) -> CachedCase:
    arguments = (text, machine.text, one.measure)
    key = key_of(*arguments, kind="experiments")
    return CachedCase("experiment", f"{one.name} x {factor:g}", key, f"{HOME}:figures", arguments)


def _found(experiment: FactorStudy, results: dict[float, dict[str, Any]]) -> Found:
    failed = {f: one["failed"] for f, one in results.items() if "failed" in one}
    return Found(experiment, {f: one for f, one in results.items() if f not in failed}, failed)


def _broken(machine: Machine, found: Found, text: str) -> CachedCase:
    key = key_of("broken", text, machine.text, kind="experiments")
    return CachedCase("broken", found.experiment.name, key, f"{HOME}:broken", (text, machine.text))
