"""Controllers available on the live rig: the proportional law, shipped laws and saved ones.

The shipped law `hinf` was designed in the folder `shipped` on the identified Model 2 of the shipped rig:

    rotorsim design hinf rig_model_2.json --preset rig --out hinf.json

It has the limits of plausibility of that design, so sensors that are turned or reversed on the page give an alarm.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rotorsim.base.errors import DataError
from rotorsim.control.law import load_law
from rotorsim.experiments.proportional_law import ProportionalLaw
from rotorsim.live.rig.controls import OFF, P_LAW, driven_axes
from rotorsim.machine import Machine

SHIPPED = Path(__file__).parent / "shipped"
LAWS = ("hinf",)
"""Shipped laws by name; the folder also holds the model that they were designed on."""


def read_laws(paths: Sequence[Path], machine: Machine | None = None) -> dict[str, Any]:
    """Laws by file name, after those of the machine; raises LawError or DataError.

    A machine whose pins are not driven along both axes takes none.

    Examples
    --------
    >>> import rotorsim as rs
    >>> sorted(rs.live.read_laws([], machine))[:1]
    ['P']
    """
    if machine is not None and driven_axes(machine) != "xy":
        if paths:
            raise DataError(f"--law: {machine.name} has no injectors that a controller could move; leave it out")
        return {OFF: None}
    laws: dict[str, Any] = {OFF: None, P_LAW: P_LAW}
    laws |= {path.stem: load_law(path) for path in (SHIPPED / f"{name}.json" for name in LAWS)}
    for path in paths:
        if path.stem in laws:
            raise DataError(f"--law {path}: there is a controller '{path.stem}' already; rename the file")
        laws[path.stem] = load_law(path)
    return laws


def running(law: Any, centre: tuple[float, float]) -> Any:
    """Controller at rest, with its centre at `centre` [m] if it has none of its own."""
    if law == P_LAW:
        return ProportionalLaw(centre=centre)
    return law.with_(centre=centre) if law.centre is None else law
