"""Worst case of a bounded step by grid, played in C, with its accuracy; a loop at 5 kHz under SCHED_FIFO.

python studies/benchmarks/real_time.py --steps 100000 --grids 16x8,32x16 --bounds 50

A row a grid, bound and kind of step, and one of all kinds `together`: median, 99.99 % and longest time of a step [us],
the longest over the median, steps cut short, and the journal's distance [clearances] from the exact plant's: over the
run, as far as a quarter of the step has an answer (steps compared, median, 99 %, ratio of the rms orbits), and after
one step from the same state (99 % and largest, every hundredth step).

A step's time is the least of up to five plays from the same state, in processor time; `once` is the longest of those
played once, `undisturbed` that of those during which the system did not take the processor away. `fixed` and `each`
[us] are the straight line of a time over the corrections of its step, `by count` its value at the most corrections,
over the median.

`--paced` steps are played on a grid of 0.2 ms, and those that ended after their deadline are counted. `ended` are runs
that the unit ended, which begin anew from rest; errors are those before the first of them, and their last steps are
not among those `played`.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[2]))

from fmu.export import choose, export, fmi_headers, plant_unit
from fmu.importer import ImportedUnit
from fmu.model import PlantUnit, identifier
from fmu.variables import ROW
from reynolds.newton import CUT, LIMIT
from rotorsim.machine import Machine, load_machine
from rotorsim.plant import Plant
from rotorsim.plant.kernels.layout import COLUMNS

SAMPLE, SPEED, PRESSURE = 2e-4, 600.0, 0.3e6
"""Sampling time [s], speed [rad/s] and gauge pressure [Pa] at the start."""
CONTACT = {"effects.contact.stiffness": 5e7, "effects.contact.friction": 0.1}
KINDS = ("whirl", "rub", "touch", "supply", "saturated", "all")
SHOWN = ("bearing.x", "bearing.y", "solver.corrections", "solver.overruns")
EVERY = 100
"""Steps between those that are compared with an exact one from the same state."""


def machine(bound: int | None) -> Machine:
    """The shipped rig whose sleeve takes contact, its steps bounded to so many corrections."""
    rig = load_machine("dtu_gas_bearing")
    rig = rig if rig.effects.get("contact") else rig.with_(CONTACT)
    return rig if bound is None else rig.with_({"solver.corrections": bound})


def rows(kind: str, n: int, seed: int) -> np.ndarray:
    """Inputs (n, 6) in the order of `fmu.variables.ROW`; the first are those at rest."""
    rng, t, found = np.random.default_rng(seed), SAMPLE * np.arange(n), np.tile([SPEED, PRESSURE, 0, 0, 0, 0], (n, 1))
    turning = np.stack([np.cos(700.0 * t), np.sin(700.0 * t)], axis=1)
    if kind == "whirl":
        found[:, 0], found[:, 1], found[:, 4:] = 800.0, 0.2e6, 60.0 * turning
    if kind == "rub":
        found[:, 0] = 500.0 + 300.0 * np.sin(3.0 * t)
        found[:, 4:] = 250.0 * np.stack([np.cos(130.0 * t), np.sin(130.0 * t)], axis=1)
    if kind in ("supply", "all"):
        found[:, 1] = rng.uniform(0.1e6, 0.7e6, n // 25 + 1).repeat(25)[:n]
    if kind in ("saturated", "all"):
        found[:, 2:4] = 5.0 * np.sign(rng.standard_normal((n // 10 + 1, 2))).repeat(10, axis=0)[:n]
    if kind in ("touch", "all"):
        hits = np.where(rng.random((n, 1)) < 0.01, rng.uniform(-1500.0, 1500.0, (n, 2)), 0.0)
        found[:, 4:] = hits + (150.0 * turning if kind == "all" else 0.0)
    found[0] = [SPEED, PRESSURE, 0, 0, 0, 0]
    return found


def absolute(given: np.ndarray, ambient: float) -> np.ndarray:
    """Inputs as the kernels take them: the supply [Pa] absolute."""
    found = given.copy()
    found[:, 1] += ambient
    return found


class Player:
    """The compiled program, and the bounded unit of a grid unpacked for it, in a folder."""

    def __init__(self, grid: tuple[int, int], bound: int, folder: Path) -> None:
        self.plant = Plant(machine(bound), n_theta=grid[0], n_z=grid[1], dt=SAMPLE)
        self.same = Plant(machine(None), n_theta=grid[0], n_z=grid[1], dt=SAMPLE)
        self.exact = Plant(machine(None), n_theta=grid[0], n_z=grid[1], dt=SAMPLE / 4)
        self.unit: PlantUnit = plant_unit(self.plant, SPEED, PRESSURE)
        self.folder, self.program = folder, folder / "play"
        self.archive = export(self.unit, folder / "rig.fmu", (3,), choose("host"), "native")[3]
        source = Path(__file__).with_suffix(".c")
        command = ["gcc", "-std=gnu11", "-O2", f"-I{fmi_headers()}", str(source), "-o", str(self.program), "-ldl"]
        subprocess.run(command, check=True)

    def play(self, given: np.ndarray, paced: bool) -> tuple[np.ndarray, str]:
        """Rows of the program (n, 7), and what it notes."""
        files = self.folder / "rows", self.folder / "table"
        given.tofile(files[0])
        with ImportedUnit(self.archive) as unit:
            library = next(Path(unit.folder, "binaries").glob(f"*/{identifier(self.unit)}.so"))
            references = [str(unit.variables[name].valueReference) for name in (*ROW, *SHOWN)]
            command = [self.program, library, self.unit.token, *files, str(int(paced)), *references]
            done = subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True)
        return np.fromfile(files[1]).reshape(-1, 7), done.stderr.strip()

    def single_errors(self, given: np.ndarray) -> np.ndarray:
        """Distance [clearances] of the journal from an exact step's out of the same state, every hundredth step."""
        own, exact = self.plant.assembly, self.same.assembly
        at = slice(own.film.journal, own.film.journal + 2)
        w, out, found = self.plant.start(SPEED, PRESSURE).w, np.zeros((1, own.columns)), []
        table = absolute(given, own.machine.gas.ambient_pressure)
        for k in range(len(table)):
            before = w.copy() if k % EVERY == 0 else None
            own.module.run(w, own.ix, own.parameters, table[k : k + 1], out, own.steps_per_sample)
            if before is None:
                continue
            before[[own.rotor.largest, own.film.convergence + LIMIT, own.film.convergence + CUT]] = 0.0
            if exact.module.run(before, exact.ix, exact.parameters, table[k : k + 1], out, exact.steps_per_sample) == 1:
                found.append(np.hypot(*(before[at] - w[at])))
        return np.array(found) / own.machine.films[0].clearance

    def run_errors(self, given: np.ndarray, journal: np.ndarray) -> tuple[np.ndarray, float]:
        """Distance [clearances] of the journal from the exact plant's, as far as that has an answer; orbits' ratio.

        The ratio is that of the rms radius of both over that time.
        """
        a = self.exact.assembly
        simulation, out = self.exact.start(SPEED, PRESSURE), np.zeros((len(given), a.columns))
        inputs = absolute(given, a.machine.gas.ambient_pressure)
        done = int(a.module.run(simulation.w, a.ix, a.parameters, inputs, out, a.steps_per_sample))
        true = out[1:done, [COLUMNS.index(f"journal_{axis}") for axis in "xy"]]
        own = journal[: len(true)]
        ratio = np.linalg.norm(own - own.mean(axis=0)) / np.linalg.norm(true - true.mean(axis=0))
        return np.hypot(*(true - own).T) / a.machine.films[0].clearance, float(ratio)


