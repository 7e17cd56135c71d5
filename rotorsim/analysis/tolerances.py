r"""Random machines within their tolerances: distributions of quantities, probability of a miss, what matters most.

The values that vary are a Latin hypercube, uniform within the tolerance or normal with half of it as the standard
deviation. A star in a path stands for entries that vary each by itself, as parts that are made one by one do.

Critical speeds and the onset of whirl of the nominal machine are searched wholly. Those of a random machine are
followed from there: with the mode's eigenvalue s at the speed, a chord's step on

.. math:: g(\Omega) = |s| - \Omega \quad \text{or} \quad g(\Omega) = \zeta

from a start that a regression over the machines before predicts, until it is below 5e-3. Some of the machines are
searched wholly too, and the largest difference is stated.

The share of a value in the scatter of a quantity is that of the regression of ranks, beta_i rho_i: the standardised
coefficient times the correlation; they add up to its R^2 (Saltelli et al. 2008), each within 0 to R^2 only where values
do not go together by chance. The interval of a probability is that of Clopper and Pearson, which is wider than a Latin
hypercube needs.

Cites: clopper_1934, saltelli_2008.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import binomtest, norm, qmc, rankdata

from fe_shaft.pencil import Modes
from fe_shaft.spectrum import refined
from rotorsim.analysis.campbell import highest_speed
from rotorsim.analysis.design_review import critical_lines
from rotorsim.analysis.modes_over_speed import modes_over_speed
from rotorsim.analysis.supply import felt
from rotorsim.analysis.sweep_definition import QUANTITIES, Analysis, SweepQuantity, read_quantities
from rotorsim.analysis.targets import split, value_at
from rotorsim.analysis.whirl_onset import LeastDamped, stability_limit
from rotorsim.base.display import did_you_mean
from rotorsim.base.errors import ConvergenceError, DataError, NoLiftOffError, RotorsimError
from rotorsim.base.files import make_folder, write_csv
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.base.processes import one_thread, spread
from rotorsim.base.units import NUMBER, TABLE as UNITS, TO_RPM, parse
from rotorsim.machine.file_text import expanded, with_values
from rotorsim.machine.schema import Machine
from rotorsim.plant.linearise import LinearPlant, linearise
from rotorsim.plant.plant import Plant, as_plant, point
from rotorsim.plant.simulation import describe, settle

CLOSE = 5e-3
"""Relative step after which a followed speed is known to some 1e-4: chords of other machines are wrong by percents."""
MOST_STEPS = 8
"""Steps after which a speed is not found by following."""
PILOT = 40
"""Machines that are followed from the nominal one; the starts of the others are predicted from these."""
CHUNK = 10
"""Machines of one task."""
WHOLE = 3
"""Machines that are searched wholly too."""
STEP = 1e-3
"""Relative step of the slope of a followed quantity."""
AGREED = 1e-3
"""Largest relative difference to a whole search for which the followed ones count as confirmed."""
SURE = 0.95
"""Level of an interval of confidence."""
SIGMAS = 2.0
"""Standard deviations that the tolerance of a normal value stands for."""
CRITICALS = "criticals"
"""Name under which all critical speeds of 1X are asked for."""
DEFAULT = ("onset", "flow", CRITICALS)
"""Quantities where none are asked for."""
NETCDF = "random.nc"
"""File of all values."""
TABLE = "random.csv"
"""File of the same as a table."""
TOLERANCE = re.compile(
    rf"\s*(?P<path>[^=\s]+)\s*=\s*(?:(?P<centre>{NUMBER}\s*[^+\s±][^+±]*?|{NUMBER}))?\s*(?:\+-|\+/-|±)\s*"
    rf"(?P<half>{NUMBER})\s*(?P<unit>%|\S*?)\s*(?P<law>normal|uniform)?\s*", re.ASCII | re.IGNORECASE,
)  # fmt: skip
CRITICAL = re.compile(r"critical_[1-9]\d*", re.ASCII)
"""Name of one of them."""
REQUIREMENT = re.compile(r"\s*(\w+)\s*([<>])\s*(.+?)\s*", re.ASCII)
Spread = Callable[[Callable[..., Any], Sequence[tuple[Any, ...]]], Iterator[tuple[int, Any]]]


@dataclass(frozen=True)
class Variation:
    """A value that varies: path, centre and tolerance in its unit, and whether it is normal or uniform."""

    path: str
    centre: float
    half: float
    unit: str
    normal: bool = False

    def at(self, share: np.ndarray) -> np.ndarray:
        """Values (n,) at shares (n,) between 0 and 1 of the probability."""
        if not self.normal:
            return np.asarray(self.centre + self.half * (2 * share - 1))
        return np.asarray(self.centre + self.half / SIGMAS * norm.ppf(share))

    def text(self, value: float) -> str | float:
        """A value as a machine file has it."""
        return f"{value:.12g} {self.unit}" if self.unit else float(value)


@dataclass(frozen=True)
class Requirement:
    """A limit of a quantity [SI], from below or above."""

    quantity: str
    above: bool
    limit: float
    text: str


def read_variations(texts: Iterable[str], machine: Machine) -> tuple[Variation, ...]:
    """Variations of texts 'PATH=18 um +- 2 um normal, PATH=+- 10 %'; raises DataError or MachineFileError.

    Examples
    --------
    >>> import rotorsim as rs
    >>> from rotorsim.analysis.tolerances import read_variations
    >>> found = read_variations(["bearings.*.clearance=+- 10 %"], rs.load_machine("aerostatic_spindle"))
    >>> [(one.path, one.centre, one.half, one.unit) for one in found]
    [('bearings.0.clearance', 20.0, 2.0, 'um'), ('bearings.1.clearance', 20.0, 2.0, 'um')]
    """
    found: list[Variation] = []
    for text in (part for given in texts for part in given.split(",") if part.strip()):
        match = TOLERANCE.fullmatch(text)
        if match is None:
            raise DataError(
                f"--vary: '{text.strip()}' is not PATH=VALUE +- TOLERANCE; write e.g. "
                "'bearings.*.clearance=18 um +- 2 um' or 'bearings.*.clearance=+- 10 % normal'",
                argument="vary",
                value=text,
            )
        for path in expanded(machine.text, match["path"]):
            found.append(_variation(path, match, machine))
    if not found:
        raise DataError("--vary: no value varies; write e.g. 'bearings.*.clearance=+- 10 %'", argument="vary")
    paths = [one.path for one in found]
    for path in paths:
        if paths.count(path) > 1:
            raise DataError(f"--vary: {path} is given twice; write it once", argument="vary", value=path)
    for one in found:
        for share in (-1.0, 1.0):
            machine.replace(one.path, one.text(one.centre + share * one.half))
    return tuple(found)


def _variation(path: str, match: re.Match[str], machine: Machine) -> Variation:
    number, unit = split(path, value_at(machine.text, path) if match["centre"] is None else _plain(match["centre"]))
    half = float(match["half"])
    if match["unit"] == "%":
        half = abs(number) * half / 100
    elif match["unit"] != unit:
        half = _converted(path, half, match["unit"], unit)
    if not half > 0:
        raise DataError(f"--vary: the tolerance of {path} is not above 0", argument="vary", value=path)
    return Variation(path, number, half, unit, (match["law"] or "").lower() == "normal")


def _plain(text: str) -> str | float:
    try:
        return float(text)
    except ValueError:
        return text.strip()


def _converted(path: str, half: float, unit: str, wanted: str) -> float:
    """A tolerance in the unit of its value."""
    for kind in (kind.factors for kind in UNITS.values() if unit in kind.factors and wanted in kind.factors):
        return half * float(kind[unit]) / float(kind[wanted])
    raise DataError(f"--vary: the tolerance of {path} is in '{unit}', its value in '{wanted}'; use one unit")


def read_requirements(texts: Iterable[str], what: Sequence[str]) -> tuple[Requirement, ...]:
    """Requirements of texts 'onset > 30000 rpm' on what is asked for, critical speeds one by one; raises DataError."""
    found = []
    for text in texts:
        match = REQUIREMENT.fullmatch(text)
        if match is None:
            raise DataError(f"--require: '{text}' is not QUANTITY > VALUE; write e.g. 'onset > 30000 rpm'")
        _known(CRITICALS if CRITICAL.fullmatch(match[1]) else match[1], what, "--require")
        try:
            limit = float(parse(match[3], unit_of(match[1])))
        except ValueError as error:
            raise DataError(f"--require: {error}") from error
        found.append(Requirement(match[1], match[2] == ">", limit, text.strip()))
    return tuple(found)


def check_critical(names: Iterable[str], task: Task, option: str = "--require") -> None:
    """Raise DataError for a critical speed that the nominal machine does not have."""
    speeds = [one.name for one in task.followed if one.name != "onset"]
    for name in names:
        if CRITICAL.fullmatch(name) and name not in speeds:
            raise DataError(
                f"{option}: up to {task.highest * TO_RPM:.6g} rpm the machine has no {name}, but "
                f"{', '.join(speeds) or 'none at all'}; raise the highest speed",
                argument=option.lstrip("-"),
                value=name,
            )


def _known(name: str, what: Sequence[str], option: str) -> None:
    if name not in what:
        raise DataError(f"{option}: '{name}' is none of the quantities asked for; {did_you_mean(name, what)}")


def quantity_of(name: str) -> SweepQuantity:
    """Quantity of a name; critical speeds are `critical_1` and so on."""
    if name in QUANTITIES:
        return QUANTITIES[name]
    return SweepQuantity(name, "rad/s", "rpm", TO_RPM, "highest", f"critical speed {name.rpartition('_')[2]}")


def named_quantity(name: str, task: Task) -> SweepQuantity:
    """Quantity of a name, a critical speed with the sense in which its mode whirls in the nominal machine."""
    found = quantity_of(name)
    whirl = next((one.whirl for one in task.followed if one.name == name), "")
    return replace(found, meaning=f"{found.meaning}, {whirl}") if whirl else found


def modes_in_words(task: Task) -> dict[str, str]:
    """Every critical speed of the nominal machine in words."""
    return {one.name: one.words for one in task.followed if one.words}


def unit_of(name: str) -> str:
    """SI unit of a quantity."""
    return quantity_of(name).unit


@dataclass(eq=False)
class Equilibria:
    """Equilibria of a machine at a pressure [Pa, gauge] and several speeds, each from the one before."""

    plant: Plant
    pressure: float
    w: np.ndarray | None = None

    def at(self, speed: float) -> np.ndarray:
        """Workspace of the equilibrium at a speed [rad/s]."""
        self.w = settle(self.plant.assembly, speed, self.pressure, self.w)
        return self.w

    def linearised(self, speed: float) -> LinearPlant:
        """Linear model about the equilibrium at a speed [rad/s]."""
        return linearise(self.plant.assembly, self.at(speed), speed)


@dataclass(frozen=True, eq=False)
class FollowedSpeed:
    """A critical speed or onset of the nominal machine: speed [rad/s], slope of g there, mode, sense, mode in words."""

    name: str
    speed: float
    slope: float
    mode: Modes
    whirl: str = ""
    words: str = ""

    def measure(self, modes: Modes, speed: float) -> float:
        """Function g whose zero is the speed: |s| less the speed, or the damping ratio."""
        s = complex(modes.values[np.abs(modes.values - self.mode.values[0]).argmin()])
        return -s.real / abs(s) if self.name == "onset" else abs(s) - speed

    def of(self, equilibria: Equilibria, start: float) -> float | None:
        """The speed [rad/s] of another machine, from a start; None where the mode is not found again."""
        speed, seed = start, self.mode
        for _ in range(MOST_STEPS):
            with one_thread():
                seed = refined(model := equilibria.linearised(speed), seed)
            if not len(seed.values) or model.size != len(seed.right):
                return None
            step = self.measure(seed, speed) / self.slope
            speed -= step
            if not 0 < speed < 10 * self.speed:
                return None
            if abs(step) < CLOSE * speed:
                return speed
        return None


def followed_speeds(plant: Plant, pressure: float, highest: float, what: Sequence[str]) -> list[FollowedSpeed]:
    """The critical speeds of 1X and the onset of the nominal machine up to a speed [rad/s], as far as asked for."""
    found = []
    if CRITICALS in what:
        every = modes_over_speed(plant, [0.0, highest], pressure, orders=(1,))
        lines = zip(every.crossings, critical_lines(plant, every), strict=True)
        inside = [(one, line) for one, line in lines if 0 < one.at <= highest]
        for k, (one, line) in enumerate(sorted(inside, key=lambda pair: pair[0].at), 1):
            found.append(FollowedSpeed(f"critical_{k}", one.at, 1.0, _bare(one.modes), line.whirl, line.in_words))
    if "onset" in what:
        onset, frequency, _ = stability_limit(plant, pressure, highest)
        if np.isfinite(onset) and frequency:
            search = LeastDamped.up_to(plant, pressure, highest)
            modes = search.node(onset).modes
            found.append(FollowedSpeed("onset", onset, 1.0, _take(modes, 1j * frequency)))
    return [replace(one, slope=_slope(plant, pressure, one)) for one in found]


def _take(modes: Modes, value: complex) -> Modes:
    return _bare(modes.take(np.abs(modes.values - value) == np.abs(modes.values - value).min()))


def _bare(modes: Modes) -> Modes:
    """Modes as they travel to another process: without the counting of their region."""
    return Modes(modes.values, modes.right, modes.left)


def _slope(plant: Plant, pressure: float, one: FollowedSpeed) -> float:
    """Slope of g at the speed of the nominal machine."""
    sides = [one.speed * (1 + STEP), one.speed * (1 - STEP)]
    with one_thread():
        high, low = (one.measure(refined(plant.linearise(v, pressure), one.mode), v) for v in sides)
    return (high - low) / (sides[0] - sides[1])


@dataclass(frozen=True, eq=False)
class Task:
    """Computation of every machine: nominal text, paths, followed speeds, analyses, pressure, highest speed."""

    text: str
    paths: tuple[str, ...]
    followed: tuple[FollowedSpeed, ...]
    analyses: tuple[Analysis, ...]
    onset: bool
    flow: bool
    speed: float
    pressure: float
    highest: float


def _rows(
    task: Task, machines: Sequence[tuple[Any, ...]], starts: Sequence[Sequence[float]] | None
) -> list[dict[str, float]]:
    """Quantities [SI] of machines with these values, in this process or another; searched wholly without starts."""
    if starts is None:
        return [whole_row(task, values) for values in machines]
    return [row_of(task, values, start) for values, start in zip(machines, starts, strict=True)]


def machine_of(task: Task, values: Sequence[Any]) -> Machine:
    """The machine with values as a machine file has them: one reader knows every unit, those with an offset too."""
    return Machine.from_text(with_values(task.text, dict(zip(task.paths, values, strict=True))))


def row_of(task: Task, values: Sequence[Any], starts: Sequence[float]) -> dict[str, float]:
    """Quantities [SI] of the machine with these values; empty where it would not be valid."""
    row: dict[str, float] = {}
    try:
        plant = Plant(machine_of(task, values))
    except RotorsimError:
        return row
    equilibria = Equilibria(plant, task.pressure)
    try:
        for one, start in zip(task.followed, starts, strict=True):
            speed = one.of(equilibria, start)
            if speed is None and one.name == "onset":
                speed = searched_onset(plant, task)
            row[one.name] = float("nan") if speed is None else speed
        if task.onset:
            row["onset"] = searched_onset(plant, task)
        if task.flow:
            row["flow"] = float(describe(plant.assembly, equilibria.at(task.speed)).mass_flow.sum())
    except (NoLiftOffError, ConvergenceError):
        pass
    for analysis in task.analyses:
        row |= {name: float("nan") if v is None else v for name, v in analysis.run(plant).items() if name != "reason"}
    return row


def searched_onset(plant: Plant, task: Task) -> float:
    """Onset [rad/s] of a whole search: infinite where none is up to the highest speed, NaN where it is not known."""
    onset, _, complete = stability_limit(plant, task.pressure, task.highest)
    return onset if np.isfinite(onset) else float("inf") if complete == 1.0 else float("nan")


def in_order(row: dict[str, float]) -> dict[str, float]:
    """A row whose critical speeds ascend, as their names say: modes may pass each other from machine to machine.

    None of them is known where one mode was not found again.
    """
    names = [name for name in row if name.startswith("critical_")]
    speeds = np.sort([row[name] for name in names])
    if np.isnan(speeds).any():
        speeds = np.full(len(names), np.nan)
    return row | dict(zip(names, speeds.tolist(), strict=True))


def whole_row(task: Task, values: Sequence[Any]) -> dict[str, float]:
    """Followed quantities [SI] of a machine, each searched wholly; its critical speeds ascend."""
    plant = Plant(machine_of(task, values))
    names = [CRITICALS] if any(one.name != "onset" for one in task.followed) else []
    speeds = sorted(one.speed for one in followed_speeds(plant, task.pressure, task.highest, names))
    found = dict(zip([one.name for one in task.followed if one.name != "onset"], speeds, strict=False))
    if any(one.name == "onset" for one in task.followed):
        found["onset"] = searched_onset(plant, task)
    return found


@dataclass(frozen=True, eq=False)
class RandomResult:
    """Random machines: `data` has the values that vary, in their units, and quantities [SI], over the sample.

    `nominal` holds the quantities of the nominal machine, `confirmed` the largest relative difference of followed
    quantities to those of whole searches, `modes` the nominal machine's critical speeds in words.
    """

    data: xr.Dataset
    variations: tuple[Variation, ...]
    quantities: tuple[SweepQuantity, ...]
    requirements: tuple[Requirement, ...]
    nominal: dict[str, float]
    confirmed: dict[str, float]
    modes: dict[str, str] = field(default_factory=dict)

    def distribution(self, name: str) -> dict[str, float]:
        """Mean, standard deviation, 5, 50 and 95 % of a quantity in its shown unit, and two counts.

        One is of the machines of which it is not known, one of those that have none up to the highest speed.
        """
        quantity = quantity_of(name)
        values = self.data[name].values * quantity.factor
        known = values[np.isfinite(values)]
        low, middle, high = np.quantile(known, [0.05, 0.5, 0.95]) if known.size else [np.nan] * 3
        return {
            "nominal": self.nominal.get(name, float("nan")) * quantity.factor,
            "mean": float(known.mean()) if known.size else float("nan"),
            "deviation": float(known.std(ddof=1)) if known.size > 1 else float("nan"),
            "5 %": float(low), "50 %": float(middle), "95 %": float(high), "not known": int(np.isnan(values).sum()),
            "above the highest": int(np.isinf(values).sum()),
        }  # fmt: skip

    def misses(self, requirement: Requirement) -> tuple[int, int, float, float, float]:
        """Machines that miss a requirement, those not known among them, probability and its interval.

        A quantity that is not known counts as a miss.
        """
        values = self.data[requirement.quantity].values
        kept = values > requirement.limit if requirement.above else values < requirement.limit
        missed, unknown, n = int((~kept).sum()), int(np.isnan(values).sum()), len(values)
        return missed, unknown, missed / n, *clopper_pearson(missed, n)

    def shares(self, name: str) -> tuple[dict[str, float], float]:
        """Share of every value in the scatter of a quantity by regression of ranks, and R^2."""
        known = np.isfinite(self.data[name].values)
        X = np.column_stack([self.data[one.path].values[known] for one in self.variations])
        return rank_shares(X, self.data[name].values[known], [one.path for one in self.variations])

    def table(self) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
        """Head with units and a row a machine; None where it is not known."""
        head = [f"{one.path} [{one.unit or '1'}]" for one in self.variations] + [q.heading for q in self.quantities]
        columns = [self.data[one.path].values for one in self.variations]
        columns += [self.data[q.name].values * q.factor for q in self.quantities]
        return tuple(head), [tuple(float(v) if np.isfinite(v) else None for v in row) for row in np.transpose(columns)]

    def numbers(self) -> dict[str, Any]:
        """Distributions, probabilities and shares as plain values."""
        names = [q.name for q in self.quantities]
        shares = {name: self.shares(name) for name in names}
        misses = {one.text: self.misses(one) for one in self.requirements}
        return {
            "machines": self.data.sizes["sample"],
            "distributions": {f"{n} [{quantity_of(n).shown}]": self.distribution(n) for n in names},
            "misses": {text: dict(zip(("missed", "not_known", "probability", "low", "high"), m, strict=True))
                       for text, m in misses.items()},
            "shares": {name: {"r2": r2, **by} for name, (by, r2) in shares.items()},
            "difference_to_whole_searches": self.confirmed,
        }  # fmt: skip

    def write(self, folder: str | Path) -> dict[str, str]:
        """Write `random.nc` (SI) and `random.csv` (units in its head) into a folder; returns the paths by kind."""
        folder = make_folder(folder)
        write_netcdf(folder / NETCDF, self.data.rename({p.path: p.path.replace(".", "_") for p in self.variations}))
        write_csv(folder / TABLE, *self.table())
        return {"random": str(folder / NETCDF), "table": str(folder / TABLE)}


def clopper_pearson(k: int, n: int, level: float = SURE) -> tuple[float, float]:
    """Interval of the probability of an event that was seen k times in n.

    Examples
    --------
    >>> from rotorsim.analysis.tolerances import clopper_pearson
    >>> [round(p, 4) for p in clopper_pearson(0, 100)]
    [0.0, 0.0362]
    """
    found = binomtest(k, n).proportion_ci(level, "exact")
    return float(found.low), float(found.high)


def rank_shares(X: np.ndarray, y: np.ndarray, names: Sequence[str]) -> tuple[dict[str, float], float]:
    """Shares of columns of X (n, k) in the scatter of y (n,) by regression of ranks, and R^2; zeros without scatter.

    Examples
    --------
    >>> from rotorsim.analysis.tolerances import rank_shares
    >>> x = np.arange(8.0)
    >>> rank_shares(np.column_stack([x, np.resize([0.0, 1.0], 8)]), x**3, ("a", "b"))[0]["a"].__round__(9)
    1.0
    """
    if len(y) < X.shape[1] + 2 or np.ptp(y) == 0:
        return dict.fromkeys(names, 0.0), 0.0
    ranks = np.column_stack([rankdata(column) for column in X.T] + [rankdata(y)])
    ranks = (ranks - ranks.mean(axis=0)) / np.where(ranks.std(axis=0) > 0, ranks.std(axis=0), 1.0)
    A, b = ranks[:, :-1], ranks[:, -1]
    shares = np.linalg.lstsq(A, b, rcond=None)[0] * (A.T @ b / len(b))
    return dict(zip(names, shares.tolist(), strict=True)), float(shares.sum())


def random_machines(
    machine: Plant | Machine | str, vary: str | Sequence[str], count: int = 500, what: str | Sequence[str] = DEFAULT,
    require: Sequence[str] = (), speed: float | str = 0.0, pressure: float | str = 0.5e6,
    highest: float | str | None = None, seed: int = 0, workers: int = 1,
    progress: Callable[[int, int], None] | None = None, each: Spread | None = None,
) -> RandomResult:  # fmt: skip
    """Quantities of machines whose values are random within tolerances.

    Parameters
    ----------
    machine : Plant, Machine or str
        The nominal machine, its name or its file.
    vary : str or sequence of str
        Values with tolerances: 'bearings.*.clearance=18 um +- 2 um', '+- 10 %' of the machine's own value, 'normal'
        behind it for a normal distribution of which the tolerance is two standard deviations.
    count : int
        Machines.
    what : str or sequence of str
        Quantities of `sweep`, and 'criticals' for the critical speeds of 1X.
    require : sequence of str
        Limits: 'onset > 30000 rpm'.
    speed, pressure : float or str
        Operating point [rad/s], [Pa, gauge].
    highest : float or str, optional
        Speed [rad/s] up to which onset and critical speeds of the nominal machine are searched.
    seed : int
        Makes the Latin hypercube.
    workers : int
        Processes.
    progress : callable, optional
        Called with the machines done and in all.
    each : callable, optional
        Calls a function for a sequence of arguments, as `rotorsim.base.processes.spread` does; by default on `workers`.

    Raises
    ------
    DataError, MachineFileError
        For values, quantities or limits that cannot be read.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.random_machines("plain_rotor", "discs.0.mass=+- 5 %", 20, "criticals")
    >>> found.data.sizes["sample"]
    20
    """
    plant = as_plant(machine)
    names = tuple(part.strip() for part in what.split(",")) if isinstance(what, str) else tuple(what)
    variations = read_variations([vary] if isinstance(vary, str) else vary, plant.machine)
    shares, values, machines = _drawn(variations, count, seed)
    requirements = read_requirements(require, names)
    task = task_of(plant, names, [v.path for v in variations], *point(speed, pressure), highest)
    check_critical([one.quantity for one in requirements], task)
    run = each or (lambda function, calls: spread(function, calls, workers))
    rows, whole = _all_rows(task, machines, shares, run, progress)
    rows = [in_order(row) for row in rows]
    named = names_of(task, names)
    return _result(plant, task, variations, values, rows, named, requirements, _confirmed(rows, whole))


def _drawn(
    variations: Sequence[Variation], count: int, seed: int
) -> tuple[np.ndarray, np.ndarray, list[tuple[Any, ...]]]:
    """A Latin hypercube (sample, value) of shares of the probability, its values, and their texts in a machine file."""
    if count < 2 or seed < 0:
        raise DataError(f"random: {count} machines, seed {seed}; give 2 machines or more and a seed from 0")
    shares = qmc.LatinHypercube(len(variations), rng=np.random.default_rng(seed)).random(count)
    values = np.column_stack([one.at(column) for one, column in zip(variations, shares.T, strict=True)])
    return shares, values, [tuple(v.text(x) for v, x in zip(variations, row, strict=True)) for row in values]


def task_of(
    plant: Plant, names: Sequence[str], paths: Sequence[str], speed: float, pressure: float,
    highest: float | str | None,
) -> Task:  # fmt: skip
    """The computation of every machine, after the nominal one was searched."""
    plain = [name for name in names if name != CRITICALS]
    quantities = read_quantities(plain, plant.machine) if plain else ()
    pressure = float(felt([plant.machine], [pressure])[0])
    top = highest_speed(plant) if highest is None else point(highest, 0.0)[0]
    followed = tuple(followed_speeds(plant, pressure, top, names))
    kinds = dict.fromkeys(q.kind for q in quantities if q.name not in ("onset", "flow"))
    fixed = {"speed": speed, "pressure": pressure, "highest_speed": top}
    analyses = tuple(kind(**{k: v for k, v in fixed.items() if k in kind.__dataclass_fields__}) for kind in kinds)
    lone = "onset" in names and not any(one.name == "onset" for one in followed)
    return Task(plant.machine.text, tuple(paths), followed, analyses, lone, "flow" in names, speed, pressure, top)


def names_of(task: Task, names: Sequence[str]) -> list[str]:
    """Names of the quantities of a task; of its analyses those that were asked for."""
    found = [one.name for one in task.followed] + ["onset"] * task.onset + ["flow"] * task.flow
    return found + [name for one in task.analyses for name in one.quantities if name in names]


def compared(row: dict[str, float], whole: dict[str, float]) -> dict[str, float]:
    """Relative differences of the quantities of a whole search, infinite where one of both is not known."""
    found = {}
    for name, value in whole.items():
        own = row.get(name, float("nan"))
        same = own == value or (np.isnan(own) and np.isnan(value))
        apart = 0.0 if same else abs(own / value - 1)
        found[name] = float(apart) if np.isfinite(apart) else float("inf")
    return found


def _all_rows(
    task: Task, machines: Sequence[tuple[Any, ...]], shares: np.ndarray, run: Spread,
    progress: Callable[[int, int], None] | None,
) -> tuple[list[dict[str, float]], dict[int, dict[str, float]]]:  # fmt: skip
    """Rows of all machines, and by their numbers those of the machines that are searched wholly, too.

    Machines that start at the nominal speeds come first, then those whose starts are predicted and the whole searches.
    """
    rows: list[dict[str, float]] = [{} for _ in machines]
    starts = np.tile([one.speed for one in task.followed], (len(machines), 1))
    chosen = np.linspace(0, len(machines) - 1, WHOLE).round().astype(int).tolist() if task.followed else []
    whole: dict[int, dict[str, float]] = {}
    for part in (range(min(PILOT, len(machines))), range(min(PILOT, len(machines)), len(machines))):
        if part.start:
            starts[part.start :] = _predicted(task, rows[: part.start], shares)[part.start :]
        chunks = [part[i : i + CHUNK] for i in range(0, len(part), CHUNK)]
        long = list(dict.fromkeys(chosen)) if part.start else []
        calls: list[tuple[Any, ...]] = [(task, [machines[k]], None) for k in long]
        calls += [(task, [machines[k] for k in chunk], [starts[k].tolist() for k in chunk]) for chunk in chunks]
        for number, found in run(_rows, calls) if calls else ():
            if number < len(long):
                whole[long[number]] = found[0]
                continue
            for k, row in zip(chunks[number - len(long)], found, strict=True):
                rows[k] = row
            if progress:
                progress(sum(map(bool, rows)), len(rows))
    return rows, whole


def _predicted(task: Task, rows: Sequence[dict[str, float]], shares: np.ndarray) -> np.ndarray:
    """Starts (machines, followed) [rad/s]: regression of the speeds so far on the values, squares where enough."""
    centred = 2 * shares - 1
    terms = [np.ones(len(shares)), *centred.T]
    if len(rows) > 3 * (2 * shares.shape[1] + 1):
        terms += list((centred**2).T)
    A, starts = np.column_stack(terms), np.empty((len(shares), len(task.followed)))
    for k, one in enumerate(task.followed):
        y = np.array([row.get(one.name, np.nan) for row in rows])
        known = np.isfinite(y)
        if known.sum() <= A.shape[1]:
            starts[:, k] = one.speed
            continue
        starts[:, k] = A @ np.linalg.lstsq(A[: len(rows)][known], y[known], rcond=None)[0]
        starts[:, k] = np.clip(starts[:, k], 0.5 * one.speed, 2 * one.speed)
    return starts


def _confirmed(rows: Sequence[dict[str, float]], whole: dict[int, dict[str, float]]) -> dict[str, float]:
    """Largest relative difference of each followed quantity to whole searches of some of the machines."""
    worst: dict[str, float] = {}
    for number, searched in whole.items():
        for name, apart in compared(rows[number], searched).items():
            worst[name] = max(worst.get(name, 0.0), apart)
    return worst


def _result(
    plant: Plant, task: Task, variations: tuple[Variation, ...], values: np.ndarray, rows: Sequence[dict[str, float]],
    names: Sequence[str], requirements: tuple[Requirement, ...], confirmed: dict[str, float],
) -> RandomResult:  # fmt: skip
    columns: dict[str, Any] = {
        one.path: ("sample", values[:, k], {"units": one.unit or "1", "long_name": one.path})
        for k, one in enumerate(variations)
    }
    quantities = tuple(named_quantity(name, task) for name in dict.fromkeys(names))
    for q in quantities:
        label = {"units": q.unit, "long_name": q.meaning}
        columns[q.name] = ("sample", np.array([row.get(q.name, np.nan) for row in rows]), label)
    centre = [tuple(one.text(one.centre) for one in variations)]
    nominal = _rows(task, centre, [[one.speed for one in task.followed]])[0]
    attrs = plant.provenance() | {"kind": "random", "pressure": task.pressure, "highest_speed": task.highest}
    data = xr.Dataset(columns, attrs=attrs)
    return RandomResult(data, variations, quantities, requirements, nominal, confirmed, modes_in_words(task))
