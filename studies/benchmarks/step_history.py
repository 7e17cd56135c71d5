"""Time of a sample of the plant over the project's history, as a ratio to a fixed reference measured in turns with it.

Run with a warm cache:  python studies/benchmarks/step_history.py [--add | --check]

Prints the line of the installed rotorsim. `--add` appends it to `history/steps.jsonl`, once for every change that
lands; `--check` compares it with the last lines of the same processor and ends with 1 where a case has become slower by
more than `SLOWER`, twice in a row, and with 3 where there is no such line. A line holds for each case the processor
time of a sample of 0.2 ms [us] and the ratio to the time of `reference_work`, both medians over `ROUNDS` turns.
"""

import argparse
import json
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numba
import numpy as np
from llvmlite.binding import get_host_cpu_name

sys.path.append(str(Path(__file__).resolve().parents[2]))

import rotorsim
from reynolds.vectors import wide_vectors
from rotorsim.experiments import Prbs
from rotorsim.machine import load_machine
from rotorsim.plant import Plant
from studies.benchmarks import speed, whole_plant
from studies.benchmarks.reference_work import in_turns

HISTORY = Path(__file__).parent / "history" / "steps.jsonl"
GRIDS = ((32, 8), (32, 16), (64, 16))
SAMPLES, PASSES, ROUNDS = 500, 500, 51
LAST, SLOWER = 3, 1.15
"""Number of earlier lines, the fastest of which a new one is compared with, and the ratio from which it is slower."""


def cases() -> Iterator[tuple[str, Callable[[], object]]]:
    """Name of each case and what runs `SAMPLES` samples of it: the bare step at two orbits, then the whole rig."""
    for n_theta, n_z in GRIDS:
        for orbit, me in speed.UNBALANCE.items():
            machine = load_machine("dtu_gas_bearing").replace("effects.unbalance.me", me)
            for path, value in speed.BARE.items():
                machine = machine.replace(path, value)
            simulation = Plant(machine, n_theta=n_theta, n_z=n_z, dt=2e-4).start(speed.SPEED, speed.PRESSURE)
            still = np.tile([speed.SPEED, speed.PRESSURE, 0, 0, 0, 0], (SAMPLES, 1))
            yield f"step {n_theta}x{n_z}, {orbit}", partial(simulation.advance, still)
    rig = Plant("dtu_gas_bearing", n_theta=32, n_z=16, dt=1e-4).start(whole_plant.SPEED, whole_plant.PRESSURE)
    prbs = Prbs(whole_plant.SPEED, whole_plant.PRESSURE, 1.0, 1.0).rows(2000, SAMPLES)
    yield "whole rig under PRBS, 32x16, 0.1 ms", lambda: rig.advance(prbs)


def line() -> dict[str, object]:
    """Line that one landing adds to the history."""
    date, commit = _commit()
    where = {"date": date, "commit": commit, "machine": processor(), "numba": numba.__version__}
    return where | {"cases": {name: in_turns(run, SAMPLES, PASSES, ROUNDS) for name, run in cases()}}


def _commit() -> tuple[str, str]:
    """Date and short name of the commit in rotorsim's working tree, the name with `+` where files were changed since.

    An installed copy has no tree; then it is that of this file.
    """
    installed, here = (Path(rotorsim.__file__).parents[1], Path(__file__).parents[2])
    tree = installed if (installed / ".git").exists() else here

    def git(*arguments: str) -> str:
        return subprocess.run(["git", "-C", str(tree), *arguments], check=True, capture_output=True, text=True).stdout

    date, commit = git("log", "-1", "--format=%cs %h").split()
    changed = git("status", "--porcelain", "--", "rotorsim", "reynolds", "fe_shaft")
    return date, commit + ("+" if changed else "")


def processor() -> str:
    """Name of the processor, the compiler's name of the kind that code is made for (NUMBA_CPU_NAME or its own), and
    the bits of its vectors: a kind that is named alone keeps the computer's own features (NUMBA_CPU_FEATURES)."""
    cpuinfo = Path("/proc/cpuinfo")
    lines = cpuinfo.read_text().splitlines() if cpuinfo.exists() else []
    names = [text.partition(":")[2].strip() for text in lines if text.startswith("model name")]
    name = names[0] if names else platform.processor() or platform.machine()
    return f"{name} ({numba.config.CPU_NAME or get_host_cpu_name()}, {vector_bits()} bits)"


def vector_bits() -> int:
    """Bits of the widest vectors that kernels fill, as the machine code of a small one has them."""

    @numba.njit
    def increase(w):
        wide_vectors()
        for k in range(w.size):
            w[k] += 1.0

    increase(np.zeros(1))
    (code,) = increase.inspect_asm().values()
    return next((bits for bits, register in ((512, "zmm"), (256, "ymm")) if register in code), 128)


def read(history: Path = HISTORY) -> list[dict]:
    """All lines, oldest first."""
    return [json.loads(text) for text in history.read_text(encoding="utf-8").splitlines()] if history.exists() else []


def slower(new: dict, lines: list[dict]) -> dict[str, str]:
    """Cases that take more than `SLOWER` times the fastest of their processor's last lines, by name."""
    comparable, found = [old["cases"] for old in lines if _comparable(old, new)][-LAST:], {}
    for name, case in new["cases"].items():
        before = [old[name]["ratio"] for old in comparable if name in old]
        if before and case["ratio"] > SLOWER * (fastest := min(before)):
            found[name] = (
                f"{name}: {case['ratio']:.2f} of the reference, {case['ratio'] / fastest:.2f} times the fastest lately"
            )
    return found


def _comparable(old: dict, new: dict) -> bool:
    return old["machine"] == new["machine"] and old["commit"] != new["commit"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    choice = parser.add_mutually_exclusive_group()
    choice.add_argument("--add", action="store_true", help="append the line to the history")
    choice.add_argument("--check", action="store_true", help="end with 1 where a case is slower, 3 without a line")
    asked = parser.parse_args()
    new = line()
    print(json.dumps(new))
    lines = read()
    alone = not any(_comparable(old, new) for old in lines)
    if alone:
        print(f"no earlier line of {new['machine']} to compare with", file=sys.stderr)
    found = slower(new, lines)
    if found and asked.check:  # what else runs may slow one case down once
        again = slower(line(), lines)
        found = {name: again[name] for name in found if name in again}
    for sentence in found.values():
        print(f"slower: {sentence}", file=sys.stderr)
    if asked.add:
        with HISTORY.open("a", encoding="utf-8") as history:
            history.write(json.dumps(new) + "\n")
    return (3 if alone else 1 if found else 0) if asked.check else 0


if __name__ == "__main__":
    sys.exit(main())
