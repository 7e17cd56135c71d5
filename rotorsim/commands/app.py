"""Application object with all commands of `rotorsim`, which the chapters of this folder register."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Annotated, Any

import typer

from rotorsim.base.interrupt import interrupted
from rotorsim.commands import (
    balance,
    campaign,
    compare,
    control,
    data,
    diagnosis,
    experiment,
    fmu,
    identification,
    linear,
    live,
    machine,
    map,
    sweep,
)
from rotorsim.commands.experiment import experiment_function
from rotorsim.commands.registry import COMMANDS, GROUPS, CommandGroup

CHAPTERS = (
    balance, campaign, compare, control, data, diagnosis, experiment, fmu, identification, linear, live, machine, map,
    sweep,
)  # fmt: skip
"""Modules whose import registers the commands."""
PANELS = {
    "Simulate in time": ("runup", "experiment", "campaign", "live"),
    "Without time simulation": ("map", "sweep", "response", "campbell", "modes"),
    "Machine files": ("machine", "cite"),
    "Measured data": ("data", "compare", "balance", "diagnose", "hide", "report"),
    "Models, control, other simulators": ("identify", "study", "design", "verify", "fmu"),
    "This installation": ("warm",),
}
"""Commands by the title under which the help lists them."""
TITLES = {name: title for title, names in PANELS.items() for name in names}


class Commands(CommandGroup):
    """Top-level command group; Ctrl-C in any command ends with one sentence."""

    def names(self) -> Iterable[str]:
        """Names of the commands, without the groups below; the run-up is one of the experiments."""
        return "runup", *COMMANDS[""]

    def function(self, name: str) -> Callable[..., None] | None:
        """Function of a command, or None."""
        return experiment_function(name, name) if name == "runup" else super().function(name)

    def panel(self, name: str) -> str | None:
        """Title under which the help lists a command."""
        return TITLES[name]

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands, title by title."""
        return sorted(super().list_commands(ctx), key=list(TITLES).index)

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        """Read the command line."""
        try:
            return super().make_context(*arguments, **options)
        except KeyboardInterrupt:
            interrupted()

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            interrupted()


app = typer.Typer(
    cls=Commands,
    name="rotorsim",
    help="Simulate rotors on gas bearings.\n\nMACHINE is a shipped machine, such as dtu_gas_bearing or plain_rotor, "
    "or a machine file of your own. 'rotorsim COMMAND --help' shows the options of a command and an example.",
    epilog="Example: rotorsim runup\n\nExample: rotorsim experiment impact plain_rotor --out impact --open",
    context_settings={"help_option_names": ["-h", "--help"]},
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
for _name, _kind in GROUPS.items():
    _group = typer.Typer(cls=_kind, help=_kind.__doc__, epilog=_kind.epilog, no_args_is_help=True)
    app.add_typer(_group, name=_name, rich_help_panel=TITLES[_name])


def _version(asked: bool) -> None:
    """Print name and version, and end."""
    if asked:
        from rotorsim.base.version import installed

        typer.echo(f"rotorsim {installed('rotorsim')}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and end.")
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error; may stand anywhere.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Run with unusual values too; may stand anywhere.")] = False,
) -> None:
    pass
