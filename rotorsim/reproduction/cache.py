"""Cache of stage results as JSON files named by a hash of their inputs, so that a study can resume."""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import rotorsim
from rotorsim.base.files import make_folder, write_json

PARTS = {
    "control": ("rotorsim/control",),
    "verify": ("rotorsim/analysis", "rotorsim/control", "rotorsim/verify", "rotorsim/reproduction/control_cases.py"),
    "hysteresis": ("rotorsim/reproduction/claims/hysteresis.py",),
    "identification": (
        "identification",
        *(f"rotorsim/reproduction/{name}.py" for name in (
            "coherent", "figures", "identification_vs_physics", "local_models", "physics", "table")),
        "rotorsim/reproduction/claims/identification_numbers.py",
        "rotorsim/reproduction/claims/targets.py",
        "rotorsim/reproduction/claims/rules.toml",
    ),
}  # fmt: skip
"""Sources, files and folders, that a kind of result follows from; the plant's kernels are named by their own hash."""


@lru_cache
def sources_hash(kind: str = "verify") -> str:
    """Hash of the sources that a kind of result is made by."""
    root = Path(rotorsim.__file__).parents[1]
    digest = hashlib.sha256()
    for name in PARTS[kind]:
        place = root / name
        for path in sorted(place.rglob("*.py")) if place.is_dir() else [place]:
            digest.update(path.read_bytes())
    return digest.hexdigest()


def key_of(*parts: str, kind: str = "verify") -> str:
    """Key of a result by the texts that it follows from and the sources that make it."""
    return hashlib.sha256("\0".join([*parts, sources_hash(kind)]).encode()).hexdigest()[:16]


def file_of(folder: Path, stage: str, key: str) -> Path:
    """Where a result is kept."""
    return folder / f"{stage}-{key}.json"


def find(folder: Path, stage: str, key: str) -> Any:
    """The result of an earlier run with this key, or None."""
    path = file_of(folder, stage, key)
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except ValueError:  # cut off by a full disk: made again
        return None


def keep(folder: Path, stage: str, key: str, made: Any) -> Any:
    """Write a result, complete or not at all; returns it as it will be read."""
    path = file_of(folder, stage, key)
    make_folder(folder)
    write_json(path, made, indent=None)
    return json.loads(path.read_text(encoding="utf-8"))
