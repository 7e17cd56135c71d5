"""Benchmark of intervals: the share of 90 % intervals of Models 3, 2 and 2-rate that hold the linearised plant.

Six operating points off the grid of the thesis, PRBS of 1 V, noise of the machine file.
"""

from collections.abc import Iterator

import numpy as np

import identification as idn
from identification.local.greybox import RATED
from rotorsim.base.units import RPM
from rotorsim.experiments import Prbs, run
from rotorsim.plant.plant import Plant
from rotorsim.study.identification_vs_physics import Physics, physics
from studies.benchmarks.result import Figure

POINTS = ((750, 0.45e6), (1250, 0.65e6), (2250, 0.35e6), (3250, 0.55e6), (4750, 0.65e6), (5250, 0.45e6))
"""Speeds [rpm] and pressures [Pa]."""
SEEDS, FIRST, SECONDS = 20, 200, 6.0
CLASSES = {"frequencies": "f_", "damping ratios": "zeta", "static gains": "gain"}
MOST = 20.0
"""Bound of the share outside [%]; below 3 % the intervals are too wide."""


def intervals() -> Iterator[Figure]:
    """Share of intervals that do not hold the plant's value, in all and by quantity."""
    plant = Plant("dtu_gas_bearing")
    outside: dict[str, list[tuple[str, bool]]] = {"3": [], "2": [], RATED: []}
    for rpm, pressure in POINTS:
        wanted = values(physics(plant, rpm * RPM, pressure))
        for seed in range(FIRST, FIRST + SEEDS):
            record = run(plant, Prbs(rpm * RPM, pressure, duration=SECONDS, sequence=seed), seed)
            for kind, rows in outside.items():
                for one in idn.identify(record, kind).intervals:
                    rows.append((one.name, not one.low <= wanted[one.name] <= one.high))
    for kind, rows in outside.items():
        yield Figure(f"Model {kind}: 90 % intervals that do not hold the plant's value", _share(rows, ""), "%", MOST)
        for name, start in CLASSES.items():
            yield Figure(f"Model {kind}: of these those of {name}", _share(rows, start), "%")


def values(known: Physics) -> dict[str, float]:
    """The plant's own values by the names of intervals."""
    found = {f"f_{k + 1}": float(known.wn[k]) / (2 * np.pi) for k in range(2)}
    found |= {f"zeta_{k + 1}": float(known.zeta[k]) for k in range(2)}
    for i, j in np.ndindex(2, 2):
        found[f"gain_{'xy'[i]}{'xy'[j]}"] = 1e6 * float(known.static_gain[i, j])
    return found


def _share(rows: list[tuple[str, bool]], start: str) -> float:
    return 100 * float(np.mean([out for name, out in rows if name.startswith(start)]))
