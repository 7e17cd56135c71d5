"""Folder in the cache by which an interrupted `rotorsim diagnose` resumes."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rotorsim.base.cache import in_cache, key_of
from rotorsim.base.errors import RotorsimError

MONTH = 30 * 86400.0
"""Seconds that an interrupted diagnosis waits for the same command."""


@contextmanager
def unfinished(*asked: Any) -> Iterator[Path]:
    """Where this diagnosis keeps what it computes, in the cache: until its end, or for a month if it is interrupted."""
    root = in_cache("diagnoses")
    folder = root / key_of(Path.cwd(), asked)
    for old in root.iterdir():
        if time.time() - old.stat().st_mtime > MONTH:
            shutil.rmtree(old, ignore_errors=True)
    try:
        yield folder
    except RotorsimError:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    shutil.rmtree(folder, ignore_errors=True)
