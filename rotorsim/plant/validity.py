r"""Range in which the film model holds, by numbers of its films at an equilibrium.

.. math:: \Lambda = \frac{6 \mu \Omega R^2}{p_a c^2}, \quad M = \frac{\Omega R}{\sqrt{\gamma R_g T}}, \quad
          Re^* = \frac{\rho \Omega R\, c^2}{\mu R}, \quad
          Kn = \max \frac{\mu}{p\,h} \sqrt{\frac{\pi R_g T}{2}}, \quad
          M_e = \frac{\dot m}{2 \cdot 2 \pi R\, c\, \rho_a \sqrt{\gamma R_g T}}

rho is the mean over the film, Kn the largest anywhere in it, edges included; rho_a is that at ambient pressure, c the
clearance. A limit is where the model leaves something out that no longer is small: inertia (Re*, M_e), heat across the
film (M: the middle of a sheared film is warmer than its walls by Pr (gamma - 1) M^2 / 8 of the absolute temperature,
3.5 % at M = 1), slip (Kn), a sonic entry from a feed hole; or where nothing checked it (Lambda, and the table `checked`
of a machine file).

Cites: hamrock_2004, white_2011, burgdorfer_1959.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from reynolds.injector import critical_ratio
from rotorsim.base.errors import RotorsimError
from rotorsim.base.rounding import DAMPED
from rotorsim.base.units import MPA, TO_RPM
from rotorsim.machine.bearings import TableBearing
from rotorsim.machine.gas_film import Gas, GasFilm
from rotorsim.plant.assemble import Assembly
from rotorsim.plant.plant import Plant, point
from rotorsim.plant.simulation import Simulation

if TYPE_CHECKING:
    from rotorsim.machine.schema import Machine

WITHIN = 1e-6
"""Share by which a speed may pass the end of a table."""
STEPS = 12
"""Halvings of the range of speeds in which a limit is passed."""


@dataclass(frozen=True)
class Bound:
    """Largest value of a number of a film, and what the model leaves out or nothing has checked beyond it."""

    name: str
    limit: float
    why: str


BOUNDS = {
    "bearing": Bound("bearing number", 25.0, "the film was compared with an independent solution up to there"),
    "mach": Bound("Mach number of the surface", 1.0, "the film is taken as isothermal"),
    "reynolds": Bound("reduced Reynolds number", 1.0, "the film has no inertia"),
    "knudsen": Bound("Knudsen number", 0.01, "the gas does not slip at the walls; add [effects.slip]"),
    "outflow": Bound("Mach number of the flow at the edges", 0.3, "the film has no inertia"),
    "choked": Bound("share of the feed holes choked where they enter the film", 0.0, "the film has no sonic entry"),
}
SLIPPING = Bound("Knudsen number", 0.1, "[effects.slip] is of first order")


@dataclass(frozen=True)
class Exceeded:
    """A limit of validity that an operating point exceeds: what, where, value, limit, unit, and the sentence."""

    name: str
    place: str
    value: float
    limit: float
    unit: str
    sentence: str


def bearing_number(gas: Gas, film: GasFilm, speed: float) -> float:
    """Lambda at a speed [rad/s]."""
    return 6 * gas.mu * speed * (film.diameter / 2 / film.clearance) ** 2 / gas.ambient_pressure


def sound(gas: Gas) -> float:
    """Speed of sound [m/s]."""
    return sqrt(gas.kappa * gas.R * gas.temperature)


def density(gas: Gas, pressure: float) -> float:
    """Density [kg/m^3] at an absolute pressure [Pa]."""
    return pressure / (gas.R * gas.temperature)


def surface_mach(gas: Gas, film: GasFilm, speed: float) -> float:
    """Mach number of the journal's surface at a speed [rad/s]."""
    return speed * film.diameter / 2 / sound(gas)


def reduced_reynolds(gas: Gas, film: GasFilm, speed: float, pressure: float) -> float:
    """Inertia over viscous force in the film at a speed [rad/s] and mean absolute pressure [Pa]."""
    return density(gas, pressure) * speed * film.clearance**2 / gas.mu


def knudsen(gas: Gas, viscosity: float, pressure: float, gap: float) -> float:
    """Mean free path over a gap [m] at an absolute pressure [Pa] and viscosity [Pa s] there."""
    return viscosity / (pressure * gap) * sqrt(pi * gas.R * gas.temperature / 2)


