"""Records of a rotor simulated by ROSS 2.3.0, as CSV files: test data for `diagnose` from an independent program.

Needs numpy and ROSS alone, so that it runs in an environment of its own:

    python -m venv ross && ross/bin/pip install ross-rotordynamics==2.3.0 "plotly<6" "pandas<3" "nfoursid>=1.0"
    ross/bin/python studies/benchmarks/ross_records.py OUT [CASE ...]

ROSS turns the rotor of the shipped machine file `plain_rotor` (the same shaft, disc and bearings; other elements,
another time integration) about half its first critical speed. Each case is a folder of steady records (`fit`,
`held_out`, `untouched`) with white noise of 0.1 um. Two sizes of each fault:

- sound: nothing is wrong;  two_planes: a second unbalance at a quarter of the span
- bow: a half sine between the bearings, as the force of the shaft's own stiffness
- coupling_parallel, coupling_angular: a flexible coupling out of line at the left end (Xia et al. in ROSS)
- crack: a crack after Mayes right of the disc. The model of ROSS breathes with its own x axis, so its weight acts along
  -x, and the records are turned by a right angle: the weight is along -y again, and the crack opens below
- rub: a stator around the disc without friction, of a rotor without weight
"""

import argparse
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

try:
    import ross
    from ross.faults import Crack, MisalignmentFlex, Rubbing
except ImportError:  # the help does without
    ross = None

warnings.filterwarnings("ignore")
ELEMENTS, DISC, QUARTER = 12, 6, 3
SAMPLE, SECONDS, SETTLING = 2e-4, 1.4, 1.6
DAMPING, CRITICAL = 0.02, 46.0
"""Damping ratio of the shaft: a run starts at rest and has to forget it; first critical speed [Hz], about."""
SPEEDS = {
    "fit": (0.40, 0.46, 0.50, 0.55, 0.70, 0.80), "held_out": (0.43, 0.52, 0.62, 0.75),
    "untouched": (0.42, 0.51, 0.66, 0.78),
}  # fmt: skip
"""Speeds by role, as shares of the first critical one: about its half, where 2X is strong."""
UNBALANCE, NOISE = 25e-6, 0.1e-6
REDUCED = {"model_reduction": {"method": "pseudomodal", "num_modes": 24}}
Motion = Callable[[Any, float, np.ndarray], np.ndarray]


def rotor() -> Any:
    """The rotor of the machine file; the shaft's damping is proportional to its stiffness."""
    steel = ross.Material("steel_of_the_rotor", rho=7850, E=210e9, Poisson=0.3)
    beta = 2 * DAMPING / (2 * np.pi * CRITICAL)
    shaft = [ross.ShaftElement(0.6 / ELEMENTS, 0.0, 0.02, material=steel, beta=beta) for _ in range(ELEMENTS)]
    disc = ross.DiskElement(n=DISC, m=3.946, Id=0.006519, Ip=0.012627)
    bearings = [ross.BearingElement(n=n, kxx=10e6, cxx=200.0) for n in (0, ELEMENTS)]
    return ross.Rotor(shaft, [disc], bearings)


def at_disc(one: Any, response: Any) -> np.ndarray:
    """Displacement (n, 2) [m] of the disc."""
    first = DISC * one.number_dof
    return np.array(response.yout[:, first : first + 2])


def sag(one: Any) -> np.ndarray:
    """Displacement (2,) [m] of the disc by the weight."""
    # along and about the axis nothing holds the rotor: least squares
    first = DISC * one.number_dof
    return np.asarray(np.linalg.lstsq(one.K(0.0), one.gravitational_force(), rcond=1e-9)[0][first : first + 2])


def turned(one: Any, speed: float, t: np.ndarray, more: np.ndarray | float = 0.0) -> np.ndarray:
    """Motion (n, 2) [m] of the unbalanced disc with `more` forces (dof, n) [N], the weight included."""
    F = one.unbalance_force_over_time([DISC], [UNBALANCE], [0.0], speed, t) + more
    return at_disc(one, one.run_time_response(speed, F.T, t)) + sag(one)


def two_planes(me: float) -> Motion:
    """A second unbalance [kg m] at a quarter of the span."""

    def motion(one: Any, speed: float, t: np.ndarray) -> np.ndarray:
        return turned(one, speed, t, one.unbalance_force_over_time([QUARTER], [me], [1.9], speed, t))

    return motion


def bow(size: float) -> Motion:
    """A half sine between the bearings [m], at 63 deg."""

    def motion(one: Any, speed: float, t: np.ndarray) -> np.ndarray:
        held = one.K(0.0).copy()
        for n in (0, ELEMENTS):
            for dof in (0, 1):
                held[n * one.number_dof + dof, n * one.number_dof + dof] -= 10e6
        z = np.arange(ELEMENTS + 1) / ELEMENTS
        u, slope = size * np.sin(np.pi * z), size * np.pi / 0.6 * np.cos(np.pi * z)
        q = np.zeros((one.ndof, 2))  # for a bow along x and along y
        q[0 :: one.number_dof, 0], q[4 :: one.number_dof, 0] = u, slope
        q[1 :: one.number_dof, 1], q[3 :: one.number_dof, 1] = u, -slope
        angle = speed * t + np.radians(63)
        return turned(one, speed, t, held @ q @ np.array([np.cos(angle), np.sin(angle)]))

    return motion


