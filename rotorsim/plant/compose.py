"""Generation of a machine's kernel module: sizes as numbers, static calls of its effects, the step.

The files of `rotorsim.plant.kernels` are templates. They import sizes (FILM, ROTOR, RIG) and calls of effects from
`kernels/effect_calls.py`, where an editor finds them; the module has their functions with the sizes as numbers and
with that file's functions written for the machine's effects. The film's kernels are a module of their own, which
machines with the same film share. Both lie in the user's cache folder under a name that hashes every source that goes
into them, so a change of any kernel gives a new module, new parameter values never recompile, and numba's disk cache
holds the machine code next to it.

`KernelModule` has the functions that Python calls. Everywhere w (n,) is the workspace (all states, float64), ix (m,)
its integers and P the parameter record; a function reads and writes w in place and allocates nothing.
"""

from __future__ import annotations

import ast
import importlib.util
import inspect
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from numbers import Number
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol, cast

import numpy as np

from reynolds import (
    differences,
    film,
    injector,
    lanes,
    linear_terms,
    newton,
    residual,
    ring,
    steady,
    texture,
    transient,
)
from reynolds.grid import Layout
from reynolds.jit import cache_digest, cache_folder
from reynolds.specialise import is_view, kernel_functions, write_module
from rotorsim.base.cache import in_cache, key_of, source_files
from rotorsim.base.errors import DataError
from rotorsim.base.files import WriteError, sweep, write_text
from rotorsim.effects import Effect
from rotorsim.plant.kernels import entry, equilibrium_kernel, films, injectors, modal_rotor, sample, step
from rotorsim.plant.kernels.effect_calls import FUNCTIONS, write_film_constants
from rotorsim.plant.kernels.layout import RigLayout, RotorLayout
from rotorsim.plant.kernels.modal_rotor import SLOT

Array = np.ndarray


class KernelModule(Protocol):
    """Entry points of a composed module; their code is in `rotorsim.plant.kernels`."""

    __name__: str
    __file__: str | None
    newton: Any
    """Film solver, of the module that machines with the same film share."""

    def settle(self, w: Array, initial: Array, ix: Array, P: Any, speed: float, supply: float) -> int:
        """Fill w with the equilibrium at speed [rad/s] and supply [Pa, absolute]; a code of `equilibrium_kernel`."""

    def run(self, w: Array, ix: Array, P: Any, inputs: Array, out: Array, steps_per_sample: int) -> int:
        """Advance one sample per row of `inputs` (k, 6), writing `out` (k, columns); returns the samples done.

        inputs: speed at the sample's end [rad/s], supply [Pa, absolute], references x, y [V], disc force x, y [N].
        """

    def static_terms(self, w: Array, P: Any, speed: float, moving: bool) -> None:
        """Write the steady modal force and the modal stiffness at rest at speed [rad/s]."""

    def narrowest(self, w: Array, P: Any) -> float:
        """Smallest distance [m] between journal and sleeve."""

    def supply_line(self, w: Array, P: Any, h: float, supply: float, flow: float) -> tuple[float, float]:
        """Pressure [Pa, absolute] behind the line at start and end of h [s] at supply [Pa, absolute], flow [kg/s]."""

    def serve(
        self, task: int, w: Array, initial: Array, ix: Array, P: Any, u: Array, out: Array, steps: int
    ) -> int:  # fmt: skip
        """Settle, advance or read, as a co-simulation unit asks; a row u (6,) of inputs; returns a status."""


CHECK = "# hash of the lines above: "
FILM_SOURCES = (
    film, texture, injector, lanes, residual, differences, ring, newton, linear_terms, transient, steady,
)  # fmt: skip
LINEAR_ENTRIES = ("linear_terms", "gap_terms")
"""Kernels of a film that are compiled where a linear model is asked for."""
FILM_ENTRIES = ("newton", "refresh")
SEVERAL_ENTRIES = ("begin_correction", "read_correction", "finish_correction", "refresh")
"""Kernels of a film that are compiled once for a grid, whatever the effects are: of one film, and of several."""
SOURCES = (modal_rotor, films, injectors, sample, step, equilibrium_kernel, entry)
"""Templates of a machine's module."""
KERNELS = ("kernel", "foundation", "warmed", "braking", "reading_noise")
"""Kernels that an effect can have."""
ENTRIES = tuple(name for name, _ in inspect.getmembers(KernelModule, inspect.isfunction) if not name.startswith("_"))


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


