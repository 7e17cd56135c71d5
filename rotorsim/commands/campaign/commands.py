"""`rotorsim campaign PLAN --out DIR`, and `status`, `retry`, `collect`, `check` for a campaign's store.

Exit code 0: all cases are done. 2: cannot be run; one sentence gives the reason. 3: all were run and some failed.
130 (143 for SIGTERM): stopped; the same command continues.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from rotorsim.campaign import load_plan
from rotorsim.campaign.run import retry as retry_failed, run_campaign
from rotorsim.commands.campaign.output import (
    collect_into,
    note_compiling_of_plan,
    print_outcome,
    print_plan,
    print_status,
    settings,
)
from rotorsim.commands.lazy_group import example

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a campaign.")]
Workers = Annotated[int | None, typer.Option("--workers", help="Processes on this machine; default one per core.")]
Scheduler = Annotated[str | None, typer.Option("--scheduler", help="Dask scheduler to use, e.g. tcp://host:8786.")]
TimeLimit = Annotated[str | None, typer.Option("--time-limit", help="Longest time of a case, instead of the plan's.")]
Mixed = Annotated[bool, typer.Option("--mixed", help="Go on with other versions than the campaign was begun with.")]
TlsCa = Annotated[Path | None, typer.Option("--tls-ca", help="Certificate of the authority (PEM), for tls:// only.")]
TlsCert = Annotated[Path | None, typer.Option("--tls-cert", help="Certificate of this client (PEM).")]
TlsKey = Annotated[Path | None, typer.Option("--tls-key", help="Key of this client (PEM).")]
AsJson = Annotated[bool, typer.Option("--json", help="Print numbers as JSON.")]


@example("rotorsim campaign thesis --out my_campaign; rotorsim campaign status my_campaign")
def run_plan(
    plan: Annotated[str, typer.Argument(metavar="PLAN", help="Plan file, or a shipped plan: thesis.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the campaign; resumed if it is one.")],
    workers: Workers = None,
    scheduler: Scheduler = None,
    time_limit: TimeLimit = None,
    mixed: Mixed = False,
    tls_ca: TlsCa = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    as_json: AsJson = False,
) -> None:
    """Run a plan, or what is left of it; the word `run` may be left out."""
    chosen = settings(workers, scheduler, time_limit, mixed, (tls_ca, tls_cert, tls_key), not as_json)
    loaded = load_plan(plan)
    if scheduler is None:
        note_compiling_of_plan(loaded)
    print_outcome(run_campaign(loaded, out, chosen), out, as_json)


@example("rotorsim campaign retry my_campaign --time-limit '30 min'")
def retry(
    folder: Folder,
    workers: Workers = None,
    scheduler: Scheduler = None,
    time_limit: TimeLimit = None,
    mixed: Mixed = False,
    tls_ca: TlsCa = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    as_json: AsJson = False,
) -> None:
    """Run the failed cases again, and those that are left."""
    chosen = settings(workers, scheduler, time_limit, mixed, (tls_ca, tls_cert, tls_key), not as_json)
    print_outcome(retry_failed(folder, chosen), folder, as_json)


@example("rotorsim campaign status my_campaign --failed 10")
def status(
    folder: Folder,
    failed: Annotated[int, typer.Option("--failed", help="How many failed cases to name.")] = 5,
    as_json: AsJson = False,
) -> None:
    """Say what is done, failed and left; also while the campaign runs."""
    print_status(folder, failed, as_json)


@example("rotorsim campaign collect my_campaign --experiment identification --out all.nc")
def collect(
    folder: Folder,
    out: Annotated[
        Path | None, typer.Option("--out", help="File to write: .csv for a row per case, .nc for the records in one.")
    ] = None,
    experiment: Annotated[str | None, typer.Option("--experiment", help="Experiment of the plan, for .nc.")] = None,
    variables: Annotated[
        str | None, typer.Option("--variables", help="Variables with commas between, for .nc.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file.")] = False,
) -> None:
    """Put what is done into one table or one file; without --out, print what that would hold."""
    names = None if variables is None else [name.strip() for name in variables.split(",")]
    collect_into(folder, out, experiment, names, force)


@example("rotorsim campaign check my_plan.toml")
def check(plan: Annotated[str, typer.Argument(metavar="PLAN", help="Plan file or shipped plan.")]) -> None:
    """Read a plan and print what it would run, without running it."""
    print_plan(plan)
