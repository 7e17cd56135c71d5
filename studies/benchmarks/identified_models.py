"""Benchmark of identification: time, sensitivities, parameter errors, poor start values, comparison with nfoursid.

The data come from models inside the class, so that the truth is known; on the rig `rotorsim study` measures.
"""

import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import identification as idn
from identification.campaign import identify_all
from identification.local.greybox import STRUCTURES, modes
from identification.local.least_squares import FitProblem, GreyBox
from studies.benchmarks.result import Figure

TRUTH = np.array(
    [-5.0e5, -1.8e4, 2.4e4, -5.5e5, -110.0, -7.0, 7.0, -75.0, 1.6, -0.3, 0.26, 1.7, 900.0, 800.0]
)  # fmt: skip
"""Model 3 near the rig's values."""
TS, NOISE = 2e-4, 0.5e-6
SEEDS, STARTS = 200, 100
"""Number of records and of starts."""
SHORT = 1.4
"""Length of the record for the comparison with another package [s]."""


def record(
    seed: int, seconds: float = 10.0, theta: np.ndarray = TRUTH, speed: float = 0.0, pressure: float = 3e5
) -> Any:
    """A PRBS record of Model 3 with white noise."""
    rng, n = np.random.default_rng(seed), round(seconds / TS)
    u = np.repeat(2.0 * rng.integers(0, 2, (-(-n // 25), 2)) - 1, 25, axis=0)[:n]
    u[:2000] = 0
    y = idn.LinearModel(*STRUCTURES["3"].matrices(theta)).simulate(u, TS) + NOISE * rng.normal(size=(n, 2))
    return idn.from_arrays(np.arange(n) * TS, u, y, speed=speed, pressure=pressure)


def one_record() -> Iterator[Figure]:
    """Model 3 of a record of 10 s, 5 kHz, two by two."""
    data = record(0)
    idn.identify(data)
    spent = [_seconds(lambda: idn.identify(data), time.process_time) for _ in range(5)]
    yield Figure("Model 3 of one record of 10 s, processor time, median of 5", float(np.median(spent)), "s", 1.0)


def _seconds(work: Callable[[], Any], clock: Callable[[], float]) -> float:
    begin = clock()
    work()
    return clock() - begin


def many_records() -> Iterator[Figure]:
    """35 + 34 records from files to surfaces on two cores."""
    grid = list(product(np.linspace(0, 628, 7), np.linspace(3e5, 7e5, 5)))
    with tempfile.TemporaryDirectory() as name:
        for k, (w, p) in enumerate([*grid, *grid[:-1]]):
            made = record(k, theta=_theta_at(w, p), speed=w, pressure=p).assign_attrs(role="fit" if k < 35 else "hold")
            idn.save(made, Path(name) / f"{k:02d}.nc")
        begin, used = time.perf_counter(), time.process_time()
        found = identify_all(idn.survey(idn.files_of([name])), workers=2)
        good = {role: [o.result for o in found if o.source.role == role and o.result] for role in ("fit", "hold")}
        lpv = idn.fit_lpv(good["fit"], 2, good["hold"])
        wall, used = time.perf_counter() - begin, time.process_time() - used
    yield Figure("LPV model of 69 records of 10 s from files, two threads", wall, "s", 60.0)
    yield Figure("the same, processor time over two cores", used / 2, "s", 60.0)
    middle = modes(lpv.theta(300.0, 5.1e5))[0] / modes(_theta_at(300.0, 5.1e5))[0] - 1
    yield Figure("its largest error of a frequency between the points", 100 * float(np.abs(middle).max()), "%", 0.1)


def _theta_at(speed: float, pressure: float) -> np.ndarray:
    """Parameters that are second-order polynomials of the operating point."""
    a, b = speed / 628, (pressure - 3e5) / 4e5
    theta = TRUTH * np.repeat([1 + 0.3 * b + 0.02 * a * a, 1 - 0.4 * b - 0.1 * a * b, 1 + 0.2 * b * b], [4, 4, 6])
    theta[[1, 2, 9, 10]] = TRUTH[[1, 2, 9, 10]] * a
    return theta


def sensitivities() -> Iterator[Figure]:
    """Largest difference of Jacobians and central differences, relative to the column's largest entry."""
    rng, worst = np.random.default_rng(1), 0.0
    theta = {"1": TRUTH[:12], "3": TRUTH, "2": np.r_[TRUTH[:12], 5e3, 6e3, 1.5e7, 1e4, 2e7, 1.2e7, 8e3, 1e7]}
    for kind, at in theta.items():
        w, y = rng.normal(size=(300, 2)), 1e-6 * rng.normal(size=(300, 2))
        problem = FitProblem(GreyBox(STRUCTURES[kind], TS), w, y, np.full((300, 1), 300**-0.5))
        x0 = np.zeros(problem.states(at))
        _, J = problem.residual(at, x0)
        for i, value in enumerate(at):
            slope = np.zeros((300, 2))
            for move, weight in ((-2, 1), (-1, -8), (1, 8), (2, -1)):
                moved = at.copy()
                moved[i] += move * 2e-4 * value
                slope -= weight * problem.residual(moved, x0)[0] / (12 * 2e-4 * value)
            worst = max(worst, float(np.abs(slope - J[..., i]).max() / np.abs(J[..., i]).max()))
    yield Figure("Jacobians against central differences, Models 1, 2, 3", worst, "", 1e-6)


def truth() -> Iterator[Figure]:
    """Errors and standard deviations over many records of one model."""
    wn, zeta = modes(TRUTH)
    frequency, damping, outside = [], [], []
    for seed in range(SEEDS):
        found = idn.identify(record(seed))
        frequency.append(np.abs(found.wn / wn - 1).max())
        damping.append(np.abs(found.zeta / zeta - 1).max())
        z = [(v - t) / sd for (v, sd), t in zip(found.parameters.values(), TRUTH, strict=True)]
        outside.append(np.abs(z) > 3)
    yield Figure(f"largest error of a frequency in {SEEDS} records", 100 * float(max(frequency)), "%", 0.1)
    yield Figure("largest error of a damping ratio in them", 100 * float(max(damping)), "%", 3.0)
    yield Figure("share of parameters outside 3 standard deviations", 100 * float(np.mean(outside)), "%", 5.0)


def starts() -> Iterator[Figure]:
    """Starts off by up to 30 % in frequency, a factor 3 in damping, 2 in gain; half of them at these limits."""
    rng, missed, data = np.random.default_rng(0), 0, record(5, seconds=4.0)
    near = idn.identify(data)
    for k in range(STARTS):
        f, d, g = rng.choice([-1.0, 1.0], 3) if k % 2 else rng.uniform(-1, 1, 3)
        f, d, g = 1 + 0.3 * f, 3.0**d, 2.0**g
        start = TRUTH * np.repeat([f**2, f * d, f**2 * g, 1.0], [4, 4, 4, 2])
        far = idn.identify(data, start=start)
        missed += not (np.allclose(far.wn, near.wn, rtol=1e-4) and np.allclose(far.zeta, near.zeta, rtol=1e-2))
    yield Figure(f"share of {STARTS} starts far off that lead elsewhere", 100 * missed / STARTS, "%", 5.0)


def public() -> Iterator[Figure]:
    """Another package's black-box model of order 6 on the same record, where it is installed: nfoursid.

    A short record, for that package keeps a square matrix of the record's length.
    """
    try:
        import pandas as pd
        from nfoursid.nfoursid import NFourSID
    except ImportError:
        return
    data = record(0, seconds=SHORT)
    signals = idn.filtered(data)
    scale = float(signals.y.std())
    frame = pd.DataFrame(np.hstack([signals.u, signals.y / scale]), columns=["u1", "u2", "y1", "y2"])

    def theirs() -> idn.LinearModel:
        solver = NFourSID(frame, output_columns=["y1", "y2"], input_columns=["u1", "u2"], num_block_rows=25)
        solver.subspace_identification()
        found, _ = solver.system_identification(rank=6)
        return idn.LinearModel(found.a, found.b, found.c * scale, found.d * scale, TS)

    made: list[idn.LinearModel] = []
    other = _seconds(lambda: made.append(theirs()), time.process_time)
    own = _seconds(lambda: made.append(idn.identify(data, "blackbox", 6).model), time.process_time)
    theirs_fit, own_fit = (100 * float(np.mean(idn.fit_of(m, signals))) for m in made)
    yield Figure(f"black box of order 6 on {SHORT} s, nfoursid: fit", theirs_fit, "%")
    yield Figure(f"black box of order 6 on {SHORT} s, here: fit", own_fit, "%")
    yield Figure("nfoursid: processor time", other, "s")
    yield Figure("here: processor time", own, "s")
