"""Cases of the control study that worker processes compute: plain arguments in, plain JSON out.

Cites: thesis.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from identification import load_model
from rotorsim.analysis import critical_speeds, whirl_onset
from rotorsim.base.errors import DataError
from rotorsim.base.units import KRPM, RIG_SAMPLE, TO_UM
from rotorsim.control import DesignError, Law, load_law, runout_table
from rotorsim.control.catalogue import make_spec, module_of
from rotorsim.control.designs import p
from rotorsim.control.sampled_loop import overview
from rotorsim.experiments import slow_roll
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.plant.simulation import split_columns
from rotorsim.report.control import spectra_of
from rotorsim.signals import MissingError, decay_of, mode_pair
from rotorsim.verify import closed_loop
from rotorsim.verify.closed_loop import other_machines
from rotorsim.verify.runs import Run, run_rows, steady_rows
from rotorsim.verify.transients import (
    PULSE,
    ImpactResponse,
    amplitude,
    amplitudes,
    changing,
    impact_answers,
    impact_responses,
    ring_down,
    runup,
    safe_speed,
)

Point = tuple[float, float]
SIZES = (1.0, 5.0, 20.0)
"""Peaks [N] of hits that show whether the film is linear."""
SIZE_POINTS = ((0.0, 0.3e6), (3 * KRPM, 0.3e6), (3 * KRPM, 0.5e6))
RING_DOWN = 5.0
"""Peak [N] of the hits whose damping is compared with the thesis', which does not print its own."""
RING_TIME = 0.4
"""Duration [s] of an answer whose modes or decrement are read: two of them 6 Hz apart beat twice."""
SLOW = 0.1 * KRPM
"""Rate [rad/s^2] of the thesis' run-up (E.5.2)."""
BANDS = {"third": (33.0, 48.0), "half": (50.0, 75.0)}
"""Speeds [Hz] between which the peaks near one third and one half of the critical speeds are looked for."""
WINDOW = 0.5
"""Length [s] of a stretch whose amplitude counts."""
SHOWN = 400.0
"""Highest frequency [Hz] of a waterfall."""
MOST_DAMPED = 0.979
"""A damping ratio of a fit of two modes from here on is the fit's bound and none."""
SLOW_ROLL, TURNS = 0.2 * KRPM, 5
"""Speed [rad/s] and turns of the slow roll that a runout table is made of; the thesis' is below 200 rpm (2.6.2)."""
FAST, COAST = 2 * KRPM, 0.04 * KRPM
"""Rates [rad/s^2] of a fast run-up (Paper F, as here) and of the thesis' coast-down (E.5.2)."""
COAST_END = 5.5 * KRPM
"""Speed [rad/s] at which the coast-down ends, below both critical speeds at 0.3 MPa (Table E.2)."""
VOLTS = np.concatenate([np.arange(-5, 5), np.arange(5, -6, -1)])
"""References [V] of a staircase up and down over their whole range (E.2.1)."""
STEP, SETTLED = 0.3, 0.1
"""Duration of a step of the staircase and its last part that is averaged [s]."""


def design(model_path: str, name: str, preset: str, changes: list[str], out: str) -> dict[str, Any]:
    """Write the law of a design; its findings, or why it was refused."""
    model = load_model(model_path)
    try:
        law = module_of(name).design(model, make_spec(name, changes, preset))
    except DesignError as error:
        return {"refused": str(error)}
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    law.save(out)
    return {"overview": overview(law, model) if name != "youla" else {}, "order": law.order}


def hits(machine: str, law: str, points: list[Point], near_film: bool = False) -> list[dict[str, Any]]:
    """Responses to hits of the disc, or with `near_film` of the shaft next to it, at operating points [rad/s, Pa]."""
    plant = _plant(machine)
    position = next_to_film(plant) if near_film else None
    return [asdict(impact_responses(plant, _law(law), *q, position=position)) for q in points]


def next_to_film(plant: Plant) -> float:
    """Position [m] of the film's end towards the disc: as close to the bearing as a hammer comes."""
    film, disc = plant.machine.films[0], plant.machine.discs[0]
    return float(film.position + np.copysign(film.length / 2, disc.position - film.position))


