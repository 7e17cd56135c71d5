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

import reynolds
from reynolds.grid import Layout
from reynolds.jit import cache_folder, cache_root
from rotorsim.effects import Effect
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
    return folder.exists() and any(folder.rglob("*.run-*.nbi"))


def _imports(calls: Sequence[Call]) -> str:
    kernels = sorted({(type(c.effect).kernel.__module__, type(c.effect).kernel.__name__) for c in calls})
    lines = [f"from {module} import {name}" for module, name in kernels]
    return "\n".join(["from reynolds.grid import Layout", "from reynolds.jit import inlined", *lines]) + (
        "\nfrom rotorsim.plant.rotor import RotorLayout\n"
    )


def _literals(film: Layout, rotor: RotorLayout) -> str:
    return f"FILM = {film!r}\nROTOR = {rotor!r}\n"


def _add_forces(calls: Sequence[Call]) -> str:
    lines = ["@inlined", "def add_forces(w, P, t, angle, speed, acceleration):"]
    for call in calls:
        if call.effect.port == "force":
            motion = "0.0, 0.0, 0.0, 0.0"
            if call.effect.needs_motion:
                lines += [f"    x, y = project(w, ROTOR, {call.shape}, ROTOR.q_rhs)"]
                lines += [f"    vx, vy = project(w, ROTOR, {call.shape}, ROTOR.v_rhs)"]
                motion = "x, y, vx, vy"
            kernel = type(call.effect).kernel.__name__
            lines += [f"    fx, fy = {kernel}(t, angle, speed, acceleration, {motion}, P.{call.record})"]
            lines += [f"    add_force(w, ROTOR, {call.shape}, fx, fy, ROTOR.f)"]
    return "\n\n" + "\n".join(lines if len(lines) > 2 else [*lines, "    pass"]) + "\n"


def _contact_forces(calls: Sequence[Call]) -> str:
    lines = ["@inlined", "def contact_forces(x, y, vx, vy, surface_speed, P):"]
    lines += ["    fx, fy, kxx, kxy, kyx, kyy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0"]
    for call in calls:
        if call.effect.port == "contact":
            kernel, gap = type(call.effect).kernel.__name__, f"P.film.clearance - P.{call.record}.asperity"
            lines += [f"    a, b, c, d, e, f = {kernel}({gap}, x, y, vx, vy, surface_speed, P.{call.record})"]
            lines += ["    fx, fy, kxx, kxy, kyx, kyy = fx + a, fy + b, kxx + c, kxy + d, kyx + e, kyy + f"]
    return "\n\n" + "\n".join([*lines, "    return fx, fy, kxx, kxy, kyx, kyy"]) + "\n\n\n"


def _sources_hash(calls: Sequence[Call]) -> str:
    folders = [Path(str(reynolds.__file__)).parent, Path(__file__).parent]
    files = [path for folder in folders for path in folder.glob("*.py")]
    files += [Path(inspect.getsourcefile(type(call.effect)) or "") for call in calls]
    return cache_folder(sorted(set(files))).name


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
