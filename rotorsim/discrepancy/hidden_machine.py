"""Records with hidden effects, simulated on a finer grid and step than a diagnosis, with another calibration.

The truth goes to a folder of its own next to the records, which `diagnose` never opens.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification import make_record
from rotorsim.base.errors import DataError, NoLiftOffError
from rotorsim.base.files import make_folder, replacing_all, write_json
from rotorsim.base.hdf5 import write_netcdf
from rotorsim.base.input_files import parse_json
from rotorsim.base.units import RIG_SAMPLE
from rotorsim.discrepancy.calibration import (
    DIRECTIONS,
    MESH,
    FitParameter,
    ParameterPoint,
    calibration,
)
from rotorsim.discrepancy.candidates import Form, candidates
from rotorsim.discrepancy.experiments import PlannedRecord, campaign
from rotorsim.discrepancy.trial import find_period
from rotorsim.discrepancy.twin import Twin, in_motion
from rotorsim.effects import REGISTRY, Effect
from rotorsim.machine import Machine, load_machine
from rotorsim.plant.kernels.layout import COLUMNS
from rotorsim.plant.simulation import Simulation, settle, split_columns

if TYPE_CHECKING:
    import xarray as xr

GRID, STEP = (48, 16), 5e-5
"""Grid and step [s] of hidden records; a diagnosis works on 32x8 and 0.2 ms and proves it on 64x16 and 0.1 ms."""
SHARE_OF_PRIOR = 0.3
"""Standard deviation of the hidden machine's calibration, in standard deviations of the priors."""
SIZES = (2.0, 8.0)
"""Range of hidden amplitudes in steps of the candidates."""
RANDOM = ("random_force", "drive")
"""Ports of effects whose random numbers move the shaft."""
TILE = 2000
"""Samples of a period of the campaign's excitation, in which it makes whole turns."""
BALANCED = 1e-3
"""Mean of an excitation, as a share of its largest value, up to which nothing creeps."""
Disturb = Callable[[np.ndarray, PlannedRecord], np.ndarray]
"""Function that changes the inputs (n, 6) of a planned record."""


@dataclass(frozen=True)
class HiddenTruth:
    """Hidden truth of a blind test: forms with their parameter values, the changed calibration, seed."""

    forms: tuple[Form, ...]
    amplitudes: tuple[tuple[float, ...], ...]
    point: ParameterPoint
    seed: int

    def as_dict(self, twin: Twin) -> dict[str, Any]:
        """Plain numbers and text of the truth, as they are sealed."""
        return {
            "effects": [f.effect for f in self.forms],
            "forms": [f.label for f in self.forms],
            "fit_parameters": {k.name: v for k, v in self.point.values.items()},
            "fixed": dict(self.point.fixed),
            "parameters": self.point.setting(twin),
            "seed": self.seed,
        }


@dataclass(frozen=True)
class SealedTruth:
    """Part of a sealed truth that makes further records of the same machine: point and seed."""

    point: ParameterPoint
    seed: int


def read_truth(path: Path) -> SealedTruth:
    """Machine of a sealed truth; raises DataError where it cannot be read."""
    try:
        table = parse_json(path.read_text(encoding="utf-8-sig"))
        values = {FitParameter(str(name), 1.0): float(v) for name, v in table["fit_parameters"].items()}
        fixed = {str(name): float(v) for name, v in table["fixed"].items()}
        return SealedTruth(ParameterPoint(values, fixed), int(table["seed"]))
    except OSError as error:
        raise DataError(
            f"{path}: cannot be read ({error.strerror}); give the folder that rotorsim hide has made",
            argument="rig",
            value=str(path),
        ) from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DataError(
            f"{path}: is not the truth of hidden records; make them anew with rotorsim hide",
            argument="rig",
            value=str(path),
        ) from error


def truth_twin(machine: Machine, effects: Sequence[str] | None = None) -> Twin:
    """Plant for hidden records, on a finer grid and step than a diagnosis and with sensor noise."""
    grid = GRID if machine.film is not None else (32, 8)
    return Twin(machine, grid, STEP, scatter=True, only=None if effects is None else tuple(sorted(effects)))


