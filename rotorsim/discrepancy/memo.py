"""Responses on disk while a diagnosis runs: one that was interrupted reads what it had computed and goes on."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from rotorsim.discrepancy.comparison import Comparison, Point
    from rotorsim.discrepancy.twin import Twin


@dataclass(frozen=True)
class Memo:
    """A folder of data vectors, named by everything that they depend on."""

    folder: Path

    def get(
        self, comparison: Comparison, point: Point, twin: Twin, whole: bool, compute: Callable[[], np.ndarray]
    ) -> np.ndarray:
        """The vector (n,) that is kept, or the one computed now."""
        path = self.folder / f"{_key(comparison, point, twin, whole)}.npy"
        found = read(path, len(comparison.measured))
        if found is None:
            found = compute()
            self.folder.mkdir(parents=True, exist_ok=True)
            write(path, found)
        return found


@cache
def sources() -> bytes:
    """Digest of this package: an edit of how knobs turn the plant makes what was kept worthless."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()


def _key(comparison: Comparison, point: Point, twin: Twin, whole: bool) -> str:
    digest = hashlib.sha256(sources() + twin.equipped[0].hash.encode())
    digest.update(str(twin.assembly.module.__name__).encode())
    for trial in comparison.trials:
        digest.update(f"{trial.inputs} {trial.angle!r} {trial.lead}".encode())
    digest.update(repr(sorted((k.name, k.key, v) for k, v in point.values.items())).encode())
    digest.update(repr((sorted(point.fixed.items()), whole)).encode())
    return digest.hexdigest()[:32]


def read(path: Path, n: int) -> np.ndarray | None:
    """A vector (n,) kept in a file; None where there is none, or another."""
    try:
        column = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    return np.asarray(column, float) if column.shape == (n,) else None


def write(path: Path, column: np.ndarray) -> None:
    """Keep a vector, complete or not at all."""
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    with part.open("wb") as file:
        np.save(file, column)
    os.replace(part, path)
