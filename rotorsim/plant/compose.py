"""Generation of a machine's kernel module: sizes as numbers, calls of effects, the step.

The files of `rotorsim.plant.kernels` are templates. They import sizes (FILM, ROTOR, RIG) and calls of effects from
`kernels/effect_calls.py`, where an editor finds them; the module has their functions with the sizes as numbers and
with that file's functions written as loops over the effects. The film's kernels are a module of their own, which
machines with the same film share, and every kernel of an effect is one (`rotorsim.plant.calls`). All lie in the user's
cache folder under a name that hashes every source that goes into them, so a change of any kernel gives a new module,
new parameter values never recompile, and numba's disk cache holds the machine code next to it.

`KernelModule` has the functions that Python calls. Everywhere w (n,) is the workspace (all states, float64), ix (m,)
its integers and P the parameter record; a function reads and writes w in place and allocates nothing.

A template takes its layout, a hundred integers, as an argument. That parameter is dropped from definitions and calls,
each field becomes its number, and branches that numbers decide are left out. The arithmetic is the same to the last
bit; numba compiles it in less than half the time. A `view` is written where it is called.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import operator
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import deepcopy
from types import ModuleType
from typing import Any, Protocol, cast

import numpy as np

from reynolds import differences, film, injector, newton, residual, ring, texture, transient, vectors
from reynolds.grid import Layout
from reynolds.jit import cache_digest, calls_addresses
from rotorsim.base.cache import key_of, source_files
from rotorsim.plant.calls import Call, load_module, sources_of_effects
from rotorsim.plant.kernels import entry, equilibrium_kernel, films, injectors, modal_rotor, sample, step
from rotorsim.plant.kernels.effect_calls import FUNCTIONS, KERNELS, write_film_constants
from rotorsim.plant.kernels.layout import LIVE, OF_EFFECTS, RigLayout, RotorLayout

Array = np.ndarray


class KernelModule(Protocol):
    """Entry points of a composed module; their code is in `rotorsim.plant.kernels`."""

    __name__: str
    __file__: str | None
    newton: Any
    """Film solver, of the module that machines with the same film share."""

    def settle(self, w: Array, initial: Array, ix: Array, P: Any, speed: float, supply: float, near: bool) -> int:
        """Fill w with the equilibrium at speed [rad/s] and supply [Pa, absolute]; a code of `equilibrium_kernel`.

        `near`: `initial` is one of the same machine already.
        """

    def stand(self, w: Array, initial: Array, P: Any, supply: float) -> bool:
        """Fill w with the shaft at standstill on its sleeves without supply [Pa, absolute]; whether it rests."""

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


FILM_SOURCES = (
    film, texture, injector, vectors, residual, differences, ring, newton, transient,
)  # fmt: skip
LINEAR_ENTRIES = ("linear_terms", "gap_terms")
"""Kernels of a film that are compiled where a linear model is asked for."""
FILM_ENTRIES = ("newton", "refresh")
SEVERAL_ENTRIES = ("begin_correction", "read_correction", "finish_correction", "refresh")
"""Kernels of a film that are compiled once for a grid, whatever the effects are: of one film, and of several."""
SOURCES = (modal_rotor, films, injectors, sample, step, equilibrium_kernel, entry)
"""Templates of a machine's module."""
ENTRIES = {
    name: "kernel" if name in ("run", "serve") else "seldom"
    for name, _ in inspect.getmembers(KernelModule, inspect.isfunction)
    if not name.startswith("_")
}
"""Their decorators."""


def compose(layout: Layout, rotor: RotorLayout, rig: RigLayout, calls: Sequence[Call]) -> KernelModule:
    """Write (once) and import the kernel module for these sizes and effects.

    Its functions are those of a module for the sizes alone, which calls effects by their address. Where that cannot be
    (code that leaves this process, or plain Python) they are compiled with the effects in them.
    """
    entries, sources = film_entries(rotor.n_films), _sources_hash()
    film_name = f"rotorsim_film_{key_of(repr(layout), entries, sources)[:16]}"
    effects = [(c.record, c.numbers(rotor, rig)) for c in calls], sources_of_effects({type(c.effect) for c in calls})
    merging = not calls_addresses()
    name = f"rotorsim_machine_{key_of(film_name, repr(rotor), repr(rig), effects, merging, sources)[:16]}"

    def film_text() -> str:
        return write_module(
            _film_functions(), {"L": layout}, FILM_SOURCES, dict.fromkeys((*entries, *LINEAR_ENTRIES), "shared")
        )

    def text(ports: list[str], imports: list[str], live: Collection[str] = ()) -> str:
        layouts = dict.fromkeys(("L", "FL", "FILM"), layout) | {"R": rotor, "ROTOR": rotor, "RIG": rig}
        films = _film_functions()
        ports = [*ports, write_film_constants(rotor.n_films)]
        own = [f for m in SOURCES for f in kernel_functions(m)] + [f for f in films if is_view(f)]
        names = {f.name for f in films if not is_view(f)}
        imports = [f"from {film_name} import {', '.join(sorted(names))}", *imports]
        return write_module([*kernel_functions("\n".join(ports)), *own], layouts, SOURCES, ENTRIES, imports, live=live)

    def merged_text() -> str:
        ports = [
            f.write_lines([(*one, f.skipped(type(c.effect))) for one, c in zip(effects[0], calls, strict=True)
                           if f.takes(c.effect)]) for f in FUNCTIONS
        ]  # fmt: skip
        kernels = [line for c in calls for kind in KERNELS for line in _taken(c, kind)]
        return text(ports, ["from reynolds.jit import merged", *kernels])

    def step_text() -> str:
        ports = [f.write_loop(number) for number, f in enumerate(FUNCTIONS)]
        names = "answer_0, answer_1, answer_2, answer_3, answer_6, entry"
        return text(ports, [f"from reynolds.addressed_calls import {names}"], LIVE)

    load_module(film_name, film_text)
    if merging:
        return cast(KernelModule, load_module(name, merged_text))
    sizes = {field: value for field, value in rig._asdict().items() if field not in OF_EFFECTS}
    step_name = f"rotorsim_plant_{key_of(film_name, repr(rotor._replace(turning=0)), sizes, sources)[:16]}"
    load_module(step_name, step_text)
    return cast(KernelModule, load_module(name, lambda: f"from {step_name} import *\n"))


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


