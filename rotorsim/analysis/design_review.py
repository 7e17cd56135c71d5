r"""Design review of a machine: what the rules of `standards` ask of it, and what is found.

The deflected line of a mode, x(z) and y(z) complex, is drawn in the plane and at the instant in which the place that
moves most is furthest out. Unbalances stand at its antinodes: one with the load of the whole rotor, or with the mass
beyond the bearing where the antinode overhangs; two opposed ones, each with the load of the journal next to it, where
the line changes its side. Static loads of the journals are the reactions of the shaft under its own weight.

.. math:: \delta = \frac{2\pi\zeta}{\sqrt{1 - \zeta^2}}

is the logarithmic decrement. Source of the rules: `rotorsim.analysis.standards`.

Cites: api_684, friswell_2010.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from fe_shaft.follower import Node
from fe_shaft.modal import half_axes
from fe_shaft.response import GRAVITY, weight
from reynolds import kernels
from rotorsim.analysis import standards
from rotorsim.analysis.axial import AxialCurves, axial_curves
from rotorsim.analysis.campbell import critical_speed_map, crossing_numbers, top_speed
from rotorsim.analysis.modes_over_speed import ModesOverSpeed, around, modes_over_speed
from rotorsim.analysis.shaft_motion import driven, measuring_places, synchronous_stiffness, unbalances_of
from rotorsim.analysis.standards import HalfPower
from rotorsim.analysis.supply import felt
from rotorsim.analysis.whirl_onset import stability_limit, why_open
from rotorsim.base.display import Report, silent
from rotorsim.base.errors import ConvergenceError, DataError, MachineFileError, NoLiftOffError, RotorsimError
from rotorsim.base.rounding import ALIKE, first_of_largest, whirl_sense
from rotorsim.base.units import TO_RPM, TO_UM
from rotorsim.effects.rotor.unbalance import RotorUnbalance
from rotorsim.machine.bearings import BearingPart, TableBearing
from rotorsim.machine.rotor import ShaftProbe
from rotorsim.machine.schema import Machine, leaves
from rotorsim.plant import Plant
from rotorsim.plant.linearise import DAMPED, LinearPlant
from rotorsim.plant.simulation import describe, journal_room, settle

if TYPE_CHECKING:
    from rotorsim.plant.simulation import Equilibrium

BEYOND = 1.35
"""Highest speed that is looked at, over the highest operating speed: above the largest margin of 26 %."""
STEPS = 10
"""Steps of the speeds at which modes are found, up to the highest operating speed."""
FURTHER = 4
"""Steps beyond it."""
RESPONSES = 60
"""Steps of the speeds at which responses are solved."""
AROUND = (-4.0, -2.5, -1.6, -1.0, -0.6, -0.3, 0.0, 0.3, 0.6, 1.0, 1.6, 2.5, 4.0)
"""Further speeds around a critical one, as multiples of its damping ratio."""
FIRST = 4
"""Modes of the rotor over which the region reaches, however low the speeds are."""
OPPOSED = 0.25
"""Least antinode on the other side, over the largest one, for which a mode has two unbalances."""
STIFFNESSES = 30
"""Stiffnesses of the critical speed map, evenly in their logarithm."""
LINE = 81
"""Points of a deflected line besides the nodes."""
SAME_PLANE = 0.08
"""Distance of two planes, over the shaft's length, up to which unbalances in them are one case."""
NEAR = 0.08
"""Distance of a peak of the response from a critical speed, over it, up to which it is that of the mode."""
ROUNDED = 1e-8
"""Motion of a place, over the largest one along the shaft, up to which it is a node's, known to rounding alone."""
UNSEEN = 1e-9
"""Response [m, 0-pk] below which a peak is rounding."""
TURNS = np.linspace(0, 2 * np.pi, 48, endpoint=False)
"""Angles [rad] at which the room of a journal is measured."""
MET = "met"
"""Verdict of a requirement that is kept."""
MISSED = "not met"
"""Verdict of one that is not kept."""
OPEN = "not looked at"
"""Verdict of one that is not known to be kept."""
CHANGED = 1e-3
"""Relative change of a value by which a slope is measured."""
OF_MODE = re.compile(r"\d+ rpm|, \S+ Hz, (no|one|\d+) nodes?$")
"""Speed, frequency and shape of a mode in the name of a requirement."""


@dataclass(frozen=True, eq=False)
class CriticalSpeed:
    """A crossing of 1X: speed [rad/s], damping ratio, whirl, deflected line (`drawn_places`,) and its zeros [m].

    `case` is the unbalance that drives the mode; `peak` the highest peak of the response, of all places looked at and
    all cases, that lies next to it, seen at `place` under the unbalance `driven_by`; None where unbalance drives none.
    """

    speed: float
    zeta: float
    whirl: str
    line: np.ndarray
    nodes: tuple[float, ...]
    case: str
    peak: HalfPower | None = None
    place: str = ""
    driven_by: str = ""

    @property
    def shape(self) -> str:
        """Number of nodes of the line, in words."""
        return {0: "no node", 1: "one node"}.get(len(self.nodes), f"{len(self.nodes)} nodes")

    @property
    def in_words(self) -> str:
        """Sense, frequency and shape, as every page names the mode."""
        return f"{self.whirl}, {self.speed / (2 * np.pi):.4g} Hz, {self.shape}"

    @property
    def decrement(self) -> float:
        """Logarithmic decrement."""
        return float(2 * np.pi * self.zeta / np.sqrt(1 - self.zeta**2))

    @property
    def amplification(self) -> float:
        """Amplification factor of the peak by half power, else 1 / (2 zeta)."""
        if self.peak is not None and np.isfinite(self.peak.amplification):
            return self.peak.amplification
        return 1 / (2 * self.zeta) if self.zeta > 0 else float("inf")


