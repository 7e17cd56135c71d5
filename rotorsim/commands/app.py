"""Application object with all commands of `rotorsim`, which the chapters of this folder register."""

from __future__ import annotations

from importlib import import_module
from typing import Annotated, Any

import typer

from rotorsim.base.interrupt import interrupted
from rotorsim.commands.registry import GROUPS, CommandGroup, click_command

PANELS = {
    "Simulate in time": {"runup": "experiment", "experiment": "experiment", "campaign": "campaign", "live": "live"},
    "Without time simulation": {
        "map": "map", "sweep": "sweep", "response": "linear", "campbell": "linear", "modes": "linear",
    },
    "Machine files": {"machine": "machine", "cite": "machine"},
    "Measured data": {
        "data": "data", "compare": "compare", "balance": "balance", "diagnose": "diagnosis", "hide": "diagnosis",
        "report": "report",
    },
    "Models, control, other simulators": {
        "identify": "identification", "study": "identification", "design": "control", "verify": "control", "fmu": "fmu",
    },
    "This installation": {"warm": "machine"},
}  # fmt: skip
"""Chapter that registers each command or group, by the title under which the help lists them."""
TITLES = {name: title for title, names in PANELS.items() for name in names}
CHAPTERS = {name: chapter for names in PANELS.values() for name, chapter in names.items()}


class Commands(CommandGroup):
    """Top-level command group; Ctrl-C in any command ends with one sentence.

    A chapter is imported when one of its commands is asked for, so help of one loads no other.
    """

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands and groups, title by title."""
        return list(TITLES)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command or group of a name, or None."""
        if cmd_name not in CHAPTERS:
            return super().get_command(ctx, cmd_name)
        chapter = import_module(f"rotorsim.commands.{CHAPTERS[cmd_name]}")
        if cmd_name == "runup":
            return click_command(cmd_name, chapter.experiment_function(cmd_name, cmd_name), TITLES[cmd_name])
        return _group(cmd_name) if cmd_name in GROUPS else super().get_command(ctx, cmd_name)

    def panel(self, name: str) -> str | None:
        """Title under which the help lists a command."""
        return TITLES[name]

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


def _group(name: str) -> Any:
    """Click group of a registered class of commands."""
    kind, holder = GROUPS[name], typer.Typer()
    own = typer.Typer(cls=kind, help=kind.__doc__, epilog=kind.epilog, no_args_is_help=True)
    holder.add_typer(own, name=name, rich_help_panel=TITLES[name])
    return typer.main.get_group(holder).commands[name]


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


def _version(asked: bool) -> None:
    """Print name and version, and end."""
    if asked:
        from rotorsim.base.cache import installed

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
