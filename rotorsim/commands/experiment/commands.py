"""`rotorsim experiment NAME`: one command per virtual experiment, generated from the experiment's parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import Field
from pathlib import Path
from shlex import split
from typing import Annotated, Any

import typer

from rotorsim.base.quantity import Quantity
from rotorsim.base.units import parse, show
from rotorsim.commands.experiment.controlled import LawFile, Setup, WithoutOrbit
from rotorsim.commands.experiment.run import run_experiment
from rotorsim.commands.lazy_group import click_command, example, with_options
from rotorsim.commands.options import AsJson, Force, MachineName, PlantOptions, WithReport, a_folder, quantity
from rotorsim.commands.page_options import PageOptions
from rotorsim.experiments import EXPERIMENTS
from rotorsim.experiments.parameters import parameters

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
CALLS = {
    "controlled": "rs.experiments.controlled(plant, rs.experiments.ProportionalLaw(0.25e6, 0.22e6, "
    "centre=plant.equilibrium(0.0, 0.6e6).disc), pressure=0.6e6, duration=2.0, "
    "excitations=(rs.experiments.Impact(peak=20.0, hits=2),))",
}
"""Calls in Python of the examples that take more than numbers."""
Out = Annotated[
    Path | None, typer.Option("--out", callback=a_folder, help="Folder for record and report; default a new one.")
]
Seed = Annotated[str, typer.Option("--seed", help="Seed of the sensors' noise.")]
COMMON: dict[str, tuple[Any, Any]] = {
    "settings": (PlantOptions, PlantOptions()),
    "page": (PageOptions, PageOptions()),
    "seed": (Seed, "0"),
    "out": (Out, None),
    "force": (Force, False),
    "report": (WithReport, True),
    "as_json": (AsJson, False),
}
FILES: dict[str, dict[str, tuple[Any, Any]]] = {
    "controlled": {"law": (LawFile, None), "without_orbit": (WithoutOrbit, False)}
}
"""Options of an experiment that are no parameters."""


def function(name: str, kind: Any, doc: str) -> Callable[..., None]:
    """A function that typer makes a command of: one option for each parameter of `kind`, then the common ones."""
    entries = list(parameters(kind))
    table = {"machine": (MachineName, "dtu_gas_bearing")}
    files = FILES.get(name, {})
    table |= {entry.name: option(entry, known) for entry, known in entries} | files | COMMON

    def command(**values: Any) -> None:
        given = {entry.name: read(entry.name, values.pop(entry.name), known) for entry, known in entries}
        given |= {key: values.pop(key) for key in files}
        run_experiment(name, kind, given, **values)

    command.__doc__ = doc
    line = f"rotorsim experiment {name} dtu_gas_bearing {EXAMPLES[name]}"
    return example(line, CALLS.get(name) or python_call(name, entries))(with_options(command, table))


def python_call(name: str, entries: list[tuple[Field[Any], Quantity]]) -> str:
    """The call of an experiment's function with the values of its example, SI."""
    words, known = split(EXAMPLES[name]), {entry.name: quantity for entry, quantity in entries}
    given = {word[2:].replace("-", "_"): text for word, text in zip(words[::2], words[1::2], strict=True)}
    values = (f"{key}={_literal(text, known.get(key))}" for key, text in given.items())
    return f"rs.experiments.{name}(plant, {', '.join(values)})"


def _literal(text: str, known: Quantity | None) -> str:
    """A value of an option as Python reads it; those that are no parameters are whole numbers."""
    if known is None:
        return text
    return repr(text) if known.choices else f"{parse(text, known.unit):.6g}"


def option(entry: Field[Any], known: Quantity) -> tuple[Any, Any]:
    """Annotation and default text of a parameter's option."""
    hint = f" One of {', '.join(known.choices)}." if known.choices else ""
    flag = typer.Option(f"--{entry.name.replace('_', '-')}", help=known.doc + hint)
    default: Any = entry.default
    if default is None:
        return Annotated[str | None, flag], None
    return Annotated[str, flag], default if known.choices else show(default, known.unit)


def read(name: str, text: str | None, known: Quantity) -> Any:
    """Value of an option's text."""
    return (
        text if text is None or known.choices else quantity(name.replace("_", "-"), text, known.unit, known.suggestion)
    )


COMMANDS: dict[str, Any] = {
    name: click_command(
        name, function(name, Setup if name == "controlled" else kind, (kind.__doc__ or "").splitlines()[0])
    )
    for name, kind in EXPERIMENTS.items()
}
"""Click commands of all experiments."""
