"""Writes a machine's own kernel module: literal sizes, static calls of its effects, the step.

The module is `step.py` with the names of `neutral.py` replaced. It lies in the user's cache folder under a name that
hashes every source that goes into it, so a change of any kernel gives a new module, new parameter values never
recompile, and numba's disk cache holds the machine code beside it.
"""

from __future__ import annotations

import hashlib
import importlib.util
import inspect
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import reynolds
from reynolds.grid import Layout
from reynolds.jit import cache_folder, cache_root
from rotorsim.effects import Effect
from rotorsim.errors import DataError
from rotorsim.plant.rotor import RotorLayout

IMPORT = "from rotorsim.plant.neutral import FILM, ROTOR, add_forces, contact_forces\n"


@dataclass(frozen=True)
class Call:
    """One effect of a machine: instance, name in the parameter record, offset of its (2, n) shape rows."""

    effect: Effect
    record: str
    shape: int


def compose(film: Layout, rotor: RotorLayout, calls: Sequence[Call]) -> ModuleType:
    """Write (once) and import the kernel module for these sizes and effects."""
    template = (Path(__file__).parent / "step.py").read_text()
    body = template.replace(IMPORT, _imports(calls)) + "\n\n"
    head, rest = body.split("PARTS = 1024", 1)
    text = head + _literals(film, rotor) + _add_forces(calls) + _contact_forces(calls) + "PARTS = 1024" + rest
    digest = hashlib.sha256((text + _sources_hash(calls)).encode()).hexdigest()[:16]
    return _load(f"rotorsim_plant_{digest}", text)


def is_compiled(module: ModuleType) -> bool:
    """Whether machine code of the module's step is in the disk cache already."""
    folder = cache_folder([Path(str(module.__file__))])
    return folder.exists() and any(folder.rglob(f"{module.__name__}.run-*.nbi"))


def _imports(calls: Sequence[Call]) -> str:
    kernels = [(type(c.effect).kernel, c.record) for c in calls]
    lines = [f"from {k.__module__} import {k.__name__} as {record}_kernel" for k, record in kernels]
    return "\n".join(["from reynolds.grid import Layout", "from reynolds.jit import inlined", *lines]) + (
        "\nfrom rotorsim.plant.rotor import RotorLayout\n"
    )


def _literals(film: Layout, rotor: RotorLayout) -> str:
    return f"FILM = {film!r}\nROTOR = {rotor!r}\n"


def _add_forces(calls: Sequence[Call]) -> str:
    lines = ["@inlined", "def add_forces(w, P, t, angle, speed, acceleration):"]
    for call in calls:
        if call.effect.port == "force":
            lines += [f"    fx, fy = {call.record}_kernel(t, angle, speed, acceleration, P.{call.record})"]
            lines += [f"    add_force(w, ROTOR, {call.shape}, fx, fy, ROTOR.f)"]
    return "\n\n" + "\n".join(lines if len(lines) > 2 else [*lines, "    pass"]) + "\n"


def _contact_forces(calls: Sequence[Call]) -> str:
    lines = ["@inlined", "def contact_forces(x, y, vx, vy, surface_speed, P):"]
    lines += ["    fx, fy, kxx, kxy, kyx, kyy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0"]
    for call in calls:
        if call.effect.port == "contact":
            arguments = f"P.film.clearance, x, y, vx, vy, surface_speed, P.{call.record}"
            lines += [f"    a, b, c, d, e, f = {call.record}_kernel({arguments})"]
            lines += ["    fx, fy, kxx, kxy, kyx, kyy = fx + a, fy + b, kxx + c, kxy + d, kyx + e, kyy + f"]
    return "\n\n" + "\n".join([*lines, "    return fx, fy, kxx, kxy, kyx, kyy"]) + "\n\n\n"


def _sources_hash(calls: Sequence[Call]) -> str:
    folders = [Path(str(reynolds.__file__)).parent, Path(__file__).parent]
    files = {path for folder in folders for path in folder.glob("*.py")}
    for call in calls:
        files |= _sources_of(type(call.effect).kernel, set())
    return cache_folder(sorted(files)).name


def _sources_of(kernel: Any, seen: set[int]) -> set[Path]:
    """Files of a kernel and of all compiled functions it calls."""
    function = getattr(kernel, "py_func", kernel)
    if id(function) in seen:
        return set()
    seen.add(id(function))
    file = Path(inspect.getsourcefile(function) or "")
    if not file.is_file():
        raise DataError(f"effect kernel {function.__name__}: has no source file; define it in a module")
    files = {file}
    for name in function.__code__.co_names:
        called = function.__globals__.get(name)
        if hasattr(called, "py_func"):
            files |= _sources_of(called, seen)
    return files


def _load(name: str, text: str) -> ModuleType:
    if name in sys.modules:
        return sys.modules[name]
    path = cache_root() / "plants" / f"{name}.py"
    if not path.exists() or path.read_text() != text:
        _write(path, text)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def _write(path: Path, text: str) -> None:
    """Write in one move, so that two processes may compose the same machine at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    with os.fdopen(handle, "w") as stream:
        stream.write(text)
    os.replace(temporary, path)