def largest_knudsen(simulation: Simulation, number: int = 0) -> float:
    """Largest Knudsen number at the nodes of a film now, edges included."""
    a = simulation.assembly
    v, L = a.film_part(simulation.w, number), a.film
    lines = L.first + np.arange(L.n_theta)[:, None] * L.stride
    nodes = lines + np.arange(L.half - 1, L.n_rows + 1)
    worst = np.argmin(v[L.p + nodes] * v[L.h + nodes])
    p, h = (float(v[at + nodes.ravel()[worst]]) for at in (L.p, L.h))
    return knudsen(a.machine.gas, float(v[L.mu]), p, h)


def outflow_mach(gas: Gas, film: GasFilm, flow: float) -> float:
    """Mach number at both edges of the film, through which a flow [kg/s] leaves."""
    area = 2 * pi * film.diameter * film.clearance
    return flow / (area * density(gas, gas.ambient_pressure) * sound(gas))


def choked_share(simulation: Simulation, number: int = 0) -> float:
    """Share of the injectors and orifices of a film whose flow into it is sonic now; 0 without any."""
    a = simulation.assembly
    v, n = a.film_part(simulation.w, number), len(a.films[number].injectors)
    if not n:
        return 0.0
    ratio = v[a.film.local_p : a.film.local_p + n] / v[a.film.plenum : a.film.plenum + n]
    return float(np.mean(ratio < critical_ratio(a.machine.gas.kappa)))


def film_numbers(simulation: Simulation) -> list[dict[str, float]]:
    """Numbers of every film now, by the keys of `BOUNDS`."""
    a = simulation.assembly
    gas, speed, found = a.machine.gas, abs(float(simulation.w[a.rotor.speed])), []
    for k, film in enumerate(a.machine.films):
        pressure = float(simulation.film_pressure(k).mean())
        start = a.film.film_flow
        flow = float(a.film_part(simulation.w, k)[start : start + len(a.films[k].injectors)].sum())
        found.append({
            "bearing": bearing_number(gas, film, speed),
            "mach": surface_mach(gas, film, speed),
            "reynolds": reduced_reynolds(gas, film, speed, pressure),
            "knudsen": largest_knudsen(simulation, k),
            "outflow": outflow_mach(gas, film, flow),
            "choked": choked_share(simulation, k),
        })  # fmt: skip
    return found


def range_of_validity(plant: Plant, speed: float = 0.0, pressure: float = 0.0) -> list[Exceeded]:
    """Limits that the film model exceeds at the equilibrium of a speed [rad/s] and gauge pressure [Pa].

    Speed and pressure are numbers in SI or texts with a unit. Raises as `Plant.equilibrium`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> [one.name for one in rs.plant.range_of_validity(plant, "12000 rpm", "0.5 MPa")]
    ['speed']
    """
    return exceeded(plant.start(speed, pressure), point(speed, pressure)[1])


def exceeded(simulation: Simulation, pressure: float) -> list[Exceeded]:
    """Limits that the film model exceeds where a simulation stands, supplied at a gauge pressure [Pa]."""
    a = simulation.assembly
    speed = float(simulation.w[a.rotor.speed])
    found = [*_unchecked(a.machine, speed, pressure), *beyond_tables(a.machine, speed)]
    numbers = film_numbers(simulation)
    bounds = [BOUNDS | ({"knudsen": SLIPPING} if slips(simulation, k) else {}) for k in range(len(numbers))]
    for key in BOUNDS:
        for bound in dict.fromkeys(own[key] for own in bounds):
            films = zip(a.machine.film_names, numbers, bounds, strict=True)
            where = {name: one[key] for name, one, own in films if own[key] == bound and one[key] > bound.limit}
            if where:
                value = max(where.values())
                place = f"{'films' if len(where) > 1 else 'film'} {', '.join(where)}" if len(numbers) > 1 else "film"
                text = f"{bound.name} {value:.3g} > {bound.limit:g} in the {place} ({bound.why})"
                found.append(Exceeded(bound.name, place, value, bound.limit, "1", text))
    return found


def slips(simulation: Simulation, number: int = 0) -> bool:
    """Whether the gas of a film slips at the walls now, by half its mean free path at least."""
    a = simulation.assembly
    v, F = a.film_part(simulation.w, number), a.film_constants(number)
    # mean free path times pressure: that of the effect, and that of the gas by its viscosity and R_g T
    own = v[a.film.mu] * sqrt(pi / 2 * F.source * F.dy * F.dz)
    return bool(v[a.film.slip] / 6 >= 0.5 * own)


