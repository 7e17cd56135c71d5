"""Writer of kernels: from Python's syntax to LLVM's code in one pass, for the plain language that kernels are written in.

A kernel has numbers, elements of arrays, fields of records, tuples, loops over a range and calls. For these the type of
an expression follows from those of its parts, so code can be written while the syntax is read: numba's way over
bytecode, control flow, single assignment and inference takes ten times as long. What is not plain arithmetic (`min`,
`math.exp`, an intrinsic, another kernel) numba resolves and writes, so a kernel means what it means to numba. What the
writer has no words for raises `UnwrittenError`, and numba compiles the whole kernel.

An index counts from an array's start. What would be wrong without a word is refused: `raise` and `assert`, since no
kernel reads the status of what it calls by address, and an index that literals show to be below the start.
"""

from __future__ import annotations

import ast
import builtins
import operator
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, NamedTuple, NoReturn

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.errors import NumbaError
from numba.core.types.containers import BaseTuple

FLOATS: dict[Any, Any] = {
    operator.add: lambda b, x, y: b.fadd(x, y),
    operator.sub: lambda b, x, y: b.fsub(x, y),
    operator.mul: lambda b, x, y: b.fmul(x, y),
    operator.truediv: lambda b, x, y: b.fdiv(x, y),
    operator.ne: lambda b, x, y: b.fcmp_unordered("!=", x, y),
}
"""Instructions for two float64; kernels divide by zero as IEEE 754 does."""
INTEGERS: dict[Any, Any] = {
    operator.add: lambda b, x, y: b.add(x, y, flags=["nsw"]),
    operator.sub: lambda b, x, y: b.sub(x, y, flags=["nsw"]),
    operator.mul: lambda b, x, y: b.mul(x, y, flags=["nsw"]),
    operator.ne: lambda b, x, y: b.icmp_signed("!=", x, y),
}
"""Instructions for two int64."""
for _function, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">="),
                         (operator.eq, "==")):  # fmt: skip
    FLOATS[_function] = lambda b, x, y, sign=_sign: b.fcmp_ordered(sign, x, y)
    INTEGERS[_function] = lambda b, x, y, sign=_sign: b.icmp_signed(sign, x, y)
OPERATORS: dict[type[ast.AST], Any] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow, ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_, ast.BitXor: operator.xor, ast.LShift: operator.lshift, ast.RShift: operator.rshift,
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne, ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Invert: operator.invert,
}  # fmt: skip
COMPARISONS = {operator.lt, operator.le, operator.gt, operator.ge, operator.eq, operator.ne}
INTEGER = ir.IntType(64)
SMALL = 64
"""Largest power that is written as products."""
ERROR = "can raise {}, which no caller reads; give a number, and refuse values in `problems`"
"""Why a kernel is refused."""
NAMELESS = object()
"""Meaning of an expression that is no name of a constant, function or module."""


class UnwrittenError(NumbaError):
    """A kernel that says more than the writer has words for; the text is what."""


class AgainError(Exception):
    """A variable or result that turned out to be of a wider type than what is written of it."""


class Value(NamedTuple):
    """A value in the code that is written."""

    kind: Any
    code: Any
    least: int | None = None
    """The smallest value of an integer, where literals tell it."""


@cache
def _definitions(file: str) -> dict[CodeType, ast.FunctionDef]:
    """Syntax of a file's functions by their code, which tells whether the file is as it was when it was imported."""
    try:
        tree = ast.parse(Path(file).read_text(encoding="utf-8"))
    except (OSError, ValueError, SyntaxError):
        return {}
    nodes = {n.name: n for n in tree.body if isinstance(n, ast.FunctionDef)}
    codes = compile(tree, file, "exec", dont_inherit=True).co_consts
    return {code: nodes[code.co_name] for code in codes if isinstance(code, CodeType) and code.co_name in nodes}


def definition(function: Callable[..., Any]) -> ast.FunctionDef:
    """Syntax of a function of a module; raises UnwrittenError for all others."""
    found = _definitions(function.__code__.co_filename).get(function.__code__)
    if found is None:
        raise UnwrittenError(f"{function.__name__}: its source is not a file's")
    return found