def ring_downs(machine: str, law: str, points: list[Point]) -> list[dict[str, Any]]:
    """Natural frequency [rad/s] and damping ratio of the disc after hits along x and y at operating points."""
    return ringing(_plant(machine), _law(law), points)


def ringing(plant: Plant, law: Law | None, points: Iterable[Point]) -> list[dict[str, Any]]:
    """The same of a plant and a law."""
    rows = []
    for speed, pressure in points:
        answers = impact_answers(plant, law, speed, pressure, RING_DOWN)
        wn, zeta = zip(*map(ring_down, answers), strict=True)
        rows.append({"speed": speed, "pressure": pressure, "wn": wn, "zeta": zeta})
    return rows


def fits(machine: str, law: str, points: list[Point]) -> list[dict[str, Any]]:
    """Ring-downs after hits next to the film, read as the thesis reads them, at operating points [rad/s, Pa]."""
    return fitted(_plant(machine), _law(law), points)


def fitted(plant: Plant, law: Law | None, points: Iterable[Point]) -> list[dict[str, Any]]:
    """The same of a plant and a law: `wn` [rad/s] and `zeta` (2,) of a fit of two modes to the answers to hits along x
    and y, added, slowest first; `decrement`, the damping ratio of y by the logarithmic decrement."""
    rows = []
    for speed, pressure in points:
        x, y = impact_answers(plant, law, speed, pressure, RING_DOWN, next_to_film(plant), RING_TIME)
        free = round(PULSE / plant.machine.sampling_time)
        time = np.arange(len(x) - free) * plant.machine.sampling_time
        wn, zeta = two_modes(time, (x + y)[free:])
        rows.append({"speed": speed, "pressure": pressure, "wn": wn, "zeta": zeta,
                     "decrement": decrement(time, y[free:])})  # fmt: skip
    return rows


def two_modes(time: np.ndarray, motion: np.ndarray) -> tuple[list[float], list[float]]:
    """Natural frequencies [rad/s] and damping ratios of a fit of two modes; NaN where there is none or at its bound."""
    if not np.isfinite(motion).all():
        return [np.nan] * 2, [np.nan] * 2
    found = mode_pair(time, motion)
    zeta = np.where(found.zeta < MOST_DAMPED, found.zeta, np.nan)
    return (2 * np.pi * found.frequency).tolist(), zeta.tolist()


def decrement(time: np.ndarray, motion: np.ndarray) -> float:
    """Damping ratio of y in a motion (n, 2) by the logarithmic decrement; without its extremes, that of the mode of a
    fit of two which y shows most."""
    if not np.isfinite(motion).all():
        return float("nan")
    try:
        return decay_of(time, motion[:, 1]).zeta
    except MissingError:
        wn, zeta = map(np.array, two_modes(time, motion))
    if not np.isfinite(zeta).all():
        return float("nan")
    waves = np.exp(np.outer(time, wn * (-zeta + 1j * np.sqrt(1 - zeta**2))))
    basis = np.hstack([waves.real, waves.imag])
    size = np.linalg.lstsq(basis, motion[:, 1], rcond=None)[0].reshape(2, 2)
    return float(zeta[np.hypot(*size).argmax()])


def hits_by_size(machine: str, law: str) -> list[dict[str, Any]]:
    """Impact responses of the open loop and of a law for hits of several sizes."""
    rows = []
    for speed, pressure in SIZE_POINTS:
        for peak in SIZES:
            pair = [impact_responses(_plant(machine), one, speed, pressure, peak) for one in (None, _law(law))]
            row: dict[str, Any] = {"speed": speed, "pressure": pressure, "peak": peak, "largest": pair[1].largest}
            row |= {"open": pair[0].response, "closed": pair[1].response}
            rows.append(row | {"damping": (pair[0].damping, pair[1].damping)})
    return rows


