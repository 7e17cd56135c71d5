"""Writer of kernels: from Python's syntax to LLVM's code in one pass, for the plain language that they are written in.

A kernel has numbers, elements of arrays, fields of records, tuples, loops over a range and calls. Numba's way over
bytecode, control flow, single assignment and inference takes ten times as long as to write it at once. A kernel that
states more raises `UnwrittenError`, and numba compiles the whole of it.

`raise` and `assert` are refused: no kernel reads the status of what it calls by address.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from types import CodeType
from typing import Any, NoReturn

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.types.containers import BaseTuple, UniTuple

from reynolds.kernel_expressions import ALWAYS, INTEGER, ExpressionWriter, UnwrittenError, Value, operator_of

ERROR = "can raise {}, which no caller reads; give a number, and refuse values in `problems`"
"""Why a kernel is refused."""


class WiderTypeError(Exception):
    """A variable or result has a wider type than the code written so far assumes; the kernel is written again."""


@cache
def _definitions(file: str) -> dict[CodeType, ast.FunctionDef]:
    """Syntax of a file's functions by their code, which shows whether the file is as it was when it was imported."""
    try:
        tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    except (OSError, ValueError, SyntaxError):
        return {}
    nodes = {(n.name, _first_line(n)): n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)}
    codes = [c for c in compile(tree, file, "exec", dont_inherit=True).co_consts if isinstance(c, CodeType)]
    places = [(code.co_name, code.co_firstlineno) for code in codes]
    return {code: nodes[place] for code, place in zip(codes, places, strict=True) if place in nodes}


def _first_line(node: ast.FunctionDef) -> int:
    """Line at which the code of a function begins, that of its first decorator."""
    return node.decorator_list[0].lineno if node.decorator_list else node.lineno


def definition(function: Callable[..., Any]) -> ast.FunctionDef:
    """Syntax of a function of a module with plain arguments; raises UnwrittenError for all others."""
    found = _definitions(function.__code__.co_filename).get(function.__code__)
    if found is None:
        raise UnwrittenError(f"{function.__name__}: its source is not a file's")
    a = found.args
    if a.vararg or a.kwarg or a.defaults or a.posonlyargs or a.kwonlyargs:
        raise UnwrittenError(f"{function.__name__}: arguments of other kinds")
    return found


