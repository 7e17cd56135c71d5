"""Operating map: equilibrium, modes, gains and film coefficients over speed, pressure and machine fields.

A point is an equilibrium and the linear model about it; a map repeats it over a grid and labels what it finds. That of
a machine has the safe region too, and on request lift-off, onset and critical speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from rotorsim.analysis.axes import MOST, Field, checked, labelled, over_fields, with_fields
from rotorsim.analysis.campbell import critical_speeds, safe_region, surroundings
from rotorsim.analysis.modes_over_speed import MARGIN
from rotorsim.analysis.supply import felt, lift_off
from rotorsim.analysis.whirl_onset import whirl_onset
from rotorsim.base.display import Card, Shown, several
from rotorsim.base.errors import DataError, NoLiftOffError
from rotorsim.base.interrupt import finishing
from rotorsim.base.processes import cores, spread
from rotorsim.base.units import TO_UM, show
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.linearise import LinearPlant, linearise
from rotorsim.plant.simulation import Equilibrium, describe, settle
from rotorsim.plant.validity import growth

if TYPE_CHECKING:
    import xarray as xr

MODES = 4
"""Modes that are kept: the lowest."""
AT = ("static", "mode 1", "mode 2")
"""Frequencies at which K(omega) and C(omega) are read when none are given."""
VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "done": ((), "1", "whether the point was computed"),
    "lifted": ((), "1", "whether the film carries the rotor"),
    "eccentricity_ratio": ((), "1", "eccentricity ratio, the largest of all films"),
    "h_min": ((), "m", "smallest film thickness"),
    "journal": (("axis",), "m", "journal position"),
    "disc": (("axis",), "m", "disc position"),
    "film_force": (("axis",), "N", "film force on the journal"),
    "mass_flow": (("injector",), "kg/s", "mass flow into the film"),
    "wn": (("mode",), "rad/s", "natural frequency"),
    "zeta": (("mode",), "1", "damping ratio"),
    "whirl_ratio": (("mode",), "1", "roundness of the disc's orbit, 1 forward, -1 backward"),
    "proven": ((), "1", "1: no mode is missing among those listed up to the second pair and the speed, 0: not proven"),
    "zeta_least": ((), "1", "least damping ratio of all modes up to the highest speed, and of the first four"),
    "looked": ((), "1", "1: all modes and the critical speeds around the speed were looked for, 0: not all"),
    "static_gain": (("axis", "reference"), "m/V", "static gain from reference to disc"),
    "delay": (("axis",), "s", "delay of the film force behind the reference"),
    "film_frequency": (("at",), "rad/s", "whirl frequency of film stiffness and damping"),
    "film_stiffness": (("at", "axis", "to"), "N/m", "film stiffness K(omega)"),
    "film_damping": (("at", "axis", "to"), "N s/m", "film damping C(omega)"),
}
"""Variables of a point: dimensions, unit, name."""
CRITICAL: dict[str, tuple[str, str]] = {
    "critical_speed": ("rad/s", "speed that a natural frequency equals"),
    "critical_zeta": ("1", "damping ratio at the critical speed"),
    "critical_direction": ("1", "1: the natural frequency rises above the speed, -1: it falls below"),
    "critical_whirl_ratio": ("1", "roundness of the disc's orbit, 1 forward, -1 backward"),
}
"""Variables of a critical speed, in the order of the columns of `safe_region.Surroundings.critical`: unit, name."""
BRANCHES: dict[str, tuple[str, str]] = {
    "branch_wn": ("rad/s", "natural frequency of a mode, followed"),
    "branch_zeta": ("1", "damping ratio of a mode, followed"),
    "branch_whirl_ratio": ("1", "roundness of the disc's orbit, 1 forward, -1 backward"),
}
"""Variables of a branch, in the order of the last axis of `safe_region.Surroundings.branches`: unit, name."""


@dataclass(frozen=True, eq=False, repr=False)
class OperatingPoint(Shown):
    """Equilibrium, linear model, and K, C (n, 2 films, 2 films) [N/m, N s/m] at the whirl frequencies `at` [rad/s].

    K[i, a, b] is the films' force against a per displacement along b at at[i]; a and b are x, y of the first film, then
    x, y of the second and so on: three frequencies of two films give (3, 4, 4). NaN (n, 2, 2) without films.
    """

    equilibrium: Equilibrium
    model: LinearPlant
    at: np.ndarray
    K: np.ndarray
    C: np.ndarray

    def card(self) -> Card:
        """Modes, then what the equilibrium shows."""
        rest = self.equilibrium.card()
        rows = [(f"modes [Hz]{'' if self.model.proven else ', perhaps not all'}",
                 several(self.model.wn, scale=1 / (2 * np.pi))),
                ("damping ratios", several(self.model.zeta, ".3g")), *rest.rows]  # fmt: skip
        return Card(rest.title.replace("Equilibrium", "Operating point"), rows)


def operating_point(
    plant: Plant, speed: float, pressure: float, frequencies: Sequence[float] | None = None
) -> OperatingPoint:
    """The machine at `speed` [rad/s] and gauge `pressure` [Pa]; frequencies [rad/s] default to 0 and the two modes.

    `OperatingPoint` states the axes of its K and C. Raises NoLiftOffError where the film does not carry the rotor.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.analysis.operating_point(plant, 300.0, 0.5e6).K.shape
    (3, 2, 2)
    """
    return _point(plant, speed, pressure, frequencies, None)


def _point(
    plant: Plant, speed: float, pressure: float, frequencies: Sequence[float] | None, model: LinearPlant | None
) -> OperatingPoint:
    """The point with its linear model, where that is known already."""
    a = plant.assembly
    w = settle(a, speed, pressure)
    model = model or linearise(a, w, speed)
    at = np.array([0.0, *model.wn[:2]] if frequencies is None else frequencies, float)
    if a.film_model is None:
        K = C = np.full((len(at), 2, 2), np.nan)
    else:
        K, C = (np.stack(part) for part in zip(*(model.response.coefficients(float(o)) for o in at), strict=True))
    return OperatingPoint(describe(a, w), model, at, K, C)


WORTH = 60
"""Points that make one more process worth its start."""
Row = tuple[list[dict[str, np.ndarray]], np.ndarray, np.ndarray]
"""Points of one pressure of one machine, critical speeds (k, 4) around them, branches of modes (b, speeds, 3)."""


def operating_map(
    plant: Plant,
    speeds: Sequence[float] | np.ndarray,
    pressures: Sequence[float] | np.ndarray,
    fields: Sequence[Field] = (),
    frequencies: Sequence[float] | None = None,
    workers: int | None = 1,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Equilibrium, modes, gains, delays and film coefficients over the grid.

    Parameters
    ----------
    speeds, pressures : (n_speed,) [rad/s], (n_pressure,) [Pa, gauge]
        Ascending.
    fields : sequence of Field
        Further axes: fields of the machine file.
    frequencies : (n_at,), optional
        Whirl frequencies of K and C [rad/s]; else 0 and those of the two lowest modes.
    workers : int or None
        Processes; None for as many as pay.
    progress : callable, optional
        Called with (points done, points in all).

    Returns
    -------
    Dataset over (fields..., pressure, speed); NaN and `lifted` = 0 where the film does not carry the rotor. Critical
    speeds, `critical_speed` and more (fields..., pressure, critical), are those within 15 % of the speeds. After an
    interrupt `ended` is "interrupted" and `done` is 0 where nothing was computed; before the first row of points an
    interrupt is raised as KeyboardInterrupt.

    Raises
    ------
    DataError
        If a grid is empty, not finite, not ascending or too large, or a pressure is below vacuum.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.operating_map(plant, [0.0, 300.0], [0.5e6], workers=1)
    >>> found["wn"].sizes["speed"]
    2
    """
    speeds, pressures = checked("map: speeds [rad/s]", speeds), checked("map: pressures [Pa]", pressures)
    plant.machine.gas.absolute(float(pressures[0]))
    if frequencies is not None and (not len(frequencies) or not np.all(np.isfinite(frequencies))):
        raise DataError("map: the whirl frequencies are empty or not finite; give numbers in rad/s")
    shape = (*(len(f.values) for f in fields), len(pressures), len(speeds))
    if np.prod(shape) > MOST:
        raise DataError(f"map: {np.prod(shape)} points; at most {MOST} are computed, take a coarser grid")
    machines = [with_fields(plant.machine, fields, values) for values in product(*(f.values for f in fields))]
    jobs = [(m.text, speeds, p, frequencies) for m in machines for p in pressures]
    total, done, ended = int(np.prod(shape)), 0, "complete"
    rows: dict[int, Row] = {}
    try:
        for number, row in spread(_row, jobs, useful(workers, total)):
            rows[number] = row
            done += len(row[0])
            if progress:
                progress(done, total)
    except KeyboardInterrupt:
        if not rows:
            raise
        finishing()
        ended = "interrupted"
    tables = _tables(rows, len(jobs), shape)
    every = [rows.get(number) for number in range(len(jobs))]
    critical = _padded([None if row is None else row[1] for row in every], shape)
    branches = _padded([None if row is None else row[2] for row in every], shape)
    at = AT if frequencies is None else [f"{f / (2 * np.pi):.6g} Hz" for f in frequencies]
    coords = coordinates(fields, speeds, pressures, at, plant.machine.film_names)
    return label(tables, critical, branches, coords, fields, plant.provenance() | {"kind": "map", "ended": ended})


