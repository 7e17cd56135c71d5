"""Runs a plan's records into a folder, several at a time; what is there already is kept."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from rotorsim.experiments import Prbs, Steady, run
from rotorsim.plant.plant import Plant
from rotorsim.study.plan import Job, Plan

KEPT = ("reference", "disc", "disc_measured", "pin", "angle_measured", "speed_measured", "pressure_measured")
"""Variables that identification and the noise-free fit need; the rest would double the files."""
_plant: Any = None


def make_records(
    machine: Any, plan: Plan, folder: Path, workers: int = 2, told: Callable[[int, int], None] | None = None
) -> list[Path]:
    """Files of all records of the plan on a machine; `told(done, total)` is called as they are finished."""
    folder.mkdir(parents=True, exist_ok=True)
    jobs = plan.jobs()
    missing = [job for job in jobs if not (folder / job.name).exists()]
    done = len(jobs) - len(missing)
    if missing:
        with ProcessPoolExecutor(workers, get_context("spawn"), _begin, (machine,)) as pool:
            for _ in pool.map(_record, missing, [folder] * len(missing)):
                done += 1
                if told is not None:
                    told(done, len(jobs))
    return [folder / job.name for job in jobs]


def _begin(machine: Any) -> None:
    global _plant
    _plant = Plant(machine)


def _record(job: Job, folder: Path) -> None:
    from identification import save

    if job.role == "steady":
        experiment: Any = Steady(job.speed, job.pressure, job.duration)
    else:
        experiment = Prbs(job.speed, job.pressure, duration=job.duration, sequence=job.number)
    made = run(_plant, experiment, seed=job.number)
    made = made[[name for name in KEPT if name in made]].assign_attrs(role=job.role)
    part = folder / f".{job.name}.{os.getpid()}.nc"
    save(made, part)
    os.replace(part, folder / job.name)