@dataclass(frozen=True)
class UnbalanceCase:
    """Unbalances of an analysis, in words, with the loads [kg] that they follow from."""

    name: str
    unbalances: tuple[RotorUnbalance, ...]
    loads: tuple[float, ...] = ()


@dataclass(frozen=True)
class Clearance:
    """A close clearance: place, position z [m], diametral clearance [m], largest scaled motion [m, pk-pk], its cause.

    The motion is NaN where no response is known.
    """

    place: str
    z: float
    gap: float
    motion: float
    case: str
    speed: float


@dataclass(frozen=True, eq=False)
class FilmState:
    """A film at the highest operating speed: load [N], least gap [m], K [N/m] and C [N s/m] at 1X, power [W], flow."""

    name: str
    load: float
    eccentricity: float
    K: np.ndarray
    C: np.ndarray
    power: float
    flow: float
    rises: np.ndarray


@dataclass(frozen=True)
class DesignCheck:
    """A requirement: the limit and what is found in a unit, the verdict (`MET`, `MISSED` or `OPEN`), its rule.

    `sense` is how the limit is asked, "at least", "above" or "at most"; None is a number that there is not or that is
    not known.
    `detail` belongs to what is found.
    """

    name: str
    sense: str
    limit: float
    found: float | None
    unit: str
    verdict: str
    rule: str
    detail: str = ""
    remark: str = ""

    @property
    def reserve(self) -> float:
        """Distance from the limit over the limit, negative beyond it; NaN where nothing is found."""
        if self.found is None or not self.limit > 0:
            return float("nan")
        return (self.found / self.limit - 1) * (-1 if self.sense == "at most" else 1)


@dataclass(frozen=True, eq=False)
class DesignReview:
    """Numbers of a design review at operating speeds `low` to `high` [rad/s] and a gauge pressure [Pa].

    `responses` holds the major half axis (case, speed, z) [m, 0-pk] of the shaft, `probes` the positions of the probe
    planes by name, `places` those at which peaks are looked for; `decrements` (speed) the least logarithmic decrement;
    `modes` those that were followed over the speeds. `onset` is the speed [rad/s], the frequency and whether every mode
    was looked for. `sensitivity` is the largest one of a law, None without; `axial` None without thrust bearings.
    """

    plant: Plant
    low: float
    high: float
    pressure: float
    stated: bool
    criticals: tuple[CriticalSpeed, ...]
    cases: tuple[UnbalanceCase, ...]
    loads: np.ndarray
    responses: xr.Dataset
    probes: dict[str, float]
    places: dict[str, float]
    clearances: tuple[Clearance, ...]
    scales: dict[str, float]
    decrements: xr.DataArray
    onset: tuple[float, float, float]
    films: tuple[FilmState, ...]
    least_gap: float
    not_carried: str
    modes: ModesOverSpeed
    searched: tuple[float, float]
    open_speeds: tuple[tuple[float, float], ...]
    sensitivity: float | None
    axial: AxialCurves | None

    @property
    def file_case(self) -> UnbalanceCase:
        """The unbalance of the machine file, or one of grade G 2.5 without it."""
        return self.cases[-1]

    @cached_property
    def checks(self) -> tuple[DesignCheck, ...]:
        """Requirements, in the order of the page."""
        return tuple(_checks(self))

    @cached_property
    def _map(self) -> tuple[xr.Dataset | None, str, xr.DataArray]:
        return _map(self.plant, self.modes)

    @property
    def undamped(self) -> xr.Dataset | None:
        """Critical speed map; None where there is none."""
        return self._map[0]

    @property
    def no_map(self) -> str:
        """Why the critical speed map is missing."""
        return self._map[1]

    @property
    def stiffness(self) -> xr.DataArray:
        """Stiffness (bearing, speed, axis) [N/m] of the bearings."""
        return self._map[2]

    def motion(self, case: str, z: float) -> np.ndarray:
        """Motion (speed,) [m, pk-pk] at a place under a case of unbalance."""
        number = [one.name for one in self.cases].index(case)
        return np.asarray(2 * _major(self.responses)[number, :, _nearest(self.responses, z)])


def design_review(
    plant: Plant,
    speeds: tuple[float, float] | None = None,
    pressure: float = 0.5e6,
    sensitivity: float | None = None,
    progress: Report = silent,
) -> DesignReview:
    """Review the design of a machine by the rules of API 617/684, ISO 21940-11, ISO 20816-3 and ISO 14839-3.

    Parameters
    ----------
    plant : Plant
    speeds : (float, float), optional
        Lowest and highest operating speed [rad/s]; by default both are `drive.highest_speed`, or `top_speed` of a
        machine that states none.
    pressure : float
        Gauge supply pressure [Pa].
    sensitivity : float, optional
        Largest sensitivity of a control law's loop.
    progress : callable
        Takes a text about each step before it starts.

    Raises
    ------
    DataError
        For speeds that are not above 0 or do not ascend.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.design_review(rs.Plant("plain_rotor"), (250.0, 300.0))
    >>> {check.verdict for check in found.checks} <= {"met", "not met", "not looked at"}
    True
    """
    stated = speeds is not None or plant.machine.drive.highest_speed is not None
    low, high = speeds or (top_speed(plant),) * 2
    if not 0 < low <= high:
        raise DataError(f"design review: speeds from {low * TO_RPM:g} to {high * TO_RPM:g} rpm; give ascending ones")
    axial = axial_curves(plant.machine, high, pressure, BEYOND) if plant.machine.thrust_bearings else None
    pressure = float(felt([plant.machine], [pressure])[0])
    at = np.unique([*np.linspace(0.0, high, STEPS + 1), *np.linspace(high, BEYOND * high, FURTHER + 1), low])
    last = around(at)[-1] * TO_RPM
    found = modes_over_speed(
        plant, at, pressure, FIRST, (1,), lambda text: progress(f"step 1 of 3, {text} of 0 to {last:.0f} rpm")
    )
    loads = static_loads(plant)
    modes = critical_lines(plant, found)
    cases = _cases(plant, modes, loads, high)
    probes = _probes(plant)
    places = _looked(plant, probes)
    gaps = list(_gaps(plant))
    known = np.unique(np.round([*plant.assembly.mesh.nodes, *places.values(), *(z for _, z, _ in gaps)], 9))
    responses = _responses(plant, found, modes, cases, known, pressure, high, progress)
    scales = _scales(responses, cases, probes, (low, high))
    progress(f"step 3 of 3, films at {high * TO_RPM:.0f} rpm and the figures")
    films, gap, refused = _films(plant, high, pressure)
    return DesignReview(
        plant, low, high, pressure, stated,
        tuple(_with_peaks(modes, responses, cases, places)), cases, loads, responses, probes, places,
        tuple(_clearances(gaps, responses, scales, high)), scales, _decrements(found),
        _onset(found), films, gap, refused, found, found.searched,
        tuple([*found.refused, *found.uncertain, *((v, v) for v in found.unproven)]), sensitivity, axial,
    )  # fmt: skip