def draw(
    twin: Twin, effects: Sequence[str], seed: int, sizes: tuple[float, float] = SIZES, off: float = SHARE_OF_PRIOR
) -> HiddenTruth:
    """Random forms and sizes of hidden effects and a changed calibration; raises DataError for an unknown effect."""
    rng = np.random.default_rng([seed, 7])
    forms: list[Form] = []
    amplitudes: list[tuple[float, ...]] = []
    values: dict[FitParameter, float] = {}
    fixed: dict[str, float] = {}
    every = candidates(twin)
    for name in effects:
        own = [f for f in every if name in (f.effect, f.key)]
        if not own:
            known = ", ".join(sorted({f.effect for f in every}))
            raise DataError(
                f"hide: '{name}' cannot be hidden in {twin.machine.name}; choose one of {known}",
                argument="effects",
                value=name,
            )
        form = own[int(rng.integers(len(own)))]
        size = float(np.exp(rng.uniform(*np.log(sizes))))
        v = _amplitude(form, size, rng)
        forms.append(form)
        amplitudes.append(tuple(v))
        values.update(dict(zip(form.parameters, map(float, v), strict=True)))
        fixed.update(form.fixed)
    for parameter in calibration(twin):
        if parameter.key in DIRECTIONS:
            values[parameter] = float(rng.normal(0, 1e-6))
        elif parameter != MESH and not parameter.trend:
            values[parameter] = float(np.clip(rng.normal(0, off), -2 * off, 2 * off) * parameter.sd)
    return HiddenTruth(tuple(forms), tuple(amplitudes), ParameterPoint(values, fixed), seed)


def _amplitude(form: Form, size: float, rng: np.random.Generator) -> np.ndarray:
    steps = np.array([k.step for k in form.parameters])
    if len(steps) == 2:
        turned = rng.uniform(0, 2 * np.pi)
        return np.asarray(size * steps * [np.cos(turned), np.sin(turned)])
    sign = 1.0 if form.parameters[0].low >= 0 or rng.uniform() < 0.5 else -1.0
    return np.asarray(np.clip(sign * size * steps, form.parameters[0].low, form.parameters[0].high))


