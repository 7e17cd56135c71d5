"""Diagnosis of records simulated by ROSS 2.3.0 on a machine file with linear bearings: independent test data.

Run with the `benchmarks` extra installed:  python benchmarks/diagnose_ross.py [sound] [misaligned] [cracked] [runup]

ROSS turns the rotor of the shipped file `plain_rotor` (the same shaft, disc and bearings, other elements, its own time
integration) with nothing wrong, with a parallel misalignment of a flexible coupling at the left end, or with a crack
after Mayes by the disc, about half the first critical speed; `runup` gives the cracked one as a table of 1X, 2X, 3X
alone. A verdict is right if it names what is hidden, a tie that holds it, or is an honest unknown or partial one, and
wrong otherwise; the script ends with 1 on a wrong one.
"""

from __future__ import annotations

import json
import sys
import time
import warnings
from typing import Any

import numpy as np
import ross

from identification import make_record, make_vectors
from rotorsim.discrepancy import Diagnosis, diagnose
from rotorsim.machine import Machine, load_machine

warnings.filterwarnings("ignore")
ELEMENTS, DISC = 12, 6
SAMPLE, SECONDS, SETTLING = 2e-4, 2.4, 1.6
DAMPING = 0.02
"""Damping ratio of the shaft: a run of ROSS starts at rest and has to forget it."""
CRITICAL = 46.0
"""First critical speed [Hz] of the plain rotor, about."""
SPEEDS = {
    "fit": (0.40, 0.46, 0.50, 0.55, 0.70, 0.80), "held_out": (0.43, 0.52, 0.62, 0.75),
    "untouched": (0.42, 0.51, 0.66, 0.78),
}  # fmt: skip
"""Speeds by role, as shares of the first critical one: about its half, where 2X is strong."""
UNBALANCE = 25e-6
NOISE = 0.1e-6
RIGHT = {"sound": (), "misaligned": ("coupling",), "cracked": ("crack",), "runup": ("crack",)}
"""Effects that may be named."""


def machine() -> Machine:
    """The plain rotor with a shaft that is damped more."""
    return load_machine("plain_rotor").replace("shaft.damping_ratio", DAMPING)


def rotor() -> Any:
    """The same rotor as ROSS has it; the shaft's damping is proportional to its stiffness."""
    steel = ross.Material("steel_of_the_rotor", rho=7850, E=210e9, Poisson=0.3)
    beta = 2 * DAMPING / (2 * np.pi * CRITICAL)
    shaft = [ross.ShaftElement(0.6 / ELEMENTS, 0.0, 0.02, material=steel, beta=beta) for _ in range(ELEMENTS)]
    disc = ross.DiskElement(n=DISC, m=3.946, Id=0.006519, Ip=0.012627)
    bearings = [ross.BearingElement(n=n, kxx=10e6, cxx=200.0) for n in (0, ELEMENTS)]
    return ross.Rotor(shaft, [disc], bearings)


def turned(one: Any, fault: str, speed: Any, t: np.ndarray) -> np.ndarray:
    """Displacement (n, 2) [m] of the disc at a speed [rad/s]; the mean is that of the weight in every case."""
    common = {"node": [DISC], "unbalance_magnitude": [UNBALANCE], "unbalance_phase": [0.0], "speed": speed, "t": t}
    reduced = {"model_reduction": {"method": "pseudomodal", "num_modes": 24}}
    if fault == "misaligned":
        result = one.run_misalignment(
            coupling="flex", mis_type="parallel", n=0, mis_distance_x=2e-4, mis_distance_y=2e-4, mis_angle=0.0,
            radial_stiffness=40e3, bending_stiffness=38e3, **common,
        )  # fmt: skip
    elif fault in ("cracked", "runup"):
        result = one.run_crack(n=DISC, depth_ratio=0.25, crack_model="Mayes", **reduced, **common)
    else:
        F = one.unbalance_force_over_time([DISC], [UNBALANCE], [0.0], speed, t)
        result = one.run_time_response(speed, F.T, t)
    first = DISC * one.number_dof
    y = np.array(result.yout[:, first : first + 2])
    if fault in ("cracked", "runup"):
        return y
    # along and about the axis nothing holds the rotor: least squares
    sag = np.linalg.lstsq(one.K(0.0), one.gravitational_force(), rcond=1e-9)[0]
    return y + sag[first : first + 2]


def records(fault: str, rng: np.random.Generator) -> list[Any]:
    """Steady records at constant speeds, the one at half the critical speed twice."""
    one, found = rotor(), []
    n, skipped = round(SECONDS / SAMPLE), round(SETTLING / SAMPLE)
    t = np.arange(n + skipped) * SAMPLE
    plan = [(role, share) for role, shares in SPEEDS.items() for share in shares] + [("fit", 0.50)]
    for i, (role, share) in enumerate(plan):
        speed = 2 * np.pi * CRITICAL * share
        y = turned(one, fault, speed, t)[skipped:] + rng.normal(0, NOISE, (n, 2))
        values = {"disc_measured": y, "angle_measured": speed * t[skipped:], "speed_measured": np.full(n, speed)}
        found.append(make_record(t[:n], values, {"role": role, "record": f"{fault} {i}"}))
    return found


def table(fault: str, rng: np.random.Generator) -> Any:
    """1X, 2X, 3X amplitudes and phases over the speed, from steady runs: what a slow run-up shows."""
    one, orders = rotor(), (1, 2, 3)
    speeds = 2 * np.pi * CRITICAL * np.linspace(0.38, 0.85, 24)
    t = np.arange(round(2.4 / SAMPLE)) * SAMPLE
    rows = []
    for speed in speeds:
        y = turned(one, fault, speed, t) + rng.normal(0, NOISE, (len(t), 2))
        keep = round(1.2 / SAMPLE)
        late = t[keep:]
        fitted = np.column_stack([np.ones_like(late)] + [f(n * speed * late) for n in orders for f in (np.cos, np.sin)])
        x = np.linalg.lstsq(fitted, y[keep:], rcond=None)[0]
        rows.append([x[1 + 2 * i] - 1j * x[2 + 2 * i] for i in range(3)])
    vectors = np.array(rows)
    return make_vectors(speeds, np.abs(vectors), -np.angle(vectors), orders, {})


def verdict(fault: str, found: Diagnosis) -> str:
    """right, tie, unknown or wrong."""
    allowed = RIGHT[fault]
    named = {f.effect for f in found.effects}
    if found.status in ("named", "tie"):
        ties = [{key.split(".")[0] for key in keys} for keys in found.ties]
        holds = [s for s in (named, *ties) if allowed and s == set(allowed)]
        return ("right" if found.status == "named" else "tie") if holds else "wrong"
    return "right" if found.status == "no_disagreement" and not allowed else "unknown"


def main() -> int:
    """Diagnose each fault and print a line of JSON for it."""
    wrong = 0
    for fault in sys.argv[1:] or list(RIGHT):
        rng = np.random.default_rng(5)
        made = [table(fault, rng)] if fault == "runup" else records(fault, rng)
        begin = time.perf_counter()
        found = diagnose(machine(), made)
        row = {
            "fault": fault, "status": found.status, "effects": [f.form for f in found.effects],
            "ties": [list(t) for t in found.ties], "verdict": verdict(fault, found),
            "seconds": round(time.perf_counter() - begin, 1), "notes": list(found.notes),
        }  # fmt: skip
        print(json.dumps(row), flush=True)
        wrong += row["verdict"] == "wrong"
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
