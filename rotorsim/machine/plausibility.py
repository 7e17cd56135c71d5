r"""Questions about values that can be meant and hardly are: far outside what is built, or not fitting each other.

Ranges of usual values and their reasons are in `usual.toml`; a question names the unit that was probably intended.
Moments of inertia are integrals over mass, and the polar one is at most the sum of the two diametral ones:

.. math:: I_p = I_x + I_y - 2 \int z^2 \, dm \le 2 I_d

with equality for an infinitely thin disc. Such values can be meant (a sleeve on the shaft carries the journal, a probe
looks through a bore), so there is a question and no error: the warning `rotorsim.base.errors.Unusual`, in Python shown
(and filtered) as any warning, on the command line the end of the command unless `--yes` is given. A machine file that
means such a value names its field: ``unusual = ["bearings.1.clearance"]``. Inertias of discs: Friswell et al. (2010).

Cites: friswell_2010.
"""

from __future__ import annotations

import tomllib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from itertools import pairwise
from math import log, sqrt
from typing import TYPE_CHECKING, Any

from rotorsim.base.errors import Unusual
from rotorsim.base.units import advised, dimension, parse, show, split
from rotorsim.machine.file_text import entries
from rotorsim.machine.gas_film import GasFilm
from rotorsim.machine.part import Part
from rotorsim.machine.rotor import ShaftProbe

if TYPE_CHECKING:
    from rotorsim.machine.tables import MachineTables


@dataclass(frozen=True)
class UsualRange:
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
def ranges() -> dict[tuple[str, str], UsualRange]:
    """Ranges by field and unit."""
    text = (files("rotorsim.machine") / "usual.toml").read_text(encoding="utf-8")
    found: dict[tuple[str, str], UsualRange] = {}
    for entry in tomllib.loads(text)["range"]:
        unit = entry["unit"]
        low = parse(entry["low"], unit) if "low" in entry else 0.0
        one = UsualRange(unit, low, parse(entry["high"], unit), entry["why"])
        found |= {(field, unit): one for field in entry["fields"]}
    return found


def range_of(path: str, unit: str) -> UsualRange | None:
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


def likely(text: str, known: UsualRange) -> str:
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


def ask_machine(machine: Part, file: str = "") -> None:
    """Warn of the unusual values of a machine that its `file` does not name as meant, all in one warning."""
    found = [f"{file}: {one}" if file else one for one in questions(machine)]
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


Questions = Iterator[tuple[str, str]]
ROUNDED = 0.01
"""Share by which rounded inertias may miss the bound."""
ALIKE = 0.05
"""Share by which the diameters of a journal and of the shaft under it may differ."""
DEEP = 20
"""Clearances of which a pocket or a groove is questioned."""


def implausible(machine: MachineTables) -> Questions:
    """Paths of values that do not fit the rest of a machine, and the sentences about them."""
    yield from _inertias(machine)
    yield from _loose_layers(machine)
    yield from _journals(machine)
    yield from _sleeves(machine)
    yield from _inside(machine)
    yield from _gas(machine)


def _inertias(machine: MachineTables) -> Questions:
    for i, disc in enumerate(machine.discs):
        if disc.polar_inertia > 2 * disc.diametral_inertia * (1 + ROUNDED):
            polar, limit = show(disc.polar_inertia, "kg*m^2"), show(2 * disc.diametral_inertia, "kg*m^2")
            yield (
                f"discs.{i}.polar_inertia",
                f"'{polar}' is above twice the diametral inertia, '{limit}', which no body has; check both",
            )
        arm, length = sqrt(disc.diametral_inertia / disc.mass), machine.shaft.length
        if arm > length:
            yield (
                f"discs.{i}.diametral_inertia",
                f"'{show(disc.diametral_inertia, 'kg*m^2')}' is that of the disc's mass {show(_short(arm), 'm')} away, "
                f"more than the shaft is long, {show(_short(length), 'm')}; check it and the mass",
            )
        radius = sqrt(2 * disc.polar_inertia / disc.mass)
        shaft = machine.shaft.outer_diameter(disc.position) / 2
        if 0 < radius < shaft * (1 - ALIKE):
            yield (
                f"discs.{i}.polar_inertia",
                f"'{show(disc.polar_inertia, 'kg*m^2')}' is that of a disc of radius {show(_short(radius), 'm')}, "
                f"inside the shaft of radius {show(_short(shaft), 'm')}; check it and the mass",
            )