def compose(layout: Layout, rotor: RotorLayout, rig: RigLayout, calls: Sequence[Call]) -> KernelModule:
    """Write (once) and import the kernel module for these sizes and effects."""
    ports = [f.write([_names(c, rotor, rig) for c in calls if f.takes(c.effect)]) for f in FUNCTIONS]
    ports.append(write_film_constants(rotor.n_films))
    entries = film_entries(rotor.n_films)
    kernels = [line for c in calls for kind in KERNELS for line in _taken(c, kind)]
    film_name = f"rotorsim_film_{key_of(repr(layout), entries, _sources_hash(()))[:16]}"
    name = f"rotorsim_plant_{key_of(film_name, repr(rotor), repr(rig), ports, kernels, _sources_hash(calls))[:16]}"

    def film_text() -> str:
        return write_module(
            _film_functions(), {"L": layout}, FILM_SOURCES, (*entries, *LINEAR_ENTRIES), decorator="shared"
        )

    def text() -> str:
        layouts = dict.fromkeys(("L", "FL", "FILM"), layout) | {"R": rotor, "ROTOR": rotor, "RIG": rig}
        films = _film_functions()
        own = [f for m in SOURCES for f in kernel_functions(m)] + [f for f in films if is_view(f)]
        names = {f.name for f in films if not is_view(f)}
        imports = [f"from {film_name} import {', '.join(sorted(names))}", "from reynolds.jit import merged", *kernels]
        return write_module([*kernel_functions("\n".join(ports)), *own], layouts, SOURCES, ENTRIES, imports)

    load_module(film_name, film_text)
    return cast(KernelModule, load_module(name, text))


def _film_functions() -> list[ast.FunctionDef]:
    """Compiled functions of the films."""
    return [f for m in FILM_SOURCES for f in kernel_functions(m)]


def film_entries(n_films: int) -> tuple[str, ...]:
    """Kernels of the films' module that are compiled by themselves."""
    return SEVERAL_ENTRIES if n_films > 1 else FILM_ENTRIES


def _taken(call: Call, kind: str) -> Sequence[str]:
    """Lines that take one of an effect's KERNELS, if it has it, into a module."""
    kernel, name = getattr(type(call.effect), kind), f"{call.record}_{kind}"
    if kernel is None:
        return ()
    return f"from {kernel.__module__} import {kernel.__name__} as {name}", f"{name} = merged({name})"


def _names(call: Call, rotor: RotorLayout, rig: RigLayout) -> dict[str, object]:
    """Values for the placeholders in the lines of `effect_calls`."""
    own = f"k * {rig.n_stroke_states} + {call.state}"
    return {
        **{kind: f"{call.record}_{kind}" for kind in KERNELS},
        "p": f"P.{call.record}",
        "shape": call.shape,
        "slot": rig.motion + SLOT * call.order,
        "state": rig.states + call.state,
        "old": f"RIG.old + {own}",
        "new": f"RIG.new + {own}",
        "dof": rotor.n_machine + 2 * call.order,
        "film": call.film,
        "journal": call.film or 0,
    }


def is_compiled(module: Any, kernels: Sequence[str] = ("run",)) -> bool:
    """Whether machine code of kernels of a module is in the disk cache already."""
    folder = cache_folder([Path(str(module.__file__))])
    return folder.exists() and all(any(folder.rglob(f"{module.__name__}.{kernel}-*.nbi")) for kernel in kernels)


def _sources_hash(calls: Sequence[Call]) -> str:
    files = set(source_files("reynolds", "rotorsim/plant/kernels", "rotorsim/plant/compose.py"))
    constants: set[str] = set()
    for call in calls:
        for kind in KERNELS:
            files |= _sources_of(getattr(type(call.effect), kind), set(), constants)
    return key_of(cache_digest(files), sorted(constants))


def _sources_of(kernel: Any, seen: set[int], constants: set[str]) -> set[Path]:
    """Files of a kernel and of all compiled functions it calls; their global numbers, which may be of other files."""
    function = getattr(kernel, "py_func", kernel)
    if function is None:
        return set()
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
