"""Diagnosis made by hand, without records or a plant: for tests of its page and its files."""

from dataclasses import replace

import numpy as np
import xarray as xr

from rotorsim.discrepancy import Diagnosis
from rotorsim.discrepancy.comparison import Misfit
from rotorsim.discrepancy.gap import STAGES
from rotorsim.discrepancy.machine_file import IdentifiedEffect
from rotorsim.discrepancy.verdict import Explanation
from rotorsim.machine import load_machine

POINTS = {"fit_1": "fit", "fit_2": "fit", "held_out_1": "held_out", "untouched_1": "untouched"}
"""Records and their roles."""


def runout(size=1.03e-6):
    """A found run-out at 2X [m]."""
    return IdentifiedEffect(
        "runout",
        "runout.amplitude_2x",
        {"amplitude_2x": size, "phase_2x": -2.5},
        {"amplitude_2x": 2e-9},
        ("runout.amplitude_2x",),
    )


def blocked(injector=3.0, **more):
    """A found blocked injector."""
    key = f"weak_injector.blocked of injector {injector:.0f}"
    return IdentifiedEffect(
        "weak_injector", key, {"injector": injector, "blocked": 0.3, **more}, {"blocked": 0.01}, (key,)
    )


def small_diagnosis(machine="plain_rotor", status="named", effects=None, **more) -> Diagnosis:
    """A diagnosis with four records; `effects` are what was found, a run-out by default."""
    rng = np.random.default_rng(0)
    found = (runout(),) if effects is None else tuple(effects)
    keys = tuple(f.form for f in found)
    made = Diagnosis(
        status=status,
        machine=load_machine(machine),
        effects=found,
        ties=(),
        calibration={"offset_x": (1e-6, 2e-8), "shaft_damping": (-0.1, 0.02)},
        evidence={"chi2_calibrated": 4e4, "chi2_with_effect": 1e3, "numbers": 1e3, "share_gone": 0.98},
        data_hash="0123456789abcdef",
        localisation=(Misfit("fit_1", "2400 rpm, 10 N", "x", "2X", 2, 5e4, 7e-7, 1e-8, 10.0, 0),),
        unknown={},
        gap=_gap(rng),
        notes=("no repeats",),
        spectra={role: [_spectrum(name, rng) for name, own in POINTS.items() if own == role]
                 for role in ("fit", "held_out", "untouched")},
        tried=({"effects": list(keys), "gone": 0.98, "cost": np.float64(1e3), "held_out": 0.0, "failed": False},),
        explanations=(Explanation(keys, False, 100.0, 1e-4, True, 0.95, (("shaft_bow.bow",),)),
              Explanation((), True, 50.0, np.nan, False, 0.04), Explanation((), False, -np.inf, 1e-2, True, 0.01)),
    )  # fmt: skip
    return replace(made, **more)


def _gap(rng) -> xr.Dataset:
    values = np.abs(rng.normal(1e-6, 1e-7, (len(POINTS), 2, len(STAGES)))) * [3.0, 1.0, 0.05, 0.04]
    coords = {"record": list(POINTS), "axis": ["x", "y"], "stage": list(STAGES)}
    attrs = {"units": "m", "long_name": "rms of measured less simulated"}
    made = xr.Dataset({"gap": (("record", "axis", "stage"), values, attrs)}, coords, {"kind": "gap"})
    points = [f"{2400 + 600 * k} rpm, 10 N" for k in range(len(POINTS))]
    return made.assign_coords(role=("record", list(POINTS.values())), point=("record", points))


def _spectrum(name, rng) -> dict:
    lines = np.abs(rng.normal(1e-8, 3e-9, (5, 2, 40)))
    number = list(POINTS).index(name)
    return {
        "record": name, "point": f"{2400 + 600 * number} rpm, 10 N", "speed": 251.3 + 62.8 * number,
        "channels": ("x", "y"), "frequency": np.arange(1.0, 41.0), "measured": 50 * lines[0],
        "stages": [30 * lines[1], 10 * lines[2], lines[3]], "floor": lines[4], "orders": (),
    }  # fmt: skip
