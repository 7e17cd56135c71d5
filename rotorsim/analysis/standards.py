r"""Rules of machine standards, as closed formulas, with what is publicly known of their wording.

A peak of the unbalance response at N_c, which is 1/sqrt(2) as high at N_1 and N_2, has the amplification factor AF. A
peak with AF below 2.5 is critically damped. The margins, in percent of the lowest and of the highest operating speed,

.. math:: AF = \frac{N_c}{N_2 - N_1}, \qquad
          SM_{below} = \min\left(16,\; 17\left(1 - \frac{1}{AF - 1.5}\right)\right), \qquad
          SM_{above} = \min\left(26,\; 10 + 17\left(1 - \frac{1}{AF - 1.5}\right)\right)

Residual unbalance, shaft vibration (peak to peak, at N in rpm) and permissible unbalance of a grade G [mm/s] are

.. math:: U_r = \frac{6350\,W}{N}\ \mathrm{g\,mm} = \frac{4\,W}{N}\ \mathrm{oz\,in}, \qquad
          A_{vl} = \min\left(25.4, 25.4\sqrt{12000 / N}\right)\ \mathrm{\mu m}, \qquad
          U_{per} = \frac{G\,m}{\Omega}

with the static load W of a journal in kg, or in lb. Each `Rule` states how far its source could be read.

Cites: api_617, api_684, iso_14839, iso_20816, iso_21940.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from rotorsim.base.units import TO_RPM

CRITICALLY_DAMPED = 2.5
"""Amplification factor below which a peak needs no separation margin."""
ANALYSED = 2.0
"""Unbalance of an analysis over the residual unbalance that the rotor may have."""
RESIDUAL = 6350.0
"""Residual unbalance times the speed over the journal's load [g mm rpm/kg]."""
LIMIT = 25.4e-6
"""Largest limit of shaft vibration [m, peak to peak]."""
REFERENCE_SPEED = 12000.0
"""Speed [rpm] up to which that limit holds."""
SCALES = (0.5, 6.0)
"""Least and largest factor by which a computed response is scaled to the limit of vibration."""
CLEARANCE = 0.75
"""Share of a diametral running clearance that the scaled motion, peak to peak, may take."""
LEAST_DECREMENT = 0.1
"""Least logarithmic decrement of the first forward mode."""
GRADES = (0.4, 1.0, 2.5, 6.3)
"""Balance quality grades [mm/s] that are shown."""
SHAFT_ZONES = {"A": 4800e-6, "B": 9000e-6, "C": 13200e-6}
"""Upper limit of a zone of shaft vibration [m, peak to peak] times the square root of the speed [rpm]."""
SCOPE = (120.0, 30000.0)
"""Speeds [rpm] between which the zones of shaft vibration are made for."""
SENSITIVITY_ZONES = {"A": 3.0, "B": 4.0, "C": 5.0}
"""Upper limit of the largest sensitivity in a zone of stability."""


@dataclass(frozen=True)
class Rule:
    """A rule: its formula in words, standard and clause, and how far that could be read."""

    formula: str
    clause: str
    known: str


PUBLIC = "Formula and number as public programs and papers cite them; the standard's text was not at hand."
RECALLED = "Formula as commonly cited; the clause could not be verified here."
RULES = {
    "amplification": Rule(
        "AF = Nc / (N2 - N1) at 0.707 of the peak; below 2.5 a peak is critically damped", "API RP 684 SP6.8.2.1",
        PUBLIC,
    ),
    "margin": Rule(
        "below the least speed min(16, 17 (1 - 1/(AF - 1.5))) % of it; above the highest one "
        "min(26, 10 + 17 (1 - 1/(AF - 1.5))) % of it", "API RP 684 SP6.8.2.10", PUBLIC,
    ),
    "unbalance": Rule(
        "8 W/N oz in = 12700 W/N g mm, twice the residual 4 W/N oz in, at the antinodes of the mode: in phase at one, "
        "opposed at two", "API 617 lateral analysis", RECALLED,
    ),
    "vibration": Rule("Avl = 25.4 (12000/N)^0.5 um pk-pk, at most 25.4 um (1 mil)", "API RP 684 SP6.8.2.11", PUBLIC),
    "clearance": Rule(
        "motion pk-pk, scaled to Avl at the worst probe by 0.5 to 6, at most 75 % of the diametral clearance",
        "API RP 684 SP6.8.2.11, API 617 4.8.2.11", RECALLED,
    ),
    "decrement": Rule("first forward mode at least 0.1", "API 617 stability analysis", RECALLED),
    "grade": Rule("U = G m / Omega", "ISO 21940-11", RECALLED),
    "zones": Rule(
        "pk-pk below 4800, 9000, 13200 over the square root of the speed in rpm, um: zones A, B, C",
        "ISO 20816-3 (before: ISO 7919-3), 120 to 30000 rpm and above 15 kW",
        "Scope read from the title page; limits as commonly cited, the table could not be verified here.",
    ),
    "sensitivity": Rule(
        "largest sensitivity below 3, 4, 5: zones A, B, C; here of both axes at once, no less than that of each one",
        "ISO 14839-3", PUBLIC,
    ),
    "onset": Rule("every mode is damped up to the highest speed", "no standard: a rule of this program", ""),
}  # fmt: skip


