"""Comparison of fe_shaft with ROSS 2.3.0 on one rotor of 20 elements: matrices, results and CPU times.

Run with the `benchmarks` extra installed:  python studies/benchmarks/compare_ross.py [--quick] [--json]

Every timed call starts from a fresh rotor object, so that nothing is cached; one untimed call of each comes first (ROSS
compiles). Medians of `REPEATS`, the two codes in turn, on one thread. Times are those of the process' CPU, so that
other work on the computer counts little. Ends with 1 where a ratio or an equality is missed.
"""

import argparse
import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import json
import statistics
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import fe_shaft as fe
import rotorsim as rs

warnings.filterwarnings("ignore")
REPEATS = 5
SPEEDS = np.linspace(0.0, 1000.0, 50)
FREQUENCIES = np.linspace(1.0, 1000.0, 200)
TIME = np.arange(5000) * 2e-4
EQUAL = 1e-6
"""Largest relative difference of the frequencies: both codes have the same element."""
TARGETS = {"campbell, 50 speeds": 10, "unbalance, 200 frequencies": 10, "1 s at 5 kHz": 5, "UCS, 30 stiffnesses": 50}


def ours() -> fe.Rotor:
    """The rotor: 1.5 m x 50 mm in 20 elements, two discs, damped bearings."""
    steel = fe.Material("steel", rho=7810.0, E=211e9, G_s=81.2e9)
    shaft = [fe.ShaftElement(0.075, 0.0, 0.05, material=steel) for _ in range(20)]
    discs = [fe.DiskElement.from_geometry(n, steel, 0.07, 0.05, d) for n, d in ((7, 0.28), (14, 0.35))]
    return fe.Rotor(shaft, discs, [fe.BearingElement(n, 1e6, 1e3, kyy=0.8e6) for n in (0, 20)])


