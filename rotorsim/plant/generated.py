"""Generated modules: written once to the user's cache folder, whole, and imported from there."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from rotorsim.base.cache import in_cache, key_of
from rotorsim.base.files import WriteError, sweep, write_text

CHECK = "# hash of the lines above: "


def _written(folder: Path, name: str, text: Callable[[], str]) -> Path:
    """The file of a generated module in a cache folder; raises WriteError."""
    path = folder / f"{name}.py"
    if not _is_whole(path):
        sweep(folder)
        body = text()
        write_text(path, f"{body}{CHECK}{key_of(body)}\n")
    return path


def _is_whole(path: Path) -> bool:
    """Whether a generated file is as it was written."""
    if not path.exists():
        return False
    body, mark, check = path.read_text(encoding="utf-8", errors="replace").rpartition(CHECK)
    return bool(mark) and check == f"{key_of(body)}\n"


def load_module(name: str, text: Callable[[], str]) -> ModuleType:
    """A generated module, written once to the user's cache folder, where numba keeps its machine code next to it.

    `name` holds a hash of all that `text` is made of.
    """
    if name in sys.modules:
        return sys.modules[name]
    try:
        path = _written(in_cache("plants"), name, text)
    except WriteError:  # the cache is full
        path = _written(in_cache("plants", temporary=True), name, text)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