def times(table: np.ndarray) -> dict[str, float]:
    """Times [us] of the steps of a table that the unit did not end, and what of them is work.

    "fixed" and "each" are the line of the least times over the corrections, "by count" its value at the most of them
    over the median; "undisturbed" is the longest of the steps from which the system took no processor, NaN for none.
    """
    table = table[~np.isnan(table[:, 0])]
    least, work, taken = 1e6 * table[:, 1], table[:, 4], table[:, 6]
    alone = least[taken == 0]
    each, fixed = np.polyfit(work, least, 1)
    middle = float(np.median(least))
    return {
        "p50": middle, "p99.99": float(np.percentile(least, 99.99)), "longest": float(least.max()),
        "ratio": float(least.max() / middle), "undisturbed": float(alone.max()) if alone.size else np.nan,
        "disturbed": int((taken > 0).sum()), "once": 1e6 * float(table[:, 0].max()),
        "work p50": float(np.median(work)), "work": float(work.max()), "fixed": float(fixed), "each": float(each),
        "by count": float((fixed + each * work.max()) / middle),
    }  # fmt: skip


def measured(player: Player, kind: str, table: np.ndarray, seed: int) -> dict[str, float]:
    """Times [us] and errors [clearances] of the steps of a kind, which were played into a table."""
    steps, given = len(table), rows(kind, len(table), seed)
    ended = np.isnan(table[:, 0])
    first = int(np.argmax(ended)) if ended.any() else steps
    given = given[:first]
    before = np.append(0.0, np.nan_to_num(table[:-1, 5]))  # counted from 0 again after a run that ended
    cut = table[:, 5] > before
    (run, orbit), single = player.run_errors(given, table[:first, 2:4]), player.single_errors(given)
    return times(table) | {
        "ended": int(ended.sum()), "cut short": float(cut[~ended].mean()),
        "compared": len(run), "run p50": float(np.median(run)), "run p99": float(np.percentile(run, 99)),
        "orbit": orbit,
        "single p99": float(np.percentile(single, 99)),
        "single largest": float(single.max()),
    }  # fmt: skip


