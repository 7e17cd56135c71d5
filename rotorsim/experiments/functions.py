"""Experiments as functions `name(plant, parameters..., seed=0, progress=False)`, made from their dataclasses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import Field
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol, cast, overload

from rotorsim.base.display import did_you_mean
from rotorsim.base.quantity import Quantity
from rotorsim.experiments.experiment import Experiment, parameters

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.machine import Machine
    from rotorsim.plant.plant import Plant

P = ParamSpec("P")


class ExperimentFunction(Protocol[P]):
    """Function that runs an experiment, as type checkers and editors see it: with the parameters of the dataclass."""

    __name__: str

    @overload
    def __call__(self, plant: Plant | Machine | str | Path, *values: P.args, **named: P.kwargs) -> xr.Dataset: ...

    @overload
    def __call__(
        self, plant: Plant | Machine | str | Path, *values: Any, seed: int = 0, progress: bool = False, **named: Any
    ) -> xr.Dataset: ...


MACHINE = Parameter("plant", Parameter.POSITIONAL_OR_KEYWORD, annotation="Plant | Machine | str | Path")
"""First parameter of every function."""
ENDS = (
    Parameter("seed", Parameter.POSITIONAL_OR_KEYWORD, default=0, annotation="int"),
    Parameter("progress", Parameter.POSITIONAL_OR_KEYWORD, default=False, annotation="bool"),
)
"""Last parameters of every function."""
SECTIONS = """{what}

Parameters
----------
plant : Plant, machine, path or name
    The machine.
{parameters}
seed : int, default 0
    Of the plant's noise.
progress : bool, default False
    Show a bar on a terminal.

Returns
-------
Dataset
    Record of the schema (identification.records.schema) with these parameters as attributes.

Raises
------
DataError, NoLiftOffError, ConvergenceError

Examples
--------
{example}
"""
"""Documentation of a function."""


def as_function(kind: Callable[P, Experiment]) -> ExperimentFunction[P]:
    """The function that runs an experiment in memory; signature and documentation are those of the dataclass."""
    return cast(ExperimentFunction[P], _function(cast(type[Experiment], kind)))


def _function(kind: type[Experiment]) -> Callable[..., xr.Dataset]:
    def function(plant: Plant | Machine | str | Path, *values: Any, **named: Any) -> xr.Dataset:
        from rotorsim.experiments.running import run  # the dataclasses serve commands' help too, without a plant
        from rotorsim.plant.plant import as_plant

        for name in named.keys() - signed.parameters.keys():
            raise TypeError(f"{kind.name}() has no parameter '{name}'; {did_you_mean(name, signed.parameters)}")
        given = signed.bind(plant, *values, **named).arguments
        seed, progress = (given.pop(end.name, end.default) for end in ENDS)
        made = as_plant(given.pop("plant"))
        return run(made, kind(**given, Ts=made.machine.sampling_time), seed, progress)

    own = [one for one in signature(kind).parameters.values() if one.name != "Ts"]
    signed = Signature([MACHINE, *own, *ENDS], return_annotation="xr.Dataset")
    function.__name__ = function.__qualname__ = kind.name
    function.__doc__ = _documentation(kind)
    function.__signature__ = signed  # type: ignore[attr-defined]
    function.__annotations__ = {p.name: p.annotation for p in signed.parameters.values()} | {"return": "xr.Dataset"}
    return function


def _documentation(kind: type[Experiment]) -> str:
    """First sentence and example of the dataclass, and every parameter with unit, meaning and default."""
    what, *rest = (kind.__doc__ or "").splitlines()
    listed = (f"{entry.name} : {_type(entry, known)}\n    {_sentence(known)}" for entry, known in parameters(kind))
    return SECTIONS.format(what=what, parameters="\n".join(listed), example=_example(kind, "\n".join(rest)))


def _type(entry: Field[Any], known: Quantity) -> str:
    """Type or choices of a parameter, and its default."""
    if known.choices:
        return f"{{{', '.join(map(repr, known.choices))}}}, default {entry.default!r}"
    kind = str(entry.type).removesuffix(" | None")
    return f"{kind}, optional" if entry.default is None else f"{kind}, default {entry.default:.6g}"


def _sentence(known: Quantity) -> str:
    """Meaning of a parameter with its unit."""
    return known.doc if known.choices or known.unit == "1" else f"{known.doc.removesuffix('.')} [{known.unit}]."


def _example(kind: type[Experiment], text: str) -> str:
    """The call that runs the dataclass's own example, which ends with `.samples`."""
    lines = [line.strip() for line in text.partition("Examples")[2].splitlines()[2:]]
    call = "\n".join(line for line in lines if line)
    return call.replace(f".{kind.__name__}(", f".{kind.name}(plant, ").replace(".samples", '.sizes["time"]')
