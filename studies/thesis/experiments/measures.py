"""Measures of an experiment by name, and the cases that worker processes compute."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from rotorsim.analysis.calibrate import judge
from rotorsim.analysis.targets import read_targets
from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.machine import Machine
from rotorsim.plant import Plant
from studies.thesis.experiments import measures_control as control, measures_identification as identification

Measure = Callable[[Plant, Plant], dict[str, float]]
MEASURES: dict[str, Measure] = {
    one.__name__: one
    for one in (
        identification.actuators, identification.fits, identification.orders, identification.runout,
        identification.ranges, identification.scatter, control.placement, control.reduced, control.limit,
        control.decentralised, control.nominal, control.interpolation, control.hits, control.run_end, control.safe,
        control.whirl,
    )
}  # fmt: skip
"""Functions of the changed and the unchanged plant to numbers by claim and figure."""
TARGETS = "dtu_orifice"
"""Calibration targets whose rows a change may break."""
KEPT = ("met", "inside")


def measure(name: str) -> Measure:
    """The measure of a name; raises DataError for an unknown one."""
    if name not in MEASURES:
        raise DataError(f"experiments: there is no measure {name!r}; {did_you_mean(name, MEASURES)}")
    return MEASURES[name]


def figures(changed: str, shipped: str, name: str) -> dict[str, float | str]:
    """Numbers of a changed machine; `failed` with a sentence where it does not run."""
    try:
        return dict(measure(name)(_plant(changed), _plant(shipped)))
    except RotorsimError as error:
        return {"failed": str(error)}


def broken(changed: str, shipped: str) -> list[str]:
    """Rows of Table E.2 and the whirl's onset that the shipped machine keeps and the changed one does not."""
    targets = read_targets(TARGETS)
    before, after = (judge(Machine.from_text(text), targets) for text in (shipped, changed))
    return [name for name, verdict in before.items() if verdict in KEPT and after[name] not in KEPT]


@lru_cache(maxsize=2)
def _plant(machine: str) -> Plant:
    return Plant(Machine.from_text(machine))
