"""`rotorsim experiment NAME`: one command per virtual experiment, generated from the experiment's parameters.

The commands are made when the first of them is asked for, so that other commands need not wait for the imports.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from rotorsim.commands.experiment_run import run_experiment
from rotorsim.commands.options import (
    AsJson,
    Changes,
    Force,
    GridSize,
    MachineName,
    TimeStep,
    WithReport,
    a_folder,
    quantity,
)

if TYPE_CHECKING:
    from dataclasses import Field

    from rotorsim.experiments.parameters import Param

EXAMPLES = {
    "runup": "--stop '6000 rpm' --rate '100 rpm/s' --pressure '0.3 MPa'",
    "coastdown": "--start '6000 rpm' --stop '600 rpm' --longest '60 s'",
    "steady": "--speed '3000 rpm' --pressure '0.3 MPa' --duration '10 s'",
    "slow_roll": "--speed '100 rpm' --revolutions 5",
    "staircase": "--pressure '0.6 MPa' --axis both --amplitude '2 V' --step '0.5 V'",
    "prbs": "--speed '3000 rpm' --pressure '0.6 MPa' --amplitude '1 V' --duration '10 s' --seed 1",
    "chirp": "--low '20 Hz' --high '300 Hz' --duration '20 s' --axis both",
    "multisine": "--low '2 Hz' --high '300 Hz' --period '2 s' --periods 10",
    "impact": "--peak '20 N' --width '1 ms' --angle '90 deg' --hits 5",
    "controlled": "--pressure '0.6 MPa' --gain-x '0.25 V/um' --gain-y '0.22 V/um' --hit '20 N' --duration '2 s'",
}
Out = Annotated[
    Path | None, typer.Option("--out", callback=a_folder, help="Folder for record and report; default a new one.")
]
Seed = Annotated[str, typer.Option("--seed", help="Seed of noise and random inputs.")]
COMMON: dict[str, tuple[Any, Any]] = {
    "grid": (GridSize, None),
    "time_step": (TimeStep, None),
    "changes": (Changes, None),
    "seed": (Seed, "0"),
    "out": (Out, None),
    "force": (Force, False),
    "report": (WithReport, True),
    "as_json": (AsJson, False),
}


class Experiments(TyperGroup):
    """Command group whose commands are created on demand; an unknown name ends in one sentence."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of all experiments."""
        return list(_commands().commands)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of one experiment; raises DataError for an unknown one."""
        from difflib import get_close_matches

        from rotorsim.errors import DataError

        known = _commands().commands
        name = cmd_name.replace("-", "_")
        if name not in known:
            near = get_close_matches(name, known, 1, 0.5)
            hint = f"did you mean {near[0]}?" if near else f"choose one of {', '.join(known)}"
            raise DataError(f"experiment: '{cmd_name}' is not known; {hint}")
        return known[name]


app = typer.Typer(
    cls=Experiments,
    help="Run a virtual experiment and keep its record.",
    epilog="Example: rotorsim experiment prbs dtu_gas_bearing --amplitude '1 V' --duration '10 s'",
    no_args_is_help=True,
)


@app.callback()
def _group() -> None:
    pass


@lru_cache(maxsize=1)
def _commands() -> Any:
    """Click group of all experiments."""
    from rotorsim.commands.controlled import Setup
    from rotorsim.experiments import EXPERIMENTS

    made = typer.Typer(no_args_is_help=True)
    for name, kind in EXPERIMENTS.items():
        made.command(name, epilog=f"Example: rotorsim experiment {name} dtu_gas_bearing {EXAMPLES[name]}")(
            _command(name, Setup if name == "controlled" else kind, (kind.__doc__ or "").splitlines()[0])
        )
    return typer.main.get_command(made)


def _command(name: str, kind: Any, doc: str) -> Callable[..., None]:
    """A function that typer makes a command of: one option for each parameter of `kind`, then the common ones."""
    from rotorsim.experiments.parameters import parameters

    entries = list(parameters(kind))
    table = {"machine": (MachineName, "dtu_gas_bearing")}
    table |= {entry.name: option(entry, known) for entry, known in entries} | COMMON

    def command(**values: Any) -> None:
        given = {entry.name: read(entry.name, values.pop(entry.name), known) for entry, known in entries}
        run_experiment(name, kind, given, **values)

    keyword = inspect.Parameter.KEYWORD_ONLY
    command.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [inspect.Parameter(key, keyword, annotation=kind, default=value) for key, (kind, value) in table.items()]
    )
    command.__annotations__ = {key: annotation for key, (annotation, _) in table.items()}
    command.__doc__ = doc
    return command


def option(entry: Field[Any], known: Param) -> tuple[Any, Any]:
    """Annotation and default text of a parameter's option."""
    from rotorsim.machine.units import show

    hint = f" One of {', '.join(known.choices)}." if known.choices else ""
    flag = typer.Option(f"--{entry.name.replace('_', '-')}", help=known.doc + hint)
    default: Any = entry.default
    if default is None:
        return Annotated[str | None, flag], None
    return Annotated[str, flag], default if known.choices else show(default, known.unit)


def read(name: str, text: str | None, known: Param) -> Any:
    """Value of an option's text."""
    return text if text is None or known.choices else quantity(name.replace("_", "-"), text, known.unit)
