"""Records in which an effect is hidden: made on a finer grid and step than a diagnosis uses, with another calibration.

The truth goes to a folder of its own beside the records, which `diagnose` never opens.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identification import make_record
from rotorsim.discrepancy.calibration import MESH, calibration
from rotorsim.discrepancy.candidates import Form, candidates
from rotorsim.discrepancy.comparison import Point
from rotorsim.discrepancy.design import Planned, campaign
from rotorsim.discrepancy.knobs import DIRECTIONS, Knob, contributions, setting
from rotorsim.discrepancy.trial import find_period
from rotorsim.discrepancy.turning import in_motion
from rotorsim.discrepancy.twin import Twin
from rotorsim.errors import DataError, NoLiftOffError
from rotorsim.machine import Machine, load_machine
from rotorsim.plant.columns import COLUMNS
from rotorsim.plant.equilibrium import settle
from rotorsim.plant.simulation import Simulation, split_columns
from rotorsim.sampling import SAMPLE

if TYPE_CHECKING:
    import xarray as xr

GRID, STEP = (48, 16), 5e-5
"""Grid and step [s] of hidden records; a diagnosis works on 32x8 and 0.2 ms and proves it on 32x16 and 0.1 ms."""
SHARE_OF_PRIOR = 0.3
"""The hidden machine's calibration is off by so many of the priors' standard deviations (one standard deviation)."""
SIZES = (2.0, 8.0)
"""Range of hidden amplitudes in steps of the candidates."""
TILE = 2000
"""Samples of a period of the campaign's excitation, in which it makes whole turns."""
SCATTER = ("noise.0.sigma", "quantisation.0.step")
Disturb = Callable[[np.ndarray, Planned], np.ndarray]


@dataclass(frozen=True)
class Truth:
    """What is hidden: forms with the values of their knobs, the machine's other calibration, seed."""

    forms: tuple[Form, ...]
    amplitudes: tuple[tuple[float, ...], ...]
    point: Point
    seed: int

    def told(self, twin: Twin) -> dict[str, Any]:
        """As it is sealed."""
        own = {key: v for key, v in setting(twin, contributions(self.point.values, 0.0, 0.0), self.point.fixed).items()}
        return {
            "effects": [f.effect for f in self.forms],
            "forms": [f.label for f in self.forms],
            "knobs": {k.name: v for k, v in self.point.values.items()},
            "parameters": own,
            "seed": self.seed,
        }


def truth_twin(machine: Machine, effects: Sequence[str] | None = None) -> Twin:
    """The plant that hidden records come from: finer than that of a diagnosis, with the sensors' scatter."""
    grid = GRID if machine.film is not None else (32, 8)
    return Twin(machine, grid, STEP, scatter=True, only=None if effects is None else tuple(sorted(effects)))


def draw(
    twin: Twin, effects: Sequence[str], seed: int, sizes: tuple[float, float] = SIZES, off: float = SHARE_OF_PRIOR
) -> Truth:
    """Draw forms and sizes of the effects, and another calibration; raises DataError for an unknown effect."""
    rng = np.random.default_rng([seed, 7])
    forms: list[Form] = []
    amplitudes: list[tuple[float, ...]] = []
    values: dict[Knob, float] = {}
    fixed: dict[str, float] = {}
    every = candidates(twin)
    for name in effects:
        own = [f for f in every if name in (f.effect, f.key)]
        if not own:
            known = ", ".join(sorted({f.effect for f in every}))
            raise DataError(f"hide: '{name}' cannot be hidden in {twin.machine.name}; choose one of {known}")
        form = own[int(rng.integers(len(own)))]
        size = float(np.exp(rng.uniform(*np.log(sizes))))
        v = _amplitude(form, size, rng)
        forms.append(form)
        amplitudes.append(tuple(v))
        values.update(dict(zip(form.knobs, map(float, v), strict=True)))
        fixed.update(form.fixed)
    for knob in calibration(twin):
        if knob.key in DIRECTIONS:
            values[knob] = float(rng.normal(0, 1e-6))
        elif knob != MESH and not knob.trend:
            values[knob] = float(np.clip(rng.normal(0, off), -2 * off, 2 * off) * knob.sd)
    return Truth(tuple(forms), tuple(amplitudes), Point(values, fixed), seed)


def _amplitude(form: Form, size: float, rng: np.random.Generator) -> np.ndarray:
    steps = np.array([k.step for k in form.knobs])
    if len(steps) == 2:
        turned = rng.uniform(0, 2 * np.pi)
        return np.asarray(size * steps * [np.cos(turned), np.sin(turned)])
    sign = 1.0 if form.knobs[0].low >= 0 or rng.uniform() < 0.5 else -1.0
    return np.asarray(np.clip(sign * size * steps, form.knobs[0].low, form.knobs[0].high))


