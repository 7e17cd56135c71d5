"""`rotorsim campaign PLAN --out DIR`, and `status`, `retry`, `collect`, `check` for a campaign's store.

Exit code 0: all cases are done. 2: cannot be run; one sentence gives the reason. 3: all were run and some failed.
130 (143 for SIGTERM): stopped; the same command continues.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rotorsim.base.errors import DataError
from rotorsim.base.units import RIG_SAMPLE, show
from rotorsim.commands.options import AsJson, a_folder, note_compiling, plans, print_json, quantity
from rotorsim.commands.registry import CommandGroup, command, group
from rotorsim.commands.results import files

if TYPE_CHECKING:
    from rotorsim.campaign.plan import Plan
    from rotorsim.campaign.run import CampaignOutcome, Settings

SOME_FAILED = 3
"""Exit code of a campaign that was run and has failed cases."""
BYTES_PER_SAMPLE = 21 * 8
"""Size [bytes] of a sample in a whole record of a machine with a gas film."""
USAGE = "rotorsim campaign PLAN --out DIR [OPTIONS] | status DIR | retry DIR | collect DIR | check PLAN"
Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a campaign.")]


@group("campaign", "Example: rotorsim campaign thesis --out my_campaign; rotorsim campaign status my_campaign")
class CampaignCommands(CommandGroup):
    """Run many experiments by a plan, on all cores or a cluster."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put `run` before a plan."""
        if args and args[0] not in self.names() and args[0] not in ("-h", "--help"):
            args = ["run", *args]
        rest: list[str] = super().parse_args(ctx, args)
        return rest

    def format_usage(self, ctx: Any, formatter: Any) -> None:
        """Show both forms."""
        formatter.write_usage("", USAGE)


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
        from rotorsim.campaign.run import Settings
        from rotorsim.campaign.scheduler import Tls

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


@command(
    "campaign run",
    "rotorsim campaign thesis --out my_campaign; rotorsim campaign status my_campaign",
    "rs.campaign.run_campaign(rs.campaign.load_plan('thesis'), Path('my_campaign'))",
)
def run_plan(
    plan: Annotated[
        str, typer.Argument(metavar="PLAN", help="Plan file, or a shipped plan: thesis.", autocompletion=plans)
    ],
    out: Annotated[
        Path, typer.Option(metavar="DIR", callback=a_folder, help="Folder of the campaign; resumed if it is one.")
    ],
    options: RunOptions,
) -> None:
    """Run a plan, or what is left of it; the word `run` may be left out."""
    from rotorsim.campaign import load_plan
    from rotorsim.campaign.run import run_campaign

    chosen, loaded = options.settings(), load_plan(plan)
    if chosen.scheduler is None:
        note_compiling_of_plan(loaded)
    print_outcome(run_campaign(loaded, out, chosen), out, options.as_json)


@command(
    "campaign retry",
    "rotorsim campaign retry my_campaign --time-limit '30 min'",
    "rs.campaign.retry(Path('my_campaign'))",
)
def retry(folder: Folder, options: RunOptions) -> None:
    """Run the failed cases again, and those that are left."""
    from rotorsim.campaign.run import retry as retry_failed

    print_outcome(retry_failed(folder, options.settings()), folder, options.as_json)


@command("campaign status", "rotorsim campaign status my_campaign --failed 10", "rs.campaign.status('my_campaign')")
def status(
    folder: Folder,
    failed: Annotated[int, typer.Option(help="How many failed cases to name.")] = 5,
    as_json: AsJson = False,
) -> None:
    """List numbers of finished, failed and remaining cases; also while the campaign runs."""
    from rotorsim.campaign.run import spell
    from rotorsim.campaign.store import DONE, FAILED, PENDING, open_store, status as state_of

    found, plan = state_of(folder, failed), open_store(folder).plan
    if as_json:
        print_json(found)
        return
    typer.echo(f"{plan.name}: {found[DONE]} done, {found[FAILED]} failed, {found[PENDING]} left")
    typer.echo(f"computing time {spell(found['computing_s'])}, records {found['bytes'] / 1e6:.4g} MB")
    for one in found["failures"]:
        typer.echo(f"case {one['number']}, {one['experiment']}, {_values(plan, one['parameters'])}: {one['error']}")
    if found[FAILED] > len(found["failures"]):
        typer.echo(f"and {found[FAILED] - len(found['failures'])} more; --failed {found[FAILED]} names them all")