def run_up(machine: str, law: str, point: Point, table: bool = False) -> dict[str, Any]:
    """A slow run-up: imbalance amplitude (2,) [m] at its end; speeds (2,) [Hz] of the largest amplitude in BANDS.

    With `table` the law takes off the runout that a slow roll of the plant shows.
    """
    (speed, pressure), plant, held = point, _plant(machine), _law(law)
    if table and held is not None:
        slow = slow_roll(plant, speed=SLOW_ROLL, pressure=pressure, revolutions=TURNS)
        held = held.with_(runout=runout_table(slow))
    run = runup(plant, held, SLOW, pressure, speed, down=False)
    n = len(run.table)
    return {"amplitude": amplitudes(run, n - round(0.35 / RIG_SAMPLE), n).tolist(), "ended": run.ended} | peaks(run)


def peaks(run: Run) -> dict[str, list[float]]:
    """Speed [Hz] in each band at which the disc moves most, along x and y."""
    window = round(WINDOW / RIG_SAMPLE)
    n = len(run.table) // window
    moved = np.ptp(run.disc[: n * window].reshape(n, window, 2), axis=1)
    speed = run.column("speed")[: n * window].reshape(n, window).mean(axis=1) / (2 * np.pi)
    found = {}
    for name, (low, high) in BANDS.items():
        inside = (speed > low) & (speed < high)
        found[name] = speed[inside][moved[inside].argmax(axis=0)].tolist() if inside.any() else [np.nan, np.nan]
    return found


def extension(machine: str, law: str, bias: tuple[float, float] = (0.0, 0.0)) -> dict[str, Any]:
    """Run-up until the safety circle is left, onset of whirl, spectra over speed (thesis Paper F)."""
    plant, one = _plant(machine), _law(law)
    held = one.with_(bias=tuple(bias)) if one is not None and any(bias) else one
    found = safe_speed(plant, held, stop=36 * KRPM, rate=2 * KRPM)
    speed, share = onset(found.run.disc, found.run.column("speed")) or (None, None)
    return {"speed": found.speed, "left": found.left, "why": found.why, "ended": found.run.ended, "onset": speed,
            "share": share, "touched": found.run.touched, "spectra": spectra(found.run)}  # fmt: skip


def onset(disc: np.ndarray, speed: np.ndarray) -> tuple[float, float] | None:
    """Speed [rad/s] from which on the largest line stays below 0.7 of the shaft's, and its share of it there."""
    window = round(0.2 / RIG_SAMPLE)
    n = len(disc) // window
    y = disc[: n * window, 1].reshape(n, window)
    heights = np.abs(np.fft.rfft((y - y.mean(axis=1, keepdims=True)) * np.hanning(window), axis=1))
    frequency, mean = np.fft.rfftfreq(window, RIG_SAMPLE), speed[: n * window].reshape(n, window).mean(axis=1)
    share = frequency[heights.argmax(axis=1)] * 2 * np.pi / mean
    below = share < 0.7
    if not below[-1]:
        return None
    first = n - int(np.argmin(np.append(below[::-1], False)))
    return float(mean[first]), float(share[first])


def whirl(machine: str, pressures: list[float]) -> dict[str, list[float]]:
    """Onset over first critical speed, and whirl over shaft speed there, by pressure, from the linearised plant."""
    plant, at = _plant(machine), np.array(pressures)
    found, first = whirl_onset(plant, at), critical_speeds(plant, at, (1,)).critical_speed.values[:, 0, 0]
    return {"onset": (found.onset_speed.values / first).tolist(), "frequency": found.onset_ratio.values.tolist()}


def coast(machine: str, point: Point) -> dict[str, bool]:
    """Whether a fast run-up to a point rubs or ends on the way, and whether a slow coast-down from there rubs."""
    (top, pressure), plant = point, _plant(machine)
    Ts = plant.machine.sampling_time
    up = run_rows(plant, None, changing((0.0, top), (pressure, pressure), top / FAST, Ts))
    down = run_rows(plant, None, changing((top, COAST_END), (pressure, pressure), (top - COAST_END) / COAST, Ts))
    return {"up": bool(up.touched or up.ended), "down": bool(down.touched or down.ended)}