def reserve_slopes(plant: Plant, paths: Sequence[str], pressure: float = 0.5e6) -> xr.Dataset:
    """Slopes of a design review's reserves: a review for each value of the machine, changed alone by `CHANGED`.

    All reviews are at the operating speed of the machine as it is, which `drive.highest_speed` alone changes.

    Parameters
    ----------
    plant : Plant
    paths : sequence of str
        Numbers above 0 of the machine file, e.g. 'bearings.0.clearance'.
    pressure : float
        Gauge supply pressure [Pa].

    Returns
    -------
    Dataset
        reserve (check) and slope (check, path): change of the reserve over the relative change of the value. A
        requirement without a reserve is left out; NaN where the machine with the value, or a review of it, has none.

    Raises
    ------
    MachineFileError
        For a path that does not lead to a number above 0.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.reserve_slopes(rs.Plant("plain_rotor"), ["effects.unbalance.me"])
    >>> list(found.sizes)
    ['check', 'path']
    """
    known = _numbers(plant.machine, paths)
    speed = top_speed(plant)
    begun = _reserves(plant, speed, pressure)
    slope = np.full((len(begun), len(paths)), np.nan)
    for k, path in enumerate(paths):
        value, unit = known[path]
        at = speed * (1 + CHANGED) if path == "drive.highest_speed" else speed
        try:
            moved = _reserves(Plant(plant.machine.replace(path, f"{value * (1 + CHANGED)!r}{unit}")), at, pressure)
        except RotorsimError:
            continue
        slope[:, k] = [(moved.get(key, ("", np.nan))[1] - one[1]) / CHANGED for key, one in begun.items()]
    text = "change of the reserve over the relative change of the value"
    return xr.Dataset(
        {
            "reserve": (
                "check",
                [one for _, one in begun.values()],
                {"units": "1", "long_name": "distance from the limit over it"},
            ),
            "slope": (("check", "path"), slope, {"units": "1", "long_name": text}),
        },
        {"check": [name for name, _ in begun.values()], "path": list(paths)},
        plant.provenance() | {"kind": "reserve slopes", "pressure": pressure},
    )


def _numbers(machine: Machine, paths: Sequence[str]) -> dict[str, tuple[float, str]]:
    """Value and the unit behind it of every path to a number above 0; raises MachineFileError for another path."""
    known, found = {path: (value, spec) for path, value, spec, _ in leaves(machine)}, {}
    for path in paths:
        value, spec = known.get(path, (None, None))
        if spec is None or isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
            raise MachineFileError(f"{path}: is not a number above 0 of this machine", argument="paths", value=path)
        found[path] = float(value), "" if spec.unit == "1" else f" {spec.unit}"
    return found


def _reserves(plant: Plant, speed: float, pressure: float) -> dict[tuple[str, int], tuple[str, float]]:
    """Names and finite reserves at a speed [rad/s], by the name without speeds and the number among those of it."""
    found: dict[tuple[str, int], tuple[str, float]] = {}
    seen: Counter[str] = Counter()
    for check in design_review(plant, (speed, speed), pressure).checks:
        stem = OF_MODE.sub("", check.name)
        seen[stem] += 1
        if np.isfinite(check.reserve):
            found[stem, seen[stem]] = check.name, check.reserve
    return found


def static_loads(plant: Plant) -> np.ndarray:
    """Static load (bearings,) [kg] of every bearing under the weight of shaft and discs: of one below the shaft, > 0.

    Nominal stiffnesses matter with three bearings or more.
    """
    return plant.assembly.mesh.resting.bearing_forces[:, 1] / GRAVITY


def static_deflection(plant: Plant) -> xr.Dataset:
    """Deflected line of the shaft at rest under the weight of shaft and discs, and the loads of the bearings.

    Parameters
    ----------
    plant : Plant

    Returns
    -------
    Dataset
        sag (node) [m] downwards with the position z [m] of each node, load (bearing) [N] of each bearing, of one below
        the shaft > 0. Bearings have their nominal stiffness, films and tables that by which the rotor's modes are
        chosen; housings stand still.

    Raises
    ------
    ShaftError
        If the bearings leave the shaft free to fall or tilt.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.static_deflection(rs.Plant("plain_rotor"))
    >>> abs(float(found["load"].sum()) / 9.80665 / rs.load_machine("plain_rotor").mass - 1) < 1e-9
    True
    """
    found, nodes = plant.assembly.mesh.resting, plant.assembly.mesh.nodes
    sag = -found.displacement[1 : 4 * len(nodes) : 4]
    return xr.Dataset(
        {
            "sag": ("node", sag, {"units": "m", "long_name": "deflection under its weight, downwards"}),
            "load": ("bearing", found.bearing_forces[:, 1], {"units": "N", "long_name": "static load"}),
        },
        {
            "z": ("node", nodes, {"units": "m", "long_name": "position along the shaft"}),
            "bearing": list(plant.machine.bearing_names),
        },
        plant.provenance() | {"kind": "static"},
    )


