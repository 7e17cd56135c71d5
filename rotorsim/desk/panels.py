"""Answers about a design, each a panel of the page: curves and tables as plain data.

Every number is that of a public function of `rotorsim.analysis`, and every text in a table that of the page of its
result; nothing is computed here. `PANELS` has the panels by name in the order in which they are answered.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.analysis import (
    campbell,
    design_review,
    mode_shapes,
    random_machines,
    reserve_slopes,
    static_deflection,
    sweep,
    unbalance_response,
)
from rotorsim.analysis.campbell import modes_line, searched_line, top_speed
from rotorsim.analysis.design_review import AROUND, MET, MISSED, OPEN, DesignReview, deflected_line
from rotorsim.analysis.sweep import text_of
from rotorsim.analysis.sweep_definition import CARRIED, STABLE
from rotorsim.base.errors import DataError
from rotorsim.base.rounding import DAMPED
from rotorsim.base.units import MPA, RPM, TO_HZ, TO_RPM, TO_UM
from rotorsim.machine.file_text import kept_tables, value_at
from rotorsim.machine.schema import Machine, leaves
from rotorsim.plant import Plant
from rotorsim.plant.mesh import Mesh
from rotorsim.plant.simulation import settle
from rotorsim.report.design import SIGNS, answered, asked, tables
from rotorsim.report.linear import criticals, distinct, peaks, warned
from rotorsim.report.page import cells

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.analysis import RandomResult, SweepResult
    from rotorsim.plant.linearise import LinearPlant

CLOSE = 0.15
"""Distance of a speed of the response from others, over the width of the peak there, up to which it is left out."""
STEPS = 20
"""Steps of the speeds of a Campbell diagram."""
FINER = 40
"""Steps of the speeds of a response."""
BEGUN = 8
"""Steps among them at which the response of films is answered first."""
SHOWN = 8
"""Branches of a Campbell diagram."""
COLOURS = 6
"""Branches with a colour of their own."""
DRAWN = 4
"""Mode shapes."""
NEAREST = 8
"""Requirements whose slopes are shown."""
LEAST_SLOPE = 1e-3
"""Slope below which a value does not move a requirement."""
LARGEST = 3
"""Values that are shown to move a requirement."""
SCATTERED = ("criticals",)
"""Quantities of random machines."""
MACHINES = 60
"""Random machines within the tolerance."""
CLEARANCES = "-40 %:40 %:7"
"""Clearances of films at which the onset of whirl and the damping are searched, around those of the machine."""
MARGINS = ("onset", "damping")
"""Quantities over the clearance."""
BRIEF = {CARRIED: "does not carry"}
"""Reasons that a cell has in fewer words."""
VALUES = {
    "bearings": re.compile(r"bearings\.\d+\.(kxx|kyy|cxx|cyy|clearance|length)"),
    "discs": re.compile(r"discs\.\d+\.mass"),
    "shaft sections": re.compile(r"shaft\.sections\.\d+\.outer_diameter"),
}
"""Values that are changed to see what moves a design, and that have the tolerance, by kind in their order."""
MOST_VALUES = 24
"""Values of a machine, at most, that are changed."""
DIGITS = 7
"""Digits of a value in a curve."""
SHAPE_DECIMALS = 7
"""Decimals of a mode shape, whose largest is 1: what is below another order of computing changes."""
LAST = {MISSED: -inf, OPEN: inf, MET: inf}
"""Place of a requirement without a number among the reserves: one that is not met comes first."""
DECREMENTS = (-1.0, 2.0)
"""Farthest ends of the axis of logarithmic decrements."""
SUPPLY = 0.5 * MPA
"""Gauge supply pressure [Pa] at first."""
FIELDS = {"top": ("answers up to", "rpm"), "speed": ("modes at", "rpm"), "supply": ("supply", "MPa gauge"),
          "tolerance": ("tolerance", "%")}  # fmt: skip
"""Words and unit of the page's field of each value of an operating point."""
POSITIVE = ("top", "tolerance")
"""Values of an operating point that are above 0."""
LARGE = 4000
"""States of a shaft above which a panel is computed on request: of 3848 states, all but the slow ones took 5 s."""
NUMBER = re.compile(r"\s*\+?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\s*", re.ASCII | re.IGNORECASE)
"""A number that may be typed there."""
LIFTED = 1.5
"""Speed over one at which a film lifted off from which on it does: from 33 to 36 rad/s a foil's did by turns."""
HIGHEST = {"top": 1e7, "speed": 1e7, "supply": 1e7, "tolerance": 20.0}
"""Largest value of an operating point."""