def static_map(machine: str, point: Point) -> dict[str, Any]:
    """Errors [um] of a linear map from the pins' differences to the disc's equilibrium over staircases along x and y.

    `largest` of all, `rms` (2, 2) by axis of the disc and of the references; `gain` (2, 2) of disc per pins [m/m].
    """
    (speed, pressure), plant = point, _plant(machine)
    Ts = plant.machine.sampling_time
    step, last = round(STEP / Ts), round(SETTLED / Ts)
    errors, gains = np.zeros((2, 2, len(VOLTS))), np.zeros((2, 2))
    for axis in range(2):
        rows = steady_rows(speed, pressure, len(VOLTS) * STEP, Ts)
        rows[:, 2 + axis] = np.repeat(VOLTS, step)
        run = run_rows(plant, None, rows)
        if run.ended:
            raise DataError(f"static map: a staircase of {VOLTS.max():g} V {run.ended}")
        u = pin_differences(plant, run)[:, axis].reshape(-1, step)[:, -last:].mean(axis=1)
        p = run.pair("disc_measured").reshape(-1, step, 2)[:, -last:].mean(axis=1)
        line = np.column_stack([u, np.ones_like(u)])
        found = np.linalg.lstsq(line, p, rcond=None)[0]
        errors[:, axis], gains[:, axis] = TO_UM * (p - line @ found).T, found[0]
    return {"largest": float(np.abs(errors).max()), "rms": np.sqrt(np.mean(errors**2, axis=2)).tolist(),
            "gain": gains.tolist()}  # fmt: skip


def pin_differences(plant: Plant, run: Run) -> np.ndarray:
    """Differences (n, 2) [m] of opposite pins along x and y, as their sensors read them where there are any."""
    values = split_columns(plant.assembly, run.table, run.rows)
    pins, found = np.asarray(values.get("pin_measured", values["pin"])), np.zeros((len(run.table), 2))
    for k, injector in enumerate(plant.machine.injectors):
        found[:, "xy".index(injector.reference[1])] += pins[:, k] * (1 if injector.reference[0] == "+" else -1)
    return found


def spectra(run: Run) -> dict[str, list[Any]]:
    """Speeds [rad/s], frequencies [Hz] and amplitudes [um] of y for a waterfall."""
    speed, frequency, heights = spectra_of(run, SHOWN)
    return {"speed": speed.round(2).tolist(), "frequency": frequency.tolist(), "heights": heights.round(3).tolist()}


def cell(machine: str, law: str, point: Point) -> float:
    """Imbalance amplitude [m] of the disc at a constant point, on the machine whose sensors see no runout."""
    run = run_rows(_plant(_without_runout(machine)), _law(law), steady_rows(*point, 3.0))
    half, n = len(run.table) // 2, len(run.table)
    return amplitude(run, half, n)


def _without_runout(machine: str) -> str:
    """The machine file with a round and smooth disc under the sensors."""
    changed = Machine.from_text(machine)
    for name in ("amplitude_1x", "amplitude_2x", "amplitude_3x", "roughness"):
        if name in tomllib.loads(machine).get("effects", {}).get("runout", {}):
            changed = changed.replace(f"effects.runout.{name}", "0 um")
    return changed.text


def machine_code(machine: str) -> list[str]:
    """Make, once for all processes, the machine code of the plants that a verification runs besides its own."""
    names = []
    for name, plant in other_machines(_plant(machine)):
        for law in (None, p.make(p.Spec())):
            run_rows(plant, law, steady_rows(0.0, 0.5e6, RIG_SAMPLE))
        names.append(name)
    return names


def verification(machine: str, law: str, before: list[dict[str, Any]], after: list[dict[str, Any]]) -> dict[str, Any]:
    """The rows of a full verification whose hits are known."""
    one = _law(law)
    assert one is not None
    responses = [tuple(ImpactResponse(**row) for row in rows) for rows in (before, after)]
    found = closed_loop(one, _plant(machine), open_loop=responses[0], closed=responses[1])
    return {"rows": found.table, "passed": found.passed}


@lru_cache(maxsize=2)
def _plant(machine: str) -> Plant:
    return Plant(Machine.from_text(machine))


def _law(path: str) -> Law | None:
    return load_law(path) if path else None