def critical_lines(plant: Plant, found: ModesOverSpeed) -> list[CriticalSpeed]:
    """Every crossing of 1X with its deflected line, in the order of `found.crossings`."""
    nodes = drawn_places(plant)
    rows = np.stack([plant.assembly.mesh.shape_between(z) for z in nodes])
    return [_critical(nodes, rows, *one) for one in _crossed(found)]


def _crossed(found: ModesOverSpeed) -> Iterator[tuple[float, float, str, np.ndarray]]:
    """Speed [rad/s], damping ratio, whirl and modal displacements of every crossing of 1X."""
    for (speed, zeta, _, _, orbit), one in zip(crossing_numbers(found.crossings), found.crossings, strict=True):
        assert isinstance(one.pencil, LinearPlant)
        m = len(one.pencil.rotor.stiffness)
        yield float(speed), float(zeta), str(whirl_sense(np.array([orbit]))[0]), one.modes.right[-2 * m : -m, 0]


def _critical(
    nodes: np.ndarray, rows: np.ndarray, speed: float, zeta: float, whirl: str, q: np.ndarray
) -> CriticalSpeed:
    """A crossing of 1X with its deflected line, from modal displacements q and rows (n, 2, m) at the nodes [m]."""
    line = deflected_line(*(rows @ q[: rows.shape[2]]).T)
    flips = np.flatnonzero(line[:-1] * line[1:] < 0)
    zeros = nodes[flips] + (nodes[flips + 1] - nodes[flips]) * line[flips] / (line[flips] - line[flips + 1])
    opposed = min(line.max(), -line.min()) > OPPOSED * np.abs(line).max()
    return CriticalSpeed(speed, zeta, whirl, line, tuple(zeros.tolist()), "couple" if opposed else "static")


def drawn_places(plant: Plant) -> np.ndarray:
    """Positions (n,) [m] along the shaft at which deflected lines are known."""
    nodes = plant.assembly.mesh.nodes
    return np.unique(np.round([*nodes, *np.linspace(nodes[0], nodes[-1], LINE)], 9))


