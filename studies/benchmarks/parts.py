"""Parts of `python studies/benchmarks/measure.py` and the functions of each, imported on demand."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from studies.benchmarks.result import Figure


@dataclass(frozen=True)
class BenchmarkPart:
    """Functions as "module.function" of this folder; `cold` start with an empty cache, `full` take many minutes."""

    usual: tuple[str, ...]
    cold: tuple[str, ...] = ()
    full: tuple[str, ...] = ()
    needs: str = ""
    """A package of an extra without which nothing of it runs."""

    def lacks(self) -> str:
        """Packages to install; empty if none is missing."""
        try:
            there = not self.needs or find_spec(self.needs) is not None
        except ValueError:  # an import that is blocked
            there = False
        return "" if there else self.needs

    def jobs(self, cold: bool, full: bool) -> list[Callable[[], Iterable[Figure]]]:
        """The functions, each yielding figures."""
        names = (*self.usual, *(self.cold if cold else ()), *(self.full if full else ()))
        return [_function(name) for name in names]


PARTS: dict[str, BenchmarkPart] = {
    "speed": BenchmarkPart(
        (
            "speed.imports",
            "speed.whole_run",
            "speed.equilibrium",
            "speed.steps",
            "whole_plant.whole_plant",
            "whole_plant.long_run",
        ),
        cold=("speed.first_compilation",),
    ),
    "accuracy": BenchmarkPart(("accuracy.rig", "accuracy.grids", "accuracy.decay", "accuracy.mass")),
    "linear": BenchmarkPart(("linear.points", "linear.maps", "linear.onsets", "linear.crossings", "linear.films")),
    "identification": BenchmarkPart(
        ("identified_models.one_record", "identified_models.sensitivities", "structures.structures"),
        full=(
            "identified_models.starts",
            "identified_models.truth",
            "identified_models.many_records",
            "identified_models.public",
            "intervals.intervals",
            "closed_loops.closed_loops",
        ),
    ),
    "campaign": BenchmarkPart(("campaign.efficiency", "campaign.overhead"), full=("campaign.thesis", "campaign.many")),
    "fmu": BenchmarkPart(("unit.unit",), cold=("unit.export_cold",), needs="fmpy"),
    "control": BenchmarkPart(("control_laws.runtime", "control_laws.designs"), full=("control_laws.synthesis",)),
    "sensor-faults": BenchmarkPart((), full=("sensor_faults.sensor_faults",)),
    "control-package": BenchmarkPart(("control_package.against_control",), needs="control"),
    "rig": BenchmarkPart(()),
}
"""Benchmarks by part, as `measure` takes its name."""


def _function(name: str) -> Callable[[], Iterable[Figure]]:
    module, function = name.split(".")
    job: Callable[[], Iterable[Figure]] = getattr(import_module(f"studies.benchmarks.{module}"), function)
    return job
