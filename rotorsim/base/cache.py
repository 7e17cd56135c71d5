"""Cache of results in files, each named by a hash of all that it follows from, the sources that compute it included.

A file that is missing, damaged or of an earlier version is not an error: the result is computed again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from rotorsim.base.files import make_folder, write_bytes, write_json

ROOT = Path(__file__).resolve().parents[2]
"""Folder of the packages."""
PLANT = (
    "reynolds", "fe_shaft", "identification",
    *(f"rotorsim/{room}" for room in ("base", "signals", "effects", "machine", "plant")),
)  # fmt: skip
"""Sources that a simulation of the plant follows from, as places below ROOT."""
RUNS = (*PLANT, "rotorsim/experiments", "rotorsim/control")
"""Sources that a simulated record follows from."""


@lru_cache
def sources_hash(*places: str) -> str:
    """Hash of source files, given as files or folders (with all below) relative to ROOT or absolute.

    Raises FileNotFoundError for a place that does not exist, so that a moved source cannot drop out unnoticed.
    """
    digest = hashlib.sha256()
    for path in source_files(*places):
        name = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else path.name
        digest.update(f"{name}\0".encode() + path.read_bytes())
    return digest.hexdigest()


def source_files(*places: str) -> list[Path]:
    """Files of places below ROOT: themselves, or the Python files of folders; raises FileNotFoundError."""
    found: set[Path] = set()
    for place in places:
        own = sorted((ROOT / place).rglob("*.py")) if not (ROOT / place).is_file() else [ROOT / place]
        if not own:
            raise FileNotFoundError(f"{place}: no such source in {ROOT}")
        found.update(own)
    return sorted(found)


def key_of(*parts: Any) -> str:
    """Key by parts whose `repr` is complete: text, numbers, tuples, lists and dicts of them, never arrays."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Cache:
    """Folder of cached results; where they are `required`, a file that cannot be written raises WriteError."""

    folder: Path
    required: bool = False

    def array(self, key: str, shape: tuple[int, ...], compute: Callable[[], np.ndarray]) -> np.ndarray:
        """The cached array of real numbers, or the one computed now."""
        path = self.folder / f"{key}.npy"
        found = _read_array(path, shape)
        if found is None:
            found = compute()
            content = BytesIO()
            np.save(content, found)
            self._keep(write_bytes, path, content.getvalue())
        return found

    def find(self, name: str) -> Any:
        """The cached JSON value, or None."""
        try:
            return json.loads((self.folder / f"{name}.json").read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return None

    def keep(self, name: str, value: Any) -> Any:
        """Cache a JSON value; returns it as it will be read."""
        plain = json.loads(json.dumps(value))
        self._keep(write_json, self.folder / f"{name}.json", plain, None)
        return plain

    def _keep(self, write: Callable[..., None], path: Path, *content: Any) -> None:
        with nullcontext() if self.required else suppress(OSError):
            make_folder(path.parent)
            write(path, *content)


def _read_array(path: Path, shape: tuple[int, ...]) -> np.ndarray | None:
    """The array of a file; None if it is missing, damaged or of another shape."""
    try:
        found = np.lib.format.read_array(BytesIO(path.read_bytes()), allow_pickle=False)
    except Exception:  # numpy raises many kinds for damaged files
        return None
    return found if found.shape == shape and found.dtype == float else None