def deflected_line(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Line (n,) of complex displacements x, y (n,) in the plane and instant of the largest; its largest size is 1.

    Examples
    --------
    >>> from rotorsim.analysis.design_review import deflected_line
    >>> deflected_line(np.array([1.0, -0.5j]), np.array([1j, 0.5])).round(2).tolist()
    [1.0, 0.0]
    """
    k = first_of_largest(half_axes(x, y)[0])
    # the square of the distance is a constant and half the real part of (x^2 + y^2) exp(-2 i phase); none on a circle
    square, size = x[k] ** 2 + y[k] ** 2, abs(x[k]) ** 2 + abs(y[k]) ** 2
    turned = np.exp(-0.5j * np.angle(square if abs(square) > ALIKE * size else x[k] ** 2))
    a, b = (x * turned).real, (y * turned).real
    line = (a * a[k] + b * b[k]) / np.hypot(a[k], b[k])
    return np.asarray(line / line[first_of_largest(np.abs(line))])


def _cases(plant: Plant, modes: Sequence[CriticalSpeed], loads: np.ndarray, speed: float) -> tuple[UnbalanceCase, ...]:
    """Unbalances of a rigid rotor, one in the middle and a couple, those at the antinodes of modes, the file's last."""
    nodes, bearings = drawn_places(plant), [b.position for b in plant.machine.bearings]
    rigid = nodes - 0.5 * (min(bearings) + max(bearings))
    lines = [np.ones(len(nodes)), rigid / np.abs(rigid).max(), *(mode.line for mode in modes)]
    found: dict[tuple[float, ...], UnbalanceCase] = {}
    for line in lines:
        planes, masses = _planes(plant, line, loads)
        pairs = sorted(zip(planes, masses, strict=True))
        key = tuple(z for z, _ in pairs)
        near = SAME_PLANE * plant.machine.shaft.length
        if any(len(one) == len(key) and np.abs(np.subtract(one, key)).max() < near for one in found):
            continue
        word = "couple" if len(planes) > 1 else "static"
        parts = tuple(
            RotorUnbalance(
                me=standards.ANALYSED * standards.residual_unbalance(abs(w), speed),
                phase=0.0 if w > 0 else np.pi,
                position=z,
            )
            for z, w in pairs
        )
        found[key] = UnbalanceCase(f"{word} {len(found) + 1}", parts, tuple(abs(w) for _, w in pairs))
    own = tuple(e for e in plant.machine.effects.get("unbalance", ()) if getattr(e, "me", 0) > 0)
    name = "machine file" if own else "grade G 2.5"
    return (*found.values(), UnbalanceCase(name, unbalances_of(plant.machine, speed)))


def _planes(plant: Plant, line: np.ndarray, loads: np.ndarray) -> tuple[list[float], list[float]]:
    """Planes [m] of the unbalances of a deflected line and the masses [kg] that they follow from, < 0 if opposed."""
    nodes, machine = drawn_places(plant), plant.machine
    places = np.array([b.position for b in machine.bearings])
    if np.ptp(line) < 1e-9:
        return [0.5 * float(places.min() + places.max())], [machine.mass]
    top = int(np.abs(line).argmax())
    other = int((line * -np.sign(line[top])).argmax())
    if abs(line[other]) > OPPOSED and line[other] * line[top] < 0:
        pair = [float(nodes[k]) for k in (top, other)]
        near = [float(abs(loads[int(np.abs(places - z).argmin())])) for z in pair]
        return pair, [near[0], -near[1]]
    z = float(nodes[top])
    if places.min() <= z <= places.max() or len(places) < 2:
        return [z], [machine.mass]
    return [z], [_mass_beyond(plant, float(places.min() if z < places.min() else places.max()), z)]


def _mass_beyond(plant: Plant, bearing: float, z: float) -> float:
    """Mass [kg] of shaft and discs on the side of `z` beyond a bearing [m]; of its own node one half."""
    mesh = plant.assembly.mesh
    masses = -weight(mesh.constant, 1.0)[1 : 4 * len(mesh.nodes) : 4]
    beyond = (mesh.nodes - bearing) * (z - bearing) > 0
    beyond[mesh.node(bearing)] = False
    return float(masses[beyond].sum() + 0.5 * masses[mesh.node(bearing)])


def _probes(plant: Plant) -> dict[str, float]:
    """Planes of the shaft's displacement probes [m], each once."""
    named = {p.name: p.position for p in plant.machine.probes if isinstance(p, ShaftProbe)}
    return _each_once({"measuring plane": measuring_places(plant)["measuring plane"]} | named)


def _looked(plant: Plant, probes: dict[str, float]) -> dict[str, float]:
    """Places [m] at which peaks are looked for: probes, bearings, where a standard has its probes, and half spans."""
    named = dict(zip(plant.machine.bearing_names, (b.position for b in plant.machine.bearings), strict=True))
    along = sorted(named.items(), key=lambda one: one[1])
    spans = {f"half span {a} to {b}": 0.5 * (y + z) for (a, y), (b, z) in pairwise(along)}
    words = (name.removeprefix("the ") for name in plant.machine.bearings_in_words)
    return _each_once(probes | dict(zip(words, named.values(), strict=True)) | spans)


def _each_once(places: dict[str, float]) -> dict[str, float]:
    """Places [m] with the names of those that are one joined."""
    planes: dict[float, str] = {}
    for name, z in places.items():
        planes[round(z, 6)] = f"{planes[round(z, 6)]}, {name}" if round(z, 6) in planes else name
    return {name: z for z, name in planes.items()}


def _gaps(plant: Plant) -> Iterator[tuple[str, float, float]]:
    """Close clearances of the machine file: place, position [m], diametral clearance [m], NaN where none is stated."""
    machine, start, end = plant.machine, plant.machine.shaft.start, plant.machine.shaft.end
    for k, film in enumerate(machine.films):
        room = 2 * float(journal_room(machine, k, TURNS).min())
        for side in (-0.5, 0.5):
            yield f"film {machine.film_names[k]}", min(max(film.position + side * film.length, start), end), room
    for name, effects in machine.effects.items():
        for effect in effects:
            if name in ("rub", "labyrinth_seal"):
                gap = 2 * float(getattr(effect, "gap", np.nan))
                yield name.replace("_", " "), plant.assembly.mesh.place(effect), gap


def _responses(
    plant: Plant, found: ModesOverSpeed, modes: Sequence[CriticalSpeed], cases: Sequence[UnbalanceCase],
    places: np.ndarray, pressure: float, high: float, progress: Report,
) -> xr.Dataset:  # fmt: skip
    """Major half axes (case, speed, z) [m, 0-pk] and least damping ratio (speed) up to the last speed looked at."""
    nodes = {node.at: node.pencil for node in found.followed.nodes}
    last = found.searched[1]
    more = [high] + [m.speed * (1 + k * max(m.zeta, 1e-4)) for m in modes for k in AROUND]
    speeds = np.unique(np.round([*nodes, *np.linspace(0, last, RESPONSES + 1)[1:], *more], 6))
    speeds = speeds[(speeds > 0) & (speeds <= last)]
    stiffness = list[np.ndarray | None]()
    for k, speed in enumerate(speeds.tolist()):
        progress(f"step 2 of 3, unbalance response at {k + 1} of {len(speeds)} speeds")
        model = nodes.get(speed)
        try:
            model = model if isinstance(model, LinearPlant) else plant.linearise(speed, pressure)
            stiffness.append(synchronous_stiffness(model))
        except (NoLiftOffError, ConvergenceError):
            stiffness.append(None)
    rows = np.stack([plant.assembly.mesh.shape_between(z) for z in places])
    q = driven(stiffness, speeds, np.column_stack([_load(plant, case) for case in cases]))
    x, y = (np.moveaxis(np.tensordot(rows[:, axis], q, (1, 1)), 0, 1) for axis in range(2))
    size = half_axes(x, y)[0]
    major = np.where(size > ROUNDED * size.max(axis=1, keepdims=True), size, 0.0 * size).transpose(2, 0, 1)
    known = [(node.at, damping_of(found, node)) for node in found.followed.nodes if node.pencil is not None]
    zeta = np.interp(speeds, *np.array(known).T) if known else np.full(len(speeds), np.nan)
    return xr.Dataset(
        {"major": (("case", "speed", "z"), major), "zeta_least": ("speed", zeta)},
        {"case": [c.name for c in cases], "speed": speeds, "z": places},
    )


def _load(plant: Plant, case: UnbalanceCase) -> np.ndarray:
    """Modal force (m,) of the unbalances of a case over the square of the speed [kg m]."""
    pulls = [
        one.me * np.exp(1j * one.phase) * (plant.assembly.mesh.influence(one).T @ np.array([1, -1j]))
        for one in case.unbalances
    ]
    return np.asarray(np.sum(pulls, axis=0))


def _with_peaks(
    modes: Sequence[CriticalSpeed], responses: xr.Dataset, cases: Sequence[UnbalanceCase], places: dict[str, float]
) -> Iterator[CriticalSpeed]:
    """Critical speeds, ascending, with the highest peak of the API's cases that is nearer to each than to the others.

    Where a mode grows no response is steady, so that none has a peak.
    """
    speeds, grows = responses["speed"].values, responses["zeta_least"].values < 0
    at, peaks = {place: _nearest(responses, z) for place, z in places.items()}, []
    for case, sizes in zip(cases[:-1], _major(responses)[:-1], strict=True):
        for place, k in at.items():
            found = standards.half_power(speeds, np.where(grows, np.nan, sizes[:, k]))
            peaks += [(p, place, case.name) for p in found if p.size > UNSEEN]
    every = np.array([m.speed for m in modes])
    for mode in sorted(modes, key=lambda m: m.speed):
        own = [
            one for one in peaks
            if abs(one[0].speed / mode.speed - 1) < max(NEAR, 2 * mode.zeta)
            and abs(one[0].speed - mode.speed) <= np.abs(every - one[0].speed).min() * (1 + 1e-9)
        ]  # fmt: skip
        if own:
            peak, place, case_name = max(own, key=lambda one: (np.isfinite(one[0].amplification), one[0].size))
            yield replace(mode, peak=peak, place=place, driven_by=case_name)
        else:
            yield mode


def _scales(
    responses: xr.Dataset, cases: Sequence[UnbalanceCase], probes: dict[str, float], speeds: tuple[float, float]
) -> dict[str, float]:
    """Factor of every case from its largest motion of the probes at the operating speeds to the limit of vibration.

    NaN where no response is steady there.
    """
    steady = np.where(responses["zeta_least"].values[:, None] >= 0, _major(responses), np.nan)
    at = operating(responses["speed"].values, *speeds)
    planes = [_nearest(responses, z) for z in probes.values()]
    found = {}
    for case, sizes in zip(cases[:-1], steady[:-1], strict=True):
        largest = 2 * float(np.nanmax(sizes[at][:, planes], initial=-np.inf))
        found[case.name] = standards.scale_factor(largest, speeds[1]) if np.isfinite(largest) else float("nan")
    return found


def _major(responses: xr.Dataset) -> np.ndarray:
    """Major half axes of responses, by case, speed and place, whatever the order in which they are held."""
    return responses["major"].transpose("case", "speed", "z").values


def _nearest(responses: xr.Dataset, z: float) -> int:
    """Number of the place of responses that is nearest to a position [m]."""
    return int(np.abs(responses["z"].values - z).argmin())


def operating(at: np.ndarray, low: float, high: float) -> np.ndarray:
    """Mask of the speeds (n,) [rad/s] from `low` to `high`, of the nearest one where none lies between."""
    within = (at >= low * (1 - 1e-9)) & (at <= high * (1 + 1e-9))
    return within if within.any() else np.abs(at - high) == np.abs(at - high).min()


def steady_up_to(responses: xr.Dataset, high: float) -> xr.Dataset:
    """Responses up to a speed [rad/s], NaN where a mode grows."""
    below = responses.sel(speed=responses["speed"] <= high * (1 + 1e-9))
    return below.where(below["zeta_least"] >= 0)


def _clearances(
    gaps: Sequence[tuple[str, float, float]], responses: xr.Dataset, scales: dict[str, float], high: float
) -> Iterator[Clearance]:
    """Every close clearance with the largest scaled motion there, from rest to the highest operating speed `high`.

    Speeds at which a mode grows are left out.
    """
    steady = steady_up_to(responses, high)
    major = dict(zip(steady["case"].values.tolist(), _major(steady), strict=True))
    for place, z, gap in gaps:
        at = _nearest(steady, z)
        motions = {name: 2 * scale * major[name][:, at] for name, scale in scales.items()}
        best = max(motions, key=lambda name: float(np.nanmax(motions[name], initial=-np.inf)), default="")
        sizes = motions[best]
        if not np.isfinite(sizes).any():
            yield Clearance(place, z, gap, float("nan"), best, float("nan"))
            continue
        k = int(np.nanargmax(sizes))
        yield Clearance(place, z, gap, float(sizes[k]), best, float(steady["speed"][k]))


def _decrements(found: ModesOverSpeed) -> xr.DataArray:
    """Least logarithmic decrement (speed) of all modes of the region, NaN where nothing is known."""
    nodes = found.followed.nodes
    zeta = np.array([damping_of(found, node) if node.pencil is not None else np.nan for node in nodes])
    with np.errstate(invalid="ignore"):
        return xr.DataArray(2 * np.pi * zeta / np.sqrt(1 - zeta**2), {"speed": [node.at for node in nodes]}, "speed")


def damping_of(found: ModesOverSpeed, node: Node) -> float:
    """Least damping ratio at a node; that of the region's edge where it is proven to hold no mode, NaN where not."""
    least = found.least(node.at)
    return DAMPED if np.isnan(least) and node.modes.proven else least


def _onset(found: ModesOverSpeed) -> tuple[float, float, float]:
    """Onset of whirl, looked for at the speeds whose modes are there already."""
    speeds = np.array([node.at for node in found.followed.nodes if node.at >= 0])
    try:
        return stability_limit(found.plant, found.pressure, found.searched[1], 1e-4, speeds)
    except NoLiftOffError:
        return float("nan"), float("nan"), 0.0


def _films(plant: Plant, speed: float, pressure: float) -> tuple[tuple[FilmState, ...], float, str]:
    """Every film at a speed [rad/s], the least gap [m] of all, and why there is none."""
    a = plant.assembly
    if not a.films:
        return (), float("nan"), ""
    try:
        w = settle(a, speed, pressure)
        response = plant.linearise(speed, pressure).response
    except (NoLiftOffError, ConvergenceError) as error:
        return (), float("nan"), str(error)
    at: Equilibrium = describe(a, w)
    K, C = response.coefficients(speed)
    flows = np.split(at.mass_flow, np.cumsum([len(f.injectors) for f in a.films])[:-1])
    found = []
    for k, name in enumerate(plant.machine.film_names):
        own = slice(2 * k, 2 * k + 2)
        torque = kernels.friction_torque(a.film_part(w, k), a.film_constants(k), a.film, speed)
        found.append(
            FilmState(name, float(np.hypot(*at.forces[k])), float(at.eccentricity_ratios[k]), K[own, own], C[own, own],
                      float(torque * speed), float(flows[k].sum()), at.temperature_rises[k])
        )  # fmt: skip
    return tuple(found), float(at.h_min), ""


def _map(plant: Plant, found: ModesOverSpeed) -> tuple[xr.Dataset | None, str, xr.DataArray]:
    """Undamped critical speeds over stiffness, why there are none, and the stiffness that the bearings have."""
    machine, nodes = plant.machine, [n for n in found.followed.nodes if n.pencil is not None and n.at > 0]
    values = np.full((len(machine.bearings), len(nodes), 2), np.nan)
    for i, node in enumerate(nodes):
        assert isinstance(node.pencil, LinearPlant)
        K = node.pencil.response.coefficients(node.at)[0] if machine.films else np.zeros((0, 0))
        for b, bearing in enumerate(machine.bearings):
            film = machine.film_at(b)
            if film is not None:
                values[b, i] = np.diag(K)[2 * film : 2 * film + 2]
            else:
                values[b, i] = _direct(bearing, node.at)
    stiffness = xr.DataArray(
        values, {"bearing": list(machine.bearing_names), "speed": [n.at for n in nodes], "axis": ["x", "y"]},
        ("bearing", "speed", "axis"),
    )  # fmt: skip
    positive = values[values > 0]
    middle = (float(positive.min()), float(positive.max())) if positive.size else (1e6, 1e7)
    try:
        return critical_speed_map(plant, (middle[0] / 30, middle[1] * 30), STIFFNESSES), "", stiffness
    except RotorsimError as error:
        return None, str(error), stiffness


def _direct(bearing: BearingPart, speed: float) -> np.ndarray:
    """Direct stiffness (2,) [N/m] of a bearing without a film at a speed [rad/s]."""
    assert bearing.coefficients is not None
    K = bearing.at(speed)[0] if isinstance(bearing, TableBearing) else bearing.coefficients[0]
    return np.diag(K)


def _checks(r: DesignReview) -> Iterator[DesignCheck]:
    yield from _margin_checks(r)
    yield from _stability_checks(r)
    yield from _axial_checks(r)
    yield from _clearance_checks(r)
    yield from _balance_checks(r)
    yield from _zone_checks(r)
    name, limit = "Largest sensitivity of the control loop", standards.SENSITIVITY_ZONES["B"]
    if r.sensitivity is None:
        yield DesignCheck(name, "at most", limit, None, "", OPEN, "sensitivity", remark="no law was given")
    else:
        zone = standards.sensitivity_zone(r.sensitivity)
        yield DesignCheck(name, "at most", limit, r.sensitivity, "", MET if zone in "AB" else MISSED, "sensitivity",
                          f"zone {zone}")  # fmt: skip


def _margin_checks(r: DesignReview) -> Iterator[DesignCheck]:
    """A row for every critical speed that asks for a margin."""
    asking = [mode for mode in r.criticals if margin_of(mode, r)[0] > 0]
    for mode in asking:
        asked, found = margin_of(mode, r)
        at = mode.speed if mode.peak is None else mode.peak.speed
        verdict, how = MET if found >= asked else MISSED, f"{mode.driven_by}, seen at {mode.place}"
        if mode.peak is None and is_steady(r, mode.speed):
            verdict = OPEN if verdict == MISSED else MET
            how = "1/(2 zeta): the response has no peak of this mode at the places looked at"
        elif mode.peak is None:
            how = "1/(2 zeta): no response is steady there, a mode grows"
        name = "critical speed" if mode.peak is None else "peak"
        name = f"Separation margin of the {name} at {at * TO_RPM:.0f} rpm, {mode.in_words}"
        yield DesignCheck(name, "at least", asked, found, "%", verdict, "margin", "",
                          f"amplification factor {mode.amplification:.3g}, {how}")  # fmt: skip
    if not asking:
        known = "no critical speed needs a margin" if r.criticals else "no mode crosses 1X"
        yield DesignCheck("Separation margins", "at least", 16.0, None, "%", MET, "margin", known)
    for a, b in dict.fromkeys((f"{a * TO_RPM:.0f}", f"{b * TO_RPM:.0f}") for a, b in r.open_speeds):
        where = f"from {a} to {b} rpm" if a != b else f"near {a} rpm"
        yield DesignCheck(f"Critical speeds {where}", "at least", 16.0, None, "%", OPEN, "margin", "",
                          "the film does not carry there, or the number of modes is not proven")  # fmt: skip


def is_steady(r: DesignReview, speed: float) -> bool:
    """Whether every mode decays at a speed [rad/s], so that the response to unbalance is steady."""
    return bool(np.interp(speed, r.responses["speed"].values, r.responses["zeta_least"].values) >= 0)


def margin_of(mode: CriticalSpeed, r: DesignReview) -> tuple[float, float]:
    """Separation margin [%] that a critical speed needs and has; that of its peak where the response has one.

    A backward mode without a peak needs none: unbalance, which turns forward, does not drive it.
    """
    at = mode.speed if mode.peak is None else mode.peak.speed
    undriven = mode.peak is None and mode.whirl == "backward" and is_steady(r, mode.speed)
    asked = 0.0 if undriven else standards.required_margin(mode.amplification, at > r.high)
    return asked, standards.found_margin(at, r.low, r.high)


def first_forward(r: DesignReview) -> CriticalSpeed | None:
    """The forward critical speed of the lowest speed."""
    return next((m for m in r.criticals if m.whirl == "forward"), None)


def _stability_checks(r: DesignReview) -> Iterator[DesignCheck]:
    at = r.decrements["speed"].values
    least = r.decrements.values[operating(at, r.low, r.high)]
    name = "Least logarithmic decrement at the operating speeds"
    known = bool(np.isfinite(least).all())
    low = float(least.min()) if known else None
    yield DesignCheck(
        name, "at least", standards.LEAST_DECREMENT, low, "",
        OPEN if low is None else MET if low >= standards.LEAST_DECREMENT else MISSED, "decrement", "",
        "the film does not carry, or no mode lies in the region" if low is None else
        "least of all modes with a damping ratio below 0.5, stricter than the rule, which asks for the first forward "
        "mode; without the cross-coupling of process gas that Level 1 of API 617 adds",
    )  # fmt: skip
    speed, frequency, looked = r.onset
    found = speed * TO_RPM if np.isfinite(speed) else None
    detail, remark = "", ""
    if found is not None:
        verdict, detail = MET if speed > r.high else MISSED, f"whirl at {frequency / (2 * np.pi):.4g} Hz"
    elif looked:
        verdict, detail = MET, f"none up to {r.searched[1] * TO_RPM:.0f} rpm"
    else:
        verdict, remark = OPEN, why_open(r.plant)
    yield DesignCheck("Onset of whirl", "at least", r.high * TO_RPM, found, "rpm", verdict, "onset", detail, remark)


def _axial_checks(r: DesignReview) -> Iterator[DesignCheck]:
    if r.axial is None:
        return
    name, state = "Damping ratio of the axial mode", r.axial.state
    if state is None:
        verdict, detail = (OPEN, "") if r.axial.carried is None else (MISSED, "not carried")
        yield DesignCheck(name, "above", 0.0, None, "", verdict, "onset", detail, r.axial.refused)
    else:
        how = "without oscillation" if state.overdamped else f"at {state.wn / (2 * np.pi):.4g} Hz"
        yield DesignCheck(name, "above", 0.0, state.zeta, "", MET if state.zeta > 0 else MISSED, "onset", how,
                          "faces that stay parallel")  # fmt: skip


def _clearance_checks(r: DesignReview) -> Iterator[DesignCheck]:
    worst: dict[str, Clearance] = {}
    for one in r.clearances:
        share = one.motion / one.gap
        if one.place not in worst or not share <= worst[one.place].motion / worst[one.place].gap:
            worst[one.place] = one
    limit = 100 * standards.CLEARANCE
    for place, one in worst.items():
        name, share = f"Motion in the clearance of {place}", 100 * one.motion / one.gap
        if not np.isfinite(share):
            why = "no response is steady at the operating speeds, which gives the scale"
            why = why if np.isfinite(one.gap) else "the machine file states no clearance"
            yield DesignCheck(name, "at most", limit, None, "%", OPEN, "clearance", "", why)
            continue
        verdict = MET if share <= limit else MISSED
        yield DesignCheck(name, "at most", limit, share, "%", verdict, "clearance", f"at {one.speed * TO_RPM:.0f} rpm",
                          one.case)  # fmt: skip
    yield DesignCheck("Motion in other close clearances (impellers, seals)", "at most", limit, None, "%", OPEN,
                      "clearance", "", "a machine file states those of films and rubs alone")  # fmt: skip


def _balance_checks(r: DesignReview) -> Iterator[DesignCheck]:
    mass, total = r.plant.machine.mass, 1e6 * sum(one.me for one in r.file_case.unbalances)
    asked = 1e6 * standards.permissible_unbalance(2.5, mass, r.high)
    if r.file_case.name != "machine file":
        yield DesignCheck("Unbalance of the rotor, G 2.5", "at most", asked, None, "g mm", OPEN, "grade", "",
                          "the machine file states no unbalance")  # fmt: skip
        return
    yield DesignCheck("Unbalance of the machine file, all planes, G 2.5", "at most", asked, total, "g mm",
                      MET if total <= asked else MISSED, "grade", f"G {1e-3 * total * r.high / mass:.2g}",
                      "G 2.5 is usual for turbo machines; choose the grade of your contract")  # fmt: skip
    residual = 1e6 * standards.residual_unbalance(float(np.abs(r.loads).sum()), r.high)
    yield DesignCheck("Unbalance of the machine file, all planes, API 4 W/N", "at most", residual, total, "g mm",
                      MET if total <= residual else MISSED, "unbalance", "",
                      "oz in, with W the weight in lb and N the speed in rpm")  # fmt: skip


def _zone_checks(r: DesignReview) -> Iterator[DesignCheck]:
    rpm = r.high * TO_RPM
    scope = standards.SCOPE[0] <= rpm <= standards.SCOPE[1]
    at = r.responses["speed"].values
    within = operating(at, r.low, r.high)
    steady = bool((r.responses["zeta_least"].values[within] >= 0).all())
    limits = TO_UM * standards.SHAFT_ZONES["B"] / np.sqrt(rpm), TO_UM * standards.vibration_limit(r.high)
    for probe, z in r.probes.items():
        sizes = r.motion(r.file_case.name, z)[within] * TO_UM
        motion = float(sizes.max())
        name = f"Shaft vibration pk-pk at {probe}, {r.file_case.name}"
        if not (steady and np.isfinite(motion)):
            yield DesignCheck(f"{name}, zone A or B", "at most", limits[0], None, "um", OPEN, "zones", "",
                              "a mode grows, or no response is known")  # fmt: skip
            continue
        where = f"at {at[within][sizes.argmax()] * TO_RPM:.0f} rpm"
        zone = standards.shaft_zone(motion / TO_UM, r.high)
        verdict = OPEN if not scope else MET if zone in "AB" else MISSED
        yield DesignCheck(f"{name}, zone A or B", "at most", limits[0], motion, "um", verdict, "zones",
                          f"{where}, zone {zone}",
                          "" if scope else "outside the speeds of the standard: for orientation")  # fmt: skip
        yield DesignCheck(f"{name}, Avl", "at most", limits[1], motion, "um", MET if motion <= limits[1] else MISSED,
                          "vibration", where)  # fmt: skip
