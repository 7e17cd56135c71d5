"""Speed of control laws and designs: sample and refresh times, H-infinity, a hundred H2 designs, LPV synthesis.

Designs are made on Model 2 of the shipped rig, identified from the thesis' campaign: the live rig's own law is its too.
"""

import resource
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from identification import load_model
from identification.lpv_model import LpvModel
from rotorsim.base.units import KRPM
from rotorsim.control import Law
from rotorsim.control.designs import h2_scheduled, lpv
from rotorsim.control.designs.hinf_synthesis import Weights, mixed_sensitivity, solve
from rotorsim.control.law_kernel import refresh, steps
from rotorsim.control.plants import design_plant
from rotorsim.control.sampled_loop import sweep
from rotorsim.live.laws import SHIPPED
from studies.benchmarks.result import Figure

SAMPLES = 20_000
MODEL = SHIPPED / "rig_model_2.json"


def runtime(order: int = 12) -> Iterator[Figure]:
    """CPU time of a law's sample between refreshes and of a refresh, for a table of 13 x 9 points."""
    rng = np.random.default_rng(0)
    shapes = {"A": (order, order), "B": (order, 2), "C": (2, order), "D": (2, 2), "W": (order, 2)}
    matrices: dict[str, Any] = {name: 0.1 * rng.normal(size=(13, 9, *shape)) for name, shape in shapes.items()}
    law = Law("bench", **matrices, speeds=np.linspace(0, 628, 13), pressures=np.linspace(3e5, 7e5, 9), refresh=10**9)
    measured, out = rng.normal(size=2 * SAMPLES) * 1e-6, np.zeros(2 * SAMPLES)
    for _ in range(2):  # the first call compiles
        law.reset()
        begin = time.process_time()
        steps(law.memory, law.table, law.axes, law.layout, law.settings, measured, 100.0, 4e5, out)
        spent = time.process_time() - begin
    yield Figure(f"law step, {order} states", spent / SAMPLES * 1e6, "us", 1.0)
    begin = time.process_time()
    for _ in range(2000):
        refresh(law.memory, law.table, law.axes, law.layout, 100.0, 4e5)
    yield Figure("law refresh, with the call from Python", (time.process_time() - begin) / 2000 * 1e3, "ms", 0.5)


def designs() -> Iterator[Figure]:
    """CPU time of the H-infinity optimum and of a hundred H2 designs; unstable points of the scheduled one."""
    model = rig_model()
    P = mixed_sensitivity(design_plant(model, 3 * KRPM, 0.5e6), Weights())
    begin = time.process_time()
    yield Figure("H-infinity gamma at [3 krpm, 0.5 MPa]", solve(P), "1")
    yield Figure("  CPU time", (time.process_time() - begin) * 1e3, "ms")
    spec = h2_scheduled.Spec()
    begin = time.process_time()
    for speed in np.linspace(1, 6, 10) * KRPM:
        for pressure in np.linspace(0.3e6, 0.7e6, 10):
            h2_scheduled.local_controller(model, spec, float(speed), float(pressure))
    yield Figure("100 H2 designs, CPU time", time.process_time() - begin, "s", 2.0)
    law = h2_scheduled.design(model)
    found = sweep(law, model, np.linspace(1, 6, 40) * KRPM, np.linspace(0.3e6, 0.7e6, 15))
    yield Figure("  scheduled: unstable points of 40 x 15", found.unstable, "1", 0)


def synthesis() -> Iterator[Figure]:
    """LPV synthesis on 8 x 8 points and its check on 64 x 64: CPU time and the process' largest memory."""
    model = rig_model()
    spec = lpv.PRESETS["thesis"]
    begin = time.process_time()
    made = lpv.synthesis(model, spec)
    yield Figure("LPV 8x8, CPU time", time.process_time() - begin, "s", 120.0)
    yield Figure("  largest memory of the process", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, "GB", 1.5)
    begin = time.process_time()
    fine = lpv.validated(model, spec, made, (64, 64))
    yield Figure("LPV 64x64 check, CPU time", time.process_time() - begin, "s", 10.0)
    yield Figure("  gamma on 64x64 over that on 8x8", fine / lpv.validated(model, spec, made, (8, 8)), "1", 1.005)


def rig_model() -> LpvModel:
    """Model 2 of the shipped rig."""
    model = load_model(MODEL)
    assert isinstance(model, LpvModel)
    return model
