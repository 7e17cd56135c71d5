"""Rules of the thesis' claims: intervals of each figure and operating points, from `rules.toml`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import Any

from rotorsim.base.input_files import parse_toml
from rotorsim.base.units import KRPM, MPA

Interval = tuple[float, float]


@dataclass(frozen=True)
class Figure:
    """A figure of a claim: the thesis' number and the closed intervals, in `unit`, that ours is met and near in.

    one_sided: why the intervals need not surround the thesis' number, empty where they do; kind: '', 'trivial' or 'not
    comparable', with `because`; fitted: the machine file was calibrated with it.
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


@dataclass(frozen=True)
class Claim:
    """A claim of the thesis: its words, place and figures, where they are taken, and why these tolerances."""

    number: str
    words: str
    points: str
    source: str
    why: str
    figures: tuple[Figure, ...]
    remark: str = ""


@lru_cache
def claims() -> tuple[Claim, ...]:
    """All claims, in the order of the file."""
    return tuple(_claim(number, dict(table)) for number, table in _file()["claims"].items())


def points(name: str) -> tuple[tuple[float, float], ...]:
    """Named operating points, speed [rad/s] and gauge pressure [Pa]."""
    return tuple((speed * KRPM, pressure * MPA) for speed, pressure in _file()["points"][name]["at"])


@lru_cache
def _file() -> dict[str, Any]:
    return parse_toml(text())


def text() -> str:
    """The file's text."""
    return (files("studies.thesis.claims") / "rules.toml").read_text(encoding="utf-8")


def _claim(number: str, table: dict[str, Any]) -> Claim:
    shared = {key: table.pop(key) for key in ("kind", "because") if key in table}
    return Claim(number, **table | {"figures": tuple(_figure(shared | one) for one in table["figures"])})


def _figure(table: dict[str, Any]) -> Figure:
    intervals = {key: tuple(map(float, value)) for key, value in table.items() if isinstance(value, list)}
    return Figure(**table | intervals)