@dataclass(frozen=True)
class DeskPoint:
    """Speed [rpm] up to which answers reach, that of the mode shapes, gauge supply pressure [MPa], tolerance [%].

    None is the machine's own: `top_speed` of its analyses, for both speeds.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.desk.DeskPoint(top=9000.0).top
    9000.0
    """

    top: float | None = None
    speed: float | None = None
    supply: float = SUPPLY / MPA
    tolerance: float = 5.0


class RememberingPlant(Plant):
    """A plant that linearises once at a speed and pressure, so that panels share a model and what is known of it."""

    @cached_property
    def _models(self) -> dict[tuple[str, float, bool], LinearPlant]:
        return {}

    def linearise(self, speed: float = 0.0, pressure: float = 0.0, moment: bool = False) -> LinearPlant:
        """The linear model; speeds that differ by rounding have one."""
        key = f"{speed:.12g}", pressure, moment
        if key not in self._models:
            self._models[key] = super().linearise(speed, pressure, moment)
        return self._models[key]

    @cached_property
    def _rested(self) -> dict[tuple[float, float], tuple[float, np.ndarray]]:
        return {}

    def _settled(self, speed: float, pressure: float) -> np.ndarray:
        """Workspace in equilibrium, from the last one at the pressure on: a tenth of the way from ambient pressure.

        Not where it may not lift off: a film that carries already goes on to below that speed.
        """
        key = pressure, float(np.sign(speed))
        least, near = self._rested.get(key, (inf, None))
        w = settle(self.assembly, speed, pressure, near if abs(speed) >= LIFTED * least else None)
        self._rested[key] = min(abs(speed), least), w
        return w


