"""Table of critical speeds against a direct search: `python tests/support/compare_modes.py 1 3 dtu_gas_bearing`.

Numbers are those of `random_machines`; without any, all of them and every shipped machine. On films the direct search
is the degree of the determinant over speed and damping, and all eigenvalues at each critical speed. A row holds the
critical speeds of order 1, the largest relative difference from the direct search, the asked speeds at which all
eigenvalues are not as many in the region, the difference from 4 and 16 modes and 10 and 80 speeds and from the mirror
image, the speeds at which the number of modes is not proven, and the seconds of both.
"""

import sys
import time

import numpy as np

from direct_search import all_eigenvalues, counted, crossings
from fe_shaft.pencil import Region
from mirror import mirrored
from random_machines import COUNT, random_machine
from rotorsim.analysis import campbell
from rotorsim.plant import Plant

RPM = np.pi / 30
SHIPPED = {
    "aerostatic_spindle": (0.5e6, 1e3, 60e3), "bently_rk4": (0.0, 300, 10e3), "dtu_gas_bearing": (0.5e6, 500, 12e3),
    "foil_turbo_rotor": (0.0, 6e3, 40e3), "grooved_turbo_rotor": (0.0, 20e3, 200e3), "plain_rotor": (0.0, 300, 20e3),
    "pump_on_tables": (0.0, 300, 5e3), "rigid_rotor_self_acting": (0.0, 3e3, 30e3),
}  # fmt: skip
"""Gauge pressure [Pa] and range [rpm]."""

NARROW = 1e-9
"""Relative distance from a critical speed at which the sides of a jump are looked at."""

JUMPS = 0.05
"""Share of the clearance by which a journal jumps at a fold of the equilibrium; an interval of doubt is far shorter."""


def criticals(plant, low, high, pressure=0.0, count=20, modes=8, order=1):
    """Rows (speed, damping ratio, direction) between two speeds [rad/s], ascending in speed, and the diagram."""
    found = campbell(plant, np.linspace(low, high, count), pressure, modes)
    names = ("critical_speed", "critical_zeta", "critical_direction")
    rows = np.column_stack([found[name].values[found["critical_order"].values == order] for name in names])
    size = np.abs(rows[:, 0])
    rows = rows[(size >= min(abs(low), abs(high))) & (size <= max(abs(low), abs(high)))]
    return rows[np.argsort(np.abs(rows[:, 0]))], found


def apart(rows, others):
    """Largest relative difference of critical speeds; inf where numbers, directions or damping are not the same."""
    if len(rows) != len(others) or (rows[:, 2] != others[:, 2]).any():
        return np.inf
    if np.abs(rows[:, 1] - others[:, 1]).max(initial=0.0) > 1e-5:
        return np.inf
    return float(np.abs(np.abs(others[:, 0] / rows[:, 0]) - 1).max(initial=0.0))


def compared(machine, low, top, pressure=0.0, cells=64):
    """A row of the table as a dictionary."""
    plant, start = Plant(machine), time.process_time()
    rows, found = criticals(plant, low, top, pressure)
    seconds = time.process_time() - start
    search = _from_search if plant.machine.film is None else _from_degrees
    direct = search(plant, pressure, low, top, rows, cells) | {"miscounted": _miscounted(plant, pressure, found)}
    searched = time.process_time() - start - seconds
    others = [criticals(plant, low, top, pressure, *shown)[0] for shown in ((10, 4), (80, 16))]
    back, _ = criticals(Plant(mirrored(plant.machine)), -top, -low, pressure)
    return {
        "criticals": len(rows), **direct, "shown": max(apart(rows, other) for other in others),
        "mirror": apart(rows, back), "unproven": found.attrs["nodes"] - found.attrs["nodes_proven"],
        "not_certain": _not_certain(plant, pressure, found), "seconds": seconds, "search": searched,
    }  # fmt: skip


def _from_search(plant, pressure, low, top, rows, cells):
    """Number and largest relative difference of the critical speeds of a direct search."""
    direct = crossings(lambda speed: all_eigenvalues(plant, speed, pressure), low, top, cells=cells)
    return {"direct": len(direct), "apart": apart(rows, direct[np.argsort(direct[:, 0])])}


def _from_degrees(plant, pressure, low, top, rows, _cells):
    """Whether the critical speeds are as many as counted, and their largest relative distance from an eigenvalue."""
    if counted(plant, low, top, rows, pressure):
        return {"direct": np.nan, "apart": np.inf}
    off = [_off_the_line(plant, pressure, *row[:2]) for row in rows]
    return {"direct": len(rows), "apart": max(off, default=0.0)}


def _off_the_line(plant, pressure, speed, zeta):
    """Relative distance of an eigenvalue from the line, or of the ends between which one jumps over it."""
    here = speed * (np.sqrt(1 - zeta**2) * 1j - zeta)
    sides = [(v, all_eigenvalues(plant, v, pressure)) for v in (speed, speed * (1 - NARROW), speed * (1 + NARROW))]
    gaps = [np.abs(s[np.abs(s - here).argmin()]) / v - 1 for v, s in sides]
    return min(abs(gaps[0]), NARROW if gaps[1] * gaps[2] < 0 else np.inf)


def _not_certain(plant, pressure, found):
    """Number of the intervals in which a mode is not certain though the equilibrium does not jump."""
    ends = [
        [plant.equilibrium(v, pressure).journals for v in pair] for pair in found.attrs["not_certain"].reshape(-1, 2)
    ]
    least = min((film.clearance for film in plant.machine.films), default=np.inf)
    return sum(not np.abs(b - a).max(initial=0.0) > JUMPS * least for a, b in ends)


def _miscounted(plant, pressure, found):
    """Number of the asked speeds at which the modes of the region are not as many as among all eigenvalues."""
    region = Region(*(found.attrs[f"region_{name}"] for name in ("reach", "floor", "zeta")))
    counts = [region.holds(all_eigenvalues(plant, v, pressure)).sum() for v in found["speed"].values]
    known = np.isfinite(found["modes"].values)
    return int((found["modes"].values != counts)[known].sum())


def agrees(row):
    """Whether a row has no difference above 1e-6, no speed without proof and no mode that is not certain."""
    worst = max(row["apart"], row["shown"], row["mirror"])
    return worst < 1e-6 and not (row["unproven"] or row["not_certain"] or row["miscounted"])


def main(names):
    """Print the table, and at the end how many rows have differences above 1e-6 or speeds without proof."""
    rows, wrong = 0, []
    for name in names or [*map(str, range(COUNT)), *SHIPPED]:
        machine, low, top, pressure, cells = name, 0.0, 0.0, 0.0, 32
        if name.isdigit():
            machine, top = random_machine(int(name))
            low, cells = top / 20, 64
        else:
            pressure, low, top = SHIPPED[name]
            low, top = low * RPM, top * RPM
        row = compared(machine, low, top, pressure, cells)
        rows += 1
        if not agrees(row):
            wrong.append(name)
        print(f"{name:24s}", *(f"{k} {v:.3g}" for k, v in row.items()), flush=True)
    print(f"{rows} machines, {len(wrong)} with an inequality: {' '.join(wrong)}")


if __name__ == "__main__":
    main(sys.argv[1:])
