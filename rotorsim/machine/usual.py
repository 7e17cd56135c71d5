"""Warnings about values outside their usual range, with the unit probably intended.

Ranges and their reasons are in `usual.toml`. A question is the warning `rotorsim.base.errors.Unusual`: in Python it
is shown (and filtered) as any warning, on the command line it ends the command unless `--yes` is given. A machine
file that means such a value names its field: ``unusual = ["bearings.1.clearance"]``.
"""

from __future__ import annotations

import tomllib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from math import log, sqrt
from typing import Any

from rotorsim.base.errors import Unusual
from rotorsim.base.units import advised, dimension, parse, show, split
from rotorsim.machine.part import Part
from rotorsim.machine.plausibility import implausible
from rotorsim.machine.toml import entries


@dataclass(frozen=True)
class Range:
    """Usual magnitudes [SI] of fields with a unit, and why."""

    unit: str
    low: float
    high: float
    why: str

    @property
    def typical(self) -> float:
        """The example of the dimension if it is usual, else the geometric mean of the range, or its end."""
        example = parse(dimension(self.unit).example, self.unit)
        return example if self.low <= example <= self.high else sqrt((self.low or self.high) * self.high)

    def holds(self, value: float) -> bool:
        """Whether a value is usual; 0 always is."""
        return value == 0 or self.low <= abs(value) <= self.high


@lru_cache(maxsize=1)
def ranges() -> dict[tuple[str, str], Range]:
    """Ranges by field and unit."""
    text = (files("rotorsim.machine") / "usual.toml").read_text(encoding="utf-8")
    found: dict[tuple[str, str], Range] = {}
    for entry in tomllib.loads(text)["range"]:
        unit = entry["unit"]
        low = parse(entry["low"], unit) if "low" in entry else 0.0
        one = Range(unit, low, parse(entry["high"], unit), entry["why"])
        found |= {(field, unit): one for field in entry["fields"]}
    return found


def range_of(path: str, unit: str) -> Range | None:
    """The range of a field of a machine file ('bearings.1.clearance'), an option or a parameter ('least-film')."""
    parts = (part for part in path.replace("-", "_").split(".") if not part.isdecimal())
    return ranges().get((".".join(parts), unit))


def question(path: str, value: float, unit: str, text: str = "") -> str | None:
    """A sentence about an unusual value [SI]; `text` is how it was written. None for a usual one."""
    known = range_of(path, unit)
    if known is None or known.holds(value):
        return None
    text = text.strip() or show(value, unit)
    side = "above" if abs(value) > known.high else "below"
    slip = likely(text, known)
    meant = f"; '{slip}' would be usual" if slip else "; check number and unit"
    return f"{path}: '{text}' is far {side} what is usual ({known.why}){meant}"


def likely(text: str, known: Range) -> str:
    """The number of a text with the unit that brings it nearest to what is typical; empty if none makes it usual."""
    number, written = split(text)
    found: dict[float, str] = {}
    for unit in advised(known.unit):
        try:
            value = parse(f"{number} {unit}", known.unit)
        except ValueError:
            return ""
        if unit != written and value != 0 and known.holds(value):
            found.setdefault(abs(log(abs(value) / known.typical)), f"{number} {unit}")
    return found[min(found)] if found else ""


def ask(path: str, value: float, unit: str, text: str = "", before: str = "") -> None:
    """Warn of an unusual value; `before` goes before the path, as the dashes of an option."""
    sentence = question(path, value, unit, text)
    if sentence:
        warnings.warn(before + sentence, Unusual, stacklevel=3)


def ask_machine(machine: Part) -> None:
    """Warn of the unusual values of a machine that its file does not name as meant, all in one warning."""
    found = questions(machine)
    if found:
        warnings.warn("\n".join(found), Unusual, stacklevel=3)


def questions(machine: Part, whole: bool = True) -> list[str]:
    """Sentences about the unusual values of a machine that its file does not name as meant; of a `whole` one also about
    values that do not fit each other."""
    meant = getattr(machine, "unusual", ())
    asked = [(path, q) for path, value, unit in numbers(machine) if (q := question(path, value, unit))]
    known = {path for path, _ in asked}
    if whole:
        asked += [(path, f"{path}: {q}") for path, q in implausible(machine) if path not in known]  # type: ignore[arg-type]
    way = "; a machine file may name what is meant: unusual = ['{}']"
    return [sentence + way.format(path) for path, sentence in asked if path not in meant]


def numbers(part: Any, path: str = "") -> Iterator[tuple[str, float, str]]:
    """Path, value [SI] and unit of every number of a machine that has one."""
    for name, value, known, _ in entries(part):
        here = f"{path}.{name}".lstrip(".")
        if isinstance(value, dict):
            for kind, effects in value.items():
                yield from _listed(effects, f"{here}.{kind}")
        elif isinstance(value, tuple):
            yield from _listed(value, here)
        elif isinstance(value, Part):
            yield from numbers(value, here)
        elif known is not None:
            yield here, float(value), known.unit


def _listed(items: tuple[Any, ...], path: str) -> Iterator[tuple[str, float, str]]:
    single = len(items) == 1 and path.startswith("effects.")
    for i, item in enumerate(items):
        if not isinstance(item, str):
            yield from numbers(item, path if single else f"{path}.{i}")
