"""Disk cache of simulated responses, from which an interrupted diagnosis resumes."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rotorsim.base.files import make_folder, write_bytes

if TYPE_CHECKING:
    from rotorsim.discrepancy.residuals.comparison import Comparison, Point
    from rotorsim.discrepancy.twin.twin import Twin


@dataclass(frozen=True)
class Memo:
    """Folder of cached data vectors, named by a hash of all their inputs."""

    folder: Path

    def get(
        self, comparison: Comparison, point: Point, twin: Twin, whole: bool, compute: Callable[[], np.ndarray]
    ) -> np.ndarray:
        """The vector (n,) that is kept, or the one computed now."""
        path = self.folder / f"{_key(comparison, point, twin, whole)}.npy"
        found = read(path, len(comparison.measured))
        if found is None:
            found = compute()
            write(path, found)
        return found


@cache
def sources() -> bytes:
    """Hash of this package's sources, so that an edit invalidates cached responses."""
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
    """Cached vector (n,); None if it is missing or invalid."""
    try:
        column = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    return np.asarray(column, float) if column.shape == (n,) else None


def write(path: Path, column: np.ndarray) -> None:
    """Atomically cache a vector; a full cache is not an error."""
    content = BytesIO()
    np.save(content, column)
    with suppress(OSError):
        make_folder(path.parent)
        write_bytes(path, content.getvalue())
