r"""Questions between parts of a machine: bodies that cannot exist, parts that do not fit each other.

Moments of inertia are integrals over mass, and the polar one is at most the sum of the two diametral ones:

.. math:: I_p = I_x + I_y - 2 \int z^2 \, dm \le 2 I_d

with equality for an infinitely thin disc. What is asked here can be meant (a sleeve on the shaft carries the journal, a
probe looks through a bore), so it is a question and no error, as an unusual value is.
Inertias of discs: Friswell et al. (2010).

Cites: friswell_2010.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import sqrt
from typing import TYPE_CHECKING

from rotorsim.base.units import show
from rotorsim.machine.gas_film import GasFilm
from rotorsim.machine.probes import ShaftProbe
from rotorsim.machine.rotor import Section

if TYPE_CHECKING:
    from rotorsim.machine.tables import MachineTables

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
        shaft = max((s.outer_diameter / 2 for s in _sections(machine, disc.position, disc.position)), default=0.0)
        if 0 < radius < shaft * (1 - ALIKE):
            yield (
                f"discs.{i}.polar_inertia",
                f"'{show(disc.polar_inertia, 'kg*m^2')}' is that of a disc of radius {show(_short(radius), 'm')}, "
                f"inside the shaft of radius {show(_short(shaft), 'm')}; check it and the mass",
            )


def _journals(machine: MachineTables) -> Questions:
    for path, film in _films(machine):
        start, end = film.position - film.length / 2, film.position + film.length / 2
        for section in _sections(machine, start, end):
            if abs(section.outer_diameter - film.diameter) > ALIKE * film.diameter:
                own, under = show(film.diameter, "m"), show(section.outer_diameter, "m")
                yield (
                    f"{path}.diameter",
                    f"'{own}' is not the diameter of the shaft in the bearing, '{under}'; check both",
                )
                break


def _sleeves(machine: MachineTables) -> Questions:
    """Sleeves that stand in each other, and pockets and grooves that are deep for their film."""
    films = list(_films(machine))
    for k, (path, film) in enumerate(films):
        for other, before in films[:k]:
            room = (film.length + before.length) / 2
            if abs(film.position - before.position) < room * (1 - 1e-9):
                at = show(film.position, "m")
                yield f"{path}.position", f"'{at}' puts its sleeve inside that of {other}; check places and lengths"
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
        for path, film in _films(machine):
            if abs(place - film.position) < film.length / 2 * (1 - 1e-9):
                yield at, f"'{show(place, 'm')}' puts {what} inside the sleeve of {path}; check where it stands"


def _gas(machine: MachineTables) -> Questions:
    """Stated properties of the gas that are not those of the named one."""
    if machine.films:
        yield from ((f"gas.{field}", sentence) for field, sentence in machine.gas.doubts())


def _films(machine: MachineTables) -> Iterator[tuple[str, GasFilm]]:
    for i, film in zip(machine.film_bearings, machine.films, strict=True):
        yield f"bearings.{i}", film


def _sections(machine: MachineTables, start: float, end: float) -> Iterator[Section]:
    """Sections of the shaft that two coordinates touch with more than rounding."""
    z, slack = machine.shaft.start, 1e-9 * machine.shaft.length
    for section in machine.shaft.sections:
        if (
            z < end + slack
            and z + section.length > start - slack
            and (start == end or min(z + section.length, end) - max(z, start) > 1e-3 * (end - start))
        ):
            yield section
        z += section.length


def _short(value: float) -> float:
    return float(f"{value:.4g}")
