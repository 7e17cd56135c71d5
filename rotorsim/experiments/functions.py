"""Experiments as functions `name(plant, parameters..., seed=0, progress=False)`, made from their dataclasses."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rotorsim.base.suggest import did_you_mean
from rotorsim.experiments.chirp import Chirp
from rotorsim.experiments.coastdown import Coastdown
from rotorsim.experiments.experiment import Experiment
from rotorsim.experiments.impact import Impact
from rotorsim.experiments.multisine import Multisine
from rotorsim.experiments.parameters import parameters
from rotorsim.experiments.prbs import Prbs
from rotorsim.experiments.running import run
from rotorsim.experiments.slow_roll import SlowRoll
from rotorsim.experiments.staircase import Staircase
from rotorsim.experiments.steady import Steady

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.machine import Machine
    from rotorsim.plant.plant import Plant

ENDS = (("seed", 0), ("progress", False))
"""Last parameters of every function, with their defaults."""


def as_function(kind: type[Experiment]) -> Callable[..., xr.Dataset]:
    """The function that runs an experiment in memory; signature and documentation are those of the dataclass."""

    def function(plant: Plant | Machine | str | Path, *values: Any, **named: Any) -> xr.Dataset:
        for name in named.keys() - signed.parameters.keys():
            raise TypeError(f"{kind.name}() has no parameter '{name}'; {did_you_mean(name, signed.parameters)}")
        given = signed.bind(plant, *values, **named).arguments
        seed, progress = (given.pop(name, default) for name, default in ENDS)
        return run(given.pop("plant"), kind(**given), seed, progress)

    own = [p.replace(annotation=Parameter.empty) for p in signature(kind).parameters.values()]
    ends = [Parameter(name, Parameter.POSITIONAL_OR_KEYWORD, default=default) for name, default in ENDS]
    signed = Signature([Parameter("plant", Parameter.POSITIONAL_OR_KEYWORD), *own, *ends])
    function.__name__ = function.__qualname__ = kind.name
    function.__doc__ = _documentation(kind)
    function.__signature__ = signed  # type: ignore[attr-defined]
    return function


def _documentation(kind: type[Experiment]) -> str:
    """First sentence of the dataclass, and every parameter with unit and meaning."""
    lines = [f"{(kind.__doc__ or '').splitlines()[0]}", "", "Returns the record.", "", "Parameters", "----------"]
    lines += ["plant : Plant, machine or name", "    The machine."]
    for entry, known in parameters(kind):
        unit = f" [{known.unit}]" if known.unit != "1" else ""
        lines += [f"{entry.name} :{unit or ' number' if not known.choices else ' ' + ', '.join(known.choices)}"]
        lines += [f"    {known.doc}"]
    lines += ["seed : whole number", "    Of the plant's noise.", "progress : bool", "    Show a bar on a terminal."]
    return "\n".join(lines) + "\n"


chirp = as_function(Chirp)
coastdown = as_function(Coastdown)
impact = as_function(Impact)
multisine = as_function(Multisine)
prbs = as_function(Prbs)
slow_roll = as_function(SlowRoll)
staircase = as_function(Staircase)
steady = as_function(Steady)
