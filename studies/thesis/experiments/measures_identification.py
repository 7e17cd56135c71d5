"""Figures of the claims on identification, measured on short records of one plant.

Records and models are those of the study (PRBS of 1 V, the thesis' prefilter, no dead time beyond that of the model's
structure), shorter and at fewer points: `DURATION`, and the
points named in each function. So a figure here may differ a little from the study's.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

import identification as idn
from identification.local.fits import actuator_signals
from identification.local.greybox import actuator_poles
from rotorsim.base.units import KRPM, MPA, TO_HZ, TO_UM
from rotorsim.experiments import prbs, steady
from rotorsim.plant import Plant
from rotorsim.study.identification_vs_physics import RECIPE, runout_amplitudes
from studies.thesis.claims.identification_numbers import MS, VOLT
from studies.thesis.claims.rules import points

if TYPE_CHECKING:
    import xarray as xr

DURATION, STEADY = 5.0, 2.0
"""Durations [s] of a record with and of one without excitation; the study's are 10 and 2."""
CROSS = ((0.0, 0.5), (4.0, 0.7), (6.0, 0.5))
"""Points [krpm, MPa] that stand for the fifteen of Paper C."""
SCATTER = ((0.5, 0.35), (3.5, 0.55), (5.5, 0.65))
"""Points [krpm, MPa] that stand for the centres of the grid's cells."""
Figures = dict[str, float]


def record(
    plant: Plant, speed: float, pressure: float, sequence: int = 1, duration: float = DURATION
) -> tuple[xr.Dataset, xr.Dataset | None]:
    """A record with excitation and, where the shaft turns, one without (None at rest)."""
    made = prbs(plant, speed, pressure, amplitude=1.0, duration=duration, sequence=sequence)
    return made, steady(plant, speed, pressure, duration=STEADY) if speed else None


def local(
    plant: Plant, speed: float, pressure: float, model: str = "2", duration: float = DURATION
) -> idn.Identification:
    """A local model at a speed [rad/s] and gauge pressure [Pa]."""
    excited, quiet = record(plant, speed, pressure, duration=duration)
    return idn.identify(excited, model, steady=quiet, settings=RECIPE, dead_time=0.0)


def actuators(plant: Plant, shipped: Plant) -> Figures:
    """I9 at rest and 0.5 MPa: poles of the pairs of pins and the fit of a second record."""
    one, other = (prbs(plant, 0.0, 0.5 * MPA, amplitude=1.0, duration=2.0, sequence=k) for k in (1, 2))
    found = idn.identify(one, "actuator", settings=RECIPE)
    poles, gain = actuator_poles(found.theta), np.diag(found.static_gain) / VOLT
    fit = 100 * idn.fit_of(found.model, actuator_signals(idn.filtered(other, None, RECIPE)))
    figures = {f"I9.p{k + 1}_{axis}": float(poles[i, k]) for i, axis in enumerate("xy") for k in range(2)}
    return figures | {f"I9.{name}_{axis}": float(v[i]) for name, v in (("gain", gain), ("fit", fit))
                      for i, axis in enumerate("xy")}  # fmt: skip


def fits(plant: Plant, shipped: Plant) -> Figures:
    """I2 and I3 (Model 3), I10 (Model 2) at `CROSS`: fits of second records."""
    figures: Figures = {}
    for claim, name in (("I2", "rest"), ("I3", "turning")):
        fit = _second_fit(plant, *points(name)[0], "3")
        figures |= {f"{claim}.validation_{axis}": fit[k] for k, axis in enumerate("xy")}
    cross = np.array([_second_fit(plant, w * KRPM, p * MPA, "2") for w, p in CROSS]).mean(axis=0)
    return figures | {f"I10.mean_{axis}": float(cross[k]) for k, axis in enumerate("xy")}


def orders(plant: Plant, shipped: Plant) -> Figures:
    """I5 at the first and the last of its points: fits [%] of order 6, Models 2 and 3."""
    at = points("orders")[::2]
    mean = {kind: float(np.mean([_second_fit(plant, *q, kind) for q in at])) for kind in ("blackbox", "2", "3")}
    return {"I5.order_6": mean["blackbox"], "I5.model_2": mean["2"], "I5.model_3": mean["3"],
            "I5.difference": mean["3"] - mean["2"]}  # fmt: skip


def _second_fit(plant: Plant, speed: float, pressure: float, model: str) -> np.ndarray:
    """Fit (2,) [%] of a second record by a local model."""
    excited, quiet = record(plant, speed, pressure)
    found = idn.identify(excited, model, 6, steady=quiet, settings=RECIPE, dead_time=0.0)
    second, _ = record(plant, speed, pressure, sequence=2)
    return np.asarray(100 * idn.fit_of(found.model, idn.filtered(second, quiet, RECIPE)))


def runout(plant: Plant, shipped: Plant) -> Figures:
    """I4: amplitude before and after the filter, on the rest before the excitation of a short record."""
    excited, quiet = record(plant, *points("runout")[0], duration=1.0)
    found = runout_amplitudes(excited, quiet)
    assert found is not None
    return {f"I4.{name}": float(a.max()) * TO_UM for name, a in zip(("before", "after"), found, strict=True)}


def ranges(plant: Plant, shipped: Plant) -> Figures:
    """I7: ends of the ranges of Model 2 over the corners of the grid."""
    found = [local(plant, *q) for q in points("grid")]
    gain, delay = np.array([one.static_gain for one in found]) * TO_UM, np.array([one.delay for one in found]) * MS
    wn, zeta = np.array([one.wn for one in found]), np.array([one.zeta for one in found])
    columns = {"w_x": wn[:, 0], "w_y": wn[:, 1], "zeta_x": zeta[:, 0], "zeta_y": zeta[:, 1], "tau_x": delay[:, 0],
               "tau_y": delay[:, 1], "gxx": gain[:, 0, 0], "gyy": gain[:, 1, 1]}  # fmt: skip
    return {f"I7.{name}_{end}": float(of(v)) for name, v in columns.items() for end, of in _ENDS}


_ENDS = (("low", np.min), ("high", np.max))


def scatter(plant: Plant, shipped: Plant) -> Figures:
    """I11 at `SCATTER`: what moves between records when the machine changes in between, by root mean square."""
    pairs = [[local(one, w * KRPM, p * MPA) for w, p in SCATTER] for one in (plant, shipped)]
    rms = {key: _rms(*(np.array([getattr(one, key) for one in some]) for some in pairs))
           for key in ("wn", "zeta", "delay", "static_gain")}  # fmt: skip
    return {
        "I11.w_1": rms["wn"][0] * TO_HZ, "I11.w_2": rms["wn"][1] * TO_HZ, "I11.zeta_1": float(rms["zeta"][0]),
        "I11.zeta_2": float(rms["zeta"][1]), "I11.tau_x": rms["delay"][0] * MS, "I11.tau_y": rms["delay"][1] * MS,
        "I11.gain": float(rms["static_gain"].mean()) * TO_UM,
    }  # fmt: skip


def _rms(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt(np.mean((one - other) ** 2, axis=0)))


def lpv(plant: Plant, speeds: Iterable[float] = (0.0, 3.0, 6.0), pressures: Iterable[float] = (0.3, 0.5, 0.7),
        duration: float = DURATION) -> idn.LpvModel:  # fmt: skip
    """Second-order surfaces of Model 2 over a grid [krpm, MPa] of nine points."""
    at = partial(local, plant, duration=duration)
    return idn.fit_lpv([at(w * KRPM, p * MPA) for w in speeds for p in pressures], 2)
