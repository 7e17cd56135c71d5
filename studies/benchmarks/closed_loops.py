"""Benchmark of records of a closed loop: modes found in two stages, held against the plant's own linearisation.

Six operating points; laws designed on Model 2 of an open-loop record of the point; PRBS added to their references,
which `without_orbit` keeps from following the orbit where the shaft turns; noise of the machine file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

import identification as idn
from identification.local.greybox import RATED
from rotorsim.base.errors import UnfitError
from rotorsim.base.units import KRPM
from rotorsim.control.designs import hinf, lqr, p
from rotorsim.experiments import Prbs, controlled, run, without_orbit
from rotorsim.plant.plant import Plant
from studies.benchmarks.result import Figure

if TYPE_CHECKING:
    import xarray as xr

    from rotorsim.control.law import Law

POINTS = ((0.0, 0.3e6), (1.5, 0.4e6), (3.0, 0.5e6), (4.5, 0.45e6), (5.5, 0.35e6), (6.0, 0.7e6))
"""Speeds [krpm] and pressures [Pa]."""
SECONDS, SEEDS = 30.0, (601, 602)
MODELS = {"3": "Model 3", "2": "Model 2", RATED: "Model 2 with rates"}
CLOSE, DAMPED = 1.0, 15.0
"""Largest errors of a frequency and a damping ratio [%] that a record may have."""
Design = Callable[[idn.LinearModel, float, float], "Law"]


def _preset(name: str) -> Design:
    return lambda model, w, q: hinf.design(model, replace(hinf.PRESETS[name], speed=w, pressure=q))


LAWS: dict[str, tuple[Design, float]] = {
    "lqr": (lambda model, w, q: lqr.design(model, lqr.Spec(speed=w, pressure=q)), 0.3),
    "hinf rig": (_preset("rig"), 0.3),
    "p": (lambda model, w, q: p.design(model, p.Spec(speed=w, pressure=q)), 0.2),
    "hinf thesis": (_preset("thesis"), 0.2),
}
"""Designs, and amplitude of the PRBS [V]."""


def closed_loops() -> Iterator[Figure]:
    """Errors by law, model and point, and records beyond 1 % or 15 % by law and model; those refused count."""
    plant = Plant("dtu_gas_bearing")
    missed = {(law, name): 0 for law in LAWS for name in MODELS.values()}
    for krpm, pressure in POINTS:
        speed = krpm * KRPM
        true = plant.linearise(speed, pressure)
        modes = sorted(true.mode_of_axis(axis) for axis in (0, 1))
        made = idn.identify(run(plant, Prbs(speed, pressure, sequence=1), 1), 2).model
        for law, (design, amplitude) in LAWS.items():
            records = [_record(plant, design(made, speed, pressure), amplitude, seed) for seed in SEEDS]
            for model, name in MODELS.items():
                off = np.array([_off(one, model, true.wn[modes], true.zeta[modes]) for one in records])
                missed[law, name] += int(np.sum(~((off[:, 0] <= CLOSE) & (off[:, 1] <= DAMPED))))
                where = f"{name} under {law} at {krpm:g} krpm, {1e-6 * pressure:g} MPa: largest error"
                yield Figure(f"{where} of a frequency", float(off[:, 0].max()), "%")
                yield Figure(f"{where} of a damping ratio", float(off[:, 1].max()), "%")
    for (law, name), count in missed.items():
        text = f"{name} under {law}: records of {len(POINTS) * len(SEEDS)} beyond {CLOSE:g} % or {DAMPED:g} %"
        yield Figure(text, count, "", 0.0)


def _record(plant: Plant, law: Law, amplitude: float, seed: int) -> xr.Dataset:
    """A record under a law at the law's own point."""
    spec = law.about["spec"]
    speed, pressure = float(spec["speed"]), float(spec["pressure"])
    calm = without_orbit(plant, law, speed, pressure) if speed else law
    dither = Prbs(amplitude=amplitude, duration=SECONDS, sequence=seed)
    return controlled(plant, calm, speed, pressure, SECONDS, excitations=[dither], seed=seed)


def _off(record: xr.Dataset, model: str, wn: np.ndarray, zeta: np.ndarray) -> tuple[float, float]:
    """Largest error [%] of a frequency and of a damping ratio; infinite where the record is refused."""
    try:
        found = idn.identify(record, model)
    except UnfitError:
        return np.inf, np.inf
    return 100 * float(np.abs(found.wn / wn - 1).max()), 100 * float(np.abs(found.zeta / zeta - 1).max())