def is_compiled(module: Any, kernels: Sequence[str] = ("run",)) -> bool:
    """Whether machine code of kernels of a module for this processor is in the disk cache already."""
    return all(is_kept(getattr(module, kernel)) for kernel in kernels)


def is_kept(kernel: Any) -> bool:
    """Whether whole machine code of a kernel for this processor is in the disk cache."""
    is_filled = getattr(getattr(kernel, "_cache", None), "is_filled", bool)  # plain Python has no cache
    return bool(is_filled())


def _sources_hash() -> str:
    """Hash of the templates and of what writes them."""
    places = ("kernels", "compose.py", "calls.py")
    return cache_digest(source_files("reynolds", *(f"rotorsim/plant/{place}" for place in places)))


DECORATORS = ("inlined", "kernel", "shared", "view")
OPERATIONS: Mapping[type[ast.AST], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}


class Numbers(ast.NodeTransformer):
    """Replaces layouts (named tuples of integers) by the names that they have in a syntax tree."""

    def __init__(self, layouts: Mapping[str, Any], live: Collection[str] = ()) -> None:
        self.layouts, self.live = layouts, live

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """A function without its layout parameters and its docstring."""
        node.args.args = [a for a in node.args.args if a.arg not in self.layouts]
        if ast.get_docstring(node) is not None:
            del node.body[0]
        self.generic_visit(node)
        node.body = node.body or [ast.Pass()]
        return node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """A call without its layout arguments."""
        node.args = [a for a in node.args if not (isinstance(a, ast.Name) and a.id in self.layouts)]
        return self.generic_visit(node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """A field of a layout as its number, or that of the parameter record."""
        self.generic_visit(node)
        if isinstance(node.value, ast.Name) and node.value.id in self.layouts:
            if node.attr in self.live:
                return ast.Attribute(ast.Name("P", ast.Load()), node.attr, ast.Load())
            return ast.Constant(getattr(self.layouts[node.value.id], node.attr))
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        """Arithmetic between integers as its result."""
        self.generic_visit(node)
        return _result(node, node.left, node.op, node.right)

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        """A comparison between integers as its result."""
        self.generic_visit(node)
        return _result(node, node.left, node.ops[0], node.comparators[0]) if len(node.ops) == 1 else node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        """`and` and `or` without the terms that are known."""
        self.generic_visit(node)
        decisive = isinstance(node.op, ast.Or)
        kept: list[ast.expr] = []
        for value in node.values:
            if not isinstance(value, ast.Constant):
                kept.append(value)
            elif bool(value.value) == decisive:
                kept.append(ast.Constant(decisive))
                break
        node.values = kept or [ast.Constant(not decisive)]
        return node.values[0] if len(node.values) == 1 else node

    def visit_If(self, node: ast.If | ast.IfExp) -> Any:
        """The branch or value that is taken, where that is known."""
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        if isinstance(node, ast.If):
            node.body = node.body or [ast.Pass()]
        return node

    visit_IfExp = visit_If

    def visit_For(self, node: ast.For) -> ast.AST:
        """A loop whose body may have become empty."""
        self.generic_visit(node)
        node.body = node.body or [ast.Pass()]
        return node


class Views(ast.NodeTransformer):
    """Replaces calls of views (functions of one expression) by what they return."""

    def __init__(self, views: Mapping[str, ast.FunctionDef]) -> None:
        self.views = views

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """A call of a view as its expression, with the arguments in place of the parameters."""
        self.generic_visit(node)
        view = self.views.get(node.func.id) if isinstance(node.func, ast.Name) else None
        if view is None:
            return node
        last = view.body[-1]
        assert isinstance(last, ast.Return) and last.value is not None
        given = {a.arg: value for a, value in zip(view.args.args, node.args, strict=True)}
        return Arguments(given).visit(deepcopy(last.value))


class Arguments(ast.NodeTransformer):
    """Replaces names by expressions."""

    def __init__(self, given: Mapping[str, ast.expr]) -> None:
        self.given = given

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """The expression of a name that is given, else the name."""
        return deepcopy(self.given[node.id]) if node.id in self.given else node


def _result(node: ast.AST, left: ast.AST, operation: ast.AST, right: ast.AST) -> ast.AST:
    """The result of an operation between two integers, else the node."""
    numbers = [side.value for side in (left, right) if isinstance(side, ast.Constant) and type(side.value) is int]
    function = OPERATIONS.get(type(operation))
    return node if len(numbers) < 2 or function is None else ast.Constant(function(*numbers))


def kernel_functions(source: ModuleType | str) -> list[ast.FunctionDef]:
    """Definitions of the compiled functions of a module or of a text."""
    tree = ast.parse(source if isinstance(source, str) else inspect.getsource(source))
    return [n for n in tree.body if isinstance(n, ast.FunctionDef) and _decorator(n) in DECORATORS]


def is_view(function: ast.FunctionDef) -> bool:
    """Whether a function is written where it is called, in each module that calls it."""
    return _decorator(function) == "view"


def write_module(
    functions: Iterable[ast.FunctionDef],
    layouts: Mapping[str, Any],
    sources: Sequence[ModuleType],
    entries: Mapping[str, str],
    imports: Sequence[str] = (),
    live: Collection[str] = (),
) -> str:
    """Source text of a module of functions with the layouts, by the names they have there, written as numbers.

    The `live` fields are not numbers but fields of the parameter record P.

    What the functions use and do not define is imported by the lines `imports`, or from the sources: a constant, or
    a function that is compiled apart. The `entries` get their decorators, all others are parts; one that others call
    is a part for them. Raises NameError for a name without a meaning.
    """
    numbers, functions = Numbers(layouts, live), list(functions)
    views = Views({f.name: f for f in functions if is_view(f)})
    found = [numbers.visit(views.visit(f)) for f in functions if not is_view(f)]
    called = {n.func.id for f in found for n in ast.walk(f) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)}
    inner = Arguments({name: ast.Name(f"_{name}", ast.Load()) for name in called & set(entries)})
    for function in list(found):
        inline = ast.Constant(_decorator(function) == "inlined")
        inner.generic_visit(function)
        if function.name in inner.given:
            found.append(_entry_of(function))
            function.name = f"_{function.name}"
        if function.name not in entries:
            function.decorator_list = [ast.Call(ast.Name("part"), [inline], [])]
    for function in found:
        if function.name in entries:
            function.decorator_list = [ast.Name(entries[function.name])]
    known = {f.name for f in found} | {a.asname or a.name for line in imports for a in _aliases(line)}
    lines = [
        f"from reynolds.jit import {', '.join(sorted({*entries.values(), 'part'}))}",
        *imports,
        *_import_lines(_globals_of(found) - known, sources),
    ]
    return "\n\n\n".join(["\n".join(lines), *(ast.unparse(ast.fix_missing_locations(f)) for f in found)]) + "\n"


