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
from rotorsim.base.units import KRPM, RIG_SAMPLE
from rotorsim.control import DesignError, Law, load_law
from rotorsim.control.catalogue import make_spec, module_of
from rotorsim.control.designs import p
from rotorsim.control.sampled_loop import overview
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.report.control import spectra_of
from rotorsim.verify import closed_loop
from rotorsim.verify.closed_loop import other_machines
from rotorsim.verify.runs import Run, run_rows, steady_rows
from rotorsim.verify.transients import (
    ImpactResponse,
    amplitude,
    amplitudes,
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
SLOW = 0.1 * KRPM
"""Rate [rad/s^2] of the thesis' run-up (E.5.2)."""
BANDS = {"third": (33.0, 48.0), "half": (50.0, 75.0)}
"""Speeds [Hz] between which the peaks near one third and one half of the critical speeds are looked for."""
WINDOW = 0.5
"""Length [s] of a stretch whose amplitude counts."""
SHOWN = 400.0
"""Highest frequency [Hz] of a waterfall."""


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


def hits(machine: str, law: str, points: list[Point]) -> list[dict[str, Any]]:
    """Impact responses at operating points [rad/s, Pa]."""
    return [asdict(impact_responses(_plant(machine), _law(law), *q)) for q in points]


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


def run_up(machine: str, law: str, point: Point) -> dict[str, Any]:
    """A slow run-up: imbalance amplitude (2,) [m] at its end; speeds (2,) [Hz] of the largest amplitude in BANDS."""
    speed, pressure = point
    run = runup(_plant(machine), _law(law), SLOW, pressure, speed, down=False)
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
