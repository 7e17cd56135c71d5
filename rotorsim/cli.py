"""The command line: `rotorsim COMMAND`. Commands live in `rotorsim.commands`; errors become sentences."""

from __future__ import annotations

import os
import sys
from typing import Annotated

import typer

from rotorsim.commands import bench, campaign, data, experiment, fmu, machine, study, study_control
from rotorsim.commands import design as design_command
from rotorsim.commands import diagnose as diagnosis_command
from rotorsim.commands import hide as hiding_command
from rotorsim.commands import identify as identification_command
from rotorsim.commands import live as live_module
from rotorsim.commands import map as map_module
from rotorsim.commands import modes as modes_module
from rotorsim.commands import verify as verify_command
from rotorsim.commands.runup import EXAMPLE, runup
from rotorsim.errors import RotorsimError

app = typer.Typer(
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


@app.callback()
def _options(
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback of an error; goes anywhere.")] = False,
) -> None:
    pass


def main(arguments: list[str] | None = None) -> None:
    """Run a command; a user's error ends as a sentence on stderr and exit code 2, without a traceback."""
    arguments = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in arguments
    try:
        app(args=[a for a in arguments if a != "--debug"], prog_name="rotorsim")
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # so that the flush at exit stays silent
        sys.exit(1)
    except (RotorsimError, OSError) as error:
        if debug:
            raise
        print(sentence(error), file=sys.stderr)
        sys.exit(2)


def sentence(error: RotorsimError | OSError) -> str:
    """What to tell the user about an error."""
    if isinstance(error, RotorsimError):
        return str(error)
    file = error.filename2 or error.filename
    where = f"{file}: " if file else ""
    reason = (error.strerror or str(error)).lower()
    return f"{where}{reason}; check that the folder exists and is writable, or choose another path"