def record_of(
    twin: Twin, planned: Planned, point: Point, seed: int, disturb: Disturb | None = None, tiled: bool = False
) -> xr.Dataset:
    """A record of the hidden machine as a rig would give it: measured channels only; raises NoLiftOffError.

    A record that is `tiled` is one period of the response of a machine that has been running, again and again, with
    noise drawn beside the plant: what the whole run gives where nothing remembers longer, at a third of its cost.
    """
    speed, pressure = planned.experiment.initial()
    rows = planned.experiment.rows(0, planned.experiment.samples)
    own = setting(twin, contributions(point.values, speed, pressure), point.fixed)
    tiled = tiled and disturb is None and find_period(rows[:, 2:4]) == TILE
    tiled = tiled and not twin.lingers(own, True)
    if tiled:
        table = _tiled(twin, own, rows, (speed, pressure), 1000 * seed + planned.noise)
    else:
        fed = rows if disturb is None else disturb(rows.copy(), planned)
        a = twin.set(own)
        w = in_motion(a, settle(a, speed, pressure), speed, pressure)
        w[a.rig.seed] = 1000 * seed + planned.noise
        table = Simulation(a, w).advance(fed)
    values = split_columns(table, rows, twin.machine.film is not None)
    keep = ("disc_measured", "angle_measured", "speed_measured", "pressure_measured", "reference", "disc_force")
    shown = {name: values[name] for name in keep if name in values}
    for knob, value in point.values.items():
        if knob.key.startswith("offset_"):
            shown["disc_measured"][:, "xy".index(knob.key[-1])] += value
    attrs = {"role": planned.role, "record": planned.name, "sample_rate_hz": 1 / SAMPLE}
    return make_record(np.arange(len(rows)) * SAMPLE, shown, attrs | planned.experiment.attrs())


def _tiled(twin: Twin, own: dict[str, float], rows: np.ndarray, point: tuple[float, float], seed: int) -> np.ndarray:
    """A table of samples made of one period, without the scatter of the displacement sensors, which is added."""
    sigma, step = (own.get(key, getattr(twin.effect(key.split(".")[0], 0), key.split(".")[2])) for key in SCATTER)
    a = twin.set({**own, **dict.fromkeys(SCATTER, 0.0)})
    short = Simulation(a, settle(a, *point)).advance(rows[: 3 * TILE])
    number = np.arange(len(rows))
    table = short[2 * TILE + number % TILE]
    for name in ("angle", "angle_measured"):
        turned = short[2 * TILE :, COLUMNS.index(name)] - short[2 * TILE, COLUMNS.index(name)]
        table[:, COLUMNS.index(name)] = turned[number % TILE] + number // TILE * (TILE * SAMPLE * point[0])
    first = COLUMNS.index("disc_measured_x")
    noisy = table[:, first : first + 2] + np.random.default_rng(seed).normal(0, sigma, (len(rows), 2))
    table[:, first : first + 2] = np.round(noisy / step) * step if step else noisy
    return table


def hide(
    machine: Machine | str | Path,
    effects: Sequence[str] = (),
    seed: int = 0,
    out: str | Path | None = None,
    sizes: tuple[float, float] = SIZES,
    truth: Truth | None = None,
    disturb: Disturb | None = None,
    twin: Twin | None = None,
    progress: Callable[[int, int], None] | None = None,
    tiled: bool = False,
) -> list[xr.Dataset]:
    """Records of a machine in which effects are hidden.

    Parameters
    ----------
    machine : Machine or name or path
        What the user believes the machine to be.
    effects : names
        Effects, or forms of them such as "runout.second"; none for a machine in which nothing is missing.
    seed : int
        Draws form, size and phase of the effects, the machine's other calibration and the sensors' noise.
    out : folder
        Records go to `out/records`, the truth to `out/sealed/truth.json`; nowhere when not given.
    sizes : (least, most)
        Range of amplitudes in steps of the candidates.
    truth, disturb, twin :
        Instead of a draw; a change of the inputs that the records do not tell; a truth plant to use again.
    tiled : bool
        Run one period of each periodic record only, and repeat it (`record_of`).

    Returns
    -------
    list of Dataset
        Records with attributes `role` (fit, held_out, untouched) and `record`.
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


def write(folder: Path, records: Sequence[xr.Dataset], truth: Truth, twin: Twin) -> None:
    """Records and the sealed truth; raises DataError where there are some already."""
    target, sealed = folder / "records", folder / "sealed"
    if target.exists() or sealed.exists():
        raise DataError(f"{folder}: has hidden records already; choose another --out")
    target.mkdir(parents=True)
    sealed.mkdir()
    for record in records:
        record.to_netcdf(target / f"{record.attrs['record']}.nc", engine="h5netcdf")
    (sealed / "truth.json").write_text(json.dumps(truth.told(twin), indent=2, default=float), encoding="utf-8")


def scaled(truth: Truth, factor: float) -> Truth:
    """The same truth with hidden amplitudes times a factor."""
    values = dict(truth.point.values)
    for form in truth.forms:
        for knob in form.knobs:
            values[knob] *= factor
    return replace(truth, point=replace(truth.point, values=values))