class KernelWriter(ExpressionWriter):
    """Writer of one kernel's body for given types of arguments.

    A variable has one type throughout. It is known from what was assigned first; where a later assignment widens it,
    the kernel is written again.
    """

    def __init__(self, function: Callable[..., Any], refuse: Callable[[str, int], NoReturn]) -> None:
        self.node = definition(function)
        every = list(ast.walk(self.node))
        stored = [n.id for n in every if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        self.stores = Counter([*stored, *(a.arg for a in self.node.args.args)])
        self.assigned = set(stored)
        super().__init__(function, {*stored, *(a.arg for a in self.node.args.args)}, refuse)
        plain = any(isinstance(n, ast.Return) and n.value is not None for n in every)
        self.result: Any = None
        self.declared = types.float64 if plain else types.none

    def write(self, context: Any, builder: Any, arguments: Sequence[Value]) -> None:
        """Write the body where the builder stands; raises WiderTypeError where `declared` was not the result's type."""
        self.context, self.typing, self.b = context, context.typing_context, builder
        self.places, self.least, self.since, self.condition = {}, {}, {}, ALWAYS
        self.loops: list[tuple[Any, Any]] = []
        names = [a.arg for a in self.node.args.args]
        self.given = dict(zip(names, arguments, strict=True))
        for name in names:
            if name in self.assigned:
                self._keep(name, self.given.pop(name))
        self._block(self.node.body)
        if not self.b.block.is_terminated:
            self._return(Value(types.none, self.context.get_dummy_value()))

    def _block(self, statements: Sequence[ast.stmt]) -> None:
        before = self.condition
        for statement in statements:
            if self.b.block.is_terminated:
                break
            self.written(statement)(statement)
            if _may_leave(statement):
                self.condition = object()
        self.condition = before

    def _Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):
            self.value(node.value)

    def _Pass(self, node: ast.Pass) -> None:
        pass

    def _Raise(self, node: ast.Raise) -> None:
        cause = node.exc.func if isinstance(node.exc, ast.Call) else node.exc
        self._refuse_error(ast.unparse(cause) if cause else "an error", node)

    def _Assert(self, node: ast.Assert) -> None:
        self._refuse_error("AssertionError", node)

    def _refuse_error(self, name: str, node: ast.stmt) -> NoReturn:
        self.refuse(ERROR.format(name), node.lineno)

    def _Assign(self, node: ast.Assign) -> None:
        first = node.targets[0]
        if len(node.targets) == 1 and isinstance(node.value, ast.Tuple) and isinstance(first, ast.Tuple):
            if len(first.elts) != len(node.value.elts):
                raise UnwrittenError("tuples of different lengths")
            for target, value in zip(first.elts, [self.value(e) for e in node.value.elts], strict=True):
                self._assign(target, value)
            return
        value = self.value(node.value)
        for target in node.targets:
            self._assign(target, value)

    def _assign(self, target: ast.expr, value: Value) -> None:
        if isinstance(target, ast.Name):
            self._keep(target.id, value)
        elif isinstance(target, ast.Subscript):
            owner, place = self._element(target)
            self.b.store(self.cast(value, owner.kind.dtype), place)
        elif isinstance(target, ast.Tuple) and isinstance(value.kind, BaseTuple):
            if len(value.kind) != len(target.elts):
                raise UnwrittenError("tuples of different lengths")
            for k, part in enumerate(target.elts):
                self._assign(part, self.item(value, k))
        else:
            raise UnwrittenError(f"assignment to {type(target).__name__}")

    def _element(self, target: ast.Subscript) -> tuple[Value, Any]:
        """Array and address of an element that may be written."""
        owner = self.value(target.value)
        place = self.place(owner, target)
        if place is None or not owner.kind.mutable:
            raise UnwrittenError(f"an element of {owner.kind}")
        return owner, place

    def _AugAssign(self, node: ast.AugAssign) -> None:
        function = operator_of(node.op)
        if isinstance(node.target, ast.Name):
            before = self.name(node.target.id)
            if isinstance(before.kind, types.Array):
                raise UnwrittenError("change of a whole array")
            self._keep(node.target.id, self.operate(function, before, self.value(node.value)))
            return
        if not isinstance(node.target, ast.Subscript):
            raise UnwrittenError("change of an attribute")
        owner, place = self._element(node.target)
        before = Value(owner.kind.dtype, self.b.load(place))
        after = self.operate(function, before, self.value(node.value))
        self.b.store(self.cast(after, owner.kind.dtype), place)

    def _If(self, node: ast.If) -> None:
        then, other, end = (self.b.append_basic_block() for _ in range(3))
        self.b.cbranch(self.truth(node.test), then, other)
        ends = False
        for block, statements in ((then, node.body), (other, node.orelse)):
            self.b.position_at_end(block)
            with self.under_condition():
                self._block(statements)
            if not self.b.block.is_terminated:
                self.b.branch(end)
                ends = True
        self.b.position_at_end(end)
        if not ends:
            self.b.unreachable()

    def _While(self, node: ast.While) -> None:
        if node.orelse:
            raise UnwrittenError("else of a loop")
        head, body, end = (self.b.append_basic_block() for _ in range(3))
        self.b.branch(head)
        self.b.position_at_end(head)
        for_ever = isinstance(node.test, ast.Constant) and node.test.value is True
        if for_ever:
            self.b.branch(body)
        else:
            self.b.cbranch(self.truth(node.test), body, end)
        with self.under_condition():
            self._loop(node.body, body, head, end)
        if for_ever and not any(isinstance(n, ast.Break) for n in ast.walk(node)):
            self.b.unreachable()

    def _loop(self, statements: Sequence[ast.stmt], body: Any, following: Any, end: Any) -> None:
        """Write the body of a loop and go to its end."""
        self.b.position_at_end(body)
        self.loops.append((following, end))
        self._block(statements)
        self.loops.pop()
        if not self.b.block.is_terminated:
            self.b.branch(following)
        self.b.position_at_end(end)

    def _For(self, node: ast.For) -> None:
        over = node.iter
        if node.orelse or not isinstance(node.target, ast.Name):
            raise UnwrittenError("else of a loop, or a loop over pairs")
        if isinstance(over, ast.Call) and self.meaning(over.func) is range and not over.keywords:
            if not 1 <= len(over.args) <= 3:
                raise UnwrittenError("a range of other arguments")
            bounds = [self.value(bound) for bound in over.args]
            first, last = bounds[:2] if len(bounds) > 1 else (self.integer(0), bounds[0])
            self._count(node, first, last, bounds[2] if len(bounds) > 2 else self.integer(1))
            return
        values = self.value(over)
        if not isinstance(values.kind, UniTuple):
            raise UnwrittenError(f"loop over {values.kind}")
        parts = cgutils.unpack_tuple(self.b, values.code, len(values.kind))
        row = cgutils.alloca_once(self.b, ir.ArrayType(parts[0].type, len(parts)))
        for k, part in enumerate(parts):
            self.b.store(part, self.b.gep(row, [INTEGER(0), INTEGER(k)]))
        self._count(
            node, self.integer(0), self.integer(len(parts)), self.integer(1),
            lambda k: Value(values.kind.dtype, self.b.load(self.b.gep(row, [INTEGER(0), k.code]))),
        )  # fmt: skip

    def _count(
        self, node: ast.For, first: Value, last: Value, step: Value, element: Callable[[Value], Value] | None = None
    ) -> None:
        """Write a loop over integers, or over the elements that they stand for."""
        if {first.kind, last.kind, step.kind} != {types.int64}:
            raise UnwrittenError("a range of other numbers")
        counter = cgutils.alloca_once(self.b, INTEGER)
        self.b.store(first.code, counter)
        head, body, following, end = (self.b.append_basic_block() for _ in range(4))
        self.b.branch(head)
        self.b.position_at_end(head)
        k = self.b.load(counter)
        goes_on, rises = self.b.icmp_signed("<", k, last.code), step.least is not None and step.least > 0
        if not rises:
            falling = self.b.icmp_signed(">", k, last.code)
            goes_on = self.b.select(self.b.icmp_signed(">", step.code, INTEGER(0)), goes_on, falling)
        self.b.cbranch(goes_on, body, end)
        self.b.position_at_end(body)
        number = Value(types.int64, k, first.least if rises else None)
        with self.under_condition(self.condition if _surely_runs(first, last, step) else None):
            self._keep(node.target.id, element(number) if element else number)  # type: ignore[attr-defined]
            self._loop(node.body, body, following, end)
        self.b.position_at_end(following)
        self.b.store(self.b.add(k, step.code, flags=["nsw"]), counter)
        self.b.branch(head)
        self.b.position_at_end(end)

    def _Break(self, node: ast.Break) -> None:
        self.b.branch(self.loops[-1][1])

    def _Continue(self, node: ast.Continue) -> None:
        self.b.branch(self.loops[-1][0])

    def _Return(self, node: ast.Return) -> None:
        if node.value is None or (isinstance(node.value, ast.Constant) and node.value.value is None):
            self._return(Value(types.none, self.context.get_dummy_value()))
        else:
            self._return(self.value(node.value))

    def _return(self, value: Value) -> None:
        self.result = value.kind if self.result is None else self.joined(self.result, value.kind)
        if self.result != self.declared:
            self.declared = self.result
            raise WiderTypeError
        code = self.context.get_return_value(self.b, self.result, self.cast(value, self.result))
        self.context.call_conv.return_value(self.b, code)

    def _keep(self, name: str, value: Value) -> None:
        """Assign to a variable."""
        kind = value.kind if name not in self.kinds else self.joined(self.kinds[name], value.kind)
        if name in self.places and kind != self.kinds[name]:
            self.kinds[name] = kind
            raise WiderTypeError
        self.kinds[name] = kind
        if name not in self.places:
            self.places[name] = cgutils.alloca_once(self.b, self.context.get_value_type(kind), name=name)
        self.b.store(self.cast(value, kind), self.places[name])
        self.least[name] = value.least if self.stores[name] == 1 else None
        self.since[name] = self.condition


def _may_leave(node: ast.stmt) -> bool:
    """Whether what follows a statement runs under a condition."""
    if isinstance(node, (ast.If, ast.For)):
        return any(_may_leave(inner) for inner in (*node.body, *node.orelse))
    return isinstance(node, (ast.While, ast.Return, ast.Break, ast.Continue))


def _surely_runs(first: Value, last: Value, step: Value) -> bool:
    """Whether literals show that a range is not empty."""
    if not all(isinstance(value.code, ir.Constant) for value in (first, last, step)):
        return False
    return step.code.constant != 0 and len(range(first.code.constant, last.code.constant, step.code.constant)) > 0
