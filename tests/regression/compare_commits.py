"""Bitwise comparison of the numbers of two commits on one computer.

    python tests/regression/compare_commits.py BEFORE [AFTER] [--parts runs units]

AFTER is the working tree when it is not given. Both run the same `sampled_runs.py` (this copy of it), each in its own
process with its own sources, so that differences between processors cannot pass for a change. Exit code 0: no bit
differs; 1: some do, and the table names which and by how much.
"""

import argparse
import difflib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
PARTS = ("runs", "linear", "units", "identification", "diagnosis", "texts")
SHOWN = 12
"""Lines of a changed text that are printed."""


@contextmanager
def sources(commit: str | None) -> Iterator[Path]:
    """A folder with the sources of a commit; the working tree for None."""
    root = HERE.parents[1]
    if commit is None:
        yield root
        return
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        subprocess.run(["git", "-C", root, "worktree", "add", "--quiet", "--detach", tree, commit], check=True)
        try:
            yield tree
        finally:
            subprocess.run(["git", "-C", root, "worktree", "remove", "--force", tree], check=True)


def numbers(tree: Path, parts: list[str], records: Path) -> dict[str, np.ndarray]:
    """Results that the sources in `tree` compute; `records` is the folder of those that are diagnosed."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "numbers.npz"
        environment = os.environ | {
            "PYTHONPATH": str(tree),
            "OPENBLAS_NUM_THREADS": "1",
            "ROTORSIM_RECORDS": str(records),
        }
        command = [sys.executable, str(HERE / "sampled_runs.py"), str(out), *parts]
        subprocess.run(command, check=True, env=environment, cwd=folder)
        with np.load(out) as stored:
            return {key: stored[key] for key in stored.files}


def differences(before: dict[str, np.ndarray], after: dict[str, np.ndarray]) -> list[str]:
    """A line for every series that is missing, new or not equal in every bit."""
    lines = []
    for key in sorted(before.keys() | after.keys()):
        if key not in after or key not in before:
            lines.append(f"{key}: only {'before' if key in before else 'after'}")
            continue
        old, new = before[key], after[key]
        if key.startswith("texts/"):
            lines += _changes(key, old, new)
            continue
        if old.shape != new.shape or old.dtype != new.dtype:
            lines.append(f"{key}: {old.dtype} {old.shape} before, {new.dtype} {new.shape} after")
        elif old.tobytes() != new.tobytes():
            change = np.nanmax(np.abs(new - old)) / max(float(np.nanmax(np.abs(old))), 1e-300)
            lines.append(f"{key}: differs, by {change:.2g} of its largest value")
    return lines


def _changes(name: str, before: np.ndarray, after: np.ndarray) -> list[str]:
    """The first lines that differ between two texts."""
    texts = [text.tobytes().decode().splitlines() for text in (before, after)]
    found = [
        line[:160] for line in difflib.unified_diff(*texts, n=0, lineterm="") if line[:2] not in ("--", "++", "@@")
    ]
    return [f"{name}: {len(found)} lines differ", *(f"    {line}" for line in found[:SHOWN])] if found else []


def main() -> None:
    """Compare and print; see the module's docstring."""
    parser = argparse.ArgumentParser(description="Compare two commits bit by bit.")
    parser.add_argument("before")
    parser.add_argument("after", nargs="?")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS))
    chosen = parser.parse_args()
    results = []
    with tempfile.TemporaryDirectory() as folder:
        records = Path(folder) / "records"
        if "diagnosis" in chosen.parts:
            with sources(chosen.after) as tree:
                numbers(tree, ["hidden"], records)
        for commit in (chosen.before, chosen.after):
            with sources(commit) as tree:
                results.append(numbers(tree, chosen.parts, records))
    lines = differences(*results)
    print("\n".join(lines) if lines else f"{len(results[0])} series: no bit differs")
    sys.exit(1 if lines else 0)


if __name__ == "__main__":
    main()
