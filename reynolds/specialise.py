"""Modules of kernels with their sizes written as numbers.

A kernel takes its layout, a hundred integers, as an argument. Here that parameter is dropped from definitions and
calls, each field becomes its number, and branches that numbers decide are left out. The arithmetic is the same to the
last bit; numba compiles it in less than half the time. A `view` is written where it is called.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import operator
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from copy import deepcopy
from types import ModuleType
from typing import Any

DECORATORS = ("inlined", "kernel", "view")
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

    def __init__(self, layouts: Mapping[str, Any]) -> None:
        self.layouts = layouts

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
        """A field of a layout as its number."""
        self.generic_visit(node)
        if isinstance(node.value, ast.Name) and node.value.id in self.layouts:
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

    def visit_If(self, node: ast.If) -> Any:
        """The branch that is taken, where that is known."""
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        node.body = node.body or [ast.Pass()]
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        """The value that is taken, where that is known."""
        self.generic_visit(node)
        if isinstance(node.test, ast.Constant):
            return node.body if node.test.value else node.orelse
        return node

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
        return deepcopy(self.given.get(node.id, node))


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
    entries: Collection[str],
    imports: Sequence[str] = (),
    decorator: str = "kernel",
) -> str:
    """Source text of a module of functions with the layouts, by the names they have there, written as numbers.

    What the functions use and do not define is imported by the lines `imports`, or from the sources: a constant, or
    a function that is compiled apart. The `entries` get the decorator, all others are parts. Raises NameError for a
    name without a meaning.
    """
    numbers, functions = Numbers(layouts), list(functions)
    views = Views({f.name: f for f in functions if is_view(f)})
    found = [numbers.visit(views.visit(f)) for f in functions if not is_view(f)]
    for function in found:
        if function.name in entries:
            function.decorator_list = [ast.Name(decorator)]
        else:
            inline = ast.Constant(_decorator(function) == "inlined")
            function.decorator_list = [ast.Call(ast.Name("part"), [inline], [])]
    known = {f.name for f in found} | {a.asname or a.name for line in imports for a in _aliases(line)}
    lines = [
        f"from reynolds.jit import {decorator}, part",
        *imports,
        *_import_lines(_globals_of(found) - known, sources),
    ]
    return "\n\n\n".join(["\n".join(lines), *(ast.unparse(ast.fix_missing_locations(f)) for f in found)]) + "\n"


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
