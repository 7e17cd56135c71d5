"""Table of the experiments, from `experiments.toml`: number of the machine, factors, what is measured, why it stays."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache, reduce
from importlib.resources import files
from typing import Any

from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import DataError
from rotorsim.base.input_files import parse_toml
from rotorsim.machine import Machine
from rotorsim.machine.file_text import expanded
from studies.thesis.claims.rules import ClaimFigure, first_claims

KEYS = {"words", "fields", "factors", "measure", "figures", "why"}
EXTRA = {
    "C2.least": ClaimFigure(
        "least", "level of Fig. B.4's S below which no controller keeps", "", 1.0, (0.0, 1.0), (0.0, 1.1),
        one_sided="at most one is needed",
    ),
    "C4.radius": ClaimFigure(
        "radius", "hardening: largest pole radius of the loop", "", 1.0, (0.0, 0.999999), (0.0, 1.001),
        one_sided="stable below one",
    ),
    "C10.unstable": ClaimFigure(
        "unstable", "points of 600 that surfaces of second order leave unstable", "", 0.0, (0.0, 0.0), (0.0, 1.0)
    ),
    "C10.excess": ClaimFigure(
        "excess", "excess of their imbalance response at held-out points", "", 0.0, (0.0, 0.1), (0.0, 0.2)
    ),
}  # fmt: skip
"""Figures that explain a claim and judge none."""
POWER = "^"
"""Between a field's path and the power of the factor that it is multiplied with, 1 where there is none."""


@dataclass(frozen=True)
class FactorStudy:
    """One number of the machine times each of `factors`, ascending in the file's order.

    fields: dotted paths, each multiplied with the factor, or with a power of it ('injectors.2.pd_zero^-1')
    measure: what is computed at each factor, by its name in `measures`
    figures: claim and figure, as 'I4.before'
    why: why the value that gives the thesis' figure is not the shipped one
    """

    name: str
    words: str
    fields: tuple[str, ...]
    factors: tuple[float, ...]
    measure: str
    figures: tuple[str, ...]
    why: str

    @property
    def claims(self) -> tuple[str, ...]:
        """Numbers of the claims that it explains."""
        return tuple(dict.fromkeys(figure.split(".")[0] for figure in self.figures))


@lru_cache
def experiments() -> tuple[FactorStudy, ...]:
    """All experiments, in the order of the file."""
    text = (files("studies.thesis.experiments") / "experiments.toml").read_text(encoding="utf-8")
    return read(text)


def read(text: str) -> tuple[FactorStudy, ...]:
    """Experiments of a file's text; raises DataError with one sentence.

    Examples
    --------
    >>> text = '''[plenum]
    ... words = "volume"
    ... fields = ["injection.plenum_volume"]
    ... factors = [1.0, 2.0]
    ... measure = "whirl"
    ... figures = ["C12.onset_3"]
    ... why = "it is calibrated"'''
    >>> [one.name for one in read(text)]
    ['plenum']
    """
    try:
        tables = parse_toml(text)
    except tomllib.TOMLDecodeError as error:
        raise DataError(f"experiments: is not a TOML file ({error}); correct it") from error
    return tuple(_experiment(name, table) for name, table in tables.items())


def _experiment(name: str, table: Any) -> FactorStudy:
    if not isinstance(table, dict) or set(table) != KEYS:
        raise DataError(f"experiments: {name} needs the keys {', '.join(sorted(KEYS))} and no others")
    factors = tuple(float(v) for v in table["factors"])
    if 1.0 not in factors or len(set(factors)) != len(factors):
        raise DataError(f"experiments: {name}.factors {list(factors)} must hold 1, the machine as it is, and each once")
    for figure in table["figures"]:
        figure_of(figure)
    values = {key: tuple(table[key]) for key in ("fields", "figures")}
    return FactorStudy(
        name, table["words"], values["fields"], factors, table["measure"], values["figures"], table["why"]
    )


def figure_of(key: str) -> ClaimFigure:
    """The rule of a figure 'I4.before'; raises DataError where there is none."""
    known = known_figures()
    if key not in known:
        raise DataError(f"experiments: there is no figure {key}; {did_you_mean(key, known)}")
    return known[key]


@lru_cache
def known_figures() -> dict[str, ClaimFigure]:
    """All figures of the first rules by claim and name, and those that only experiments have."""
    return {f"{claim.number}.{figure.name}": figure for claim in first_claims() for figure in claim.figures} | EXTRA


def chosen_experiments(names: Iterable[str]) -> tuple[FactorStudy, ...]:
    """The experiments of these names or claims, all where none is given; raises DataError for an unknown name."""
    wanted, found = list(names), experiments()
    known = [one.name for one in found] + sorted({claim for one in found for claim in one.claims})
    for name in wanted:
        if name not in known:
            raise DataError(
                f"--only: there is no experiment or claim {name!r}; there are {', '.join(known)}",
                argument="only",
                value=name,
            )
    return tuple(one for one in found if not wanted or one.name in wanted or set(one.claims) & set(wanted))


def changed(machine: Machine, experiment: FactorStudy, factor: float) -> Machine:
    """The machine with every field times the factor; raises MachineFileError where it would not be valid."""
    if factor == 1:
        return machine
    return machine.with_({path: factor**power * value for path, (value, power) in values(machine, experiment).items()})


def values(machine: Machine, experiment: FactorStudy) -> Mapping[str, tuple[float, float]]:
    """Values [SI] of the fields and powers of the factor, stars of lists written out.

    Raises
    ------
    DataError
        For a field that is no number of the machine.
    """
    found = {}
    for field in experiment.fields:
        name, _, power = field.partition(POWER)
        for path in expanded(machine.text, name):
            value = reduce(_below, path.split("."), machine)
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise DataError(f"experiments: {experiment.name}: {path} of {machine.name} is {value!r} and no number")
            found[path] = float(value), float(power or 1)
    return found


def _below(part: Any, key: str) -> Any:
    """Field of a part, list or effect of a machine; None where there is none."""
    if isinstance(part, tuple):
        if key.isdecimal():
            return part[int(key)] if int(key) < len(part) else None
        return _below(part[0], key) if len(part) == 1 else None
    return part.get(key) if isinstance(part, Mapping) else getattr(part, key, None)