def beyond_tables(machine: Machine, speed: float) -> Iterator[Exceeded]:
    """Tables of bearings whose first or last speed a speed [rad/s] passes, so that the row at the end is held."""
    for name, bearing in zip(machine.bearing_names, machine.bearings, strict=True):
        if not isinstance(bearing, TableBearing):
            continue
        first, last = bearing.reach
        if abs(speed) > last * (1 + WITHIN):
            yield _held(f"table of {name}", name, abs(speed), last, "ends")
        elif abs(speed) < first * (1 - WITHIN):
            yield _held(f"start of the table of {name}", name, abs(speed), first, "begins")


def _held(key: str, name: str, speed: float, end: float, verb: str) -> Exceeded:
    text = (
        f"{speed * TO_RPM:.0f} rpm, and the table of the bearing {name} {verb} at {end * TO_RPM:.0f} rpm; its values "
        "there are held"
    )
    return Exceeded(key, name, speed, end, "rad/s", text)


def linear_warnings(
    plant: Plant,
    speeds: ArrayLike,
    zeta: ArrayLike | None = None,
    pressure: float = 0.0,
    carried: ArrayLike | None = None,
) -> dict[str, str]:
    """Attribute `warnings` of a linear analysis: a sentence a line about speeds at which it does not hold; or nothing.

    Speeds (n,) [rad/s] beyond the tables of bearings, beyond the checked range, at which a mode grows (least damping
    ratio `zeta`, NaN where there is none), and that no film carries at the supply pressure [Pa, gauge].
    """
    signed = np.atleast_1d(np.asarray(speeds, float))
    w = np.abs(signed)
    found: dict[str, str] = {}
    for speed in (float(w.min()), float(w.max())):
        for one in (*beyond_tables(plant.machine, speed), *_unchecked(plant.machine, speed, pressure)):
            found.setdefault(one.name, one.sentence)
    sentences = list(found.values())
    damping = np.full(w.shape, np.nan) if zeta is None else np.atleast_1d(np.asarray(zeta, float))
    diverges = damping <= -1
    leaving = np.where(diverges | np.isnan(damping), damping, 1.0)
    for grows, what in (
        (diverges, f"the rotor leaves its place without oscillation {growth(signed, leaving)}"),
        (~diverges & (damping < -DAMPED), f"a mode grows {growth(signed, np.where(diverges, 1.0, damping))}, with a "
         f"damping ratio of {np.nanmin(damping, initial=np.inf, where=~diverges):.3g} at the least"),
    ):  # fmt: skip
        if grows.any():
            sentences.append(f"{what}: the machine does not run steadily there, and a steady response does not exist")
    lost = np.zeros(w.shape, bool) if carried is None else ~np.atleast_1d(np.asarray(carried, bool))
    if lost.any():
        ranges = ", ".join(_range(signed[run]) for run in _runs(lost))
        sentences.append(
            f"the film does not carry at {ranges} ({lost.sum()} of {w.size} speeds): nothing is known there"
        )
    return {"warnings": "\n".join(sentences)} if sentences else {}


def growth(speeds: np.ndarray, zeta: np.ndarray, onset: float = np.nan) -> str:
    """Ranges of speeds at which a mode grows, as words, each sense of rotation from rest on.

    Parameters
    ----------
    speeds, zeta : arrays (n,)
        Speeds [rad/s] and the least damping ratio at each; NaN where there is none.
    onset : float
        Speed [rad/s], not negative, from which on a mode grows, where it was searched.
    """
    parts = []
    for turns, sense in ((1, speeds >= 0), (-1, speeds < 0)):
        at = np.flatnonzero(sense & ~np.isnan(zeta))
        at = at[np.argsort(np.abs(speeds[at]))]
        w, grows = speeds[at] * TO_RPM, zeta[at] < -DAMPED
        for run in _runs(grows):
            i, k = int(run[0]), int(run[-1])
            begins = f"from between {w[i - 1]:.0f} and {w[i]:.0f} rpm on" if i else f"at {w[i]:.0f} rpm already"
            if turns > 0 and (w[i - 1] if i else 0.0) < onset * TO_RPM <= w[i]:
                begins = f"from {onset * TO_RPM:.0f} rpm on"
            ends = f" up to between {w[k]:.0f} and {w[k + 1]:.0f} rpm" if k + 1 < w.size else ""
            parts.append(begins + ends)
    return " and ".join(parts)


def _runs(true: np.ndarray) -> list[np.ndarray]:
    """Places of each unbroken row of true ones."""
    places = np.flatnonzero(true)
    return [run for run in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if run.size]