def _loose_layers(machine: MachineTables) -> Questions:
    """Layers whose bore is wider than the shaft under it, and arms longer than the shaft."""
    shaft = machine.shaft
    for i, layer in enumerate(shaft.layers):
        others = [*shaft.placed, *((one.position, one) for one in shaft.layers if one is not layer)]
        z = layer.position + layer.length / 2
        bore, outer = layer.diameters(layer.length / 2)
        reach = [piece.diameters(z - at)[1] for at, piece in others if at <= z <= at + piece.length]
        under = max((one for one in reach if one < outer), default=0.0)
        if bore > under * (1 + ALIKE):
            yield (
                f"shaft.layers.{i}.inner_diameter",
                f"'{show(_short(bore), 'm')}' leaves a gap to the '{show(_short(under), 'm')}' under it; check both",
            )
    for i, disc in enumerate(machine.discs):
        if abs(disc.arm) > shaft.length:
            yield f"discs.{i}.seat", f"an arm of '{show(_short(disc.arm), 'm')}' is longer than the shaft; check it"


def _journals(machine: MachineTables) -> Questions:
    for path, film in films_of(machine):
        for under in _diameters(machine, film.position - film.length / 2, film.position + film.length / 2):
            own, found = show(film.diameter, "m"), show(_short(under), "m")
            if abs(under - film.diameter) > ALIKE * film.diameter:
                yield (
                    f"{path}.diameter",
                    f"'{own}' is not the diameter of the shaft in the bearing, '{found}'; check both",
                )
                break
            if under > film.diameter + 2 * film.clearance:
                yield (
                    f"{path}.diameter",
                    f"'{own}' and the clearance leave no room for the shaft, '{found}'; check both",
                )
                break


def _sleeves(machine: MachineTables) -> Questions:
    """Sleeves that stand in each other or at another bearing, and pockets and grooves that are deep for their film."""
    films = list(films_of(machine))
    for k, (path, film) in enumerate(films):
        for other, before in films[:k]:
            room = (film.length + before.length) / 2
            if abs(film.position - before.position) < room * (1 - 1e-9):
                at = show(film.position, "m")
                yield f"{path}.position", f"'{at}' puts its sleeve inside that of {other}; check places and lengths"
        for i, bearing in enumerate(machine.bearings):
            if not isinstance(bearing, GasFilm) and abs(film.position - bearing.position) < film.length:
                at = show(film.position, "m")
                yield (
                    f"{path}.position",
                    f"'{at}' is within its length of bearings.{i}; delete one of them, or check both",
                )
        for name, form in film.sleeve.forms.items():
            depth = getattr(form, "depth", 0.0)
            if depth > DEEP * film.clearance:
                yield (
                    f"{path}.{name}.depth",
                    f"'{show(depth, 'm')}' is more than {DEEP} times the clearance, '{show(film.clearance, 'm')}', "
                    "too deep for the equation of a thin film; check both",
                )


def _inside(machine: MachineTables) -> Questions:
    """Discs and probes of the shaft that stand inside a sleeve."""
    parts = [(f"discs.{i}.position", disc.position, "a disc") for i, disc in enumerate(machine.discs)]
    parts += [
        (f"probes.{i}.position", probe.position, "a probe")
        for i, probe in enumerate(machine.probes)
        if isinstance(probe, ShaftProbe)
    ]
    for at, place, what in parts:
        for path, film in films_of(machine):
            if abs(place - film.position) < film.length / 2 * (1 - 1e-9):
                yield at, f"'{show(place, 'm')}' puts {what} inside the sleeve of {path}; check where it stands"


def _gas(machine: MachineTables) -> Questions:
    """Stated properties of the gas that are not those of the named one."""
    if machine.films:
        yield from ((f"gas.{field}", sentence) for field, sentence in machine.gas.doubts())


def films_of(machine: MachineTables) -> Iterator[tuple[str, GasFilm]]:
    """Paths of the gas films and themselves, as far as the kinds of bearings are known."""
    yield from ((f"bearings.{i}", one) for i, one in enumerate(machine.bearings) if isinstance(one, GasFilm))


def _diameters(machine: MachineTables, start: float, end: float) -> Iterator[float]:
    """Diameters [m] over the layers in the middle and at the ends of every piece of the shaft between two coordinates.

    A piece that takes a thousandth of the range is left out.
    """
    shaft = machine.shaft
    marks = [z for at, section in shaft.placed for z in (at, at + section.length)]
    marks += [z for layer in shaft.layers for z in (layer.position, layer.end)]
    inner = sorted({start, end, *(z for z in marks if start < z < end)})
    for a, b in pairwise(inner):
        if b - a > 1e-3 * (end - start):
            yield from (shaft.outer_diameter(a + share * (b - a)) for share in (1e-6, 0.5, 1 - 1e-6))


def _short(value: float) -> float:
    return float(f"{value:.4g}")
