"""Common part of all `rotorsim experiment` commands: run, record, report, printed table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import typer

from rotorsim.base.errors import DataError
from rotorsim.commands.experiment.table import result_rows
from rotorsim.commands.options import (
    PlantOptions,
    leave_if_cut,
    leave_if_empty,
    note_compiling,
    print_table,
    reporting_kept_samples,
)
from rotorsim.commands.page_options import PageOptions
from rotorsim.commands.results import results
from rotorsim.experiments import Experiment, Outcome, record
from rotorsim.experiments.parameters import ask_speeds
from rotorsim.experiments.summary import summarise_experiment
from rotorsim.signals.record_blocks import open_record


def run_experiment(
    name: str, kind: Any, given: dict[str, Any], machine: str, settings: PlantOptions, page: PageOptions,
    seed: str, out: Path | None, force: bool, report: bool, as_json: bool,
) -> None:  # fmt: skip
    """Run an experiment, write its record and print the result table."""
    page.check(report)
    number = read_seed(seed)
    plant = settings.plant(machine)
    setup = kind(**given, Ts=plant.machine.sampling_time)
    ask_speeds(plant.machine, setup)
    names = (f"{name}.nc", f"{name}.html") if report else (f"{name}.nc",)
    with results(out, name, names, force) as folder:
        path = folder / names[0]
        page.begin(path.with_suffix(".html"), force)
        note_compiling(plant.assembly, "settle", "run")
        experiment = setup.experiment(plant) if hasattr(setup, "experiment") else setup
        outcome = record(plant, experiment, path, number, progress=not as_json)
        leave_if_empty(outcome, path)
        with reporting_kept_samples(path):
            _print_outcome(path, experiment, outcome, page if report else None, as_json)
    leave_if_cut(outcome, path)


def read_seed(text: str) -> int:
    """Seed from an option's text; raises DataError."""
    if not text.isdecimal() or len(text) > 16:
        raise DataError(f"--seed: '{text[:30]}' is not a whole number from 0 to 2^53 - 1; give e.g. --seed 1")
    return int(text)


def _print_outcome(
    path: Path, experiment: Experiment, outcome: Outcome, page: PageOptions | None, as_json: bool
) -> None:
    with open_record(path) as data:
        summary = summarise_experiment(data)
    files = {"record": str(path)} | (write_page(path, page) if page else {})
    if as_json:
        numbers = {"parameters": experiment.attrs(), "ended": outcome.ended, "solver": outcome.counters, "files": files}
        typer.echo(json.dumps(summary | numbers, indent=2))
    else:
        print_table(result_rows(summary), files)


def write_page(record: Path, options: PageOptions) -> dict[str, str]:
    """Write the report next to the record; returns its files."""
    from rotorsim.report.record import write_report

    page = record.with_suffix(".html")
    write_report(record, page)
    return {"report": str(page)} | options.finish(page)