class KernelWriter:
    """Writer of one kernel's body for given types of arguments.

    A variable has one type throughout. It is known from what was assigned first; where a later assignment widens it,
    the kernel is written again.
    """

    def __init__(self, function: Callable[..., Any], refuse: Callable[[str, int], NoReturn]) -> None:
        self.function, self.refuse = function, refuse
        self.node = definition(function)
        stored = [n.id for n in ast.walk(self.node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        self.stores = Counter(stored)
        self.local = {*stored, *(a.arg for a in self.node.args.args)}
        self.kinds: dict[str, Any] = {}
        plain = any(isinstance(n, ast.Return) and n.value is not None for n in ast.walk(self.node))
        self.result: Any = None
        self.declared = types.float64 if plain else types.none

    def write(self, context: Any, builder: Any, arguments: Sequence[Value]) -> None:
        """Write the body where the builder stands; raises AgainError where `declared` was not the result's type."""
        self.context, self.typing, self.b = context, context.typing_context, builder
        self.places: dict[str, Any] = {}
        self.least: dict[str, int | None] = {}
        self.loops: list[tuple[Any, Any]] = []
        names = [a.arg for a in self.node.args.args]
        self.given = dict(zip(names, arguments, strict=True))
        for name in names:
            if name in self.stores:
                self._keep(name, self.given.pop(name))
        self._block(self.node.body)
        if not self.b.block.is_terminated:
            self._return(Value(types.none, self.context.get_dummy_value()))

    # Statements

    def _block(self, statements: Sequence[ast.stmt]) -> None:
        for statement in statements:
            if self.b.block.is_terminated:
                return
            self._written(statement)(statement)

    def _written(self, node: ast.AST) -> Callable[[Any], Any]:
        """The method for a kind of node."""
        found: Callable[[Any], Any] | None = getattr(self, f"_{type(node).__name__}", None)
        if found is None:
            raise UnwrittenError(f"{self.function.__name__}: {type(node).__name__}")
        return found

    def _Expr(self, node: ast.Expr) -> None:
        if not isinstance(node.value, ast.Constant):
            self._value(node.value)

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
            for target, value in zip(first.elts, [self._value(e) for e in node.value.elts], strict=True):
                self._assign(target, value)
            return
        value = self._value(node.value)
        for target in node.targets:
            self._assign(target, value)

    def _assign(self, target: ast.expr, value: Value) -> None:
        if isinstance(target, ast.Name):
            self._keep(target.id, value)
        elif isinstance(target, ast.Subscript):
            owner = self._value(target.value)
            place = self._place(owner, target)
            if place is None:
                raise UnwrittenError(f"an element of {owner.kind}")
            self.b.store(self._cast(value, owner.kind.dtype), place)
        elif isinstance(target, ast.Tuple) and isinstance(value.kind, BaseTuple):
            if len(value.kind) != len(target.elts):
                raise UnwrittenError("tuples of different lengths")
            for k, part in enumerate(target.elts):
                self._assign(part, self._item(value, k))
        else:
            raise UnwrittenError(f"assignment to {type(target).__name__}")

    def _AugAssign(self, node: ast.AugAssign) -> None:
        function = OPERATORS[type(node.op)]
        if isinstance(node.target, ast.Name):
            self._keep(node.target.id, self._operate(function, self._name(node.target.id), self._value(node.value)))
            return
        if not isinstance(node.target, ast.Subscript):
            raise UnwrittenError("change of an attribute")
        owner = self._value(node.target.value)
        place = self._place(owner, node.target)
        if place is None:
            raise UnwrittenError(f"an element of {owner.kind}")
        before = Value(owner.kind.dtype, self.b.load(place))
        after = self._operate(function, before, self._value(node.value))
        self.b.store(self._cast(after, owner.kind.dtype), place)

    def _If(self, node: ast.If) -> None:
        then, other, end = (self.b.append_basic_block() for _ in range(3))
        self.b.cbranch(self._truth(node.test), then, other)
        ends = False
        for block, statements in ((then, node.body), (other, node.orelse)):
            self.b.position_at_end(block)
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
            self.b.cbranch(self._truth(node.test), body, end)
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
        if isinstance(over, ast.Call) and self._meaning(over.func) is range and not over.keywords:
            bounds = [self._value(bound) for bound in over.args]
            first, last = bounds[:2] if len(bounds) > 1 else (self._integer(0), bounds[0])
            self._count(node, first, last, bounds[2] if len(bounds) > 2 else self._integer(1))
            return
        values = self._value(over)
        if not isinstance(values.kind, types.UniTuple):
            raise UnwrittenError(f"loop over {values.kind}")
        parts = cgutils.unpack_tuple(self.b, values.code, len(values.kind))
        row = cgutils.alloca_once(self.b, ir.ArrayType(parts[0].type, len(parts)))
        for k, part in enumerate(parts):
            self.b.store(part, self.b.gep(row, [INTEGER(0), INTEGER(k)]))
        self._count(
            node, self._integer(0), self._integer(len(parts)), self._integer(1),
            lambda k: Value(values.kind.dtype, self.b.load(self.b.gep(row, [INTEGER(0), k.code]))),
        )  # fmt: skip

    def _count(
        self, node: ast.For, first: Value, last: Value, step: Value, element: Callable[[Value], Value] | None = None
    ) -> None:
        """Write a loop over integers, or over the elements that they stand for."""
        if {first.kind, last.kind, step.kind} != {types.int64} or not isinstance(step.code, ir.Constant):
            raise UnwrittenError("a range of other steps")
        by = step.code.constant
        if by == 0:
            raise UnwrittenError("a range of no steps")
        counter = cgutils.alloca_once(self.b, INTEGER)
        self.b.store(first.code, counter)
        head, body, following, end = (self.b.append_basic_block() for _ in range(4))
        self.b.branch(head)
        self.b.position_at_end(head)
        k = self.b.load(counter)
        self.b.cbranch(self.b.icmp_signed("<" if by > 0 else ">", k, last.code), body, end)
        self.b.position_at_end(body)
        number = Value(types.int64, k, first.least if by > 0 else None)
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
        nothing = node.value is None or (isinstance(node.value, ast.Constant) and node.value.value is None)
        self._return(Value(types.none, self.context.get_dummy_value()) if nothing else self._value(node.value))

    def _return(self, value: Value) -> None:
        self.result = value.kind if self.result is None else self._joined(self.result, value.kind)
        if self.result != self.declared:
            self.declared = self.result
            raise AgainError
        code = self.context.get_return_value(self.b, self.result, self._cast(value, self.result))
        self.context.call_conv.return_value(self.b, code)

    # Variables

    def _keep(self, name: str, value: Value) -> None:
        """Assign to a variable."""
        kind = value.kind if name not in self.kinds else self._joined(self.kinds[name], value.kind)
        if name in self.places and kind != self.kinds[name]:
            self.kinds[name] = kind
            raise AgainError
        self.kinds[name] = kind
        if name not in self.places:
            self.places[name] = cgutils.alloca_once(self.b, self.context.get_value_type(kind), name=name)
        self.b.store(self._cast(value, kind), self.places[name])
        self.least[name] = value.least if self.stores[name] == 1 else None

    def _joined(self, one: Any, other: Any) -> Any:
        """Type that has the values of both."""
        kind = one if one == other else self.typing.unify_types(one, other)
        if kind is None or isinstance(kind, types.Optional):
            raise UnwrittenError(f"{self.function.__name__}: {one} and {other} in one variable")
        return kind

    def _cast(self, value: Value, kind: Any) -> Any:
        if value.kind == kind:
            return value.code
        return self.context.cast(self.b, value.code, value.kind, kind)

    def _name(self, name: str) -> Value:
        if name in self.given:
            return self.given[name]
        if name in self.places:
            return Value(self.kinds[name], self.b.load(self.places[name]), self.least[name])
        raise UnwrittenError(f"{self.function.__name__}: {name} is used before it is set")

    # Expressions

    def _value(self, node: ast.expr) -> Value:
        value: Value = self._written(node)(node)
        return value

    def _meaning(self, node: ast.AST) -> Any:
        """The constant, function or module that an expression names, or NAMELESS."""
        if isinstance(node, ast.Name) and node.id not in self.local:
            names = self.function.__globals__
            return names[node.id] if node.id in names else getattr(builtins, node.id, NAMELESS)
        owner = self._meaning(node.value) if isinstance(node, ast.Attribute) else NAMELESS
        return getattr(owner, node.attr, NAMELESS) if isinstance(owner, (ModuleType, tuple)) else NAMELESS  # type: ignore[attr-defined]

    def _integer(self, value: int) -> Value:
        return Value(types.int64, INTEGER(value), value)

    def _constant(self, value: Any) -> Value:
        if isinstance(value, bool):
            return Value(types.boolean, ir.IntType(1)(value))
        if type(value) is int and abs(value) < 2**63:
            return self._integer(value)
        if isinstance(value, float):
            return Value(types.float64, ir.DoubleType()(float(value)))
        if isinstance(value, np.number):
            kind = self.typing.resolve_value_type(value)
            return Value(kind, self.context.get_constant_generic(self.b, kind, value))
        if not isinstance(value, tuple):
            raise UnwrittenError(f"a constant of {type(value).__name__}")
        return self._tuple([self._constant(one) for one in value])

    def _tuple(self, values: list[Value]) -> Value:
        kind = BaseTuple.from_types([value.kind for value in values])
        return Value(kind, self.context.make_tuple(self.b, kind, [value.code for value in values]))

    def _Constant(self, node: ast.Constant) -> Value:
        return self._constant(node.value)

    def _Tuple(self, node: ast.Tuple) -> Value:
        return self._tuple([self._value(element) for element in node.elts])

    def _Name(self, node: ast.Name) -> Value:
        meaning = self._meaning(node)
        return self._name(node.id) if meaning is NAMELESS else self._constant(meaning)

    def _Attribute(self, node: ast.Attribute) -> Value:
        meaning = self._meaning(node)
        if meaning is not NAMELESS:
            return self._constant(meaning)
        owner = self._value(node.value)
        kind = self.typing.resolve_getattr(owner.kind, node.attr)
        if kind is None or isinstance(kind, types.BoundFunction):
            raise UnwrittenError(f"{node.attr} of {owner.kind}")
        write = self.context.get_getattr(owner.kind, node.attr)
        return Value(kind, write(self.context, self.b, owner.kind, owner.code, node.attr))

    def _Subscript(self, node: ast.Subscript) -> Value:
        owner = self._value(node.value)
        if isinstance(owner.kind, BaseTuple):
            index = self._value(node.slice)
            if isinstance(index.code, ir.Constant) and index.kind == types.int64:
                k = index.code.constant
                if not 0 <= k < len(owner.kind):
                    raise UnwrittenError(f"element {k} of {owner.kind}")
                return self._item(owner, k)
            return self._call(operator.getitem, owner, index)
        if isinstance(node.slice, ast.Slice):
            return self._call(operator.getitem, owner, self._slice(node.slice))
        place = self._place(owner, node)
        if place is None:
            raise UnwrittenError(f"an element of {owner.kind}")
        return Value(owner.kind.dtype, self.b.load(place))

    def _item(self, owner: Value, k: int) -> Value:
        return Value(owner.kind[k], self.b.extract_value(owner.code, k))

    def _slice(self, node: ast.Slice) -> Value:
        first, last = (self._value(n) if n else None for n in (node.lower, node.upper))
        if node.step is not None or any(v is not None and v.kind != types.int64 for v in (first, last)):
            raise UnwrittenError("a slice of other steps")
        made = self.context.make_helper(self.b, types.slice2_type)
        made.start, made.step = first.code if first else INTEGER(0), INTEGER(1)
        made.stop = last.code if last else INTEGER(2**63 - 1)
        return Value(types.slice2_type, made._getvalue())

    def _place(self, owner: Value, node: ast.Subscript) -> Any:
        """Address of an element of a contiguous array of numbers; None for all else."""
        kind = owner.kind
        if not isinstance(kind, types.Array) or kind.layout != "C" or kind.dtype not in (types.float64, types.int64):
            return None
        indices = [self._value(n) for n in (node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice])]
        if len(indices) != kind.ndim or any(index.kind != types.int64 for index in indices) or not kind.aligned:
            return None
        for index in indices:
            if index.least is not None and index.least < 0:
                self.refuse(
                    f"takes {ast.unparse(node.value)}[{index.least}]; an index counts from the start of the array and "
                    "not from its end",
                    node.lineno,
                )
        codes = [index.code for index in indices]
        if kind.ndim == 1:
            data = self.context.data_model_manager[kind].get_field_position("data")
            return self.b.gep(self.b.extract_value(owner.code, data), codes)
        array = self.context.make_array(kind)(self.context, self.b, owner.code)
        return cgutils.get_item_pointer(self.context, self.b, kind, array, codes)

    def _BinOp(self, node: ast.BinOp) -> Value:
        left, right = self._value(node.left), self._value(node.right)
        if isinstance(node.op, ast.Pow):
            return self._power(left, right)
        return self._operate(OPERATORS[type(node.op)], left, right)

    def _operate(self, function: Any, left: Value, right: Value) -> Value:
        """Value of an operation on two values."""
        kinds = {left.kind, right.kind}
        if not kinds <= {types.int64, types.float64}:
            return self._call(function, left, right)
        whole = kinds == {types.int64} and function is not operator.truediv
        write = (INTEGERS if whole else FLOATS).get(function)
        if write is None:
            return self._call(function, left, right)
        kind = types.int64 if whole else types.float64
        code = write(self.b, self._cast(left, kind), self._cast(right, kind))
        least = None
        if left.least is not None and right.least is not None:
            if function is operator.add:
                least = left.least + right.least
            elif function is operator.sub and isinstance(right.code, ir.Constant):
                least = left.least - right.least
        return Value(types.boolean if function in COMPARISONS else kind, code, least if whole else None)

    def _power(self, base: Value, exponent: Value) -> Value:
        """A power; with a small literal as its exponent a product, in numba's order."""
        if exponent.kind != types.int64:
            return self._call(operator.pow, base, exponent)
        left = exponent.least if isinstance(exponent.code, ir.Constant) else None
        if left is None or not 0 < left <= SMALL or base.kind not in (types.int64, types.float64):
            raise UnwrittenError("a power of another exponent")
        whole = base.kind == types.int64
        result, factor = INTEGER(1) if whole else ir.DoubleType()(1.0), base.code
        while left:
            if left & 1:
                result = self.b.mul(result, factor) if whole else self.b.fmul(result, factor)
            factor = self.b.mul(factor, factor) if whole else self.b.fmul(factor, factor)
            left >>= 1
        return Value(base.kind, result)

    def _UnaryOp(self, node: ast.UnaryOp) -> Value:
        if isinstance(node.op, ast.Not):
            return Value(types.boolean, self.b.not_(self._truth(node.operand)))
        if isinstance(node.op, ast.USub) and isinstance(node.operand, ast.Constant):
            return self._constant(-node.operand.value)  # type: ignore[operator]
        value = self._value(node.operand)
        if isinstance(node.op, ast.USub) and value.kind == types.float64:
            return Value(types.float64, self.b.fneg(value.code))
        return self._call(OPERATORS[type(node.op)], value)

    def _Compare(self, node: ast.Compare) -> Value:
        if len(node.ops) > 1 and any(isinstance(n, ast.Call) for n in ast.walk(node)):
            raise UnwrittenError("calls in a chain of comparisons")
        values = [self._value(n) for n in (node.left, *node.comparators)]
        codes = []
        for sign, left, right in zip(node.ops, values[:-1], values[1:], strict=True):
            if type(sign) not in OPERATORS:
                raise UnwrittenError(f"comparison by {type(sign).__name__}")
            codes.append(self._cast(self._operate(OPERATORS[type(sign)], left, right), types.boolean))
        result = codes[0]
        for code in codes[1:]:
            result = self.b.and_(result, code)
        return Value(types.boolean, result)

    def _truth(self, node: ast.expr) -> Any:
        """Whether a condition holds, as one bit."""
        value = self._value(node)
        if value.kind == types.boolean:
            return value.code
        if value.kind not in (types.int64, types.float64):
            raise UnwrittenError(f"truth of {value.kind}")
        return self._operate(operator.ne, value, self._integer(0)).code

    def _BoolOp(self, node: ast.BoolOp) -> Value:
        end, decisive = self.b.append_basic_block(), isinstance(node.op, ast.Or)
        found = []
        for k, term in enumerate(node.values):
            value = self._value(term)
            if value.kind != types.boolean:
                raise UnwrittenError("`and` or `or` of numbers")
            if k == len(node.values) - 1:
                found.append((value.code, self.b.block))
                self.b.branch(end)
                break
            found.append((ir.IntType(1)(decisive), self.b.block))
            following = self.b.append_basic_block()
            self.b.cbranch(value.code, *((end, following) if decisive else (following, end)))
            self.b.position_at_end(following)
        self.b.position_at_end(end)
        return Value(types.boolean, self._one_of(ir.IntType(1), found))

    def _one_of(self, kind: Any, found: list[tuple[Any, Any]]) -> Any:
        """The code that belongs to the block from which this one was entered."""
        result = self.b.phi(kind)
        for code, block in found:
            result.add_incoming(code, block)
        return result

    def _IfExp(self, node: ast.IfExp) -> Value:
        blocks = [self.b.append_basic_block() for _ in range(2)]
        self.b.cbranch(self._truth(node.test), *blocks)
        found = []
        for block, part in zip(blocks, (node.body, node.orelse), strict=True):
            self.b.position_at_end(block)
            found.append((self._value(part), self.b.block))
        kind, end = self._joined(*(value.kind for value, _ in found)), self.b.append_basic_block()
        codes = []
        for value, block in found:
            self.b.position_at_end(block)
            codes.append((self._cast(value, kind), block))
            self.b.branch(end)
        self.b.position_at_end(end)
        return Value(kind, self._one_of(self.context.get_value_type(kind), codes))

    def _Call(self, node: ast.Call) -> Value:
        callee = self._meaning(node.func)
        if node.keywords or callee is NAMELESS:
            raise UnwrittenError(f"a call of {ast.unparse(node.func)}")
        if callee is len and isinstance(self._meaning(node.args[0]), tuple):
            return self._integer(len(self._meaning(node.args[0])))
        given = [self._value(argument) for argument in node.args]
        if callee in (int, float) and len(given) == 1 and given[0].kind in (types.int64, types.float64):
            kind = types.int64 if callee is int else types.float64
            return Value(kind, self._cast(given[0], kind))
        return self._call(callee, *given)

    def _call(self, callee: Any, *given: Value) -> Value:
        """Value of a function that numba resolves."""
        kind = _kind_of(self.typing, callee)
        if isinstance(kind, types.NumberClass) and len(given) == 1:
            return Value(kind.instance_type, self._cast(given[0], kind.instance_type))
        signature = kind.get_call_type(self.typing, tuple(value.kind for value in given), {})
        taken = () if signature is None else signature.args
        folded = len(taken) == 1 and isinstance(taken[0], BaseTuple) and len(given) == len(taken[0]) != 1
        taken = tuple(taken[0]) if folded else taken  # any number of arguments
        if signature is None or len(taken) != len(given):
            raise UnwrittenError(f"{callee} of {[value.kind for value in given]}")
        codes = [self._cast(value, one) for value, one in zip(given, taken, strict=True)]
        if folded:
            codes = [self.context.make_tuple(self.b, signature.args[0], codes)]
        return Value(signature.return_type, self.context.get_function(kind, signature)(self.b, codes))


def _kind_of(typing: Any, callee: Any) -> Any:
    """Numba's type of a function; raises UnwrittenError for what it cannot call."""
    try:
        kind = typing.resolve_value_type(callee)
    except (ValueError, TypeError) as error:
        raise UnwrittenError(str(error)) from None
    if not isinstance(kind, (types.Function, types.Dispatcher, types.NumberClass)):
        raise UnwrittenError(f"a call of {kind}")
    return kind