def paced(player: Player, steps: int, seed: int) -> dict[str, object]:
    """Response times [us] in a loop at 5 kHz, and how many of those played ended after the next sample was due."""
    table, note = player.play(rows("all", steps, seed), paced=True)
    late = table[~np.isnan(table[:, 0]), 0]
    response = 1e6 * late
    return {
        "scheduler": note, "steps": steps, "played": len(late), "ended": steps - len(late),
        "missed": int((late > SAMPLE).sum()), "p50": float(np.median(response)),
        "p99.99": float(np.percentile(response, 99.99)), "longest": float(response.max()),
    }  # fmt: skip


def table(options: argparse.Namespace) -> Iterator[dict[str, object]]:
    """A row a grid, bound and kind, and one of all kinds."""
    for grid in options.grids.split(","):
        n_theta, n_z = map(int, grid.split("x"))
        for bound in map(int, options.bounds.split(",")):
            with tempfile.TemporaryDirectory() as folder:
                player, head = Player((n_theta, n_z), bound, Path(folder)), {"grid": grid, "bound": bound}
                played = []
                for kind in KINDS if options.steps else ():
                    played.append(player.play(rows(kind, options.steps, options.seed), paced=False)[0])
                    yield head | {"kind": kind} | measured(player, kind, played[-1], options.seed)
                if played:
                    yield head | {"kind": "together"} | times(np.concatenate(played))
                if options.paced:
                    yield head | {"kind": "5 kHz"} | paced(player, options.paced, options.seed)


def main() -> None:
    """Print each row as it is measured, a line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=100_000, help="steps of each kind")
    parser.add_argument("--grids", default="16x8,32x8,32x16,64x16")
    parser.add_argument("--bounds", default="50", help="corrections a step, with commas")
    parser.add_argument("--paced", type=int, default=0, help="steps of the loop at 5 kHz")
    parser.add_argument("--seed", type=int, default=5)
    for row in table(parser.parse_args()):
        print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
