"""Rules of the thesis' claims: intervals of each figure and operating points, as first written and as amended."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from importlib.resources import files
from typing import Any

from rotorsim.base.input_files import parse_toml
from rotorsim.base.units import KRPM, MPA
from rotorsim.machine import Machine

Interval = tuple[float, float]
FIRST, AMENDED = "rules.toml", "amended.toml"
"""Rules as first written, which stay, and what was amended in them since."""


@dataclass(frozen=True)
class ClaimFigure:
    """A figure of a claim: the thesis' number and the closed intervals, in `unit`, that ours is met and near in.

    one_sided: why the intervals need not surround the thesis' number, empty where they do; kind: '', 'trivial' or 'not
    comparable', with `because`; fitted: the machine file was calibrated with it; old: name of the figure of the first
    rules in whose place it stands, empty where they did not change.
    """

    name: str
    words: str
    unit: str
    thesis: float
    met: Interval
    near: Interval
    one_sided: str = ""
    kind: str = ""
    because: str = ""
    fitted: bool = False
    old: str = ""


@dataclass(frozen=True)
class Amendment:
    """Why a rule was amended: `lines` of the thesis' text, the reason, and what was known of our figures before."""

    lines: str
    why: str
    seen: str


@dataclass(frozen=True)
class Claim:
    """A claim of the thesis: its words, place and figures, where they are taken, and why these tolerances.

    amendment: of the first rule, or of its absence where the claim was `added` since; None where it stands.
    machine: name of the shipped machine that it is measured on, empty for the study's own; moved: why there.
    """

    number: str
    words: str
    points: str
    source: str
    why: str
    figures: tuple[ClaimFigure, ...]
    remark: str = ""
    amendment: Amendment | None = None
    added: bool = False
    machine: str = ""
    moved: Amendment | None = None


@lru_cache
def claims() -> tuple[Claim, ...]:
    """All claims by the rules as they are now: those of the first file in its order, then those added since."""
    table = _file(AMENDED)
    kept = tuple(_amended(claim, table["amended"].get(claim.number)) for claim in first_claims())
    added = (_added(number, dict(one)) for number, one in table["added"].items())
    return tuple(marked(_moved(claim, table["machines"])) for claim in (*kept, *added))


def marked(claim: Claim) -> Claim:
    """The claim with those of its figures marked that a machine, or its run, was fitted to since the first rules."""
    table = _file(AMENDED)
    known = {name for one in (table["as_run"], *table["machines"].values()) for name in one["fitted"]}
    figures = tuple(replace(f, fitted=f.fitted or f"{claim.number}.{f.name}" in known) for f in claim.figures)
    return replace(claim, figures=figures)


@lru_cache
def first_claims() -> tuple[Claim, ...]:
    """The claims by the rules as first written."""
    return tuple(_claim(number, dict(table)) for number, table in _file(FIRST)["claims"].items())


def machines() -> dict[str, str]:
    """Shipped machines that claims are measured on besides the study's own, each with the points of its campaign."""
    return {name: one["grid"] for name, one in _file(AMENDED)["machines"].items()}


def as_run(machine: Machine) -> Machine:
    """The machine as the thesis' rig was when its records were made: its noise, unbalance and unsteadiness."""
    for path, value in as_run_values().items():
        machine = machine.replace(path, value)
    return machine


def as_run_values() -> dict[str, Any]:
    """Values by path that `as_run` replaces in a machine file."""
    return dict(_file(AMENDED)["as_run"]["values"])


def as_run_why() -> Amendment:
    """Why the machines run with them."""
    return _amendment(_file(AMENDED)["as_run"])


def points(name: str) -> tuple[tuple[float, float], ...]:
    """Named operating points, speed [rad/s] and gauge pressure [Pa]."""
    at = (_file(FIRST)["points"] | _file(AMENDED)["points"])[name]["at"]
    return tuple((speed * KRPM, pressure * MPA) for speed, pressure in at)


@lru_cache
def _file(name: str) -> dict[str, Any]:
    return parse_toml(text(name))


def text(name: str) -> str:
    """A file's text."""
    return (files("studies.thesis.claims") / name).read_text(encoding="utf-8")


def _amended(claim: Claim, table: dict[str, Any] | None) -> Claim:
    """The claim with its amended figures in the places of the old ones."""
    if table is None:
        return claim
    shared = {key: table[key] for key in ("kind", "because") if key in table}
    changed = {one["old"]: _intervals(shared | one) for one in table["figures"]}
    figures = tuple(replace(f, **changed[f.name]) if f.name in changed else f for f in claim.figures)
    assert len(changed) == sum(bool(figure.old) for figure in figures), claim.number
    own = {key: table[key] for key in ("points", "remark") if key in table}
    return replace(claim, figures=figures, amendment=_amendment(table), **own)


def _moved(claim: Claim, machines: dict[str, dict[str, Any]]) -> Claim:
    """The claim with the machine that it is measured on."""
    for name, table in machines.items():
        if claim.number in table["claims"]:
            return replace(claim, machine=name, moved=_amendment(table))
    return claim


def _amendment(table: dict[str, Any]) -> Amendment:
    return Amendment(table["lines"], table["why"], table["seen"])


def _added(number: str, table: dict[str, Any]) -> Claim:
    amendment = _amendment(table)
    kept = {key: value for key, value in table.items() if key not in ("lines", "seen")}
    return replace(_claim(number, kept), amendment=amendment, added=True)


def _claim(number: str, table: dict[str, Any]) -> Claim:
    shared = {key: table.pop(key) for key in ("kind", "because") if key in table}
    return Claim(
        number, **table | {"figures": tuple(ClaimFigure(**_intervals(shared | one)) for one in table["figures"])}
    )


def _intervals(table: dict[str, Any]) -> dict[str, Any]:
    """The table with its lists as intervals."""
    return table | {key: tuple(map(float, value)) for key, value in table.items() if isinstance(value, list)}
