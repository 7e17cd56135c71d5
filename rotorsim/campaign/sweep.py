"""Sweep of a machine as a campaign: its plan, its run in a folder on several workers or a cluster, its result."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rotorsim.analysis.sweep import SweepResult, result_of
from rotorsim.analysis.sweep_definition import REASON, WHAT, Over, SweepDefinition, make_sweep
from rotorsim.base.units import show
from rotorsim.campaign.index import DONE, PENDING
from rotorsim.campaign.plan import Plan
from rotorsim.campaign.read_plan import make_plan
from rotorsim.campaign.run import CampaignOutcome, Settings, run_campaign
from rotorsim.campaign.store import open_store
from rotorsim.machine import Machine
from rotorsim.plant import Plant

NAME = "machine"
"""Name of the machine in the plan."""
UNITS = {"speed": "rad/s", "pressure": "Pa", "highest_speed": "rad/s"}


def plan_of(sweep: SweepDefinition) -> Plan:
    """Plan whose cases are the cells of a sweep."""
    return make_plan("\n".join(_lines(sweep)), machines={NAME: sweep.machine.text})


def _lines(sweep: SweepDefinition) -> Iterator[str]:
    """The plan's text: an experiment for each analysis, and the axes."""
    yield f'name = "sweep"\nmachine = "{NAME}"\nkeep = []\nsummary = []'
    for kind in sweep.kinds:
        yield f'\n[experiments.{kind.name}]\nkind = "{kind.name}"'
        yield from (f'{name} = "{show(value, UNITS[name])}"' for name, value in sweep.fixed(kind).items())
    for field in sweep.fields:
        yield f"\n[axes.{json.dumps(field.path)}]\nlist = {json.dumps(list(field.values))}"


def run_sweep(
    sweep: SweepDefinition, folder: Path, settings: Settings | None = None
) -> tuple[SweepResult, CampaignOutcome]:
    """Run what is left of a sweep in a campaign's folder; the result holds what is done by now."""
    outcome = run_campaign(plan_of(sweep), folder, settings)
    return collect_sweep(sweep, folder), outcome


def collect_sweep(sweep: SweepDefinition, folder: Path) -> SweepResult:
    """Result of a sweep from the rows of its campaign."""
    store = open_store(folder)
    index = store.index()
    try:
        rows = [
            (row.experiment, _place(sweep, store.plan, row.number), _values(row.status, row.summary, row.error))
            for row in index.rows()
            if row.status != PENDING
        ]
    finally:
        index.close()
    return result_of(sweep, rows)


def _place(sweep: SweepDefinition, plan: Plan, number: int) -> tuple[int, ...]:
    """Place of a case among the axes of its analysis."""
    one = plan.case(number)
    kind = next(kind for kind in sweep.kinds if kind.name == one.experiment)
    known = {axis.name: axis.values for axis in plan.axes}
    return tuple(known[field.path].index(one.values[field.path]) for field in sweep.axes_of(kind))


def _values(status: str, summary: dict[str, Any], error: str | None) -> dict[str, Any]:
    return summary if status == DONE else {REASON: error or status}


def sweep_in_folder(
    machine: Plant | Machine | str,
    over: Over,
    folder: str | Path,
    what: str | tuple[str, ...] | list[str] = WHAT,
    speed: float | str = 0.0,
    pressure: float | str = 0.5e6,
    highest_speed: float | str | None = None,
    settings: Settings | None = None,
) -> SweepResult:
    """`rs.analysis.sweep` as a campaign in a folder: nothing is computed twice, and the same call continues.

    Parameters
    ----------
    machine, over, what, speed, pressure, highest_speed
        As of `rs.analysis.sweep`.
    folder : path
        Folder of the campaign; on a cluster, one that all workers see.
    settings : Settings, optional
        Number of workers, or a scheduler.

    Raises
    ------
    DataError, MachineFileError
        As `rs.analysis.sweep`.
    StoreError, ClusterError
        As `run_campaign`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> over = {"pressure": "0.4 MPa, 0.5 MPa"}
    >>> found = rs.campaign.sweep_in_folder("dtu_gas_bearing", over, "my_sweep", "flow")  # doctest: +SKIP
    """
    defined = make_sweep(machine, over, what, speed, pressure, highest_speed)
    return run_sweep(defined, Path(folder), settings)[0]