def coupling(kind: str, size: float) -> Motion:
    """A flexible coupling out of line by `size` [m] along x and y, or [rad]."""

    def motion(one: Any, speed: float, t: np.ndarray) -> np.ndarray:
        fault = MisalignmentFlex(
            one, n=0, mis_type=kind, mis_distance_x=size, mis_distance_y=size, mis_angle=size,
            radial_stiffness=40e3, bending_stiffness=38e3,
        )  # fmt: skip
        return turned(one, speed, t, fault.compute_reaction_force(speed * t))

    return motion


def crack(depth: float) -> Motion:
    """A crack of a depth, as a share of the diameter."""

    def motion(one: Any, speed: float, t: np.ndarray) -> np.ndarray:
        fault = Crack(one, n=DISC, depth_ratio=depth, crack_model="Mayes")
        F = one.unbalance_force_over_time([DISC], [UNBALANCE], [-np.pi / 2], speed, t)
        F += one.gravitational_force(direction="x")[:, None]

        def force(step: int, **state: Any) -> np.ndarray:
            F = np.zeros(one.ndof)
            F[fault.dofs] = (fault.K_elem - fault.mayes(speed * t[step])) @ state["disp_resp"][fault.dofs]
            return F

        x, y = at_disc(one, one.run_time_response(speed, F.T, t, method="newmark", add_to_RHS=force, **REDUCED)).T
        return np.column_stack([-y, x])

    return motion


def rub(stiffness: float) -> Motion:
    """A stator [N/m] around the disc at a gap of 6 um."""

    def motion(one: Any, speed: float, t: np.ndarray) -> np.ndarray:
        fault = Rubbing(one, DISC, 6e-6, stiffness, 0.0, 0.0)
        fault.forces = np.zeros((one.ndof, len(t)))
        F = one.unbalance_force_over_time([DISC], [UNBALANCE], [0.0], speed, t)

        def force(step: int, **state: Any) -> np.ndarray:
            return np.asarray(fault._get_force_over_time(step, state["disp_resp"], state["velc_resp"], speed))

        return at_disc(one, one.run_time_response(speed, F.T, t, method="newmark", add_to_RHS=force, **REDUCED))

    return motion


CASES: dict[str, Motion] = {
    "sound": turned,
    "two_planes_10": two_planes(10e-6), "two_planes_40": two_planes(40e-6),
    "bow_2": bow(2e-6), "bow_8": bow(8e-6),
    "coupling_parallel_100": coupling("parallel", 1e-4), "coupling_parallel_200": coupling("parallel", 2e-4),
    "coupling_angular_5": coupling("angular", np.radians(5)),
    "coupling_angular_10": coupling("angular", np.radians(10)),
    "crack_15": crack(0.15), "crack_30": crack(0.30),
    "rub_100": rub(1e5), "rub_400": rub(4e5),
}  # fmt: skip
"""Cases and how the disc moves in them."""


def records(name: str) -> Iterator[tuple[str, np.ndarray]]:
    """File names and tables (n, 5): time, angle, speed, x, y in SI units; the record at half the critical twice."""
    one, rng = rotor(), np.random.default_rng([sorted(CASES).index(name), 5])
    n, skipped = round(SECONDS / SAMPLE), round(SETTLING / SAMPLE)
    t = np.arange(n + skipped) * SAMPLE
    # the crack's records are turned by a right angle, and the mark on the shaft with them
    ahead = np.pi / 2 if name.startswith("crack") else 0.0
    plan = [(f"{role}_{i + 1}", s) for role, shares in SPEEDS.items() for i, s in enumerate(shares)]
    for record, share in [*plan, ("fit_repeat", 0.50)]:
        speed = 2 * np.pi * CRITICAL * share
        y = CASES[name](one, speed, t)[skipped:] + rng.normal(0, NOISE, (n, 2))
        angle = speed * t[skipped:] + ahead
        yield record, np.column_stack([t[:n], angle, np.full(n, speed), y])


def main() -> None:
    """Write the cases asked for, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path, help="folder of the cases, each a folder of CSV files")
    parser.add_argument("case", nargs="*", help=f"one of {', '.join(CASES)}; all when not given")
    asked = parser.parse_args()
    for unknown in (case for case in asked.case if case not in CASES):
        parser.error(f"case '{unknown}' is not known; choose one of {', '.join(CASES)}")
    if ross is None:
        parser.error("needs ROSS; pip install ross-rotordynamics==2.3.0")
    head = "time [s],angle [rad],speed [rad/s],disc_measured_x [m],disc_measured_y [m]"
    for name in asked.case or CASES:
        folder = asked.out / name
        folder.mkdir(parents=True, exist_ok=True)
        for record, rows in records(name):
            np.savetxt(folder / f"{record}.csv", rows, fmt="%.9g", delimiter=",", header=head, comments="")
        print(name, flush=True)


if __name__ == "__main__":
    main()
