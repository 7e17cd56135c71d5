"""Runs all cases in all importers and prints Markdown tables: python table.py FOLDER PYTHON_OF_THE_IMPORTERS.

Ends with 1 if an importer that plays a kind of unit today no longer does, or a checker finds something.
"""

import json
import os
import subprocess
import sys
from datetime import date
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
NAMES = {
    "fmpy": "FMPy", "libcosimpy": "libcosimpy", "ecospy": "ecospy", "fmuloader": "fmuloader", "c": "C program (gcc)",
}  # fmt: skip
ABLE = {"fmpy": ("unit", "exchange", "system"), "fmuloader": ("unit", "exchange"), "c": ("unit",)}
"""Kinds that an importer has a function for, where it is not units and systems."""
TIME_LIMIT = 300.0


def able(importer: str, case: dict) -> bool:
    """Whether an importer claims to run a kind of case."""
    if (importer, case["fmi"]) == ("c", 2) or (importer, case["kind"], case["fmi"]) == ("fmpy", "system", 3):
        return False
    return case["kind"] in ABLE.get(importer, ("unit", "system"))


def broken(importer: str, case: dict) -> bool:
    """Whether an importer fails on every unit of a version: libcosimpy 0.0.6 ends on an empty one of FMI 3.0 too."""
    return (importer, case["fmi"]) == ("libcosimpy", 3)


def play(importer: str, number: int, case: dict, cases: Path, python: str) -> str:
    """Verdict in a few words."""
    library = str(Path(python).parents[1] / "lib")
    words = [python, str(HERE / "play.py"), importer, str(number), str(cases)]
    environment = os.environ | {"LD_LIBRARY_PATH": library}
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=TIME_LIMIT, env=environment)
    except subprocess.TimeoutExpired:
        return f"no end after {TIME_LIMIT:.0f} s"
    if done.returncode < 0:
        return f"ends with signal {-done.returncode}"
    lines = [line for line in done.stdout.splitlines() if line.startswith("ROWS ")]
    if done.returncode or not lines:
        return (done.stderr.strip().splitlines() or ["no output"])[-1][:90]
    return verdict(np.array(json.loads(lines[-1][5:])), np.array(case["expected"]), case["allowed"])


def verdict(found: np.ndarray, expected: np.ndarray, allowed: float) -> str:
    """'same bits', or the largest deviation over each output's largest value."""
    if found.shape != expected.shape:
        return f"too far: {len(found)} rows, not {len(expected)}"
    if np.array_equal(found, expected):
        return "same bits"
    worst = float((np.abs(found - expected).max(axis=0) / np.abs(expected).max(axis=0)).max())
    return f"{worst:.1g}" if worst <= allowed else f"{worst:.1g}: too far"


def good(found: str) -> bool:
    """Whether a verdict is one of agreement, or there was nothing to play."""
    return found in ("-", "same bits") or (found[0].isdigit() and "too far" not in found)


def versions(python: str) -> dict[str, str]:
    """Version of every importer."""
    code = "import json, importlib.metadata as m; print(json.dumps({n: m.version(n) for n in %r}))"
    names = ["fmpy", "libcosimpy", "ecospy", "fmuloader", "fmu-manipulation-toolbox", "pyssp-standard"]
    done = subprocess.run([python, "-c", code % names], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def checkers(files: list[str], python: str) -> list[tuple[str, str]]:
    """Checker and what it finds in all files together."""
    from fmpy.validation import validate_fmu

    from fmu.check import UNCHECKED, findings

    units = [f for f in files if f.endswith(".fmu")]
    tool = str(Path(python).with_name("fmutool"))
    lines = []
    for unit in units:
        done = subprocess.run([tool, "-input", unit, "-check"], capture_output=True, text=True, check=True)
        both = (done.stdout + done.stderr).splitlines()
        lines += [line for line in both if line.startswith(("ERROR", "CRITICAL"))]
        assert any("No semantic error" in line for line in both) or lines
    found = {
        "official schemas (fmu.check)": [f for file in files for f in findings(file) if UNCHECKED not in f],
        "FMPy validate_fmu": [p for unit in units for p in validate_fmu(unit)],
        "fmutool -check": lines,
        "pyssp-standard": [p for file in files if file.endswith(".ssp") for p in read_by_pyssp(file, python)],
    }
    return [(name, f"{len(all_)} findings{': ' + all_[0][:90] if all_ else ''}") for name, all_ in found.items()]


def read_by_pyssp(file: str, python: str) -> list[str]:
    """Report of pyssp-standard on a system."""
    code = (
        "import sys; from pyssp_standard.ssp import SSP\n"
        "with SSP(sys.argv[1], mode='r') as ssp:\n"
        "    with ssp.system_structure as ssd: ssd.__check_compliance__()"
    )
    done = subprocess.run([python, "-c", code, file], capture_output=True, text=True)
    return (done.stderr.strip().splitlines() or ["failed"])[-1:] if done.returncode else []


def main() -> int:
    """Print the tables."""
    folder, python = Path(sys.argv[1]), sys.argv[2]
    cases = json.loads((folder / "cases.json").read_text(encoding="utf-8"))
    known = versions(python)
    print(f"{date.today()}, Python {sys.version.split()[0]}\n")
    print("| unit | " + " | ".join(f"{name} {known.get(key, '')}".strip() for key, name in NAMES.items()) + " |")
    print("|---" * (1 + len(NAMES)) + "|")
    bad = 0
    for number, case in enumerate(cases):
        title, row = f"{case['name']}, FMI {case['fmi']}.0", []
        for importer in NAMES:
            found = play(importer, number, case, folder / "cases.json", python) if able(importer, case) else "-"
            row.append(found)
            bad += not broken(importer, case) and not good(found)
        print(f"| {title} | " + " | ".join(row) + " |", flush=True)
    print(f"\n| checker ({', '.join(f'{n} {v}' for n, v in known.items() if '-' in n)}) | finds |\n|---|---|")
    for name, found in checkers(sorted(map(str, [*folder.glob("*.fmu"), *folder.glob("*.ssp")])), python):
        print(f"| {name} | {found} |")
        bad += not found.startswith("0 ")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
