"""Disk cache of kernels: numba's, safe against killed and concurrent processes.

Numba numbers its data files in an index that it writes first. Killed between the two, or with a second process at work,
its index can name the machine code of another signature. Here a file is named by the hash of its content and written
before the index names it: code that a disk or a killed process changed is never run. A damaged, unreadable or
unwritable file is not an error: the kernel is compiled again.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, ClassVar

from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile
from numba.core.registry import cpu_target

from reynolds.compiler import SHARED, LinkedLibrary

_places: dict[str, tuple[str, str, Any]] = {}
"""Module, function and types of each symbol of shared code that this process has."""


def _noted(result: Any) -> Any:
    """A compile result whose symbol is kept if its code is shared."""
    if result.library.name == SHARED:
        f = result.fndesc
        _places[f.mangled_name] = f.modname, f.qualname, f.argtypes
    return result


class _Results(CompileResultCacheImpl):
    """Cached form of a kernel: its code, and which shared code that calls."""

    _locator_classes: ClassVar = [c for c in CompileResultCacheImpl._locator_classes if "UserProvided" in c.__name__]
    """The folder that was given, and no other: numba's further ones are not looked at for who can write there."""

    def reduce(self, result: Any) -> Any:
        """Places of the shared code, and numba's own form of the result."""
        functions = _noted(result).library._final_module.functions
        return [_places[f.name] for f in functions if f.is_declaration and f.name in _places], super().reduce(result)

    def rebuild(self, context: Any, kept: Any) -> Any:
        """The result, after the shared code that it calls."""
        places, result = kept
        for module, name, arguments in places:
            getattr(sys.modules[module], name).compile(arguments)
        return _noted(super().rebuild(context, result))


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()[:16]


class _Files(IndexDataCacheFile):
    """Index and data files of one kernel."""

    def save(self, key: Any, data: Any) -> None:
        """Keep the machine code of a key: types, processor, bytecode."""
        content = self._dump(data)
        name = f"{self._index_name.removesuffix('.nbi')}.{_digest(content)}.nbc"
        with self._open_for_write(self._data_path(name)) as file:
            file.write(content)
        kept = self._load_index()
        self._save_index(kept | {key: name})
        if kept.get(key, name) != name:
            Path(self._data_path(kept[key])).unlink(missing_ok=True)

    def load(self, key: Any) -> Any:
        """Machine code of a key; None if there is none that is whole."""
        with suppress(Exception):  # whatever unpickling a damaged file raises
            name = self._load_index()[key]
            return self._load_data(name) if self._is_whole(name) else None

    def processors(self) -> set[Any]:
        """Processors for which there is whole machine code."""
        return {processor for (_, processor, _), name in self._load_index().items() if self._is_whole(name)}

    def _is_whole(self, name: str) -> bool:
        """Whether a data file has the content that its name was made of."""
        with suppress(OSError):
            return name.endswith(f".{_digest(Path(self._data_path(name)).read_bytes())}.nbc")
        return False

    def _load_index(self) -> dict[Any, str]:
        with suppress(Exception):
            return super()._load_index()
        return {}


class KernelCache(FunctionCache):
    """Cache of one kernel."""

    _impl_class = _Results

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _Files(self._cache_path, self._impl.filename_base, stamp)

    def is_filled(self) -> bool:
        """Whether it has machine code for this processor, for arguments of whatever types."""
        return cpu_target.target_context.codegen().magic_tuple() in self._cache_file.processors()

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code, if there is any, where the disk takes it."""
        with suppress(OSError):
            if not isinstance(data.library, LinkedLibrary):
                super().save_overload(sig, data)
