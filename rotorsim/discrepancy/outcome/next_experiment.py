"""Next experiment: the run in which the predictions of two rival effects differ most after re-fitting."""

from __future__ import annotations

from typing import Any

import numpy as np

from rotorsim.base.constants import MPA, RIG_SAMPLE
from rotorsim.discrepancy.blind_test.design import HIGH, LOW, PERIOD, PERIODS, SPACING
from rotorsim.discrepancy.data.spectra import Trial, block_lines
from rotorsim.discrepancy.fit.least_squares import prior_rows
from rotorsim.discrepancy.linear_algebra import answer
from rotorsim.discrepancy.residuals.comparison import Comparison, Point, simulate
from rotorsim.discrepancy.search.search import Hypothesis
from rotorsim.experiments import Experiment, Impact, Multisine

OPTIONS = (
    ("slow roll, strong excitation", 5, 0.5, 2.0),
    ("high speed, low pressure", 110, 0.35, 1.0),
    ("high speed, high pressure", 110, 0.7, 2.0),
    ("standstill, strong excitation", 0, 0.5, 2.0),
    ("low pressure, weak excitation", 40, 0.3, 0.25),
)
"""Name, speed [Hz], pressure [MPa], amplitude [V, or 20 N]."""


def next_experiment(comparison: Comparison, best: Hypothesis, rival: Hypothesis) -> dict[str, Any]:
    """Experiment that best separates two hypotheses: speed, pressure, amplitude, expected chi-square."""
    twin = comparison.twin
    found = []
    for name, hertz, pressure, amplitude in OPTIONS:
        trial = _trial(twin.machine.film is not None, hertz, pressure * MPA, amplitude)
        floor = _floor(comparison)
        a, b = (_vector(comparison, trial, h.fit.point) for h in (best, rival))
        found.append((float(np.sum(((a - b) / floor) ** 2)), name, trial, (a - b) / floor))
    found.sort(key=lambda f: -f[0])
    plug_in, name, trial, difference = found[0]
    left = _after_refit(comparison, rival, trial, difference, _floor(comparison))
    return {
        "experiment": f"multisine: {name}" if twin.machine.film is not None else f"impact: {name}",
        "speed_hz": trial.speed / (2 * np.pi),
        "pressure_mpa": trial.pressure / MPA,
        "amplitude": trial.amplitude,
        "chi2_before_refit": plug_in,
        "chi2_after_refit": left,
        "separates": [*best.keys, "against", *rival.keys],
        "enough": left > 25.0,
    }


def _trial(film: bool, hertz: float, pressure: float, amplitude: float) -> Trial:
    speed = 2 * np.pi * hertz
    one: Experiment = (
        Multisine(speed, pressure, amplitude, LOW, HIGH, PERIOD, PERIODS, SPACING, sequence=99)
        if film
        else Impact(speed, 0.0, 20 * amplitude, 2e-3, 0.6, 2, 1.0, 0.4)
    )
    rows = one.rows(0, one.samples)
    length = round(PERIOD / RIG_SAMPLE)
    blocks = 2 if film else 1
    start = len(rows) - blocks * length
    count = int(300 * PERIOD) + 1
    empty = block_lines(np.zeros((len(rows), 2)), start, length, blocks, count)
    return Trial(
        "next", "fit", rows, pressure if film else 0.0, 0.0, start, length, blocks, empty, np.zeros(count, bool)
    )


def _vector(comparison: Comparison, trial: Trial, point: Point) -> np.ndarray:
    return trial.vector(simulate(comparison.twin, trial, point))


def _floor(comparison: Comparison) -> float:
    """One number [m] for lines not yet measured: the median floor."""
    return float(np.median(comparison.sigma))


def _after_refit(
    comparison: Comparison, rival: Hypothesis, trial: Trial, difference: np.ndarray, floor: float
) -> float:
    """Chi-square that stays when the rival is re-fitted to old and new records together (linear)."""
    here = _vector(comparison, trial, rival.fit.point)
    new = []
    for parameter in rival.fit.parameters:
        if parameter.key in comparison.directions or parameter.trend:
            new.append(np.zeros_like(here))
            continue
        moved = _vector(comparison, trial, rival.fit.point.moved([parameter], np.array([parameter.step])))
        new.append((moved - here) / parameter.step / floor)
    p = prior_rows(rival.fit.parameters)
    A = np.vstack([rival.fit.J, np.diag(p), np.column_stack(new)])
    b = np.concatenate([np.zeros(len(rival.fit.residual) + len(p)), difference])
    size = np.linalg.norm(A, axis=0)
    size[size == 0] = 1.0
    x = answer(np.linalg.lstsq, A / size, b, rcond=1e-10)[0]
    left = b - A / size @ x
    return float(left @ left)