def record_of(
    twin: Twin,
    planned: PlannedRecord,
    point: ParameterPoint,
    seed: int,
    disturb: Disturb | None = None,
    tiled: bool = False,
    changes: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Record of the hidden machine with measured channels only; raises NoLiftOffError.

    A record that is `tiled` is one period of the response of a machine that has been running, again and again, with
    noise drawn outside the plant: equal to the whole run if no state lasts longer, at a third of its cost. `changes`
    are made on purpose, by key of `calibration`.
    """
    speed, pressure = planned.experiment.initial()
    rows = planned.experiment.rows(0, planned.experiment.samples)
    own = point.setting(twin, speed, pressure, changes)
    tiled = tiled and disturb is None and find_period(rows[:, 2:4]) == TILE
    drive = rows[-TILE:, 2:4]
    balanced = bool(np.abs(drive.mean(axis=0)).max() <= BALANCED * max(np.abs(drive).max(), 1e-300))
    still = unshaken(twin, own)  # no period of a motion with random forces is the next
    tiled = tiled and not twin.lingers(own, balanced) and not still
    if tiled:
        table = _tiled(twin, own, rows, (speed, pressure), 1000 * seed + planned.noise)
    else:
        fed = rows if disturb is None else disturb(rows.copy(), planned)
        rest = twin.set({**own, **still})
        w = in_motion(rest, settle(rest, speed, pressure), speed, pressure)
        a = twin.set(own) if still else rest
        w[a.rig.seed] = 1000 * seed + planned.noise
        table = Simulation(a, w).advance(fed)
    values = split_columns(twin.assembly, table, rows)
    keep = ("disc_measured", "angle_measured", "speed_measured", "pressure_measured", "reference", "disc_force")
    shown = {name: values[name] for name in keep if name in values}
    for parameter, value in point.values.items():
        if parameter.key.startswith("offset_"):
            shown["disc_measured"][:, "xy".index(parameter.key[-1])] += value
    attrs = {"role": planned.role, "record": planned.name, "sample_rate_hz": 1 / RIG_SAMPLE}
    return make_record(np.arange(len(rows)) * RIG_SAMPLE, shown, attrs | planned.experiment.attrs())


def _tiled(twin: Twin, own: dict[str, float], rows: np.ndarray, point: tuple[float, float], seed: int) -> np.ndarray:
    """A table of samples made of one period, without the scatter of the displacement sensors, which is added."""
    scatter, quiet = _scatter(twin, own)
    a = twin.set({**own, **quiet})
    short = Simulation(a, settle(a, *point)).advance(rows[: 3 * TILE])
    number = np.arange(len(rows))
    table = short[2 * TILE + number % TILE]
    for name in ("angle", "angle_measured"):
        turned = short[2 * TILE :, COLUMNS.index(name)] - short[2 * TILE, COLUMNS.index(name)]
        table[:, COLUMNS.index(name)] = turned[number % TILE] + number // TILE * (TILE * RIG_SAMPLE * point[0])
    first = COLUMNS.index("disc_measured_x")
    rng, readings = np.random.default_rng(seed), table[:, first : first + 2]
    for effect in scatter:
        readings = effect.scatter(readings, rng)
    table[:, first : first + 2] = readings
    return table


def unshaken(twin: Twin, own: dict[str, float]) -> dict[str, float]:
    """Setting that makes the random forces and the wander of the speed neutral which a setting has; empty without."""
    found = {}
    for name, tables in twin.equipped[0].effects.items():
        kind = REGISTRY[name]
        for number, table in enumerate(tables if kind.port in RANDOM else ()):
            key = f"{name}.{number}.{kind.random_part}"
            if own.get(key, getattr(table, kind.random_part)):
                found[key] = 0.0
    return found


def _scatter(twin: Twin, own: dict[str, float]) -> tuple[list[Any], dict[str, float]]:
    """Effects that scatter the displacement readings, as set, and the setting that makes them neutral."""
    effects: list[Any] = []
    quiet: dict[str, float] = {}
    for name, kind in REGISTRY.items():
        if name in twin.equipped[0].effects and kind.scatter is not Effect.scatter:
            filed: Any = twin.effect(name, 0)
            numbers = {f.name: f"{name}.0.{f.name}" for f in fields(filed)}
            effects.append(replace(filed, **{p: own[key] for p, key in numbers.items() if key in own}))
            quiet |= {key: float(getattr(kind(), p)) for p, key in numbers.items()}
    return effects, quiet


def hide(
    machine: Machine | str | Path,
    effects: Sequence[str] = (),
    seed: int = 0,
    out: str | Path | None = None,
    sizes: tuple[float, float] = SIZES,
    truth: HiddenTruth | None = None,
    disturb: Disturb | None = None,
    twin: Twin | None = None,
    progress: Callable[[int, int], None] | None = None,
    tiled: bool = False,
) -> list[xr.Dataset]:
    """Records of a machine with hidden effects.

    Parameters
    ----------
    machine : Machine or name or path
        What the user believes the machine to be.
    effects : names
        Effects, or forms of them such as "runout.amplitude_2x"; none for a machine in which nothing is missing.
    seed : int
        Draws form, size and phase of the effects, the machine's other calibration and the sensors' noise.
    out : folder
        Records go to `out/records`, the truth to `out/sealed/truth.json`; nowhere when not given.
    sizes : (least, most)
        Range of amplitudes in steps of the candidates.
    truth, disturb, twin :
        Instead of a draw; a change of the inputs that the records do not state; a truth plant to use again.
    tiled : bool
        Run one period of each periodic record only, and repeat it (`record_of`).

    Returns
    -------
    list of Dataset
        Records with attributes `role` (fit, held_out, untouched) and `record`.

    Examples
    --------
    >>> import rotorsim as rs
    >>> rs.hide(machine, ("coupling.force_2x",), seed=3, out="puzzle")  # doctest: +SKIP
    """
    machine = machine if isinstance(machine, Machine) else load_machine(machine)
    twin = twin or truth_twin(machine)
    truth = truth or draw(twin, effects, seed, sizes)
    plan, records = campaign(machine), []
    for i, planned in enumerate(plan):
        try:
            records.append(record_of(twin, planned, truth.point, seed, disturb, tiled))
        except NoLiftOffError as error:
            raise DataError(f"hide: with seed {seed} {error}; choose another seed") from error
        if progress is not None:
            progress(i + 1, len(plan))
    if out is not None:
        write(Path(out), records, truth, twin)
    return records


def write(folder: Path, records: Sequence[xr.Dataset], truth: HiddenTruth, twin: Twin) -> None:
    """Write records and sealed truth together; raises DataError if records exist, or WriteError."""
    if (folder / "records").exists() or (folder / "sealed").exists():
        raise DataError(f"{folder}: has hidden records already; choose another folder")
    with replacing_all(folder, ("sealed", "records")) as part:
        for record in records:
            write_netcdf(make_folder(part / "records") / f"{record.attrs['record']}.nc", record)
        write_json(make_folder(part / "sealed") / "truth.json", truth.as_dict(twin), default=float)