@dataclass(frozen=True)
class HalfPower:
    """A peak of a response: speed [rad/s], size, and the speeds on its sides where it is 1/sqrt(2) as high.

    These are NaN where the response does not fall so far before it rises again or ends, and with the size where the
    points are too far apart for the peak.
    """

    speed: float
    size: float
    low: float
    high: float

    @property
    def amplification(self) -> float:
        """Amplification factor; NaN where a side is not known."""
        return self.speed / (self.high - self.low)


def half_power(speeds: Sequence[float] | np.ndarray, sizes: Sequence[float] | np.ndarray) -> list[HalfPower]:
    """Peaks of sizes (n,) over ascending speeds (n,) [rad/s], between the ends; NaN separates stretches.

    1 / size^2, which is smooth at a resonance, is a parabola at a peak and monotonic between points elsewhere.

    Examples
    --------
    >>> from rotorsim.analysis.standards import half_power
    >>> speeds = np.linspace(0.5, 1.5, 401)
    >>> whirl = speeds**2 / np.abs(1 - speeds**2 + 2j * 0.02 * speeds)
    >>> round(half_power(speeds, whirl)[0].amplification, 1)
    25.0
    """
    speeds, sizes = np.asarray(speeds, float), np.asarray(sizes, float)
    found: list[HalfPower] = []
    known = np.flatnonzero(np.isfinite(sizes) & (sizes > 0))
    for part in np.split(known, np.flatnonzero(np.diff(known) > 1) + 1):
        inner = sizes[part]
        tops = np.flatnonzero((inner[1:-1] > inner[:-2]) & (inner[1:-1] >= inner[2:])) + 1
        found += [_peak(speeds[part], (inner / inner.max()) ** -2, int(k), float(inner.max())) for k in tops]
    return found


def _peak(speeds: np.ndarray, inverse: np.ndarray, k: int, unit: float) -> HalfPower:
    """Peak next to point k of 1 / size^2 (n,), sizes in a `unit`."""
    x, y = speeds[k - 1 : k + 2] - speeds[k], inverse[k - 1 : k + 2]
    a, b, c = np.polyfit(x, y, 2)
    least = c - b**2 / (4 * a)
    sides = [_side(speeds[: k + 1][::-1], inverse[: k + 1][::-1], least), _side(speeds[k:], inverse[k:], least)]
    return HalfPower(
        float(speeds[k] - b / (2 * a)), float(unit / np.sqrt(least)) if least > 0 else float("nan"), *sides
    )


def _side(speeds: np.ndarray, inverse: np.ndarray, least: float) -> float:
    """Speed at which 1 / size^2 is twice its least, away from a peak at the first point.

    NaN where it falls before, and for a peak so narrow that the first point is beyond its sides.
    """
    over = np.flatnonzero(inverse >= 2 * least)
    if not over.size or not over[0] or (inverse[: over[0]] < least * (1 - 1e-9)).any():
        return float("nan")
    i = int(over[0])
    away = np.sqrt(np.maximum(inverse[i - 1 : i + 1] / least - 1, 0.0))  # linear in the speed of a single mass
    return float(np.interp(1.0, away, speeds[i - 1 : i + 1]))


def required_margin(amplification: float, above: bool) -> float:
    """Separation margin [%] that a peak needs, above the highest operating speed or below the lowest one.

    Examples
    --------
    >>> from rotorsim.analysis.standards import required_margin
    >>> required_margin(6.5, above=False), required_margin(2.4, above=True)
    (13.6, 0.0)
    """
    if amplification < CRITICALLY_DAMPED:
        return 0.0
    own = 17 * (1 - 1 / (amplification - 1.5))
    return min(26.0, 10 + own) if above else min(16.0, own)


def found_margin(critical: float, low: float, high: float) -> float:
    """Distance [%] of a critical speed from the operating speeds `low` to `high`, of the nearer one; 0 within."""
    if critical > high:
        return 100 * (critical / high - 1)
    return 100 * (1 - critical / low) if critical < low else 0.0


def residual_unbalance(load: float, speed: float) -> float:
    """Residual unbalance [kg m] of a journal with a static load [kg] at the highest operating speed [rad/s]."""
    return RESIDUAL * load / (speed * TO_RPM) * 1e-6


def vibration_limit(speed: float) -> float:
    """Limit of shaft vibration [m, peak to peak] at a speed [rad/s]."""
    rpm = speed * TO_RPM
    return LIMIT if rpm < REFERENCE_SPEED else LIMIT * sqrt(REFERENCE_SPEED / rpm)


def scale_factor(largest: float, speed: float) -> float:
    """Factor from a computed response, `largest` [m, peak to peak] at the probes, to the limit of vibration."""
    own = vibration_limit(speed) / largest if largest else inf
    return min(max(own, SCALES[0]), SCALES[1])


def permissible_unbalance(grade: float, mass: float, speed: float) -> float:
    """Permissible unbalance [kg m] of a rotor [kg] of a grade [mm/s] at a speed [rad/s]."""
    return grade * 1e-3 * mass / speed


def shaft_zone(motion: float, speed: float) -> str:
    """Zone, A to D, of a shaft vibration [m, peak to peak] at a speed [rad/s]."""
    return _zone(motion * sqrt(speed * TO_RPM), SHAFT_ZONES)


def sensitivity_zone(peak: float) -> str:
    """Zone, A to D, of a largest sensitivity."""
    return _zone(peak, SENSITIVITY_ZONES)


def _zone(value: float, limits: dict[str, float]) -> str:
    return next((zone for zone, limit in limits.items() if value < limit), "D")
