"""Generation of a machine's kernel module: literal sizes, static calls of its effects, the step.

The module is the templates one after another, with the names of `stubs.py` replaced. It lies in the user's cache
folder under a name that hashes every source that goes into it, so a change of any kernel gives a new module, new
parameter values never recompile, and numba's disk cache holds the machine code next to it.
"""

from __future__ import annotations

import ast
import importlib.util
import inspect
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Number
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from reynolds.grid import Layout
from reynolds.jit import cache_folder, cache_root, private_root
from rotorsim.base.cache import key_of, source_files
from rotorsim.base.errors import DataError
from rotorsim.base.files import WriteError, make_folder, sweep, write_text
from rotorsim.effects import Effect
from rotorsim.plant.kernel_module import KernelModule
from rotorsim.plant.kernels.modal_rotor import RotorLayout
from rotorsim.plant.kernels.motion_forces import SLOT
from rotorsim.plant.kernels.rig_layout import RigLayout
from rotorsim.plant.ports import FUNCTIONS

KERNELS = Path(__file__).parent / "kernels"
TEMPLATES = ("piezo", "supply", "film_gap", "outputs", "step", "entry", "equilibrium_kernel", "cosimulation")
NEEDED = """from reynolds.grid import Layout
from reynolds.jit import inlined
from rotorsim.plant.kernels.motion_forces import NUDGE, add_tangent, correct_guess, form_compliance, guess, miss
from rotorsim.plant.kernels.motion_forces import velocity
from rotorsim.plant.kernels.rig_layout import RigLayout
from rotorsim.plant.kernels.modal_rotor import RotorLayout, add_force, build_support, project"""


@dataclass(frozen=True)
class Call:
    """One effect of a machine: instance, name in the parameter record, offsets of its (2, n) shape rows and states."""

    effect: Effect
    record: str
    shape: int
    state: int
    order: int
    """Its number among the effects of its port."""


def compose(film: Layout, rotor: RotorLayout, rig: RigLayout, calls: Sequence[Call]) -> KernelModule:
    """Write (once) and import the kernel module for these sizes and effects."""
    imports, bodies = _templates()
    kernels = [f"from {k.__module__} import {k.__name__} as {c.record}_kernel" for c in calls if (k := _kernel(c))]
    literals = f"FILM = {film!r}\nROTOR = {rotor!r}\nRIG = {rig!r}"
    functions = [f.write([_names(c, rotor, rig) for c in calls if f.takes(c.effect)]) for f in FUNCTIONS]
    head = "\n".join([NEEDED, *imports, *kernels])
    text = "\n\n\n".join([head, literals, *functions, *bodies]) + "\n"
    name = f"rotorsim_plant_{key_of(text, _sources_hash(calls))[:16]}"
    return cast(KernelModule, load_module(name, text))


def _kernel(call: Call) -> Any:
    return type(call.effect).kernel


def _templates() -> tuple[list[str], list[str]]:
    """Imports from elsewhere and bodies of all templates."""
    inside = {f"rotorsim.plant.kernels.{name}" for name in ("stubs", *TEMPLATES)} | {"__future__"}
    imports: dict[str, None] = {}
    bodies = []
    for name in TEMPLATES:
        source = (KERNELS / f"{name}.py").read_text(encoding="utf-8")
        lines = source.splitlines()
        nodes = ast.parse(source).body
        imported = [n for n in nodes if isinstance(n, (ast.Import, ast.ImportFrom))]
        for node in imported:
            if getattr(node, "module", None) not in inside:
                imports[ast.unparse(node)] = None
        bodies.append("\n".join(lines[imported[-1].end_lineno or 0 :]).strip())
    return list(imports), bodies


def _names(call: Call, rotor: RotorLayout, rig: RigLayout) -> dict[str, object]:
    """Values for the placeholders in the lines of `ports`."""
    own = f"k * {rig.n_stroke_states} + {call.state}"
    return {
        "kernel": f"{call.record}_kernel",
        "p": f"P.{call.record}",
        "shape": call.shape,
        "slot": rig.motion + SLOT * call.order,
        "state": rig.states + call.state,
        "old": f"RIG.old + {own}",
        "new": f"RIG.new + {own}",
        "dof": rotor.n_shaft + 2 * call.order,
    }


def is_compiled(module: KernelModule) -> bool:
    """Whether machine code of the module's step is in the disk cache already."""
    folder = cache_folder([Path(str(module.__file__))])
    return folder.exists() and any(folder.rglob(f"{module.__name__}.run-*.nbi"))


def _sources_hash(calls: Sequence[Call]) -> str:
    files = set(source_files("reynolds", "rotorsim/plant"))
    constants: set[str] = set()
    for call in calls:
        files |= _sources_of(type(call.effect).kernel, set(), constants)
    return key_of(cache_folder(files).name, sorted(constants))


def _sources_of(kernel: Any, seen: set[int], constants: set[str]) -> set[Path]:
    """Files of a kernel and of all compiled functions it calls; their global numbers, which may be of other files."""
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
            files |= _sources_of(called, seen, constants)
        elif isinstance(called, (Number, tuple)):
            constants.add(f"{name} = {called!r}")
    return files


def _written(root: Path, name: str, text: str) -> Path:
    """The file of a generated module below a cache folder; raises WriteError."""
    path = root / "plants" / f"{name}.py"
    if not path.exists() or path.read_text() != text:
        sweep(make_folder(path.parent))
        write_text(path, text)
    return path


def load_module(name: str, text: str) -> ModuleType:
    """A generated module, written once to the user's cache folder, where numba keeps its machine code next to it."""
    if name in sys.modules:
        return sys.modules[name]
    try:
        path = _written(cache_root(), name, text)
    except WriteError:  # the cache is full
        path = _written(private_root(), name, text)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