@dataclass(frozen=True, eq=False)
class DesignCase:
    """A machine at an operating point, with the results that panels share; each is computed when it is first asked for.

    Examples
    --------
    >>> import rotorsim as rs
    >>> case = rs.desk.DesignCase(rs.load_machine("plain_rotor"))
    >>> case.campbell.sizes["branch"]
    8
    """

    machine: Machine
    point: DeskPoint = DeskPoint()

    @cached_property
    def plant(self) -> Plant:
        """The machine, ready to be analysed."""
        return RememberingPlant(self.machine)

    @property
    def pressure(self) -> float:
        """Gauge supply pressure [Pa]; 0 for a machine without feed."""
        return self.point.supply * MPA if self.machine.supplied else 0.0

    @cached_property
    def top(self) -> float:
        """Speed [rpm] up to which the answers reach, to two decimals."""
        return round(top_speed(self.plant) * TO_RPM, 2) if self.point.top is None else self.point.top

    @property
    def speed(self) -> float:
        """Speed [rpm] of the mode shapes."""
        return self.top if self.point.speed is None else self.point.speed

    @cached_property
    def response_speeds(self) -> list[float]:
        """Speeds [rpm] of the response: even steps, and more next to the critical speeds that it passes.

        Of those around a critical speed one that has another one next to it is left out.
        """
        at, zeta, order = (self.campbell[f"critical_{name}"].values for name in ("speed", "zeta", "order"))
        found = self.even_speeds
        for k in sorted(AROUND, key=abs):
            for speed, z in zip(at[order == 1] * TO_RPM, np.maximum(zeta[order == 1], 1e-4), strict=True):
                one = round(speed * (1 + k * z), 2)
                if 0 < one <= self.top and (not k or np.abs(found - one).min() > CLOSE * max(abs(k), 1) * z * speed):
                    found = np.append(found, one)
        return np.unique(found).tolist()

    @property
    def even_speeds(self) -> np.ndarray:
        """Speeds (steps,) [rpm] of the response at even steps."""
        return np.round(np.linspace(0.0, self.top, FINER + 1)[1:], 2)

    @cached_property
    def campbell(self) -> xr.Dataset:
        """Campbell diagram."""
        return campbell(self.plant, np.linspace(0.0, self.top, STEPS + 1) * RPM, self.pressure, SHOWN)

    @cached_property
    def response(self) -> xr.Dataset:
        """Response to unbalance."""
        return unbalance_response(self.plant, np.array(self.response_speeds) * RPM, self.pressure)

    @cached_property
    def modes(self) -> xr.Dataset:
        """Mode shapes."""
        return mode_shapes(self.plant, self.speed * RPM, self.pressure)

    @cached_property
    def static(self) -> xr.Dataset:
        """Static deflection."""
        return static_deflection(self.plant)

    @cached_property
    def stated(self) -> dict[str, list[str]]:
        """Paths of the values that the machine states and that can be changed, by kind."""
        tables = kept_tables(self.machine.text)
        known = [path for path, value, spec, _ in leaves(self.machine)
                 if spec is not None and isinstance(value, float) and value > 0
                 and value_at(tables, path) is not None]  # fmt: skip
        return {kind: [path for path in known if form.fullmatch(path)] for kind, form in VALUES.items()}

    @property
    def values(self) -> list[str]:
        """Paths of the values that are changed: those of bearings first, then of discs, then of the shaft."""
        return [path for paths in self.stated.values() for path in paths][:MOST_VALUES]

    @property
    def changed(self) -> str:
        """Sentence of the kinds of values that are changed, each with how many of all."""
        shares = [f"{len(set(paths) & set(self.values))} of {len(paths)} of {kind}"
                  for kind, paths in self.stated.items() if paths]  # fmt: skip
        total = sum(map(len, self.stated.values()))
        return f"{len(self.values)} of {total} values are changed: {', '.join(shares)}."

    @cached_property
    def slopes(self) -> xr.Dataset:
        """Slopes of the reserves."""
        return reserve_slopes(self.plant, self.values, self.pressure)

    @cached_property
    def scatter(self) -> RandomResult:
        """Random machines."""
        vary = [f"{path}=+- {self.point.tolerance:g} %" for path in self.values]
        return random_machines(self.plant, vary, MACHINES, SCATTERED, pressure=self.pressure, highest=self.top * RPM)

    @property
    def swept(self) -> dict[str, str]:
        """Clearances of the films, all together where they are one, else those of the first film; empty without any."""
        paths = [path for path in self.stated["bearings"] if path.endswith("clearance")]
        tables = kept_tables(self.machine.text)
        together = len({str(value_at(tables, path)) for path in paths}) == 1
        return {("bearings.*.clearance" if together else path): CLEARANCES for path in paths[:1]}

    @cached_property
    def clearances(self) -> SweepResult:
        """Onset of whirl, searched up to twice the top speed, and damping over the clearance of films."""
        return sweep(self.plant, self.swept, MARGINS, self.speed * RPM, self.pressure, 2 * self.top * RPM)

    @cached_property
    def review(self) -> DesignReview:
        """Design review at the machine's own operating speed."""
        return design_review(self.plant, pressure=self.pressure)


Plain = dict[str, Any]
PANELS: dict[str, Callable[[DesignCase], Plain]] = {}
"""Makers of panels by name, in the order of the page."""
TITLES: dict[str, str] = {}
"""Titles of the panels by name, and of those that are answered in part first."""


