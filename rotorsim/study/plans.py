"""The campaigns that the study of identification against physics needs (thesis, section 2.5; CLAIMS I6)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from pathlib import Path
from signal import SIGINT
from typing import TYPE_CHECKING

from rotorsim.errors import DataError

if TYPE_CHECKING:
    from rotorsim.campaign import Plan
    from rotorsim.machine import Machine

RPM = pi / 30
HELD = ("validation", "hold_out", "centre")
"""Roles of records that no model is fitted to."""
KEPT = ("reference", "disc", "disc_measured", "pin", "angle_measured", "speed_measured", "pressure_measured")
"""Variables that identification and the noise-free fit need; the rest would double the files."""
_HEAD = """name = "{name}"
machine = "machine"
time_limit = "30 min"
keep = {kept}
"""
_PRBS = """
[experiments.{name}]
kind = "prbs"
amplitude = "1 V"
duration = "{duration:g} s"
sequence = {number}
seed = {number}
"""
_STEADY = """
[experiments.unexcited]
kind = "steady"
duration = "2 s"
seed = 9
"""
_AXIS = """
[axes.{name}]
list = {values}
"""


@dataclass(frozen=True)
class Layout:
    """Grid of speeds [rad/s] and pressures [Pa], duration of a record [s]; the thesis' by default."""

    speeds: tuple[float, ...] = tuple(1000 * RPM * k for k in range(7))
    pressures: tuple[float, ...] = (0.3e6, 0.4e6, 0.5e6, 0.6e6, 0.7e6)
    duration: float = 10.0

    def texts(self) -> Iterator[tuple[str, str]]:
        """Name and text of each plan: the grid with a second record to validate, and the centres of its cells."""
        for name, roles, first, (speeds, pressures) in (
            ("grid", ("identification", "validation"), 1, (self.speeds, self.pressures)),
            ("centres", ("centre",), 3, (_middles(self.speeds), _middles(self.pressures))),
        ):
            text = _HEAD.format(name=name, kept=list(KEPT))
            for number, role in enumerate(roles, first):
                text += _PRBS.format(name=role, duration=self.duration, number=number)
            text += _STEADY + _AXIS.format(name="speed", values=[f"{w / RPM:.9g} rpm" for w in speeds])
            yield name, text + _AXIS.format(name="pressure", values=[f"{p:.9g} Pa" for p in pressures])


QUICK = Layout(tuple(k * RPM for k in (0.0, 3000.0, 6000.0)), (0.3e6, 0.5e6, 0.7e6))


def _middles(values: tuple[float, ...]) -> tuple[float, ...]:
    return tuple((a + b) / 2 for a, b in pairwise(values))


def plans(machine: Machine, layout: Layout) -> dict[str, Plan]:
    """Plans by name, of any machine."""
    from rotorsim.campaign.reading import make_plan

    return {name: make_plan(text, machines={"machine": machine.text}) for name, text in layout.texts()}


def run(machine: Machine, layout: Layout, out: Path, workers: int) -> list[Path]:
    """Folders of the campaigns below `out`, run now or gone on with.

    Raises
    ------
    KeyboardInterrupt
        If Ctrl-C stopped a campaign.
    DataError
        If another signal did, or records are missing at its end.
    StoreError
        If a folder holds a campaign of another plan or machine.
    """
    from rotorsim.campaign import Settings, run_campaign

    folders = []
    for name, plan in plans(machine, layout).items():
        folder = out / name
        outcome = run_campaign(plan, folder, Settings(workers=workers, show=True))
        if outcome.stopped == SIGINT:
            raise KeyboardInterrupt
        if outcome.stopped or outcome.pending:
            raise DataError(f"{folder}: stopped with {outcome.pending} records left; the same command goes on")
        folders.append(folder)
    return folders