def useful(workers: int | None, points: int) -> int:
    """Processes for a number of points: all cores when None, but none that would not pay for its start."""
    return max(1, min(workers or cores(), points // WORTH))


@lru_cache(maxsize=2)
def _plant(text: str) -> Plant:
    return Plant(Machine.from_text(text))


def _row(text: str, speeds: np.ndarray, pressure: float, frequencies: Sequence[float] | None) -> Row:
    """The points of one pressure of one machine, and the critical speeds around them."""
    plant = _plant(text)
    found = surroundings(plant, speeds, float(pressure))
    rows = []
    for k, speed in enumerate(speeds.tolist()):
        row = numbers(plant, speed, float(pressure), frequencies, found.models.get(speed))
        if row["lifted"]:
            row |= {"zeta_least": np.array(found.zeta_least[k]), "looked": np.array(found.looked[k])}
        rows.append(row)
    return rows, found.critical, found.branches


def numbers(
    plant: Plant, speed: float, pressure: float, frequencies: Sequence[float] | None, model: LinearPlant | None
) -> dict[str, np.ndarray]:
    """Values of a map at one point; without lift-off only `lifted` = 0."""
    try:
        point = _point(plant, speed, pressure, frequencies, model)
    except NoLiftOffError:
        return {"lifted": np.array(0.0)}
    rest, model = point.equilibrium, point.model
    several = len(rest.journals) > 1
    at = 3 if frequencies is None else len(frequencies)  # at rest, and at two modes where there are as many
    ratio = rest.eccentricity_ratios.max() if several else rest.eccentricity_ratio
    return {
        "lifted": np.array(1.0),
        "eccentricity_ratio": np.array(ratio),
        "h_min": np.array(rest.h_min),
        "journal": rest.journals if several else rest.journal,
        "disc": rest.disc,
        "film_force": rest.forces if several else rest.force,
        "mass_flow": rest.mass_flow,
        "wn": padded(model.wn, MODES),
        "zeta": padded(model.zeta, MODES),
        "whirl_ratio": padded(model.whirl_ratio, MODES),
        "proven": np.array(float(model.proven)),
        "static_gain": model.static_gain,
        "delay": model.delay,
        "film_frequency": padded(point.at, at),
        "film_stiffness": padded(by_film(point.K) if several else point.K, at),
        "film_damping": padded(by_film(point.C) if several else point.C, at),
    }


def by_film(values: np.ndarray) -> np.ndarray:
    """Coefficients (n, films, 2, 2) of each film out of those of all (n, 2 films, 2 films); films do not couple."""
    return np.stack([values[:, k : k + 2, k : k + 2] for k in range(0, values.shape[1], 2)], axis=1)


def padded(values: np.ndarray, count: int) -> np.ndarray:
    """The first values (count, ...) of (n, ...); NaN where there are fewer."""
    out = np.full((count, *values.shape[1:]), np.nan)
    out[: len(values)] = values[:count]
    return out


def _tables(rows: dict[int, Row], n_jobs: int, shape: tuple[int, ...]) -> dict[str, np.ndarray]:
    """Arrays (*shape, ...) of everything that any point has, NaN where a point has it not."""
    sizes = {key: value.shape for row, *_ in rows.values() for point in row for key, value in point.items()}
    tables = {key: np.full((n_jobs, shape[-1], *size), np.nan) for key, size in sizes.items()}
    done = np.zeros((n_jobs, shape[-1]))
    for number, (row, *_) in rows.items():
        done[number] = 1.0
        for k, point in enumerate(row):
            for key, value in point.items():
                tables[key][number, k] = value
    return {key: table.reshape(*shape, *table.shape[2:]) for key, table in (tables | {"done": done}).items()}


def _padded(rows: list[np.ndarray | None], shape: tuple[int, ...]) -> np.ndarray:
    """Lists (k, ...) of every pressure as one array (*shape without the speeds, k, ...), NaN where one is shorter."""
    known = [row for row in rows if row is not None]
    table = np.full((len(rows), max(map(len, known)), *known[0].shape[1:]), np.nan)
    for line, row in zip(table, rows, strict=True):
        if row is not None:
            line[: len(row)] = row
    return table.reshape(*shape[:-1], *table.shape[1:])


def coordinates(
    fields: Sequence[Field], speeds: np.ndarray, pressures: np.ndarray, at: Sequence[str], films: Sequence[str]
) -> dict[str, tuple[str, Any, dict[str, str]]]:
    """Coordinates of a map, the names of several films among them."""
    found = {f.name: (f.name, list(f.numbers), labelled(f)) for f in fields}
    return found | {
        "pressure": ("pressure", pressures, {"units": "Pa", "long_name": "supply pressure, gauge"}),
        "speed": ("speed", speeds, {"units": "rad/s", "long_name": "speed of the shaft"}),
        "axis": ("axis", ["x", "y"], {}),
        "reference": ("reference", ["x", "y"], {}),
        "to": ("to", ["x", "y"], {}),
        "at": ("at", list(at), {"long_name": "whirl frequency"}),
        "bearing": ("bearing", list(films), {"long_name": "gas bearing"}),
    }


def label(
    tables: dict[str, np.ndarray],
    critical: np.ndarray,
    branches: np.ndarray,
    coords: dict[str, Any],
    fields: Sequence[Field],
    attrs: dict[str, Any],
) -> xr.Dataset:
    """The Dataset of tables (fields..., pressure, speed, ...), of critical speeds (fields..., pressure, k, 4) and of
    branches (fields..., pressure, b, speed, 3)."""
    import xarray as xr

    over = (*(f.name for f in fields), "pressure", "speed")
    variables = {}
    for key in (k for k in VARIABLES if k in tables):
        dims, unit, text = VARIABLES[key]
        if tables[key].ndim > len(over) + len(dims):
            dims = tuple(d for dim in dims for d in (("bearing", dim) if dim == "axis" else (dim,)))
        variables[key] = ((*over, *dims), tables[key], {"units": unit, "long_name": text})
    for known, dims, values in ((CRITICAL, ("critical",), critical), (BRANCHES, ("branch", "speed"), branches)):
        for column, (key, (unit, text)) in enumerate(known.items()):
            variables[key] = ((*over[:-1], *dims), values[..., column], {"units": unit, "long_name": text})
    modes = tables["wn"].shape[-1] if "wn" in tables else 0
    extra = {"mode": ("mode", np.arange(1, modes + 1), {"long_name": "mode, by frequency"})} if modes else {}
    used = {d for dims, *_ in variables.values() for d in dims}
    return xr.Dataset(variables, {k: v for k, v in (coords | extra).items() if k in used}, attrs)


def map_machine(
    plant: Plant,
    speeds: Sequence[float] | np.ndarray,
    pressures: Sequence[float] | np.ndarray,
    fields: Sequence[Field] = (),
    frequencies: Sequence[float] | None = None,
    least_film: float | None = None,
    onset: bool = False,
    critical: bool = False,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> xr.Dataset:
    """Equilibria, modes, gains and film coefficients over a grid of operating points, with the safe region.

    Parameters
    ----------
    plant, speeds, pressures, fields, frequencies, workers, progress
        As of `operating_map`; pressure 0 alone for a machine without feed.
    least_film : float, optional
        Film [m] that counts as lift-off, 0 for what the plant runs on; None leaves the lift-off pressure out.
    onset, critical : bool
        Whether to search the onset of whirl, and the critical speeds of the orders 1, 2, 3.

    Returns
    -------
    Dataset
        That of `operating_map`, with `safe` and what is searched.

    Raises
    ------
    DataError
        For a quantity that the machine does not have, or an axis that does not ascend.

    Examples
    --------
    >>> import rotorsim as rs
    >>> found = rs.analysis.map_machine(rs.Plant("dtu_gas_bearing"), [0.0, 300.0], [0.5e6])
    >>> found["wn"].sizes["speed"]
    2
    """
    check_quantities(plant, least_film is not None, onset)
    found = safe_region(
        operating_map(
            plant, speeds, felt(machines_at_ends(plant, fields), pressures), fields, frequencies, workers, progress
        )
    )
    if found.attrs["ended"] == "complete":
        found = _more(plant, fields, found, least_film, onset, critical)
    return found


def unsafe_reasons(found: xr.Dataset) -> dict[str, xr.DataArray]:
    """Each reason not to be safe that a map knows, with the points (fields..., pressure, speed) where it holds."""
    near = f"within {100 * found.attrs.get('safe_margin', MARGIN):g} % of a critical speed"
    reasons = ("grows", "a mode grows"), ("undamped", "a mode has no damping"), ("near_critical", near)
    return {"not carried": found["lifted"] == 0} | {what: found[key] == 1 for key, what in reasons if key in found}


def unsafe_lines(found: xr.Dataset) -> list[str]:
    """Sentences on the points of a map that are not safe: how many for each reason, and where a mode grows."""
    counts = [f"{int(there.sum())} {what}" for what, there in unsafe_reasons(found).items() if there.any()]
    lines = [", ".join(counts)] if counts else []
    if "grows" in found:
        zeta, speeds = found["zeta_least"], found["speed"].values
        axes = [str(d) for d in zeta.dims if d != "speed"]
        onsets = found.get("onset_speed", zeta.isel(speed=0, drop=True) * np.nan)
        for at in product(*(range(zeta.sizes[d]) for d in axes)):
            one = dict(zip(axes, at, strict=True))
            where = growth(speeds, zeta.isel(one).values, float(onsets.isel(one)))
            stated = [_stated(found, d, found[d].values[k]) for d, k in zip(axes, at, strict=True) if zeta.sizes[d] > 1]
            lines += [f"a mode grows {where}{', at ' if stated else ''}{', '.join(stated)}"] if where else []
    return lines


def _stated(found: xr.Dataset, dimension: str, value: float) -> str:
    """A value of an axis with its unit, after its name unless it is a pressure."""
    text = show(float(f"{value:.9g}"), str(found[dimension].attrs.get("units", "1")))
    return text if dimension == "pressure" else f"{found[dimension].attrs.get('long_name', dimension)} {text}"


def machines_at_ends(plant: Plant, fields: Sequence[Field]) -> list[Machine]:
    """The machine at the first and at the last value of each field."""
    return [with_fields(plant.machine, fields, [field.values[end] for field in fields]) for end in (0, -1)]


def check_quantities(plant: Plant, with_lift_off: bool, with_onset: bool) -> None:
    """Refuse, before any computation, quantities that the machine does not have."""
    if with_onset and plant.machine.film is None:
        raise DataError("--whirl-onset: the machine has no gas film; leave the option out")
    if with_lift_off and not plant.machine.fed:
        raise DataError("--lift-off: the machine has no injectors, so no pressure lifts it; leave the option out")


def _more(
    plant: Plant, fields: Sequence[Field], found: xr.Dataset, film: float | None, with_onset: bool, critical: bool
) -> xr.Dataset:
    """The extra analyses at every value of the further axes; an interrupt keeps those before."""
    pressures, speeds = found["pressure"].values, found["speed"].values

    def crossings(plant: Plant) -> xr.Dataset:
        extra = critical_speeds(plant, pressures).rename(mode="mode_crossing", searched="crossing_searched")
        return extra.rename(
            {name: str(name).replace("critical", "crossing") for name in extra if "critical" in str(name)}
        )

    asked: list[tuple[bool, Callable[[Plant], xr.Dataset]]] = [
        (film is not None, lambda plant: _lift_off(plant, speeds, film or 0.0)),
        (with_onset, lambda plant: whirl_onset(plant, pressures)),
        (critical, crossings),
    ]
    try:
        for wanted, analysis in asked:
            if wanted:
                found = found.merge(over_fields(plant, fields, analysis))
    except KeyboardInterrupt:
        finishing()
        found = found.assign_attrs(ended="interrupted")
    return found


def _lift_off(plant: Plant, speeds: np.ndarray, film: float) -> xr.Dataset:
    import xarray as xr

    unit = {"units": "Pa", "long_name": f"pressure that leaves {film * TO_UM:.3g} um of film, gauge"}
    pressure = ("speed", lift_off(plant, speeds, least_film=film), unit)
    return xr.Dataset({"lift_off_pressure": pressure}, {"speed": speeds})