def _entry_of(function: ast.FunctionDef) -> ast.FunctionDef:
    """An entry that calls the part of a function."""
    given = ", ".join(a.arg for a in function.args.args)
    [entry] = ast.parse(f"def {function.name}({given}):\n    return _{function.name}({given})").body
    assert isinstance(entry, ast.FunctionDef)
    return entry


def _decorator(node: ast.FunctionDef) -> str:
    return node.decorator_list[0].id if node.decorator_list and isinstance(node.decorator_list[0], ast.Name) else ""


def _aliases(line: str) -> list[ast.alias]:
    return [a for n in ast.parse(line).body if isinstance(n, (ast.Import, ast.ImportFrom)) for a in n.names]


def _globals_of(functions: Iterable[ast.FunctionDef]) -> set[str]:
    """Names that functions use and do not set themselves."""
    found = set()
    for function in functions:
        names = [n for part in function.body for n in ast.walk(part) if isinstance(n, ast.Name)]
        own = {a.arg for a in function.args.args} | {n.id for n in names if not isinstance(n.ctx, ast.Load)}
        found |= {n.id for n in names} - own
    return found - set(vars(builtins))


def _import_lines(names: Iterable[str], sources: Sequence[ModuleType]) -> list[str]:
    """Lines that import names from the sources that have them."""
    lines = []
    for name in sorted(names):
        having = [m for m in sources if name in vars(m)]
        if not having or any(vars(m)[name] is not vars(having[0])[name] for m in having):
            raise NameError(f"kernels: '{name}' has {'several meanings' if having else 'no meaning'}")
        value = vars(having[0])[name]
        lines.append(f"import {name}" if isinstance(value, ModuleType) else f"from {having[0].__name__} import {name}")
    return lines
