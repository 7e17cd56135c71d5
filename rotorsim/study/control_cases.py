"""What a worker of the study of control computes: plain arguments in, plain JSON out."""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.control import DesignError, Law, load_law
from rotorsim.control.analysis import overview
from rotorsim.control.designs import make_spec, module_of
from rotorsim.control.plants import KRPM
from rotorsim.machine.schema import Machine
from rotorsim.plant import Plant
from rotorsim.sampling import SAMPLE
from rotorsim.verify import closed_loop
from rotorsim.verify.closed_loop import other_machines
from rotorsim.verify.impacts import POINTS, Energies, impact_energies
from rotorsim.verify.running import Run, run_rows, steady_rows
from rotorsim.verify.safe_speed import SafeSpeed, safe_speed
from rotorsim.verify.transients import amplitude, runup

CELL = (5.72 * KRPM, 0.678e6)
"""Centre of a cell of the H2 grid (thesis, figure G.6)."""
SIZES = (1.0, 5.0, 20.0)
"""Peaks [N] of hits that tell whether the film is linear."""
SIZE_POINTS = ((0.0, 0.3e6), (3 * KRPM, 0.3e6), (3 * KRPM, 0.5e6))
SHOWN = 400.0
"""Highest frequency [Hz] of a waterfall."""


def design(model_path: str, name: str, preset: str, changes: list[str], out: str) -> dict[str, Any]:
    """Write the law of a design; its findings, or why it was refused."""
    from identification import load_model

    model = load_model(model_path)
    try:
        law = module_of(name).design(model, make_spec(name, changes, preset))
    except DesignError as error:
        return {"refused": str(error)}
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    law.save(out)
    return {"overview": overview(law, model) if name != "youla" else {}, "order": law.order}


def hits(machine: str, law: str) -> list[dict[str, Any]]:
    """Impact energies at the twenty points."""
    return [asdict(impact_energies(_plant(machine), _law(law), *q)) for q in POINTS]


def hits_by_size(machine: str, law: str) -> list[dict[str, Any]]:
    """Impact energies of the open loop and of a law for hits of several sizes."""
    rows = []
    for speed, pressure in SIZE_POINTS:
        for peak in SIZES:
            pair = [impact_energies(_plant(machine), one, speed, pressure, peak) for one in (None, _law(law))]
            told: dict[str, Any] = {"speed": speed, "pressure": pressure, "peak": peak, "largest": pair[1].largest}
            told |= {"open": pair[0].response, "closed": pair[1].response}
            rows.append(told | {"damping": (pair[0].damping, pair[1].damping)})
    return rows


def run_up(machine: str, law: str) -> float:
    """Imbalance amplitude [m] at 6 krpm and 0.7 MPa."""
    run = runup(_plant(machine), _law(law), 0.5 * KRPM, 0.7e6, 6 * KRPM, down=False)
    return amplitude(run, len(run.table) - round(0.35 / SAMPLE), len(run.table))


def extension(machine: str, law: str, bias: tuple[float, float] = (0.0, 0.0)) -> dict[str, Any]:
    """Run-up until the safety circle is left, onset of whirl, spectra over speed (thesis Paper F)."""
    plant, one = _plant(machine), _law(law)
    held = one.with_(bias=tuple(bias)) if one is not None and any(bias) else one
    found = safe_speed(plant, held, stop=36 * KRPM, rate=2 * KRPM)
    told = {"speed": found.speed, "left": found.left, "why": found.why, "ended": found.run.ended}
    return told | whirl(found) | {"touched": found.run.touched, "spectra": spectra(found.run)}


def whirl(found: SafeSpeed) -> dict[str, Any]:
    """Onset [rad/s] of whirl or None, its frequency [Hz] and the speed [rad/s] at the end of the run."""
    tail = found.run.disc[-round(0.2 / SAMPLE) :, 1]
    spectrum = np.abs(np.fft.rfft((tail - tail.mean()) * np.hanning(len(tail))))
    frequency = float(np.fft.rfftfreq(len(tail), SAMPLE)[spectrum.argmax()])
    speed = found.run.column("speed")
    return {"whirl_hz": frequency, "last": float(speed[-1]), "onset": onset(found.run.disc, speed)}


def onset(disc: np.ndarray, speed: np.ndarray) -> float | None:
    """Speed [rad/s] from which on the parts below 0.7 of the shaft's frequency stay above all others; None if never."""
    window = round(0.2 / SAMPLE)
    n = len(disc) // window
    y = disc[: n * window, 1].reshape(n, window)
    heights = np.abs(np.fft.rfft((y - y.mean(axis=1, keepdims=True)) * np.hanning(window), axis=1))
    frequency, mean = np.fft.rfftfreq(window, SAMPLE), speed[: n * window].reshape(n, window).mean(axis=1)
    below = frequency[heights.argmax(axis=1)] < 0.7 * mean / (2 * np.pi)
    if not below[-1]:
        return None
    return float(mean[n - int(np.argmin(np.append(below[::-1], False)))])


def spectra(run: Run) -> dict[str, list[Any]]:
    """Speeds [rad/s], frequencies [Hz] and amplitudes [um] of y for a waterfall."""
    from rotorsim.report.verification import spectra_of

    speed, frequency, heights = spectra_of(run, SHOWN)
    return {"speed": speed.round(2).tolist(), "frequency": frequency.tolist(), "heights": heights.round(3).tolist()}


def cell(machine: str, law: str) -> dict[str, float]:
    """Imbalance amplitude [m] at the centre of a design cell: what the sensors show, and the disc itself."""
    run = run_rows(_plant(machine), _law(law), steady_rows(*CELL, 3.0))
    half, n = len(run.table) // 2, len(run.table)
    return {name: amplitude(run, half, n, name) for name in ("disc_measured", "disc")}


def flipped(machine: str) -> dict[str, Any]:
    """Orbit [m] before and at the end of 0.6 s under the published P gains with the other sign, after a hit of 1 N."""
    from rotorsim.control import p
    from rotorsim.experiments.impact import Impact

    law = p.make(p.Spec(kappa_x=-1.125, kappa_y=-0.99))
    told = {}
    for name, one in (("open", None), ("flipped", law.with_(average=0.05, fade=0.01))):
        rows = steady_rows(0.0, 0.5e6, 0.8)
        hammer = Impact(peak=1.0, lead=0.1, spacing=0.7)
        rows[:, 4:6] += hammer.rows(0, len(rows))[:, 4:6]
        run = run_rows(_plant(machine), one, rows)
        late = run.disc[-500:]
        told[name] = float(np.hypot(*(late - late.mean(axis=0)).T).max())
    return told


def machine_code(machine: str) -> list[str]:
    """Make, once for all processes, the machine code of the plants that a verification runs beside its own."""
    from rotorsim.control import p

    names = []
    for name, plant in other_machines(_plant(machine)):
        for law in (None, p.make(p.Spec())):
            run_rows(plant, law, steady_rows(0.0, 0.5e6, SAMPLE))
        names.append(name)
    return names


def verification(machine: str, law: str, before: list[dict[str, Any]], after: list[dict[str, Any]]) -> dict[str, Any]:
    """The rows of a full verification whose hits are known."""
    one = _law(law)
    assert one is not None
    energies = [tuple(Energies(**row) for row in rows) for rows in (before, after)]
    found = closed_loop(one, _plant(machine), open_loop=energies[0], closed=energies[1])
    return {"rows": found.table, "passed": found.passed}


@lru_cache(maxsize=2)
def _plant(machine: str) -> Plant:
    return Plant(Machine.from_text(machine))


def _law(path: str) -> Law | None:
    return load_law(path) if path else None