def _range(speeds: np.ndarray) -> str:
    """First and last of some speeds [rad/s] as words."""
    first, last = float(speeds[0]) * TO_RPM, float(speeds[-1]) * TO_RPM
    return f"{round(first)} rpm" if speeds.size == 1 else f"{round(first)} to {round(last)} rpm"


def _unchecked(machine: Machine, speed: float, pressure: float) -> Iterator[Exceeded]:
    """Speed [rad/s] and gauge pressure [Pa] beyond those that the machine file states as checked."""
    checked = machine.checked
    if checked is None or checked.holds(speed, pressure):
        return
    compared = "which the machine's model was compared with measurements"
    if not checked.holds(speed, checked.lowest_pressure):
        times = f", {abs(speed) / checked.highest_speed:.3g} times" if checked.highest_speed else ", above"
        highest = f"{checked.highest_speed * TO_RPM:.0f} rpm, {checked.against}"
        text = f"{abs(speed) * TO_RPM:.0f} rpm{times} the highest speed at {compared} ({highest})"
        yield Exceeded("speed", "machine", abs(speed), checked.highest_speed, "rad/s", text)
    if not checked.holds(0.0, pressure):
        low, high = checked.lowest_pressure, checked.highest_pressure or np.inf
        below, limit = ("below", low) if pressure < low else ("above", high)
        text = f"{pressure / MPA:.3g} MPa, {below} the pressures at {compared} ({checked.pressures}, {checked.against})"
        yield Exceeded("pressure", "machine", pressure, limit, "Pa", text)


def known_speed(machine: Machine) -> tuple[float, str] | None:
    """Highest speed [rad/s] up to which the model of a machine was checked or holds, and its reason; None without one.

    Limits that depend on the pressure in a film are not among them; see `exceeded`.
    """
    checked, made = machine.checked, machine.drive.highest_speed
    found = [] if checked is None else [(checked.highest_speed, f"the highest checked speed ({checked.against})")]
    if made is not None:
        found.append((made, "drive.highest_speed, for which the machine is made"))
    for name, film in zip(machine.film_names, machine.films, strict=True):
        for key, number in (
            ("bearing", bearing_number(machine.gas, film, 1.0)),
            ("mach", surface_mach(machine.gas, film, 1.0)),
        ):
            bound = BOUNDS[key]
            found.append((bound.limit / number, f"the {bound.name} {bound.limit:g} in {name} ({bound.why})"))
    return min(found, default=None)


def beyond(assembly: Assembly, slowest: float, fastest: float, pressure: float) -> tuple[str, ...]:
    """Sentences of what a run between two speeds [rad/s] at a gauge pressure [Pa] exceeds, and above or below which."""
    low = {one.name: one for one in _at(assembly, slowest, pressure)}
    high = {one.name: one for one in _at(assembly, fastest, pressure)}
    above = {name: _passage(assembly, name, fastest, slowest, pressure) for name in high if name not in low}
    below = {name: _passage(assembly, name, slowest, fastest, pressure) for name in low if name not in high}
    return (
        *(f"above {above[name]}: {one.sentence}" if name in above else one.sentence for name, one in high.items()),
        *(f"below {speed}: {low[name].sentence}" for name, speed in below.items()),
    )


def _passage(assembly: Assembly, name: str, beyond: float, within: float, pressure: float) -> str:
    """Speed, as a text, at which a limit is passed, between one [rad/s] beyond it and one within."""
    checked = assembly.machine.checked
    if name == "speed" and checked is not None:
        return f"{checked.highest_speed * TO_RPM:.0f} rpm"
    ends = {one.name: one.limit for one in beyond_tables(assembly.machine, beyond)}
    if name in ends:
        return f"{ends[name] * TO_RPM:.0f} rpm"
    for _ in range(STEPS):
        middle = (beyond + within) / 2
        passed = name in {one.name for one in _at(assembly, middle, pressure)}
        beyond, within = (middle, within) if passed else (beyond, middle)
    return f"{beyond * TO_RPM:.0f} rpm"


def _at(assembly: Assembly, speed: float, pressure: float) -> list[Exceeded]:
    """Limits exceeded at an equilibrium; those of the machine alone where there is none."""
    try:
        return exceeded(Simulation.at_equilibrium(assembly, speed, pressure), pressure)
    except RotorsimError:
        return [*_unchecked(assembly.machine, speed, pressure), *beyond_tables(assembly.machine, speed)]
