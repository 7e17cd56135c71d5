"""Application object with all commands of `rotorsim`."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from rotorsim.base.interrupt import interrupted
from rotorsim.commands import (
    bench,
    campaign,
    data,
    design as design_command,
    diagnose as diagnosis_command,
    experiment,
    fmu,
    hide as hiding_command,
    identify as identification_command,
    live as live_module,
    machine,
    map as map_module,
    modes as modes_module,
    study,
    study_control,
    verify as verify_command,
)
from rotorsim.commands.runup import EXAMPLE, runup


class Commands(TyperGroup):
    """Top-level command group; Ctrl-C in any command ends with one sentence."""

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
    help="First-principles simulation of rotors on active gas bearings.",
    epilog="Example: rotorsim machine show dtu_gas_bearing",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
app.command(epilog=EXAMPLE)(runup)
app.command(name="map", epilog=map_module.EXAMPLE)(map_module.map_command)
app.command(epilog=modes_module.EXAMPLE)(modes_module.modes)
app.command(epilog=live_module.EXAMPLE)(live_module.live)
app.add_typer(experiment.app, name="experiment")
app.add_typer(campaign.app, name="campaign")
app.add_typer(machine.app, name="machine")
app.add_typer(data.app, name="data")
app.add_typer(fmu.app, name="fmu")
study.app.command(epilog=study_control.EXAMPLE)(study_control.control)
study.app.command(epilog=study_control.WHOLE_EXAMPLE)(study_control.whole)
app.add_typer(study.app, name="study")
app.command(epilog=bench.EXAMPLE)(bench.bench)
app.command(epilog=identification_command.EXAMPLE)(identification_command.identify)
app.command(epilog=design_command.EXAMPLE)(design_command.design)
app.command(epilog=verify_command.EXAMPLE)(verify_command.verify)
app.command(epilog=diagnosis_command.EXAMPLE)(diagnosis_command.diagnose)
app.command(epilog=hiding_command.EXAMPLE)(hiding_command.hide)


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
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error; goes anywhere.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Run with unusual values, unquestioned; goes anywhere.")] = False,
) -> None:
    pass