def force(rotor: Any, ndof: int) -> np.ndarray:
    """A turning unbalance force at the first disc (n_t, ndof) [N]."""
    F = np.zeros((len(TIME), ndof))
    node = 7 * (ndof // 21)
    F[:, node], F[:, node + 1] = 10 * np.cos(300 * TIME), 10 * np.sin(300 * TIME)
    return F


def seconds(call: Callable[[Any], Any], fresh: Callable[[], Any]) -> tuple[float, Any]:
    """CPU time of one call on a fresh rotor, and its answer."""
    rotor = fresh()
    begin = time.process_time()
    answer = call(rotor)
    return time.process_time() - begin, answer


def main() -> None:
    """Print, or give as JSON, the times, their ratio and how far the answers are apart."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one repetition")
    parser.add_argument("--json", action="store_true", help="results as JSON on standard output")
    asked = parser.parse_args()
    try:
        import ross
    except ImportError:
        parser.error("needs ROSS; pip install 'rotorsim[benchmarks]'")

    def theirs() -> Any:
        return ours().to_ross(ross)

    jobs: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
        "campbell, 50 speeds": (lambda r: r.run_campbell(SPEEDS, 6), lambda r: r.run_campbell(SPEEDS, frequencies=6)),
        "unbalance, 200 frequencies": (
            lambda r: r.run_unbalance_response(7, 1e-4, 0.0, FREQUENCIES),
            lambda r: r.run_unbalance_response(7, 1e-4, 0.0, FREQUENCIES),
        ),
        "1 s at 5 kHz": (
            lambda r: r.run_time_response(300.0, force(r, r.ndof), TIME),
            lambda r: r.run_time_response(300.0, force(r, r.ndof), TIME),
        ),
        "UCS, 30 stiffnesses": (
            lambda r: r.run_ucs((1e6, 1e11), 30, 4),
            lambda r: r.run_ucs(stiffness_range=(6, 11), num=30, num_modes=16),
        ),
    }
    repeats = 1 if asked.quick else REPEATS
    out = sys.stderr if asked.json else sys.stdout
    print(f"fe_shaft compared with ROSS {ross.__version__}, CPU time on one thread, medians of {repeats}", file=out)
    rows, answers = [], {}
    for name, (mine, other) in jobs.items():
        seconds(mine, ours)
        if not name.startswith("UCS"):  # nothing of it is compiled, and it takes long
            seconds(other, theirs)
        pairs = [(seconds(mine, ours), seconds(other, theirs)) for _ in range(repeats)]
        answers[name] = pairs[0][0][1], pairs[0][1][1]
        rows.append(timed(name, *([pair[k][0] for pair in pairs] for k in range(2))))
        line = (
            "{analysis:<28} {fe_shaft_s:9.4f} s {ross_s:9.3f} s  x {ratio:6.1f} ({least:.1f} to {most:.1f}; {target})"
        )
        print(line.format(**rows[-1], target=f"target {TARGETS[name]}"), file=out, flush=True)
    equal, apart = equalities(theirs), differences(answers)
    name = "compressor of ROSS as a machine, six frequencies"
    equal[name], apart[f"{name}, with its splines"] = compressor(ross)
    for name, value in equal.items():
        print(f"{name:<58} {value:.1e}  (target {EQUAL:g})", file=out)
    for name, value in apart.items():
        print(f"{name:<58} {value:.1e}", file=out)
    met = all(r["ratio"] >= r["target"] for r in rows) and max(equal.values()) <= EQUAL
    if asked.json:
        results = {"ross": ross.__version__, "times": rows, "equal": equal, "differences": apart, "met": met}
        print(json.dumps(results, indent=2))
    sys.exit(0 if met else 1)


def timed(name: str, mine: list[float], other: list[float]) -> dict[str, Any]:
    """Median times of both and their ratio, with the smallest and largest ratio of a pair."""
    a, b = statistics.median(mine), statistics.median(other)
    pairs = [y / x for x, y in zip(mine, other, strict=True)]
    return {"analysis": name, "fe_shaft_s": a, "ross_s": b, "ratio": b / a, "least": min(pairs), "most": max(pairs),
            "target": TARGETS[name]}  # fmt: skip


def equalities(theirs: Callable[[], Any]) -> dict[str, float]:
    """Largest relative differences of what must be the same: matrices and frequencies."""
    mine, other = ours(), theirs()
    lateral = np.concatenate([6 * n + np.array([0, 1, 3, 4]) for n in range(21)])
    block = np.ix_(lateral, lateral)
    step = other.number_dof
    found = {}
    for name, a, b in (("M", mine.M(), other.M()), ("K", mine.K(), other.K(300.0)), ("C", mine.C(), other.C(300.0)),
                       ("G", mine.G(), other.G())):  # fmt: skip
        b = np.asarray(b)[block] if step == 6 else np.asarray(b)
        found[f"matrix {name}, of its largest"] = float(np.abs(a - b).max() / np.abs(b).max())
    for speed in (0.0, 300.0, 1000.0):
        a, b = mine.run_modal(speed).wn[:8], np.sort(theirs().run_modal(speed, num_modes=24).wn)
        found[f"frequencies at {speed:g} rad/s, eight modes"] = _apart(a, np.array([_next(b, w) for w in a]))
    return found


def compressor(ross: Any) -> tuple[float, float]:
    """Largest relative differences of six frequencies of ROSS's compressor, imported as a machine.

    At a speed at which all its tables have an entry: with these entries as coefficients, and with the splines of ROSS.
    """
    theirs = ross.compressor_example()
    speed = 837.7580409572781
    names = [kind + axes for kind in "kc" for axes in ("xx", "xy", "yx", "yy")]
    entries = [int(np.abs(b.frequency - speed).argmin()) for b in theirs.bearing_elements]
    held = [
        ross.BearingElement(n=b.n, **{name: float(getattr(b, name)[k]) for name in names})
        for b, k in zip(theirs.bearing_elements, entries, strict=True)
    ]
    mine = rs.plant.shaft_rotor(rs.machine.from_ross(theirs)).run_modal(speed).wn[:6]
    frozen = ross.Rotor(theirs.shaft_elements, theirs.disk_elements, held)
    every = [np.sort(one.run_modal(speed, num_modes=24).wn) for one in (frozen, theirs)]
    apart = [_apart(mine, np.array([_next(wn, w) for w in mine])) for wn in every]
    return apart[0], apart[1]


def differences(answers: dict[str, tuple[Any, Any]]) -> dict[str, float]:
    """Largest differences of the timed answers; ROSS integrates in time and interpolates its map otherwise."""
    a, b = answers["unbalance, 200 frequencies"]
    response = np.abs(np.asarray(b.forced_resp))
    dof = _plane_dofs(len(response))
    found = {
        "unbalance response of every node, of its largest": float(
            np.abs(np.abs(a.response[_plane_dofs(len(a.response))]) - response[dof]).max() / response[dof].max()
        )
    }
    a, b = answers["1 s at 5 kHz"]
    x, y = a.yout[:, _plane_dofs(a.yout.shape[1])], np.asarray(b.yout)
    y = y[:, _plane_dofs(y.shape[1])]
    found["motion over 1 s, of its largest"] = float(np.abs(x - y).max() / np.abs(y).max())
    a, b = answers["UCS, 30 stiffnesses"]
    found["UCS, lowest curve (ROSS searches it by interpolation)"] = _apart(a.wn[0], np.asarray(b.wn)[0])
    return found


def _plane_dofs(ndof: int) -> np.ndarray:
    """x and y of each of the 21 nodes, with four or six degrees of freedom a node."""
    step = ndof // 21
    return np.concatenate([np.arange(21) * step, np.arange(21) * step + 1])


def _next(values: np.ndarray, w: float) -> float:
    return float(values[np.abs(values - w).argmin()])


def _apart(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(np.asarray(a) / np.asarray(b) - 1).max())


if __name__ == "__main__":
    main()
