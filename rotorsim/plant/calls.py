"""Calls of a machine's effects: which kernel is called where, with which numbers, and its machine code.

The step of a machine is machine code that knows no effect. For each function of `kernels/effect_calls.py` it goes
through rows of the parameter record, one for each effect of the port, and calls the effect by its address (see
`reynolds.addressed_calls`). So a machine with one more effect has one more row. Every effect's kernel is compiled once,
alone, in a module of its own, whose name hashes the sources that go into it.

Generated modules are written once to the user's cache folder, whole, and imported from there.
"""

from __future__ import annotations

import importlib.util
import inspect
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from numbers import Number
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from reynolds.addressed_calls import ADDRESS, RECORD, SHAPE, WIDTH
from reynolds.jit import address_of, cache_digest
from rotorsim.base.cache import in_cache, key_of, source_files
from rotorsim.base.errors import DataError, RotorsimError
from rotorsim.base.files import WriteError, sweep, write_text
from rotorsim.effects import Effect
from rotorsim.plant.kernels.effect_calls import FUNCTIONS, KERNELS, NUMBERS, PortFunction
from rotorsim.plant.kernels.layout import RigLayout, RotorLayout
from rotorsim.plant.kernels.modal_rotor import SLOT

CALLS = "calls"
"""Name of the rows in the parameter record."""


@dataclass(frozen=True)
class Call:
    """One effect of a machine: instance, name in the parameter record, offsets of its (2, n) shape rows and states."""

    effect: Effect
    record: str
    shape: int
    state: int
    order: int
    """Its number among the effects of its port."""
    film: int | None = None
    """The film that it is about; None: all, where it is about films."""

    def numbers(self, rotor: RotorLayout, rig: RigLayout) -> dict[str, int]:
        """Numbers by which its calls differ from those of others, by the names in the lines of `effect_calls`."""
        return {
            "shape": self.shape,
            "slot": rig.motion + SLOT * self.order,
            "state": rig.states + self.state,
            "own": self.state,
            "dof": rotor.n_machine + 2 * self.order,
            "journal": self.film or 0,
            "film": 0 if self.film is None else self.film + 1,
        }


def used(calls: Sequence[Call]) -> Iterator[tuple[PortFunction, Call]]:
    """Every function of `effect_calls` with each effect that it calls, in order."""
    return ((function, call) for function in FUNCTIONS for call in calls if function.takes(call.effect))


def rows_of(calls: Sequence[Call], rotor: RotorLayout, rig: RigLayout, kind: np.dtype) -> np.ndarray:
    """Rows (n, WIDTH) of all calls for a kind of parameter record, without addresses."""
    found = np.zeros((sum(1 for _ in used(calls)), WIDTH), np.int64)
    for row, (_, call) in zip(found, used(calls), strict=True):
        numbers = call.numbers(rotor, rig)
        row[RECORD] = kind.fields[call.record][1] if kind.fields and call.record in kind.fields else 0
        row[SHAPE:] = [numbers[name] for name in NUMBERS]
    return found


def first_rows(calls: Sequence[Call]) -> list[int]:
    """The first row of each function, and behind them the number of rows."""
    counts = [sum(f.takes(call.effect) for call in calls) for f in FUNCTIONS]
    return [sum(counts[:k]) for k in range(len(counts) + 1)]


def fill_addresses(record: np.recarray, calls: Sequence[Call]) -> None:
    """Write the addresses of machine code into the rows of a parameter record, compiling what is not compiled yet."""
    for row, (function, call) in zip(record[CALLS][0], used(calls), strict=True):
        if function.asks:
            key = function, type(call.effect)
            if key not in _addresses:
                _addresses[key] = _compiled(*key, getattr(record[0], call.record))
            row[ADDRESS] = _addresses[key]


def _compiled(function: PortFunction, effect: type[Effect], record: Any) -> int:
    """Address of an effect's kernel; raises DataError with what the compiler has first for one that it refuses."""
    try:
        return address_of(alone(function, effect), function.kinds, record)
    except RotorsimError:
        raise
    except Exception as error:  # numba's own errors, and what its writers raise of a wrong name
        lines = [line.strip() for line in str(error).splitlines() if line.strip() and not line.startswith("Failed in")]
        # a line that announces the next one has the call that failed there
        lines = lines[: 2 if lines and lines[0].endswith(":") else 1] or [type(error).__name__]
        reason = " ".join(line.removeprefix(">>> ") for line in lines)
        kernel = getattr(effect, function.kernel).__name__
        raise DataError(
            f"effect {effect.name}: its kernel {kernel} does not compile: {reason}; see its names and parameters",
            argument="effects",
            value=effect.name,
        ) from error


_addresses: dict[tuple[PortFunction, type[Effect]], int] = {}
"""Addresses of the kernels that this process has used."""


def alone(function: PortFunction, effect: type[Effect]) -> Any:
    """An effect's kernel, in a module of its own, as a function of `effect_calls` calls it."""
    kernel = getattr(effect, function.kernel)
    text, (files, numbers) = function.write_alone(effect), sources_of(kernel)
    own = ("jit", "compiler", "kernel_expressions", "kernel_writer", "addressed_calls")
    files |= set(source_files(*(f"reynolds/{name}.py" for name in own)))
    return load_module(f"rotorsim_effect_{key_of(text, cache_digest(files), numbers)[:16]}", lambda: text).effect


def kernels_alone(calls: Sequence[Call]) -> list[tuple[str, Any]]:
    """Kernels that are called, each with its effect's name in the parameter record."""
    return [(call.record, alone(function, type(call.effect))) for function, call in used(calls) if function.asks]


def sources_of_effects(effects: Iterable[type[Effect]]) -> tuple[str, list[str]]:
    """Hash of the sources of all kernels of effects, and their global numbers."""
    found = [sources_of(getattr(effect, kind)) for effect in effects for kind in KERNELS]
    return cache_digest({file for files, _ in found for file in files}), sorted({n for _, some in found for n in some})


def sources_of(kernel: Any) -> tuple[set[Path], list[str]]:
    """Files of a kernel and of all compiled functions it calls; their global numbers, which may be of other files."""
    constants: set[str] = set()
    files = _sources(kernel, set(), constants)
    return files, sorted(constants)


def _sources(kernel: Any, seen: set[int], constants: set[str]) -> set[Path]:
    function = getattr(kernel, "py_func", kernel)
    if function is None or id(function) in seen:
        return set()
    seen.add(id(function))
    file = Path(inspect.getsourcefile(function) or "")
    if not file.is_file():
        raise DataError(f"effect kernel {function.__name__}: has no source file; define it in a module")
    files = {file}
    for name in function.__code__.co_names:
        called = function.__globals__.get(name)
        if hasattr(called, "py_func"):
            files |= _sources(called, seen, constants)
        elif isinstance(called, (Number, tuple)):
            constants.add(f"{name} = {called!r}")
    return files


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
