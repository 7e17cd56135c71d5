"""Application object with all commands of `rotorsim`: which function of which module runs each."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import typer

from rotorsim.base.interrupt import interrupted
from rotorsim.base.version import installed
from rotorsim.commands.campaign.group import Campaign
from rotorsim.commands.experiment.group import Experiments
from rotorsim.commands.lazy_group import LazyGroup

PANELS = {
    "Simulate in time": ("runup", "experiment", "campaign", "live"),
    "Without time simulation": ("map", "sweep", "response", "campbell", "modes"),
    "Machine files": ("machine", "cite"),
    "Measured data": ("data", "compare", "balance", "diagnose", "hide", "report"),
    "Models, control, other simulators": ("identify", "study", "design", "verify", "fmu"),
    "This installation": ("warm",),
}
"""Commands by the title under which the help lists them."""


class Commands(LazyGroup):
    """Top-level command group; Ctrl-C in any command ends with one sentence."""

    places: ClassVar = {
        "runup": "runup.runup",
        "map": "map.map.map_command",
        "sweep": "sweep.sweep",
        "response": "response.response",
        "campbell": "response.campbell",
        "modes": "modes.modes",
        "live": "live.live",
        "identify": "identify.identify",
        "design": "design.design",
        "verify": "verify.verify",
        "diagnose": "diagnosis.diagnose.diagnose",
        "hide": "diagnosis.hide.hide",
        "balance": "balance.balance",
        "warm": "warm.warm",
        "cite": "cite.cite",
        "compare": "compare.compare",
    }
    panels: ClassVar = PANELS

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all commands, panel by panel."""
        return [name for names in PANELS.values() for name in names]

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


class Machine(LazyGroup):
    """Write, check, show and calibrate machine files."""

    places: ClassVar = {
        "new": "machine.machine_file.new",
        "check": "machine.machine_file.check",
        "show": "machine.show.show",
        "effects": "machine.effects.effects",
        "calibrate": "machine.calibrate.calibrate_command",
    }


class Data(LazyGroup):
    """Check measured data, map its channels, convert between formats."""

    epilog = "Example: rotorsim data check run.csv"
    places: ClassVar = {
        "check": "data.check",
        "convert": "data.convert",
        "cut": "data.cut",
        "mapping": "data.mapping",
        "resample": "data.resample_command",
        "vectors": "data.vectors",
    }


class Fmu(LazyGroup):
    """Export, check and show the plant as a functional mock-up unit."""

    places: ClassVar = {"export": "fmu.export", "system": "fmu.system", "check": "fmu.check", "info": "fmu.importer"}


class Report(LazyGroup):
    """Write the page of a stored result again."""

    epilog = "Example: rotorsim report diagnosis diagnosis --units imperial"
    places: ClassVar = {"diagnosis": "report.diagnosis.diagnosis"}


class Study(LazyGroup):
    """Studies of identification against physics on a virtual rig."""

    epilog = "Example: rotorsim study identification-vs-physics --out study"
    places: ClassVar = {
        "identification-vs-physics": "study.identification_vs_physics",
    }


GROUPS: dict[str, type[LazyGroup]] = {
    "experiment": Experiments,
    "campaign": Campaign,
    "machine": Machine,
    "data": Data,
    "fmu": Fmu,
    "report": Report,
    "study": Study,
}
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


for _title, _names in PANELS.items():
    for _name in filter(GROUPS.__contains__, _names):
        _group = GROUPS[_name]
        _made = typer.Typer(cls=_group, help=_group.__doc__, epilog=_group.epilog, no_args_is_help=True)
        app.add_typer(_made, name=_name, rich_help_panel=_title)


def _version(asked: bool) -> None:
    """Print name and version, and end."""
    if asked:
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