SLOW: list[str] = []
"""Panels that need many computations, by name."""
FIRST = {"first response": "response"}
"""Panels that films answer in part first, by the name of that part."""


def panel(
    name: str, title: str, slow: bool = False
) -> Callable[[Callable[[DesignCase], Plain]], Callable[[DesignCase], Plain]]:
    """Decorator: register the maker of a panel."""

    def register(make: Callable[[DesignCase], Plain]) -> Callable[[DesignCase], Plain]:
        PANELS[name], TITLES[name] = make, title
        SLOW.extend([name] if slow else [])
        return make

    return register


def in_order(names: Sequence[str], films: bool, near: Sequence[str] = ()) -> list[str]:
    """Names of panels as they are computed: the quick ones, then the slow ones.

    The answer in part of a panel that is near, pinned or on view, comes before all, of another one before that panel.
    """
    order = sorted(names, key=SLOW.__contains__)
    for part, name in FIRST.items():
        if films and name in names:
            order.insert(0 if name in near else order.index(name), part)
    return order


def answer(case: DesignCase, name: str) -> Plain:
    """A panel of a case as plain data: curves, table, sentences.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.desk.answer(rs.desk.DesignCase(rs.load_machine("plain_rotor")), "static")["heads"]
    ['bearing', 'static load [N]']
    """
    if name in FIRST:
        return {"title": TITLES[name], "first": True} | _first_response(case)
    found: Plain = {"title": TITLES[name]} | PANELS[name](case)
    for axis in ("x", "y"):
        if "range" in found.get(axis, {}):
            found[axis]["range"] = _plain(found[axis]["range"])
    return found


@panel("campbell", "Campbell diagram")
def _campbell(case: DesignCase) -> Plain:
    found = case.campbell
    speed = found["speed"].values * TO_RPM
    curves = [
        _curve(
            f"mode {k + 1}",
            speed,
            found["wn"].values[k] * TO_HZ,
            k,
            k >= COLOURS,
            marks=_senses(found["whirl"].values[k]),
        )
        for k in range(found.sizes["branch"])
    ]
    inside = (found["critical_speed"].values <= speed[-1] * RPM) & (found["critical_order"].values == 1)
    rpm = found["critical_speed"].values[inside] * TO_RPM
    top = float(np.nanmax(found["wn"].values, initial=0.0)) * TO_HZ
    curves.append(_curve("1X", speed[[0, -1]], speed[[0, -1]] / 60, -1, dash=True))
    heads = ["order", "speed [rpm]", "natural frequency", "damping ratio", "amplification", "whirl", "mode"]
    return {
        "x": {"label": "speed [rpm]", "range": [0.0, float(speed[-1])]},
        "y": {"label": "natural frequency [Hz]", "range": [0.0, min(1.05 * top, 4.0 * float(speed[-1]) / 60) or 1.0]},
        "curves": curves, "rings": [_plain(rpm), _plain(rpm / 60)],
        "bands": _growth(found), "heads": heads, "rows": [cells(row) for row in criticals(found)],
        "notes": [f"Modes: {modes_line(found)}.", f"Critical speeds are searched from {searched_line(found)}."],
    }  # fmt: skip


@panel("response", "Unbalance response")
def _response(case: DesignCase) -> Plain:
    return _response_of(case.response)


TITLES |= {part: TITLES[name] for part, name in FIRST.items()}


