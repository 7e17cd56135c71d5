"""Results of a stage as JSON under the hash of what they follow from, so that a study goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import rotorsim


@lru_cache
def sources_hash() -> str:
    """Hash of the sources that controllers and their verification are made of."""
    root = Path(rotorsim.__file__).parent
    digest = hashlib.sha256()
    for folder in ("control", "verify"):
        for path in sorted((root / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def key_of(*parts: str) -> str:
    """Key of a result by the texts that it follows from and the sources that make it."""
    return hashlib.sha256("\0".join([*parts, sources_hash()]).encode()).hexdigest()[:16]


def kept(folder: Path, name: str, key: str, make: Callable[[], Any]) -> Any:
    """The result of `make`, from the file of an earlier call with the same key if there is one; plain JSON values."""
    path = folder / f"{name}-{key}.json"
    if path.exists():
        return json.loads(path.read_text(encoding="utf-8"))
    made = make()
    folder.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part")
    part.write_text(json.dumps(made) + "\n", encoding="utf-8")
    os.replace(part, path)
    return json.loads(path.read_text(encoding="utf-8"))
