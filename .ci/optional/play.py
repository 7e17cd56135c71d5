"""Replays a unit's stored reference through its binaries for other platforms and prints the largest deviations.

python .ci/optional/play.py UNIT.fmu WORK_FOLDER: needs zig (ziglang), and per platform wine, or qemu-aarch64 with the
C library of arm64 below /usr/aarch64-linux-gnu; a platform whose emulator is missing is named and left out.
"""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
from fmpy import read_model_description

from fmu.export import TARGETS, fmi_headers
from fmu.importer import stored

ROOT = Path(__file__).parents[2]
RUNNERS = {
    "x86_64-linux": [],
    "x86_64-windows": ["wine"],
    "aarch64-linux": ["qemu-aarch64", "-L", "/usr/aarch64-linux-gnu"],
}
TOLERANCE = 1e-9


def numbers(unit: Path) -> tuple[str, np.ndarray]:
    """Input of the player, and the outputs (n + 1, outputs) that it should write."""
    references = {v.name: v.valueReference for v in read_model_description(unit).modelVariables}
    header, given = stored(unit, "in.csv")
    names, wanted = stored(unit, "out.csv")
    chosen = [k for k, name in enumerate(header) if k and name != "drive.on"]
    shown = [k for k, name in enumerate(names) if k and name != "film.touchdown"]
    head = [given[1][0] - given[0][0], len(given), len(chosen), len(shown)]
    head += [references[header[k]] for k in chosen] + [references[names[k]] for k in shown]
    words = [repr(x) for x in head] + [repr(row[k]) for row in given for k in chosen]
    return "\n".join(words), np.array(wanted)[:, shown]


def play(unit: Path, target: str, folder: Path) -> np.ndarray:
    """Outputs of the unit's binary for a platform."""
    t = TARGETS[target]
    with zipfile.ZipFile(unit) as archive:
        name = next(n for n in archive.namelist() if n.startswith(f"binaries/{t.folder3}/"))
        library = folder / f"unit{t.suffix}"
        library.write_bytes(archive.read(name))
    player = folder / ("player.exe" if "windows" in target else f"player-{target}")
    libraries = [] if "windows" in target else ["-ldl", "-lm"]
    subprocess.run(
        [sys.executable, "-m", "ziglang", "cc", "-target", t.zig, "-O1", f"-I{fmi_headers()}",
         ROOT / "tests/fmu/player.c", "-o", player, *libraries], check=True,
    )  # fmt: skip
    words, _ = numbers(unit)
    token = read_model_description(unit).guid
    command = [*RUNNERS[target], str(player), str(library), token]
    done = subprocess.run(command, input=words, capture_output=True, text=True, check=True)
    return np.array([[float(x) for x in line.split(",")] for line in done.stdout.splitlines()])


def main() -> int:
    """Play all platforms; 1 if one is too far from the reference."""
    unit, folder, bad = Path(sys.argv[1]), Path(sys.argv[2]), 0
    _, wanted = numbers(unit)
    for target, runner in RUNNERS.items():
        if runner and not shutil.which(runner[0]):
            print(f"{target}: {runner[0]} is not installed, left out")
            continue
        found = play(unit, target, folder)
        scale = np.maximum(np.abs(wanted).max(axis=0), 1e-300)
        worst = float((np.abs(found - wanted) / scale).max())
        same = "equal to the last bit" if np.array_equal(found, wanted) else f"relative deviation {worst:.2g}"
        print(f"{target}: {len(wanted) - 1} steps, {same}")
        bad += worst > TOLERANCE
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