def _first_response(case: DesignCase) -> Plain:
    """The response at some even steps, whose peaks are not known yet."""
    found = unbalance_response(case.plant, case.even_speeds[FINER // BEGUN - 1 :: FINER // BEGUN] * RPM, case.pressure)
    so_far = f"At {BEGUN} of {FINER} even steps so far; the others, and those next to critical speeds, follow."
    return _response_of(found) | {"heads": [], "rows": [], "notes": [so_far]}


def _response_of(found: xr.Dataset) -> Plain:
    speed = found["speed"].values * TO_RPM
    steady = found["zeta_least"].values >= -DAMPED
    curves = [
        _curve(place, speed, np.where(steady, found["major"].sel(place=place).values, np.nan) * TO_UM, k)
        for k, place in enumerate(distinct(found))
    ]
    heads = ["place", "speed [rpm]", "size [\N{MICRO SIGN}m 0-pk]", "may be larger beyond"]
    return {
        "x": {"label": "speed [rpm]", "range": [0.0, float(speed[-1])]},
        "y": {"label": "major half axis [\N{MICRO SIGN}m 0-pk]", "zero": True},
        "curves": curves, "bands": _growth(found), "heads": heads, "rows": [cells(row) for row in peaks(found)],
        "notes": [f"Unbalance: {found.attrs['unbalance']}.{warned(found)}"],
    }  # fmt: skip


@panel("modes", "Mode shapes")
def _modes(case: DesignCase) -> Plain:
    found = case.modes.isel(mode=slice(DRAWN))
    shape = np.round(found["shape_re"].values + 1j * found["shape_im"].values, SHAPE_DECIMALS)  # 1 is the largest
    z = found["z"].values * 1e3
    curves = [_curve(f"mode {k + 1}", z, deflected_line(*shape[k].T), k) for k in range(len(shape))]
    rows = [
        (str(k + 1), float(found["wn"][k]) * TO_HZ, float(found["zeta"][k]), str(found["whirl"].values[k]))
        for k in range(len(shape))
    ]
    return {
        "x": {"label": "position along the shaft [mm]", "range": [float(z[0]), float(z[-1])]},
        "y": {"label": "deflected line", "range": [-1.1, 1.1]}, "curves": curves,
        "shapes": {"z": _plain(z), "radius": _plain(found["radius"].values * 1e3),
                   "lines": [[[_plain(part) for part in (x.real, x.imag)] for x in one.T] for one in shape]},
        "heads": ["mode", "frequency [Hz]", "damping ratio", "whirl"], "rows": [cells(row) for row in rows],
        "notes": [f"At {case.speed:g} rpm."],
    }  # fmt: skip


@panel("static", "Static deflection")
def _static(case: DesignCase) -> Plain:
    found = case.static
    z = found["z"].values * 1e3
    loads = zip(found["bearing"].values.tolist(), found["load"].values.tolist(), strict=True)
    return {
        "x": {"label": "position along the shaft [mm]", "range": [float(z[0]), float(z[-1])]},
        "y": {"label": "sag [\N{MICRO SIGN}m]", "zero": True, "down": True},
        "curves": [_curve("under its weight", z, found["sag"].values * TO_UM, 0)],
        "heads": ["bearing", "static load [N]"], "rows": [cells(row) for row in loads],
        "notes": ["On the bearings' nominal stiffness; housings stand still."],
    }  # fmt: skip


@panel("limits", "What limits this design")
def _limits(case: DesignCase) -> Plain:
    review = case.review
    ordered = sorted(review.checks, key=lambda c: c.reserve if isfinite(c.reserve) else LAST[c.verdict])
    rows = [
        (c.name, asked(c), answered(c), f"{100 * c.reserve:+.0f} %" if isfinite(c.reserve) else "-", SIGNS[c.verdict])
        for c in ordered
    ]
    missed = sum(c.verdict == MISSED for c in review.checks)
    met = sum(c.verdict == MET for c in review.checks)
    return {
        "heads": ["requirement", "asked", "found", "reserve", "verdict"], "rows": [cells(row) for row in rows],
        "notes": [f"At {review.high * TO_RPM:.0f} rpm by API 617/684 and ISO rules: {missed} not met, {met} met, "
                  f"{len(review.checks) - met - missed} not looked at. The nearest limit comes first."],
    }  # fmt: skip


@panel("map", "Undamped critical speeds")
def _map(case: DesignCase) -> Plain:
    review = case.review
    found, stiffness = review.undamped, review.stiffness
    if found is None:
        return {"notes": [f"Not looked at: {review.no_map}"]}
    curves = [
        _curve(f"mode {k + 1}", found["stiffness"].values, found["wn"].values[k] * TO_RPM, k)
        for k in range(found.sizes["mode"])
    ]
    speeds = stiffness["speed"].values * TO_RPM
    for name in stiffness["bearing"].values.tolist():
        for axis in "xy":
            K = stiffness.sel(bearing=name, axis=axis).values
            if (K > 0).any():
                curves.append(_curve(f"{name} K{axis}{axis}", np.where(K > 0, K, np.nan), speeds, -1, dash=axis == "y"))
    low, high = float(np.nanmin(found["wn"].values)) * TO_RPM / 1.5, 1.5 * review.high * TO_RPM
    ends = found["stiffness"].values[[0, -1]].tolist()
    return {
        "x": {"label": "stiffness of a bearing [N/m]", "log": True, "range": ends},
        "y": {"label": "critical speed [rpm]", "log": True, "range": [low, max(high, 3 * low)]}, "curves": curves,
        "notes": ["All bearings have one stiffness; grey lines are the bearings' own stiffness over the speed."],
    }  # fmt: skip


@panel("films", "Films and onset of whirl")
def _films(case: DesignCase) -> Plain:
    review = case.review
    table = tables(review)["films"]
    speed, frequency, looked = review.onset
    onset = f"A mode of {frequency * TO_HZ:.4g} Hz grows from {speed * TO_RPM:.0f} rpm." if isfinite(speed) else (
        "No mode grows at the speeds that are looked at." if looked else "Not all speeds were looked at.")  # fmt: skip
    d = review.decrements
    ends = np.nanmin(d.values, initial=0.0), np.nanmax(d.values, initial=0.0)
    low, high = (float(np.clip(end, *DECREMENTS)) for end in ends)
    return {
        "x": {"label": "speed [rpm]", "range": [0.0, float(d["speed"].values[-1] * TO_RPM)]},
        "y": {"label": "least log. decrement", "range": [1.05 * low, 1.05 * high or 1.0]},
        "curves": [_curve("least log. decrement", d["speed"].values * TO_RPM, d.values, 0)],
        "heads": list(table.heads) if table.rows else [], "rows": [cells(row) for row in table.rows],
        "notes": [onset, table.text] if table.text else [onset],
    }  # fmt: skip


@panel("clearance", "Over the clearance of the films", slow=True)
def _clearance(case: DesignCase) -> Plain:
    if not case.swept:
        return {"notes": ["No bearing of this machine has the clearance of a gas film."]}
    found = case.clearances
    heads, rows = found.table()
    why = [found.data[f"{name}_reason"].values.tolist() for name in MARGINS]
    at, onset, _ = np.array(rows, float).T
    ends, own = at[[0, -1]], np.full(2, case.speed)
    beyond = np.where([one.startswith(STABLE) for one in why[0]], 2 * case.top, np.nan)
    texts = [(row[0], *(BRIEF.get(one[k], one[k]) if v is None else v for v, one in zip(row[1:], why, strict=True)))
             for k, row in enumerate(rows)]  # fmt: skip
    return {
        "x": {"label": heads[0].replace("bearings.*.", "")},  # with room for the marks at its ends
        "y": {"label": "onset of whirl [rpm]", "zero": True},
        "curves": [_curve("onset of whirl", at, onset, 0),
                   _curve("stable up to here", at, beyond, 1, marks="f" * len(at)),
                   _curve("speed of the modes", ends, own, -1, dash=True)],
        "heads": list(heads), "rows": [cells(row) for row in texts],
        "notes": [" ".join(_margins(found, why[0])) or "No clearance that was searched has an onset or a damping.",
                  f"Damping at {case.speed:g} rpm, the dashed line."],
    }  # fmt: skip


def _margins(found: SweepResult, why: Sequence[str]) -> list[str]:
    """Sentences on the best clearances; one without an onset up to the speed searched is above all that have one."""
    at = found.data[next(iter(found.data.sizes))]
    stable, fallen = ([text_of(at, v) for v, one in zip(at.values.tolist(), why, strict=True) if one.startswith(begin)]
                      for begin in (STABLE, CARRIED))  # fmt: skip
    lines = []
    if stable:
        top = found.data.attrs["highest_speed"] * TO_RPM
        above = ", which is above every onset" if len(stable) < len(why) else ""
        lines = [f"At {', '.join(stable)} no mode grows up to {top:g} rpm{above}; faster was not searched."]
    lines += [
        f"{'Elsewhere the' if stable and name == 'onset' else 'The'} {name} is highest, "
        + f"{cells((one['value'],))[0]} {one['unit'].removesuffix('1')}".strip()
        + f", at {', '.join(one['at'].values())}."
        for name, one in found.best.items()
    ]  # fmt: skip
    return [*lines, f"At {', '.join(fallen)} the film does not carry the rotor."] if fallen else lines


@panel("slopes", "What moves the limits", slow=True)
def _slopes(case: DesignCase) -> Plain:
    found, rows = case.slopes.sortby("reserve").isel(check=slice(NEAREST)), []
    for k, name in enumerate(found["check"].values.tolist()):
        slope = found["slope"].values[k]
        order = np.argsort(-np.abs(np.nan_to_num(slope)))[:LARGEST]
        movers = [f"{case.values[i]} {slope[i]:+.3g}" for i in order if abs(slope[i]) >= LEAST_SLOPE]
        rows.append((name, f"{100 * float(found['reserve'].values[k]):+.0f} %", "; ".join(movers) or "-"))
    return {
        "heads": ["requirement", "reserve", "points of reserve for 1 % more of"], "rows": [cells(row) for row in rows],
        "notes": [f"{case.changed} Each is changed alone; the nearest limit comes first."],
    }  # fmt: skip


@panel("scatter", "Within the tolerance", slow=True)
def _scatter(case: DesignCase) -> Plain:
    found, rows = case.scatter, []
    for one in found.quantities:
        d, (shares, _) = found.distribution(one.name), found.shares(one.name)
        most = max(shares, key=lambda path: shares[path])
        rows.append((f"{one.meaning} [{one.shown}]", d["nominal"], d["5 %"], d["95 %"], most))
    return {
        "heads": ["quantity", "nominal", "5 % are below", "5 % are above", "most scatter by"],
        "rows": [cells(row) for row in rows],
        "notes": [f"{MACHINES} random machines. {case.changed} Each varies by itself, by up to "
                  f"{case.point.tolerance:g} %."],
    }  # fmt: skip


def too_large(machine: Machine) -> str:
    """Sentence on a machine whose panels are computed on request: four motions and speeds a node; empty for others."""
    states = 8 * len(Mesh(machine).nodes)
    return (
        f"The shaft has {states} states, more than {LARGE}: a panel is computed on request." if states > LARGE else ""
    )


def _curve(name: str, x: np.ndarray, y: np.ndarray, colour: int, dash: bool = False, marks: str = "") -> Plain:
    """A curve; `colour` is a number in the palette, -1 the ink; `marks` a letter for each point: f, b or nothing."""
    return {"name": name, "x": _plain(x), "y": _plain(y), "colour": colour, "dash": dash, "marks": marks}


def _senses(whirl: Sequence[str]) -> str:
    return "".join(str(one)[:1] or " " for one in whirl)


def _plain(values: np.ndarray) -> list[float | None]:
    """Values in `DIGITS` digits; None where there is none."""
    return [float(f"{v:.{DIGITS}g}") if isfinite(v) else None for v in np.asarray(values, float).tolist()]


def _growth(found: xr.Dataset) -> list[list[float]]:
    """Ranges of speed [rpm] in which a mode grows."""
    speed, grows = found["speed"].values * TO_RPM, found["zeta_least"].values < -DAMPED
    places = np.flatnonzero(grows)
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if places.size else []
    return [[float(speed[max(run[0] - 1, 0)]), float(speed[min(run[-1] + 1, len(speed) - 1)])] for run in runs]


def as_python(case: DesignCase, machine: str) -> str:
    """Python script of the numbers of a case, of a machine by name or file."""
    supply = f", {case.pressure!r}" if case.pressure else ""
    speeds = ", ".join(f"{one:g}" if float(f"{one:g}") == one else repr(one) for one in case.response_speeds)
    clearances = (
        f"clearances = rs.analysis.sweep(plant, {case.swept!r}, {MARGINS!r}, {case.speed!r} * RPM, {case.pressure!r}, "
        f"{2 * case.top!r} * RPM)\n"
    )
    return (
        "import numpy as np\n\nimport rotorsim as rs\n\nRPM = np.pi / 30\n"
        f"plant = rs.Plant({machine!r})\n"
        f"campbell = rs.analysis.campbell(plant, np.linspace(0.0, {case.top!r}, {STEPS + 1}) * RPM{supply})\n"
        f"speeds = np.array([{speeds}]) * RPM\n"
        f"response = rs.analysis.unbalance_response(plant, speeds{supply})\n"
        f"modes = rs.analysis.mode_shapes(plant, {case.speed!r} * RPM, {case.pressure!r})\n"
        "static = rs.analysis.static_deflection(plant)\n"
        f"review = rs.analysis.design_review(plant, pressure={case.pressure!r})\n"
        f"values = {case.values!r}\n"
        f"slopes = rs.analysis.reserve_slopes(plant, values, {case.pressure!r})\n"
        f"vary = [f'{{path}}=+- {case.point.tolerance:g} %' for path in values]\n"
        f"scatter = rs.analysis.random_machines(plant, vary, {MACHINES}, {SCATTERED!r}, pressure={case.pressure!r}, "
        f"highest={case.top!r} * RPM)\n" + (clearances if case.swept else "")
    )


def as_commands(case: DesignCase, machine: str) -> str:
    """Commands of the numbers of a case, of a machine by name or file."""
    supply = f" --pressure '{case.point.supply!r} MPa'" if case.pressure else ""
    speeds = ",".join(f"{one!r} rpm" for one in case.response_speeds)
    axes = "".join(f" --over '{path}={values}'" for path, values in case.swept.items())
    clearances = (
        f"rotorsim sweep {machine}{axes} --what {','.join(MARGINS)} --speed '{case.speed!r} rpm' "
        f"--highest-speed '{2 * case.top!r} rpm'{supply}\n"
    )
    return (
        f"rotorsim campbell {machine} --speeds '0 rpm:{case.top!r} rpm:{STEPS + 1}' --critical-map{supply}\n"
        f"rotorsim response {machine} --speeds '{speeds}'{supply}\n"
        f"rotorsim modes {machine} --speed '{case.speed!r} rpm'{supply}\n"
        f"rotorsim report design {machine}{supply}\n" + (clearances if axes else "")
    )


def point_of(values: Mapping[str, Any]) -> DeskPoint:
    """Operating point of what a page sent; what is empty is the machine's own. Raises DataError."""
    found = {}
    for name, (words, unit) in FIELDS.items():
        typed = values.get(name)
        if typed is None or typed == "":
            continue
        number = float(typed) if NUMBER.fullmatch(str(typed)) else -1.0
        if not (0 < number <= HIGHEST[name] or (number == 0 and name not in POSITIVE)):
            limit = f"{'above' if name in POSITIVE else 'from'} 0 up to {HIGHEST[name]:g}"
            raise DataError(
                f"{words} {str(typed)[:40]!r}: give a number {limit}, in {unit}", argument=name, value=typed
            )
        found[name] = number
    return DeskPoint(**found)