@command(
    "campaign collect",
    "rotorsim campaign collect my_campaign --experiment identification --out all.nc",
    "rs.campaign.collect('my_campaign', 'identification')",
)
def collect(
    folder: Folder,
    out: Annotated[
        Path | None, typer.Option(help="File to write: .csv for a row per case, .nc for the records in one.")
    ] = None,
    experiment: Annotated[str | None, typer.Option(help="Experiment of the plan, for .nc.")] = None,
    variables: Annotated[str | None, typer.Option(help="Variables with commas between, for .nc.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace the file.")] = False,
) -> None:
    """Put what is done into one table or one file; without --out, print what that would hold."""
    from rotorsim.base.hdf5 import write_netcdf
    from rotorsim.campaign.records import collect as collected, write_table

    names = None if variables is None else [name.strip() for name in variables.split(",")]
    if out is not None and out.suffix not in (".csv", ".nc"):
        raise DataError(f"{out}: is neither .csv nor .nc; give a name with one of these endings")
    if out is None:
        typer.echo(repr(collected(folder, experiment, names)))
        return
    with files(out, force=force, another="name"):
        if out.suffix == ".csv":
            typer.echo(f"{out}: {write_table(folder, out)} cases")
            return
        data = collected(folder, experiment, names)
        write_netcdf(out, data)
    size = " x ".join(f"{n} {dim}" for dim, n in data.sizes.items())
    typer.echo(f"{out}: {size}, {out.stat().st_size / 1e6:.4g} MB")


@command("campaign check", "rotorsim campaign check my_plan.toml", "rs.campaign.load_plan('my_plan.toml')")
def check(
    plan: Annotated[str, typer.Argument(metavar="PLAN", help="Plan file or shipped plan.", autocompletion=plans)],
) -> None:
    """Read a plan and print what it would run, without running it."""
    from rotorsim.campaign import load_plan
    from rotorsim.campaign.run import spell

    loaded = load_plan(plan)
    typer.echo(f"{loaded.name}: {len(loaded)} cases, {spell(loaded.seconds())} simulated")
    for axis in loaded.axes:
        ends = [
            v if isinstance(v, str) else show(v, axis.target.unit or "1") for v in (axis.values[0], axis.values[-1])
        ]
        drawn = "Latin hypercube" if axis.latin else f"{ends[0]} to {ends[1]}"
        typer.echo(f"  {axis.name}: {len(axis.values)} values, {drawn}")
    for entry in loaded.entries:
        typer.echo(f"  {entry.name}: {entry.kind}, " + ", ".join(f"{k} = {v}" for k, v in entry.parameters.items()))
    if loaded.keep is None:
        typer.echo(f"  records: about {loaded.seconds() / RIG_SAMPLE * BYTES_PER_SAMPLE / 1e6:.3g} MB")


def note_compiling_of_plan(plan: Plan) -> None:
    """Print one line in a pipe, which shows no progress bar, if the first case compiles its machine."""
    from rotorsim.base.display import on_terminal
    from rotorsim.machine import Machine
    from rotorsim.plant import Plant

    if on_terminal():
        return
    machine = Machine.from_text(next(iter(plan.machines.values())))
    for path, value in plan.set:
        machine = machine.replace(path, value)
    note_compiling(Plant(machine).assembly, "settle", "run")


def print_outcome(outcome: CampaignOutcome, folder: Path, as_json: bool) -> None:
    """Print the outcome of a run and exit with its code."""
    numbers = {"done": outcome.done, "failed": outcome.failed, "pending": outcome.pending, "run": outcome.run}
    if as_json:
        print_json(numbers | {"seconds": outcome.seconds, "folder": str(folder)})
    else:
        typer.echo(
            f"{folder}: {outcome.done} done, {outcome.failed} failed, {outcome.pending} left; "
            f"{outcome.run} run now in {outcome.seconds:.1f} s"
        )
    if outcome.stopped:
        print(f"stopped: {outcome.pending} cases are left; the same command continues", file=sys.stderr)
        raise typer.Exit(128 + outcome.stopped)
    if outcome.failed:
        print(
            f"{outcome.failed} cases failed: 'rotorsim campaign status {folder}' gives the reason, "
            f"'rotorsim campaign retry {folder}' runs them again",
            file=sys.stderr,
        )
        raise typer.Exit(SOME_FAILED)


def _values(plan: Plan, values: dict[str, Any]) -> str:
    units = {axis.name: axis.target.unit for axis in plan.axes}
    texts = {n: v if isinstance(v, str) or units[n] is None else show(v, units[n] or "1") for n, v in values.items()}
    return ", ".join(f"{name} = {value}" for name, value in texts.items()) or "no axes"
