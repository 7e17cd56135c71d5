"""`rotorsim campaign PLAN --out DIR`, and `status`, `retry`, `collect`, `check` for a campaign's store.

Exit code 0: all cases are done. 2: cannot be run; one sentence gives the reason. 3: all were run and some failed.
130 (143 for SIGTERM): stopped; the same command continues.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from rotorsim.base.errors import DataError
from rotorsim.campaign import load_plan
from rotorsim.campaign.cluster import Tls
from rotorsim.campaign.run import Settings, retry as retry_failed, run_campaign
from rotorsim.commands.campaign.output import (
    collect_into,
    note_compiling_of_plan,
    print_outcome,
    print_plan,
    print_status,
)
from rotorsim.commands.completion import plans
from rotorsim.commands.lazy_group import example
from rotorsim.commands.options import AsJson, quantity

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a campaign.")]


@dataclass(frozen=True)
class RunOptions:
    """Options of the commands that run cases."""

    workers: Annotated[int | None, typer.Option(help="Processes on this machine; default one per core.")] = None
    scheduler: Annotated[str | None, typer.Option(help="Dask scheduler to use, e.g. tcp://host:8786.")] = None
    time_limit: Annotated[str | None, typer.Option(help="Longest time of a case, instead of the plan's.")] = None
    mixed: Annotated[
        bool, typer.Option("--mixed", help="Continue with other software versions than the campaign was begun with.")
    ] = False
    tls_ca: Annotated[Path | None, typer.Option(help="Certificate of the authority (PEM), for tls:// only.")] = None
    tls_cert: Annotated[Path | None, typer.Option(help="Certificate of this client (PEM).")] = None
    tls_key: Annotated[Path | None, typer.Option(help="Key of this client (PEM).")] = None
    as_json: AsJson = False

    def settings(self) -> Settings:
        """Settings of a run; raises DataError for incompatible options."""
        tls = self.tls_ca, self.tls_cert, self.tls_key
        if self.workers is not None and self.scheduler is not None:
            raise DataError("--workers: a scheduler has its own workers; leave out --workers or --scheduler")
        if self.workers is not None and self.workers < 1:
            raise DataError(f"--workers: {self.workers} is below 1; give the number of processes, e.g. 2")
        if any(tls) and self.scheduler is None:
            raise DataError("--tls-ca, --tls-cert, --tls-key: are for a scheduler; add --scheduler tls://host:port")
        limit = None if self.time_limit is None else quantity("time-limit", self.time_limit, "s")
        if limit is not None and limit <= 0:
            raise DataError(f"--time-limit: '{self.time_limit}' is not above 0; give e.g. '10 min'")
        return Settings(
            self.workers, self.scheduler, Tls(*tls) if any(tls) else None, limit, self.mixed, not self.as_json
        )


@example(
    "rotorsim campaign thesis --out my_campaign; rotorsim campaign status my_campaign",
    "rs.campaign.run_campaign(rs.campaign.load_plan('thesis'), Path('my_campaign'))",
)
def run_plan(
    plan: Annotated[
        str, typer.Argument(metavar="PLAN", help="Plan file, or a shipped plan: thesis.", autocompletion=plans)
    ],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of the campaign; resumed if it is one.")],
    options: RunOptions,
) -> None:
    """Run a plan, or what is left of it; the word `run` may be left out."""
    chosen, loaded = options.settings(), load_plan(plan)
    if chosen.scheduler is None:
        note_compiling_of_plan(loaded)
    print_outcome(run_campaign(loaded, out, chosen), out, options.as_json)


@example(
    "rotorsim campaign retry my_campaign --time-limit '30 min'",
    "rs.campaign.retry(Path('my_campaign'))",
)
def retry(
    folder: Folder,
    options: RunOptions,
) -> None:
    """Run the failed cases again, and those that are left."""
    print_outcome(retry_failed(folder, options.settings()), folder, options.as_json)


@example(
    "rotorsim campaign status my_campaign --failed 10",
    "rs.campaign.status('my_campaign')",
)
def status(
    folder: Folder,
    failed: Annotated[int, typer.Option("--failed", help="How many failed cases to name.")] = 5,
    as_json: AsJson = False,
) -> None:
    """List numbers of finished, failed and remaining cases; also while the campaign runs."""
    print_status(folder, failed, as_json)


@example(
    "rotorsim campaign collect my_campaign --experiment identification --out all.nc",
    "rs.campaign.collect('my_campaign', 'identification')",
)
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


@example(
    "rotorsim campaign check my_plan.toml",
    "rs.campaign.load_plan('my_plan.toml')",
)
def check(
    plan: Annotated[str, typer.Argument(metavar="PLAN", help="Plan file or shipped plan.", autocompletion=plans)],
) -> None:
    """Read a plan and print what it would run, without running it."""
    print_plan(plan)
